"""What a study takes from a bag: the paper's definitions, the last steady motion, refusals."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from bouncing_disk_ros import bag
from bouncing_disk_ros.core.model import Disk, Motion
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.scales import MAP_PARAMETERS
from bouncing_disk_ros.study.bifurcation.tool import DEFINITION
from bouncing_disk_ros.study.from_bag import RECORDED, numbers, read_bag, wanted
from bouncing_disk_ros.study.studies import definition_of
from support.recorded import NS, RecordedRun, period_one_bag

WANTED = {name: DEFINITION.options[name] for name in MAP_PARAMETERS}
MOTION = Motion(0.02, 0.3, 4.0, 0.7)
DISK = Disk(0.25, 0.6, 0.5, 0.1, 0.08, 9.0)


def test_numbers_are_those_of_the_definitions() -> None:
    omega = 8.0 * math.pi
    found = numbers(MOTION, DISK)
    assert found["axial_forcing"] == pytest.approx(0.02 * omega**2 / (math.pi * 9.0))
    turning = 0.08**2 * 0.3 * omega**2 / (0.1 * math.pi * 9.0 * 0.5)
    assert found["angular_forcing"] == pytest.approx(turning)
    assert (found["restitution"], found["phase_lag"]) == (0.6, 0.7)


@pytest.mark.parametrize(
    ("name", "values", "given", "names"),
    [
        ("basins", {}, (), "axial_forcing restitution"),
        ("basins", {"angular_velocities": "0 1"}, ("restitution",),
         "axial_forcing phase_lag angular_forcing"),
        ("bifurcation", {}, (), "restitution phase_lag angular_forcing"),
        ("basin_shares", {"along": "restitution"}, (), "axial_forcing angular_forcing"),
        ("parameter_map", {}, (), "phase_lag angular_forcing"),
        ("motor", {"y_axis": "friction"}, (*Motion._fields, *Disk._fields[:6]),
         "preload brake_torque load_inertia"),
        ("curves", {}, (), "axial_forcing restitution"),
        ("manifolds", {}, (), "axial_forcing restitution"),
        ("resilience", {}, (), "restitution mass frequency gravity"),
    ],
)  # fmt: skip
def test_a_study_takes_what_a_run_has_unless_it_is_given_or_does_nothing(
    name: str, values: dict[str, str], given: tuple[str, ...], names: str
) -> None:
    definition = definition_of(name)
    assert definition.takes_bag
    defaults = {key: spec.default for key, spec in definition.options.items()}
    assert list(wanted(definition, {**defaults, **values}, given)) == names.split()
    assert set(RECORDED) == numbers(MOTION, DISK).keys()


def test_a_preload_counts_as_gravity() -> None:
    pressed = numbers(MOTION, DISK._replace(preload=0.25 * 3.0))
    heavy = numbers(MOTION, DISK._replace(gravity=12.0))
    for name in MAP_PARAMETERS:
        assert pressed[name] == pytest.approx(heavy[name])


def test_the_last_steady_motion_and_its_disk_are_taken(tmp_path: Path) -> None:
    with bag.Writer(tmp_path / "run") as writer:
        run = RecordedRun(writer, preset="pizza_multiple_toss")
        before = run.session.simulation.motion_in_force.target
        run.run(2.0, {1.0: lambda session: session.set_parameters({"restitution": 0.4})})
        second = before._replace(axial_amplitude=0.05)
        run.run(4.0, {3.0: lambda session: session.command([(4 * NS, second)])})
        gravity = run.session.simulation.disk.gravity
    found = read_bag(str(tmp_path / "run"), None, WANTED)
    omega = math.tau * before.frequency
    assert found.values["axial_forcing"] == pytest.approx(0.05 * omega**2 / (math.pi * gravity))
    assert found.values["restitution"] == 0.4
    assert found.warnings == ()


def test_a_motion_that_is_switched_off_at_the_end_does_not_count(tmp_path: Path) -> None:
    with bag.Writer(tmp_path / "run") as writer:
        run = RecordedRun(writer, preset="pizza_multiple_toss")
        before = run.session.simulation.motion_in_force.target
        off = before._replace(axial_amplitude=0.0, angular_amplitude=0.0)
        run.run(4.0, {2.0: lambda session: session.command([(2 * NS, off)])})
    found = read_bag(str(tmp_path / "run"), None, WANTED)
    assert found.values["axial_forcing"] == pytest.approx(0.45)
    assert "from 0.000 to 2.000 s, the last in which the platform moves up and" in found.text


def test_a_platform_that_never_moves_is_refused_where_its_motion_is_wanted(tmp_path: Path) -> None:
    folder = str(period_one_bag(tmp_path / "run", 1.0, axial_amplitude=0.0))
    with pytest.raises(InputError, match="a steady motion in which the platform moves"):
        read_bag(folder, None, WANTED)
    assert read_bag(folder, None, {"restitution": WANTED["restitution"]}).values == {
        "restitution": 0.5
    }


def test_a_load_torque_is_one_line(tmp_path: Path) -> None:
    folder = period_one_bag(tmp_path / "run", 1.0, load_torque=2e-4)
    (warning,) = read_bag(str(folder), None, {}).warnings
    assert "0.0002 N·m, is left out" in warning


def test_what_a_study_cannot_use_is_said_with_the_way_out(tmp_path: Path) -> None:
    folder = period_one_bag(tmp_path / "run", 1.0, friction=0.0)
    with pytest.raises(InputError, match=r"angular_forcing from the bag: got inf.*_forcing:="):
        read_bag(str(folder), None, WANTED)
    light = {name: WANTED[name] for name in ("axial_forcing", "restitution")}
    assert read_bag(str(folder), None, light).values["axial_forcing"] == pytest.approx(0.45)
    unknown = period_one_bag(tmp_path / "other", 1.0, without=("disk/inputs",))
    with pytest.raises(InputError, match="Give the options themselves instead"):
        read_bag(str(unknown), None, WANTED)
