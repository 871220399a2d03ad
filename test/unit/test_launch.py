"""The launch files, the URDF and the RViz views agree with the package's tables.

Where `launch_ros` is not installed (it is not among the wheels), small fakes record what the launch
files describe.
"""

from __future__ import annotations

import importlib.util
import runpy
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any
from xml.etree import ElementTree as ET

import pytest
import yaml

from bouncing_disk_ros import executables, parameters, topics
from bouncing_disk_ros.juggling import juggle
from bouncing_disk_ros.ros.transforms import robot_description
from bouncing_disk_ros.run.presets import load_preset

ROOT = Path(__file__).resolve().parents[2]
SIMULATE, TWO_DISKS, JUGGLE = (
    ROOT / "launch" / f"{n}.launch.py" for n in ("simulate", "two_disks", "juggle")
)

#: module -> the names that the launch files may take from it
FAKED = {
    "launch": ["LaunchDescription"],
    "launch.actions": ["DeclareLaunchArgument", "EmitEvent", "GroupAction",
                       "IncludeLaunchDescription", "OpaqueFunction", "Shutdown"],
    "launch.conditions": ["IfCondition"],
    "launch.events": ["matches_action"],
    "launch.events.process": ["ShutdownProcess"],
    "launch.launch_description_sources": ["PythonLaunchDescriptionSource"],
    "launch.substitutions": ["LaunchConfiguration"],
    "launch_ros": [],
    "launch_ros.actions": ["Node"],
    "launch_ros.parameter_descriptions": ["ParameterValue"],
}  # fmt: skip
Describe = Callable[..., dict[str, Any]]


def recorder(kind: str) -> Any:
    return lambda *args, **fields: SimpleNamespace(kind=kind, args=args, **fields)


