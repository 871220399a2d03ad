"""Actions of the page as command lines, and scenes: actions, and numbers that closed forms have."""

from __future__ import annotations

import math
import shlex

import pytest
import yaml

from bouncing_disk_ros import parameters, simulate
from bouncing_disk_ros.juggling.juggle import OPTIONS
from bouncing_disk_ros.maps.period_one import period_one, stability_limit
from bouncing_disk_ros.maps.scales import axial_forcing_of
from bouncing_disk_ros.run.presets import load_preset
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
from bouncing_disk_ros.workbench.scene_numbers import number_of
from bouncing_disk_ros.workbench.scene_table import SCENES, shown_number
from support.checks import there

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


def test_parameters_are_set_in_an_order_that_is_accepted_and_no_namespace_is_left_out() -> None:
    """initial_axial_velocity is refused until initial_with_platform is false."""
    found = lines(Set({"initial_axial_velocity": -1.5, "initial_with_platform": False}), NAMES)
    assert found == [
        "ros2 param set /left/bouncing_disk initial_with_platform false",
        "ros2 param set /left/bouncing_disk initial_axial_velocity -1.5",
    ]
    assert lines(Perform("x"), Names()) == ["ros2 run bouncing_disk_ros perform x"]


# --- scenes ---------------------------------------------------------------------------------------
@pytest.mark.parametrize("name", SCENES)
def test_a_scene_is_two_sentences_a_number_to_find_and_a_run_of_its_own(name: str) -> None:
    """Nothing of the run before is left: the node is cleaned up, set and configured again."""
    scene = SCENES[name]
    assert scene.text.count(". ") + scene.text.endswith(".") == 2
    assert scene.find
    values = scene.parameters
    assert parameters.complete(values).items() >= values.items()
    if scene.axial_forcing is not None:
        found = axial_forcing_of(scene.motion, scene.disk)
        assert found == pytest.approx(scene.axial_forcing, rel=1e-14)
    actions = scene.actions(parameters.DEFAULTS)
    begin, end = actions[:2], actions[3:5]
    assert begin == [Lifecycle("deactivate"), Lifecycle("cleanup")]
    assert end == [Lifecycle("configure"), Lifecycle("activate")]
    settings = actions[2]
    assert isinstance(settings, Set)
    assert {**parameters.DEFAULTS, **settings.values}.items() >= values.items()
    # after a motor with fades of 2 s the disk, motion and fades are the scene's all the same
    motor = {**parameters.complete(load_preset("swum")), "crossfade_duration": 2.0}
    (again,) = (one for one in scene.actions(motor) if isinstance(one, Set))
    left = {**motor, **again.values}
    assert left.items() >= values.items()
    assert left["crossfade_duration"] == 0.0
    shown = [line for one in actions for line in lines(one, Names())]
    assert shown[0] == "ros2 lifecycle set /bouncing_disk deactivate"
    assert len(shown) == len(settings.values) + len(actions) - 1


def test_a_fall_on_a_platform_at_rest() -> None:
    """√(2h/g) (1 + 2ε + 2ε² + …) = √(2h/g) (1+ε)/(1−ε)."""
    scene = SCENES["rest_and_chatter"]
    e = scene.disk.restitution
    fall = math.sqrt(2.0 * 0.2 / scene.disk.gravity)
    # the impacts below the reporting speed share a row, which ends in contact: rounding alone
    assert number_of("rest_and_chatter") == pytest.approx(fall * (1 + e) / (1 - e), rel=1e-9)


def test_the_first_toss_lands_in_period_1_whose_best_lag_is_minus_the_phase_of_impact() -> None:
    values = SCENES["period_1"]
    orbit = there(period_one(values.motion._replace(phase_lag=-0.7366240020191286), values.disk))
    # 30 s: 80 impacts after the toss with |multiplier| ½; what is left is below rounding
    assert number_of("first_toss") == pytest.approx(orbit.angular_velocity, rel=1e-9)
    scene = SCENES["period_1"]
    orbit = there(period_one(scene.motion, scene.disk))
    # the speed is flat at its maximum: its rounding, 1e-16, is the square of the error
    assert number_of("period_1") == pytest.approx(-orbit.forcing_phase, abs=1e-6)


def test_chaos_is_chaotic_and_the_run_is_on_its_attractor() -> None:
    assert 0.3 < number_of("chaos") < 0.5
    result = simulate(60.0, **dict(SCENES["chaos"].parameters))  # type: ignore[arg-type]
    phases = result.impacts["forcing_phase"][-100:]
    assert (result.impacts["kind"][-100:] == 0).all(), "it does not chatter"
    assert len({round(float(phase), 6) for phase in phases}) == 100, "it does not repeat"


def test_shares_and_exponents_of_the_maps() -> None:
    # 11.64 % on 1000 × 1000 starts; with 300 × 300 the edge's pixels, 4/300 of the share, may flip
    assert number_of("coexisting_orbits") == pytest.approx(0.1164, abs=0.002)
    assert 0.4 < number_of("fractal_boundary") < 0.5, "well below 1: no smooth line"


def test_stall_is_what_friction_passes_on_and_the_doubling_where_stability_ends() -> None:
    limit = stability_limit(SCENES["doubling"].disk.restitution)
    assert number_of("doubling") == pytest.approx(limit, rel=1e-12)
    disk = SCENES["motor_under_load"].disk
    most = disk.friction * disk.friction_radius * (disk.mass * disk.gravity + disk.preload)
    assert number_of("motor_under_load") == pytest.approx(1e3 * most, rel=1e-3)
    assert shown_number(0.486003, "") == "0.486"
    assert shown_number(11.1524, "mN·m") == "11.15 mN·m"
    assert shown_number(math.nan, "s") == "none"
