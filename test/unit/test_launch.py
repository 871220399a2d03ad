"""The launch file, the URDF and the RViz view agree with the package's tables.

Where `launch_ros` is not installed (it is not among the wheels), small fakes record what the launch
file describes.
"""

from __future__ import annotations

import importlib.util
import runpy
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any
from xml.etree import ElementTree as ET

import pytest
import yaml

from bouncing_disk_ros import executables, topics

ROOT = Path(__file__).resolve().parents[2]
LAUNCH_FILE = ROOT / "launch" / "simulate.launch.py"

#: module -> the names that the launch file may take from it
FAKED = {
    "launch": ["LaunchDescription"],
    "launch.actions": ["DeclareLaunchArgument", "Shutdown"],
    "launch.conditions": ["IfCondition"],
    "launch.substitutions": ["LaunchConfiguration", "OrSubstitution"],
    "launch_ros": [],
    "launch_ros.actions": ["Node"],
    "launch_ros.parameter_descriptions": ["ParameterValue"],
}


def recorder(kind: str) -> Any:
    return lambda *args, **fields: SimpleNamespace(kind=kind, args=args, **fields)


@pytest.fixture
def described(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """What the launch file describes, as recorded by the fakes."""
    for name, members in FAKED.items():
        module = ModuleType(name)
        for member in members:
            setattr(module, member, recorder(member))
        monkeypatch.setitem(sys.modules, name, module)
    monkeypatch.setattr(
        "ament_index_python.packages.get_package_share_directory", lambda package: str(ROOT)
    )
    entities: list[Any] = runpy.run_path(str(LAUNCH_FILE))["generate_launch_description"]().args[0]
    return entities


@pytest.mark.skipif(
    importlib.util.find_spec("launch_ros") is None, reason="launch_ros is only on ROS machines"
)
def test_real_launch_takes_the_description() -> None:
    description = runpy.run_path(str(LAUNCH_FILE))["generate_launch_description"]()
    assert len(description.entities) > 1


def test_simulator_gets_preset_name_and_namespace(described: list[Any]) -> None:
    (node,) = [e for e in described if e.kind == "Node" and e.package == "bouncing_disk_ros"]
    assert node.executable in executables.EXECUTABLES
    assert (node.name.args, node.namespace.args) == (("name",), ("namespace",))
    assert node.parameters[0]["preset"].args[0].args == ("preset",)
    assert node.on_exit.kind == "Shutdown"


def test_viewers_start_only_when_asked_for(described: list[Any]) -> None:
    others = {
        e.package: e for e in described if e.kind == "Node" and e.package != "bouncing_disk_ros"
    }
    assert others.keys() == {"robot_state_publisher", "rviz2"}
    wanted = others["robot_state_publisher"].condition.args[0]
    assert [setting.args[0] for setting in wanted.args] == ["robot_state_publisher", "rviz"]
    assert others["rviz2"].condition.args[0].args == ("rviz",)
    model = others["robot_state_publisher"].parameters[0]["robot_description"]
    assert ET.fromstring(model).tag == "robot"
    assert Path(others["rviz2"].arguments[1]).is_file()


def test_simulator_comes_last_so_that_a_missing_viewer_leaves_none_behind(
    described: list[Any],
) -> None:
    assert described[-1].package == "bouncing_disk_ros"


def test_every_argument_is_declared_once_and_used(described: list[Any]) -> None:
    declared = [e for e in described if e.kind == "DeclareLaunchArgument"]
    names = [e.args[0] for e in declared]
    assert len(names) == len(set(names))
    assert all(e.description and isinstance(e.default_value, str) for e in declared)
    (simulator,) = [e for e in described if getattr(e, "executable", "") == "simulator"]
    assert simulator.name.args[0] in names
    source = LAUNCH_FILE.read_text("utf-8")
    assert all(f'setting["{name}"]' in source for name in names)


def model() -> ET.Element:
    return ET.parse(ROOT / "urdf" / "bouncing_disk.urdf").getroot()


def test_urdf_moves_by_the_joints_of_joint_states() -> None:
    moving = {j.attrib["name"]: j for j in model().iter("joint") if j.get("type") != "fixed"}
    assert sorted(moving) == sorted(topics.JOINT_NAMES)
    for name, joint in moving.items():
        axis = joint.find("axis")
        assert axis is not None
        assert axis.get("xyz") == "0 0 1"
        assert joint.get("type") == ("prismatic" if name.endswith("_axial") else "continuous")


def test_urdf_is_a_tree_from_the_world_with_the_frames_of_the_topics() -> None:
    links = [link.attrib["name"] for link in model().iter("link")]
    parents = {}
    for joint in model().iter("joint"):
        parent, child = joint.find("parent"), joint.find("child")
        assert parent is not None
        assert child is not None
        parents[child.attrib["link"]] = parent.attrib["link"]
    assert sorted(links) == sorted([topics.WORLD_FRAME, *parents])
    assert set(parents.values()) <= set(links)
    assert {"platform", "disk", topics.IMPACT_FRAME} <= set(links)


def test_rviz_shows_the_topics_that_exist() -> None:
    view = yaml.safe_load((ROOT / "rviz" / "bouncing_disk.rviz").read_text("utf-8"))
    manager = view["Visualization Manager"]
    assert manager["Global Options"]["Fixed Frame"] == topics.WORLD_FRAME
    shown = [display["Topic"]["Value"] for display in manager["Displays"] if "Topic" in display]
    assert shown == ["disk/impacts"]
    assert shown[0] in {topic.name for topic in topics.TOPICS.values()}
