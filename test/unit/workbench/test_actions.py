"""Actions of the page as the command lines that the page shows: a shell and YAML read them back."""

from __future__ import annotations

import math
import shlex
from typing import Any

import pytest
import yaml

from bouncing_disk_ros.executables import EXECUTABLES
from bouncing_disk_ros.juggling.juggle import OPTIONS
from bouncing_disk_ros.topics import SERVICES, TOPICS
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
TINY, LARGE = 1e-7, 1.5e300


def read(action: Action) -> tuple[list[str], Any]:
    """The words of a command line, and the YAML of its last."""
    (line,) = lines(action, NAMES)
    words = shlex.split(line)
    return words, yaml.safe_load(words[-1])


@pytest.mark.parametrize("value", [0.039, TINY, LARGE, 4e-5, -0.7366240020191286, 1e22, 0.0])
def test_numbers_keep_their_bits(value: float) -> None:
    assert yaml.safe_load(yaml_number(value)) == value


def test_what_is_not_finite_is_written_as_yaml_has_it() -> None:
    """So that it reaches the node, which refuses it."""
    assert yaml.safe_load(yaml_number(math.inf)) == math.inf
    assert math.isnan(yaml.safe_load(yaml_number(math.nan)))


def test_a_value_of_the_motion() -> None:
    words, content = read(Move({"axial_amplitude": TINY}))
    topic = TOPICS["platform/axial_amplitude"]
    assert words[:-1] == ["ros2", "topic", "pub", "--once", f"/left/{topic.name}", topic.type]
    assert content == {"data": TINY}


def test_several_values_of_the_motion() -> None:
    words, content = read(Move({"axial_amplitude": 0.05, "frequency": 2.5}))
    topic = TOPICS["platform/command"]
    assert words[4:6] == [f"/left/{topic.name}", topic.type]
    assert content == {
        "joint_names": ["axial_amplitude", "frequency"],
        "points": [{"positions": [0.05, 2.5]}],
    }


@pytest.mark.parametrize(
    ("impulse", "wrench"),
    [
        (Impulse(0.1), {"force": {"z": 0.1}}),
        (Impulse(0.0, -0.2), {"torque": {"z": -0.2}}),
        (Impulse(0.1, 0.2), {"force": {"z": 0.1}, "torque": {"z": 0.2}}),
        (Impulse(), {"force": {"z": 0.0}}),
    ],
)
def test_impulses(impulse: Impulse, wrench: dict[str, Any]) -> None:
    words, content = read(impulse)
    assert words[4:6] == ["/left/disk/impulse", TOPICS["disk/impulse"].type]
    assert content == {"wrench": wrench}


def test_services() -> None:
    words, content = read(Call("pause", True))
    assert words[:-1] == ["ros2", "service", "call", "/left/bouncing_disk/pause",
                          SERVICES["~/pause"].type]  # fmt: skip
    assert content == {"data": True}
    assert lines(Call("reset"), NAMES) == [
        "ros2 service call /left/bouncing_disk/reset std_srvs/srv/Trigger"
    ]


def test_parameters_are_set_in_an_order_that_is_accepted() -> None:
    """initial_axial_velocity is refused until initial_with_platform is false."""
    found = lines(Set({"initial_axial_velocity": -1.5, "initial_with_platform": False}), NAMES)
    assert found == [
        "ros2 param set /left/bouncing_disk initial_with_platform false",
        "ros2 param set /left/bouncing_disk initial_axial_velocity -1.5",
    ]


def test_a_text_is_quoted_for_the_shell() -> None:
    words, _ = read(Set({"restitution": "a; rm 'x'"}))
    assert words[-1] == "a; rm 'x'"


def test_juggling_is_the_node_with_its_options() -> None:
    (line,) = lines(Juggle("deadbeat", {"restitution": 0.5, "gravity": 10.0}), NAMES)
    words = shlex.split(line)
    assert words[:5] == ["ros2", "run", "bouncing_disk_ros", "juggle", "--ros-args"]
    assert words[5::2] == ["-p", "-p", "-p", "-r"]
    assert words[6::2] == [
        "strategy:=deadbeat", "restitution:=0.5", "gravity:=10.0", "__ns:=/left"
    ]  # fmt: skip
    names = [word.partition(":=")[0] for word in words[6:-2:2]]
    assert set(names) <= OPTIONS.keys()
    (line,) = lines(StopJuggling(), NAMES)
    assert shlex.split(line, comments=True) == [], "a remark: a shell does nothing"


def test_transitions_and_programmes() -> None:
    assert lines(Lifecycle("cleanup"), NAMES) == ["ros2 lifecycle set /left/bouncing_disk cleanup"]
    (line,) = lines(Perform("first_toss_to_period_1"), NAMES)
    assert line.split()[:4] == ["ros2", "run", "bouncing_disk_ros", "perform"]
    assert "perform" in EXECUTABLES
    assert line.endswith("--ros-args -r __ns:=/left")
    assert lines(Perform("x"), Names()) == ["ros2 run bouncing_disk_ros perform x"]