@pytest.fixture
def fakes(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, members in FAKED.items():
        module = ModuleType(name)
        for member in members:
            setattr(module, member, recorder(member))
        monkeypatch.setitem(sys.modules, name, module)
    monkeypatch.setattr(
        "ament_index_python.packages.get_package_share_directory", lambda package: str(ROOT)
    )


def entities(file: Path) -> list[Any]:
    """What a launch file describes, as recorded by the fakes."""
    found: list[Any] = runpy.run_path(str(file))["generate_launch_description"]().args[0]
    return found


@pytest.fixture
def describe(fakes: None) -> Describe:
    """The nodes of simulate.launch.py with some arguments, by executable, in their order."""

    def nodes(**given: str) -> dict[str, Any]:
        *declared, function = entities(SIMULATE)
        defaults = {argument.args[0]: argument.default_value for argument in declared}
        assert given.keys() <= defaults.keys()
        context = SimpleNamespace(launch_configurations=defaults | given)
        found = function.function(context)
        return {node.executable: node for node in found}

    return nodes


def parameters_of(node: Any) -> dict[str, Any]:
    """The parameters that a node is given by value."""
    given = [row for row in node.parameters if isinstance(row, dict)]
    values = {name: value for row in given for name, value in row.items()}
    texts = {n: v.args[0] for n, v in values.items() if getattr(v, "value_type", None) is str}
    return values | texts


@pytest.mark.skipif(
    importlib.util.find_spec("launch_ros") is None, reason="launch_ros is only on ROS machines"
)
@pytest.mark.parametrize("file", [SIMULATE, TWO_DISKS, JUGGLE], ids=lambda file: file.name)
def test_real_launch_takes_the_description(file: Path) -> None:
    description = runpy.run_path(str(file))["generate_launch_description"]()
    assert len(description.entities) > 1


def test_arguments_are_explained_and_each_once(fakes: None) -> None:
    declared = [e for e in entities(SIMULATE) if e.kind == "DeclareLaunchArgument"]
    names = [e.args[0] for e in declared]
    assert len(names) == len(set(names))
    for argument in declared:
        assert argument.description
        assert argument.choices is None or argument.default_value in argument.choices


def test_without_arguments_the_simulator_runs_alone_and_parameters_decide(
    describe: Describe,
) -> None:
    nodes = describe()
    assert list(nodes) == ["simulator"]
    node = nodes["simulator"]
    assert (node.package, node.name, node.namespace) == ("bouncing_disk_ros", "bouncing_disk", "")
    assert node.executable in executables.EXECUTABLES
    assert node.parameters == []
    assert (node.respawn, node.ros_arguments) == (False, [])
    assert node.on_exit is None  # launch takes no empty list


def test_arguments_become_parameters_of_their_types(describe: Describe) -> None:
    node = describe(
        preset="swum", real_time_factor="2", publish_clock="true", autostart="False",
        publish_tf="True", frame_prefix="1/", params_file="mine.yaml", log_level="debug",
        name="rotor", namespace="lab",
    )["simulator"]  # fmt: skip
    assert node.parameters[0] == "mine.yaml"  # what follows wins over it
    values = parameters_of(node)
    assert values == {
        "preset": "swum", "real_time_factor": 2.0, "publish_clock": True, "autostart": False,
        "publish_tf": True, "frame_prefix": "1/",
    }  # fmt: skip
    checked = parameters.checked(values)
    assert {name: type(value) for name, value in values.items()} == {
        name: type(value) for name, value in checked.items()
    }
    assert node.ros_arguments == ["--log-level", "debug"]
    assert (node.name, node.namespace) == ("rotor", "lab")


def test_rviz_gets_transforms_from_the_simulator_unless_others_publish_them(
    describe: Describe,
) -> None:
    for given, publishes in (
        ({}, True), ({"robot_state_publisher": "true"}, None), ({"publish_tf": "false"}, False),
    ):  # fmt: skip
        simulator = describe(rviz="true", **given)["simulator"]
        assert parameters_of(simulator).get("publish_tf") is publishes


def test_viewers_start_only_when_asked_for_and_before_the_simulator(describe: Describe) -> None:
    """The simulator comes last, so that a viewer that is not installed leaves none behind."""
    nodes = describe(rviz="true", robot_state_publisher="true", use_sim_time="true", preset="swum")
    assert list(nodes) == ["robot_state_publisher", "rviz2", "simulator"]
    assert Path(nodes["rviz2"].arguments[1]).is_file()
    assert parameters_of(nodes["rviz2"])["use_sim_time"] is True
    values = parameters_of(nodes["robot_state_publisher"])
    assert values["use_sim_time"] is True
    # it makes the time: it would ignore the parameter, with a warning
    assert "use_sim_time" not in parameters_of(nodes["simulator"])
    assert values["robot_description"] == robot_description(load_preset("swum"))


def test_a_prefix_is_in_all_frames(describe: Describe) -> None:
    nodes = describe(rviz="true", robot_state_publisher="true", frame_prefix="first/", y="1.2")
    description = ET.fromstring(parameters_of(nodes["robot_state_publisher"])["robot_description"])
    assert all(link.attrib["name"].startswith("first/") for link in description.iter("link"))
    assert parameters_of(nodes["simulator"])["frame_prefix"] == "first/"
    place = nodes["static_transform_publisher"].arguments
    assert place == ["--x", "0", "--y", "1.2", "--z", "0", "--frame-id", "world",
                     "--child-frame-id", "first/world"]  # fmt: skip
    view = Path(nodes["rviz2"].arguments[1])
    assert "Reference Frame: first/next_collision" in view.read_text("utf-8")
    view.unlink()


def test_the_end_of_a_simulator_ends_its_own_viewers_and_nothing_else(describe: Describe) -> None:
    nodes = describe(rviz="true", frame_prefix="first/")
    simulator = nodes.pop("simulator")
    assert {action.kind for action in simulator.on_exit} == {"EmitEvent"}
    ended = [action.event.process_matcher.args[0] for action in simulator.on_exit]
    assert ended == list(nodes.values())
    Path(nodes["rviz2"].arguments[1]).unlink()
    (action,) = describe(rviz="true", shutdown_on_exit="true")["simulator"].on_exit
    assert action.kind == "Shutdown"
    again = describe(rviz="true", shutdown_on_exit="true", respawn="true")["simulator"]
    assert (again.respawn, again.on_exit) == (True, None)


def test_two_disks_differ_in_all_that_must_not_be_shared(fakes: None) -> None:
    found = entities(TWO_DISKS)
    groups = [e for e in found if e.kind == "GroupAction"]  # scoped: arguments do not leak
    given = [dict(group.args[0][0].launch_arguments) for group in groups]
    for name in ("namespace", "frame_prefix", "y", "preset"):
        assert len({str(arguments[name]) for arguments in given}) == len(given) == 2
    known = {e.args[0] for e in entities(SIMULATE) if e.kind == "DeclareLaunchArgument"}
    for arguments in given:
        assert arguments.keys() <= known
        assert (arguments["publish_tf"], arguments["rviz"]) == ("true", "false")
    view = yaml.safe_load((ROOT / "rviz" / "two_disks.rviz").read_text("utf-8"))
    text = yaml.safe_dump(view)
    for arguments in given:
        namespace, prefix = arguments["namespace"], arguments["frame_prefix"]
        assert f"Value: /{namespace}/robot_description" in text
        assert f"Value: /{namespace}/disk/impacts" in text
        assert f"Reference Frame: {prefix}next_collision" in text


def test_urdf_is_a_tree_from_the_world_that_moves_by_the_joints_of_joint_states() -> None:
    model = ET.parse(ROOT / "urdf" / "bouncing_disk.urdf").getroot()
    links = [link.attrib["name"] for link in model.iter("link")]
    parents, moving = {}, set()
    for joint in model.iter("joint"):
        found = {part.tag: part for part in joint}
        parents[found["child"].attrib["link"]] = found["parent"].attrib["link"]
        if joint.get("type") != "fixed":
            name = joint.attrib["name"]
            moving.add(name)
            assert found["axis"].get("xyz") == "0 0 1"
            assert joint.get("type") == ("prismatic" if name.endswith("_axial") else "continuous")
    assert moving == set(topics.JOINT_NAMES)
    assert sorted(links) == sorted([topics.WORLD_FRAME, *parents])
    assert {"platform", "disk", topics.IMPACT_FRAME, *parents.values()} <= set(links)


@pytest.fixture
def juggler(fakes: None) -> Callable[..., Any]:
    """The juggler of juggle.launch.py with some arguments."""

    def node(**given: str) -> Any:
        *declared, _, function = entities(JUGGLE)
        defaults = {argument.args[0]: argument.default_value for argument in declared}
        assert given.keys() <= defaults.keys()
        (found,) = function.function(SimpleNamespace(launch_configurations=defaults | given))
        return found

    return node


def test_a_juggler_knows_the_disk_of_the_preset(juggler: Callable[..., Any]) -> None:
    node = juggler(restitution_error="0.1", missed="0.2", strategy="small")
    assert node.executable in executables.EXECUTABLES
    found = parameters_of(node)
    assert found.keys() <= juggle.OPTIONS.keys() | {"use_sim_time"}
    disk = load_preset("pizza_multiple_toss")
    assert found["restitution"] == pytest.approx(1.1 * float(disk["restitution"]))
    assert found["gravity"] == float(disk["gravity"])
    assert (found["strategy"], found["missed"], found["delay"]) == ("small", 0.2, 0.0)


def test_juggle_takes_all_arguments_of_the_simulator_and_passes_them_on(fakes: None) -> None:
    *declared, simulator, _ = entities(JUGGLE)
    names = [argument.args[0] for argument in declared]
    assert len(names) == len(set(names))
    known = {e.args[0]: e for e in entities(SIMULATE) if e.kind == "DeclareLaunchArgument"}
    assert dict(simulator.launch_arguments).keys() == known.keys() <= set(names)
    for argument in declared:
        name = argument.args[0]
        if name in known and name != "preset":
            assert argument.default_value == known[name].default_value
            assert argument.choices == known[name].choices


def test_what_concerns_both_nodes_reaches_the_juggler_too(
    juggler: Callable[..., Any], tmp_path: Path
) -> None:
    file = tmp_path / "mine.yaml"
    file.write_text("/**: {ros__parameters: {restitution: 0.7, real_time_factor: 3.0}}")
    given = {"params_file": str(file), "name": "rotor", "use_sim_time": "true"}
    node = juggler(namespace="lab", log_level="debug", **given)
    found = parameters_of(node)
    assert (found["restitution"], found["real_time_factor"]) == (0.7, 3.0)
    assert found["use_sim_time"] is True
    assert parameters_of(juggler(real_time_factor="2", **given))["real_time_factor"] == 2.0
    assert node.namespace == "lab"
    assert node.ros_arguments == ["--log-level", "debug"]
    assert dict(node.remappings) == {
        f"bouncing_disk/{topic}": f"rotor/{topic}" for topic in ("gate", "proceed")
    }


def test_an_argument_that_does_not_fit_is_named(
    juggler: Callable[..., Any], describe: Describe
) -> None:
    juggling = ("restitution_error", "delay", "jitter", "real_time_factor")
    cases = [(juggler, name) for name in juggling]
    cases += [(describe, name) for name in ("real_time_factor", "x", "z")]
    for make, name in cases:
        with pytest.raises(ValueError, match=f"{name}: got 'fast', allowed: a number"):
            make(**{name: "fast"})
    with pytest.raises(ValueError, match="x, y and z need a frame_prefix"):
        describe(x="1")
