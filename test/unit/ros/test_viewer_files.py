"""Topics, fields and services named in the files for Foxglove and RViz are those of the package."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

from bouncing_disk_ros.impact_layout import IMPACT_LAYOUT
from bouncing_disk_ros.ros.qos import message_class
from bouncing_disk_ros.run.health import Reading, run_values
from bouncing_disk_ros.topics import (
    IMPACT_FRAME,
    JOINT_NAMES,
    SERVICES,
    TOPICS,
    TRANSFORM_TOPICS,
    WORLD_FRAME,
    Direction,
)

ROOT = Path(__file__).resolve().parents[3]
LAYOUT = json.loads((ROOT / "config" / "foxglove_layout.json").read_text("utf-8"))
PANELS: dict[str, dict[str, Any]] = LAYOUT["configById"]
ALL = {**TOPICS, **TRANSFORM_TOPICS}
TYPES = {
    **{name: topic.type for name, topic in ALL.items()},
    "juggle/status": "std_msgs/msg/String",
    "/rosout": "rcl_interfaces/msg/Log",
}
NODE = "/bouncing_disk"
_STEP = re.compile(r"(\w+)((?:\[\d+\])*)")


def of(kind: str) -> list[dict[str, Any]]:
    """The settings of all panels of a kind."""
    return [panel for name, panel in PANELS.items() if name.partition("!")[0] == kind]


def type_of(topic: str) -> str:
    """The type of a topic of a simulator without a namespace; AssertionError for another one."""
    found = {name if name.startswith("/") else f"/{name}": kind for name, kind in TYPES.items()}
    assert topic in found, f"{topic} is no topic of the package"
    return found[topic]


def check_path(path: str) -> None:
    """AssertionError unless a message path names a topic and fields that its messages have."""
    topic, _, fields = path.partition(".")
    kind = type_of(topic)
    for step in fields.split(".") if fields else []:
        match = _STEP.fullmatch(step)
        assert match is not None, f"{path}: {step}"
        known = message_class(kind).get_fields_and_field_types()
        assert match[1] in known, f"{path}: {kind} has {sorted(known)}"
        kind = known[match[1]]
        for _ in re.findall(r"\[\d+\]", match[2]):
            sequence = re.fullmatch(r"sequence<(.*)>", kind)
            assert sequence is not None, f"{path}: {match[1]} is no sequence"
            kind = sequence[1]
        kind = re.sub(r"^(\w+)/(\w+)$", r"\1/msg/\2", kind)


def plotted() -> Iterator[tuple[str, str]]:
    for panel in of("Plot") + of("StateTransitions"):
        for series in panel["paths"]:
            yield series["value"], series["label"]


def test_every_path_of_the_layout_is_there() -> None:
    paths = [path for path, _ in plotted()]
    paths += [panel["topicPath"] for panel in of("RawMessages")]
    paths += [panel["topicToRender"] for panel in of("RosOut") + of("DiagnosticSummary")]
    paths += [topic for panel in of("3D") for topic in panel["topics"]]
    assert len(paths) > 10
    for path in paths:
        check_path(path)


def test_the_indices_of_joints_and_of_the_runs_state_are_those_of_their_labels() -> None:
    state = run_values(Reading(0, 0, 0, 0, 0, 0, None, "running", 1.0, 0), refused=0)
    names = {"joint_states": JOINT_NAMES, "disk/run_state": tuple(state)}
    found = 0
    for path, label in plotted():
        for topic, known in names.items():
            index = re.fullmatch(rf"/{topic}\.\w+\[(\d+)\]", path)
            if index is not None:
                assert known[int(index[1])] == label, path
                found += 1
    assert found >= 4


def test_what_it_publishes_are_commands_of_the_right_type() -> None:
    for panel in of("Publish"):
        assert panel["datatype"] == type_of(panel["topicName"])
        assert TOPICS[panel["topicName"].lstrip("/")].direction is Direction.IN
        check_content(json.loads(panel["value"]), panel["datatype"])


def check_content(content: Any, kind: str) -> None:
    """AssertionError unless a message's content as JSON has fields of a type."""
    if isinstance(content, dict):
        known = message_class(kind).get_fields_and_field_types()
        for name, value in content.items():
            assert name in known, f"{kind} has no {name}"
            check_content(value, re.sub(r"^(\w+)/(\w+)$", r"\1/msg/\2", known[name]))
    elif isinstance(content, list):
        sequence = re.fullmatch(r"sequence<(.*)>", kind)
        assert sequence is not None, f"{kind} is no sequence"
        for value in content:
            check_content(value, re.sub(r"^(\w+)/(\w+)$", r"\1/msg/\2", sequence[1]))
    else:
        assert type(content) is {"double": float, "string": str}.get(kind, int), f"{content!r}"


def test_the_services_it_calls_are_the_nodes() -> None:
    called = [panel["serviceName"] for panel in of("CallService")]
    assert {name.replace(NODE, "~") for name in called} == SERVICES.keys()
    for panel in of("CallService"):
        request = json.loads(panel["requestPayload"])
        kind = SERVICES[panel["serviceName"].replace(NODE, "~")].type
        assert set(request) == ({"data"} if kind == "std_srvs/srv/SetBool" else set())


def test_each_panel_has_a_place_and_the_scene_the_frames_and_fields_of_impacts() -> None:
    placed = list(_placed(LAYOUT["layout"]))
    assert sorted(placed) == sorted(PANELS)
    (scene,) = of("3D")
    frames = {scene["followTf"], scene["fixedFrame"]}
    assert frames | {layer["frameId"] for layer in scene["layers"].values()} == {WORLD_FRAME}
    names: Any = IMPACT_LAYOUT["names"]
    assert scene["topics"]["/disk/impacts"]["colorField"] in names


def _placed(place: Any) -> Iterator[str]:
    if isinstance(place, dict):
        yield from _placed(place["first"])
        yield from _placed(place["second"])
        return
    yield place
    for tab in PANELS[place].get("tabs", ()):
        yield from _placed(tab["layout"])


@pytest.mark.parametrize("name", ["bouncing_disk", "two_disks"])
def test_rviz_shows_topics_of_the_package_as_they_are_published(name: str) -> None:
    view = yaml.safe_load((ROOT / "rviz" / f"{name}.rviz").read_text("utf-8"))
    manager = view["Visualization Manager"]
    assert manager["Global Options"]["Fixed Frame"] == WORLD_FRAME
    wanted = {"RobotModel": "std_msgs/msg/String", "PointCloud2": "sensor_msgs/msg/PointCloud2"}
    shown = set()
    for display in manager["Displays"]:
        kind = display["Class"].rpartition("/")[2]
        if kind == "Axes":
            assert display["Reference Frame"].rpartition("/")[2] == IMPACT_FRAME
        if kind not in wanted:
            continue
        asked = display["Topic" if kind == "PointCloud2" else "Description Topic"]
        short = re.sub(r"^/(first|second)/", "", asked["Value"])
        topic = ALL[short]
        assert topic.type == wanted[kind]
        durability = "Transient Local" if topic.qos.latched else "Volatile"
        assert (asked["Durability Policy"], asked["Reliability Policy"]) == (durability, "Reliable")
        assert topic.qos.reliable
        shown.add(short)
    assert shown == {"robot_description", "disk/impacts"}
