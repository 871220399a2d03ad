"""The scenes: data that the simulator takes, and numbers that hold against closed forms."""

from __future__ import annotations

import math

import pytest

from bouncing_disk_ros import parameters, simulate
from bouncing_disk_ros.maps.period_one import period_one, stability_limit
from bouncing_disk_ros.maps.scales import axial_forcing_of
from bouncing_disk_ros.run.presets import load_preset
from bouncing_disk_ros.workbench.actions import Lifecycle, Names, Set, lines
from bouncing_disk_ros.workbench.scene_numbers import number_of
from bouncing_disk_ros.workbench.scene_table import SCENES, shown_number


@pytest.mark.parametrize("name", SCENES)
def test_a_scene_is_two_sentences_and_a_number_to_find(name: str) -> None:
    scene = SCENES[name]
    assert scene.text.count(". ") + scene.text.endswith(".") == 2
    assert scene.find
    values = scene.parameters
    assert parameters.complete(values).items() >= values.items()
    if scene.axial_forcing is not None:
        found = axial_forcing_of(scene.motion, scene.disk)
        assert found == pytest.approx(scene.axial_forcing, rel=1e-14)


@pytest.mark.parametrize("name", SCENES)
def test_a_scene_is_a_run_of_its_own(name: str) -> None:
    """Nothing of the run before is left: the node is cleaned up, set and configured again."""
    scene = SCENES[name]
    actions = scene.actions(parameters.DEFAULTS)
    begin, end = actions[:2], actions[3:5]
    assert begin == [Lifecycle("deactivate"), Lifecycle("cleanup")]
    assert end == [Lifecycle("configure"), Lifecycle("activate")]
    settings = actions[2]
    assert isinstance(settings, Set)
    assert {**parameters.DEFAULTS, **settings.values}.items() >= scene.parameters.items()
    # after a motor with fades of 2 s the disk, motion and fades are the scene's all the same
    motor = {**parameters.complete(load_preset("swum")), "crossfade_duration": 2.0}
    (again,) = (one for one in scene.actions(motor) if isinstance(one, Set))
    left = {**motor, **again.values}
    assert left.items() >= scene.parameters.items()
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


def test_the_first_toss_lands_in_period_1() -> None:
    values = SCENES["period_1"]
    orbit = period_one(values.motion._replace(phase_lag=-0.7366240020191286), values.disk)
    assert orbit is not None
    # 30 s: 80 impacts after the toss with |multiplier| ½; what is left is below rounding
    assert number_of("first_toss") == pytest.approx(orbit.angular_velocity, rel=1e-9)


def test_the_best_lag_is_minus_the_phase_of_impact() -> None:
    scene = SCENES["period_1"]
    orbit = period_one(scene.motion, scene.disk)
    assert orbit is not None
    # the speed is flat at its maximum: its rounding, 1e-16, is the square of the error
    assert number_of("period_1") == pytest.approx(-orbit.forcing_phase, abs=1e-6)


def test_the_first_doubling_is_the_limit_of_stability() -> None:
    limit = stability_limit(SCENES["doubling"].disk.restitution)
    assert number_of("doubling") == pytest.approx(limit, rel=1e-12)


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


def test_the_stall_torque_is_what_friction_passes_on() -> None:
    disk = SCENES["motor_under_load"].disk
    most = disk.friction * disk.friction_radius * (disk.mass * disk.gravity + disk.preload)
    assert number_of("motor_under_load") == pytest.approx(1e3 * most, rel=1e-3)


def test_numbers_are_written_with_their_unit() -> None:
    assert shown_number(0.486003, "") == "0.486"
    assert shown_number(11.1524, "mN·m") == "11.15 mN·m"
    assert shown_number(math.nan, "s") == "none"
