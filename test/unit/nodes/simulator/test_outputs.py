"""What the simulator publishes, in its order, on publishers of a fake node."""

from __future__ import annotations

from typing import Any

from bouncing_disk_ros import parameters
from bouncing_disk_ros.nodes.simulator.outputs import Outputs
from bouncing_disk_ros.ros.conversions import time_to_ns
from bouncing_disk_ros.run.loop import Loop
from bouncing_disk_ros.run.session import Session
from bouncing_disk_ros.run.time_map import TimeMap
from bouncing_disk_ros.units import NS

WALL = 1_800_000_000 * NS


class RecordingNode:
    """Keeps what is published: (topic, message), stamps as they were then."""

    def __init__(self) -> None:
        self.sent: list[tuple[str, Any]] = []

    def create_publisher(self, kind: type, name: str, qos: Any) -> Any:
        node = self

        class Publisher:
            topic_name = name

            def publish(self, msg: Any) -> None:
                assert isinstance(msg, kind)
                header = getattr(msg, "header", None)
                node.sent.append((name, time_to_ns(header.stamp) if header else msg))

        return Publisher()


def published(seconds: int, *, clock: bool, **values: parameters.Value) -> list[tuple[str, Any]]:
    node = RecordingNode()
    outputs = Outputs(node, TimeMap(0, 0, WALL, 1.0, clock))
    session = Session(parameters.complete(values), outputs.record)
    loop = Loop(session, outputs)
    for tick in range(1, seconds * 20 + 1):
        loop.slice(tick * 50_000_000)
        outputs.state(session, True)
    return node.sent


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


def test_no_clock_is_published_unasked() -> None:
    assert "/clock" not in {name for name, _ in published(1, clock=False)}
