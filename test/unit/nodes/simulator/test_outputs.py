"""What the simulator publishes, in its order, on publishers of a fake node."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import ModuleType, SimpleNamespace
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from bouncing_disk_ros import parameters
from bouncing_disk_ros.core.model import IMPACT_DTYPE
from bouncing_disk_ros.nodes.simulator.outputs import Outputs
from bouncing_disk_ros.ros.from_messages import time_to_ns
from bouncing_disk_ros.run.loop import Loop
from bouncing_disk_ros.run.session import Session
from bouncing_disk_ros.run.time_map import TimeMap
from bouncing_disk_ros.topics import MAX_ROWS
from bouncing_disk_ros.units import NS

WALL = 1_800_000_000 * NS


class RecordingNode:
    """Keeps what is published: (topic, message), stamps as they were then; and frames by topic."""

    def __init__(self) -> None:
        self.sent: list[tuple[str, Any]] = []
        self.frames: dict[str, set[str]] = {}
        self.clocks: list[SimpleNamespace] = []

    def get_publishers_info_by_topic(self, name: str) -> list[Any]:
        """Those of /clock: nobody else is here."""
        return self.clocks

    def create_publisher(self, kind: type, name: str, qos: Any) -> Any:
        node = self

        class Publisher:
            topic_name = name

            def publish(self, msg: Any) -> None:
                assert isinstance(msg, kind)
                header = getattr(msg, "header", None)
                if header is not None:
                    node.frames.setdefault(name, set()).add(header.frame_id)
                for transform in getattr(msg, "transforms", ()):
                    pair = f"{transform.header.frame_id} > {transform.child_frame_id}"
                    node.frames.setdefault(name, set()).add(pair)
                node.sent.append((name, time_to_ns(header.stamp) if header else msg))

        return Publisher()


def outputs_of(node: RecordingNode, whole: Mapping[str, parameters.Value]) -> Outputs:
    outputs = Outputs(node, whole)
    outputs.times = TimeMap(0, 0, WALL, 1.0, bool(whole["publish_clock"]))
    return outputs


def published(seconds: int, *, clock: bool, **values: parameters.Value) -> list[tuple[str, Any]]:
    return node_after(seconds, clock=clock, **values).sent


def node_after(seconds: int, *, clock: bool = False, **values: parameters.Value) -> RecordingNode:
    node = RecordingNode()
    whole = parameters.complete({**values, "publish_clock": clock})
    outputs = outputs_of(node, whole)
    session = Session(whole, outputs.record)
    loop = Loop(session, outputs)
    for tick in range(1, seconds * 20 + 1):
        loop.slice(tick * 50_000_000)
        outputs.state(session, True)
    return node


@dataclass
class TFMessage:
    """As tf2_msgs/msg/TFMessage, which is not on every machine."""

    transforms: list[Any] = field(default_factory=list)


@pytest.fixture
def tf2_msgs(monkeypatch: pytest.MonkeyPatch) -> None:
    module = ModuleType("tf2_msgs.msg")
    module.TFMessage = TFMessage  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "tf2_msgs", ModuleType("tf2_msgs"))
    monkeypatch.setitem(sys.modules, "tf2_msgs.msg", module)


def test_the_clock_is_published_before_whatever_is_stamped_with_its_time() -> None:
    now, heard = 0, set()
    for name, content in published(3, clock=True):
        if name == "/clock":
            assert time_to_ns(content.clock) >= now  # it never goes back
            now = time_to_ns(content.clock)
        elif isinstance(content, int):
            heard.add(name)
            assert content <= now
    assert heard == {"joint_states", "disk/rotor_speed", "disk/impacts", "platform/motion"}
    assert now == WALL + 3 * NS


def test_nothing_follows_on_a_clock_that_another_one_has_come_to() -> None:
    """Within the message after it is seen, not when the node looks the next time."""
    node, whole = RecordingNode(), parameters.complete({"publish_clock": True})
    own, other = (SimpleNamespace(endpoint_gid=bytes([number])) for number in (1, 2))
    plain = node.create_publisher

    def create_publisher(kind: type, name: str, qos: Any) -> Any:
        node.clocks += [own] if name == "/clock" else []
        return plain(kind, name, qos)

    node.create_publisher = create_publisher  # type: ignore[method-assign]
    outputs = outputs_of(node, whole)
    session = Session(whole, outputs.record)
    outputs.state(session, True)
    node.clocks.append(other)
    outputs.state(session, True)
    assert len([name for name, _ in node.sent if name == "/clock"]) == 1


def test_impacts_are_stamped_with_their_last_row() -> None:
    node = RecordingNode()
    outputs = outputs_of(node, parameters.complete({}))
    rows = np.zeros(MAX_ROWS + 2, IMPACT_DTYPE)
    rows["time"] = np.arange(len(rows))
    outputs.impacts(rows)
    assert node.sent == [
        ("disk/impacts", WALL + (MAX_ROWS - 1) * NS),
        ("disk/impacts", WALL + (MAX_ROWS + 1) * NS),
    ]


def test_the_motion_is_published_again_with_new_times() -> None:
    node = RecordingNode()
    whole = parameters.complete({})
    outputs = outputs_of(node, whole)
    session = Session(whole, outputs.record)
    outputs.state(session, True)
    outputs.times = TimeMap(0, 0, WALL + 7 * NS, 1.0)
    outputs.state(session, True)
    outputs.state(session, True)
    begin_ns = session.simulation.motion_in_force.begin_ns
    assert [content for name, content in node.sent if name == "platform/motion"] == [
        WALL + begin_ns,
        WALL + 7 * NS + begin_ns,
    ]


def test_every_output_is_in_its_frame() -> None:
    node = node_after(1, world_frame="lab", impacts_frame="section", frame_prefix="first/")
    assert node.frames == {
        "joint_states": {""},  # its joints are no frame
        "disk/rotor_speed": {"first/lab"},
        "platform/motion": {"first/lab"},
        "disk/impacts": {"first/section"},
    }


@pytest.mark.usefixtures("tf2_msgs")
def test_transforms_are_published_when_asked_for_and_are_those_of_the_urdf() -> None:
    node = node_after(
        1, publish_tf=True, frame_prefix="first/", world_frame="lab", platform_frame="stator"
    )
    (description,) = (msg.data for name, msg in node.sent if name == "robot_description")
    pairs = set()
    for joint in ET.fromstring(description).iter("joint"):
        parent, child = joint.find("parent"), joint.find("child")
        assert parent is not None
        assert child is not None
        pairs.add(f"{parent.attrib['link']} > {child.attrib['link']}")
    assert node.frames["/tf"] == pairs
    assert "first/lab > first/stator_carriage" in pairs
    counts = [[name for name, _ in node.sent].count(topic) for topic in ("/tf", "joint_states")]
    assert counts == [101, 101]  # one with each sample


@pytest.mark.usefixtures("tf2_msgs")
def test_clock_and_transforms_are_not_published_unasked() -> None:
    names = {name for name, _ in published(1, clock=False)}
    assert not {"/clock", "/tf", "robot_description"} & names
