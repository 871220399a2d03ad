"""Actions of the page as the command lines that the page shows."""

from __future__ import annotations

import math
import shlex

import pytest
import yaml

from bouncing_disk_ros.juggling.juggle import OPTIONS
from bouncing_disk_ros.topics import TOPICS
from bouncing_disk_ros.workbench.actions import (
    Action,
    Call,
    Impulse,
    Juggle,
    Lifecycle,
    Move,
    Names,
    Perform,
    Set,
    StopJuggling,
    lines,
    yaml_number,
)

NAMES = Names("/left/bouncing_disk", "/left")
PUB = "ros2 topic pub --once /left"
WRENCH = f"{PUB}/disk/impulse geometry_msgs/msg/WrenchStamped"
PROGRAMME = "{joint_names: [axial_amplitude, frequency], points: [{positions: [0.05, 2.5]}]}"
JUGGLE = "-p strategy:=deadbeat -p restitution:=0.5 -p gravity:=10.0 -r __ns:=/left"


def test_numbers_keep_their_bits() -> None:
    """What is not finite reaches the node too, which refuses it."""
    for value in (0.039, 1e-7, 1.5e300, 4e-5, -0.7366240020191286, 1e22, 0.0, math.inf, -math.inf):
        assert yaml.safe_load(yaml_number(value)) == value
    assert math.isnan(yaml.safe_load(yaml_number(math.nan)))


@pytest.mark.parametrize(
    ("action", "line"),
    [
        (Move({"axial_amplitude": 1e-7}),
         f"{PUB}/platform/axial_amplitude std_msgs/msg/Float64 '{{data: 1.0e-07}}'"),
        (Move({"axial_amplitude": 0.05, "frequency": 2.5}),
         f"{PUB}/platform/command trajectory_msgs/msg/JointTrajectory '{PROGRAMME}'"),
        (Impulse(0.1), f"{WRENCH} '{{wrench: {{force: {{z: 0.1}}}}}}'"),
        (Impulse(0.0, -0.2), f"{WRENCH} '{{wrench: {{torque: {{z: -0.2}}}}}}'"),
        (Impulse(0.1, 0.2), f"{WRENCH} '{{wrench: {{force: {{z: 0.1}}, torque: {{z: 0.2}}}}}}'"),
        (Impulse(), f"{WRENCH} '{{wrench: {{force: {{z: 0.0}}}}}}'"),
        (Call("pause", True),
         "ros2 service call /left/bouncing_disk/pause std_srvs/srv/SetBool '{data: true}'"),
        (Call("reset"), "ros2 service call /left/bouncing_disk/reset std_srvs/srv/Trigger"),
        (Set({"restitution": "a; rm x"}),
         "ros2 param set /left/bouncing_disk restitution 'a; rm x'"),
        (Juggle("deadbeat", {"restitution": 0.5, "gravity": 10.0}),
         f"ros2 run bouncing_disk_ros juggle --ros-args {JUGGLE}"),
        (StopJuggling(), "# Ctrl-C in the terminal of juggle"),
        (Lifecycle("cleanup"), "ros2 lifecycle set /left/bouncing_disk cleanup"),
        (Perform("first_toss"),
         "ros2 run bouncing_disk_ros perform first_toss --ros-args -r __ns:=/left"),
    ],
)  # fmt: skip
def test_an_action_is_a_command_line(action: Action, line: str) -> None:
    assert lines(action, NAMES) == [line]
    words = shlex.split(line)
    if words[2] == "pub":
        assert words[5] == TOPICS[words[4].removeprefix("/left/")].type
        yaml.safe_load(words[6])
    if isinstance(action, Juggle):
        assert {word.partition(":=")[0] for word in words[6:-2:2]} <= OPTIONS.keys()


def test_parameters_are_set_in_an_order_that_is_accepted() -> None:
    """initial_axial_velocity is refused until initial_with_platform is false."""
    found = lines(Set({"initial_axial_velocity": -1.5, "initial_with_platform": False}), NAMES)
    assert found == [
        "ros2 param set /left/bouncing_disk initial_with_platform false",
        "ros2 param set /left/bouncing_disk initial_axial_velocity -1.5",
    ]


def test_a_namespace_of_none_is_left_out() -> None:
    assert lines(Perform("x"), Names()) == ["ros2 run bouncing_disk_ros perform x"]
