"""What a study takes from a bag or preset: definitions, the last steady motion, refusals."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
import xarray as xr

from bouncing_disk_ros import bag
from bouncing_disk_ros.command_line.start import option_values
from bouncing_disk_ros.command_line.stop import Stop
from bouncing_disk_ros.core.model import Disk, Motion
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.scales import MAP_PARAMETERS
from bouncing_disk_ros.orbit_studies.resilience.picture import impulse_unit
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.study import open_result
from bouncing_disk_ros.study.bifurcation.options import DEFINITION
from bouncing_disk_ros.study.by_name import definition_of
from bouncing_disk_ros.study.command import run_command
from bouncing_disk_ros.study.from_run import RECORDED, numbers, of_preset, read_bag, wanted
from support.checks import refused
from support.recorded import NS, RecordedRun, period_one_bag

WANTED = {name: DEFINITION.options[name] for name in MAP_PARAMETERS}
MOTION = Motion(0.02, 0.3, 4.0, 0.7)
DISK = Disk(0.25, 0.6, 0.5, 0.1, 0.08, 9.0)


def test_numbers_are_those_of_the_definitions_and_a_preload_counts_as_gravity() -> None:
    omega = 8.0 * math.pi
    found = numbers(MOTION, DISK)
    assert found["axial_forcing"] == pytest.approx(0.02 * omega**2 / (math.pi * 9.0))
    turning = 0.08**2 * 0.3 * omega**2 / (0.1 * math.pi * 9.0 * 0.5)
    assert found["angular_forcing"] == pytest.approx(turning)
    assert (found["restitution"], found["phase_lag"]) == (0.6, 0.7)
    pressed = numbers(MOTION, DISK._replace(preload=0.25 * 3.0))
    heavy = numbers(MOTION, DISK._replace(gravity=12.0))
    for name in (*MAP_PARAMETERS, "gravity"):
        assert pressed[name] == pytest.approx(heavy[name])
    assert numbers(MOTION, DISK._replace(preload=0.75), takes_loads=True)["gravity"] == 9.0


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
    assert definition.takes_run
    defaults = {key: spec.default for key, spec in definition.options.items()}
    assert list(wanted(definition, {**defaults, **values}, given)) == names.split()
    assert set(RECORDED) == numbers(MOTION, DISK).keys()


def test_impulses_in_si_units_are_those_of_the_preload(tmp_path: Path) -> None:
    """Of the preset swum, whose preload is 4500 times the weight of the rotor: m π (g + P/m)/ω."""
    wished = wanted(definition_of("resilience"), {"along": "restitution", "count": 2}, ())
    preset = of_preset("swum", wished)
    assert preset["gravity"] == pytest.approx(9.80665 + 22.3 / 5e-4)
    run = str(period_one_bag(tmp_path / "run", 1.0, preload=0.5))
    assert read_bag(run, None, wished).values["gravity"] == pytest.approx(10.0 + 0.5 / 0.25)
    for values in (preset, read_bag(run, None, wished).values):
        result = xr.Dataset(attrs={f"parameter_{name}": one for name, one in values.items()})
        width = math.pi * float(values["gravity"]) / (math.tau * float(values["frequency"]))
        assert impulse_unit(result) == pytest.approx(float(values["mass"]) * width)


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
    refused("a steady motion in which the platform moves", read_bag, folder, None, WANTED)
    assert read_bag(folder, None, {"restitution": WANTED["restitution"]}).values == {
        "restitution": 0.5
    }


def test_what_a_study_cannot_use_is_said_with_the_way_out(tmp_path: Path) -> None:
    folder = period_one_bag(tmp_path / "run", 1.0, friction=0.0)
    with pytest.raises(InputError, match=r"angular_forcing from the bag: got inf.*_forcing:="):
        read_bag(str(folder), None, WANTED)
    light = {name: WANTED[name] for name in ("axial_forcing", "restitution")}
    assert read_bag(str(folder), None, light).values["axial_forcing"] == pytest.approx(0.45)
    unknown = period_one_bag(tmp_path / "other", 1.0, without=("disk/inputs",))
    refused("Give the options themselves instead", read_bag, str(unknown), None, WANTED)
    loaded = period_one_bag(tmp_path / "loaded", 1.0, load_torque=2e-4)
    (warning,) = read_bag(str(loaded), None, {}).warnings
    assert "0.0002 N·m, is left out" in warning


def studied(name: str, folder: Path, **given: Value) -> xr.Dataset:
    """The result of a study run as its executable runs it where there is no ROS."""
    definition = definition_of(name)
    defaults = {key: spec.default for key, spec in definition.table.items()}
    where: dict[str, Value] = {"netcdf": False, "figures": "none", "output": str(folder)}
    assert run_command(definition, {**defaults, **where, **given}, given.keys(), Stop()) == 0
    return open_result(folder / "result.zarr")


def test_a_study_is_that_of_the_recorded_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = str(period_one_bag(tmp_path / "run", 3.0, preload=0.5, load_torque=1e-4))
    small: dict[str, Value] = {"width": 8, "height": 8, "angular_velocities": "0"}
    for _ in range(2):  # what was resolved is what a store is known by
        found = studied("basins", tmp_path / "b", bag=run, restitution=0.4, **small).attrs
    said = capsys.readouterr()
    # the preset has Γ = 0.45 at g = 10 m/s² and 0.25 kg: the preload adds 2 m/s²
    assert "steady motion from 0.000 to 3.000 s: Γ = 0.375, θ = -0.7366" in said.out
    assert said.err.count("the load torque of that run, 0.0001 N·m, is left out") == 2
    assert found["parameter_restitution"] == 0.4
    assert found["parameter_axial_forcing"] == pytest.approx(0.375, rel=1e-12)
    assert "parameter_bag" not in found
    with pytest.raises(InputError, match=r"There width is 8, not 9\. Choose another output"):
        studied("basins", tmp_path / "b", **{**small, "bag": run, "restitution": 0.4, "width": 9})


def test_a_result_that_is_given_as_the_output_stays_whole(tmp_path: Path) -> None:
    small: dict[str, Value] = {"width": 2, "height": 2}
    whole = studied("basins", tmp_path / "b", **small)
    with pytest.raises(InputError, match=r"got '.*zarr'.* Its folder, .*b, continues it"):
        studied("basins", tmp_path / "b" / "result.zarr", **{**small, "width": 3})
    assert whole.equals(studied("basins", tmp_path / "b", **small))


def test_a_study_is_that_of_a_preset(tmp_path: Path) -> None:
    """What the preset decides, with the simulator's own mass, g and preload for the rest."""
    file = tmp_path / "plate.yaml"
    file.write_text(
        "/**:\n  ros__parameters:\n    axial_amplitude: 0.001\n    frequency: 20.0\n"
        "    restitution: 0.7\n    preload: 0.5\n    mass: 0.25\n    gravity: 8.0\n"
    )
    small: dict[str, Value] = {"width": 4, "height": 4, "angular_velocities": "0"}
    small["preset"] = str(file)
    found = studied("basins", tmp_path / "b", **small).attrs
    forcing = 0.001 * (math.tau * 20.0) ** 2 / (math.pi * (8.0 + 0.5 / 0.25))
    assert found["parameter_axial_forcing"] == pytest.approx(forcing, rel=1e-12)
    assert found["parameter_restitution"] == 0.7
    assert found["parameter_angular_forcing"] == 100.0, "not decided by this preset: the study's"
    file.write_text("/**:\n  ros__parameters:\n    axial_amplitude: 0.0\n    restitution: 0.7\n")
    with pytest.raises(InputError, match=r"preset: .*moves up and down\. Give axial_forcing:="):
        studied("basins", tmp_path / "x", **small)
    found = studied("basins", tmp_path / "r", axial_forcing=0.4, **small).attrs
    assert (found["parameter_axial_forcing"], found["parameter_restitution"]) == (0.4, 0.7)
    file.write_text(
        "/**:\n  ros__parameters:\n    axial_amplitude: 0.0\n    angular_amplitude: 0.0\n"
    )
    found = studied("basins", tmp_path / "s", axial_forcing=0.4, **small).attrs
    assert found["parameter_angular_forcing"] == 100.0, "a platform at rest has none: the study's"
    file.write_text("/**:\n  ros__parameters:\n    axial_amplitude: 9.0\n    frequency: 900.0\n")
    with pytest.raises(InputError, match=r"axial_forcing from the preset: .* computed from .*yaml"):
        studied("basins", tmp_path / "x", **small)


def test_a_preset_that_is_given_as_a_parameter_file_is_told_how_to_be_given() -> None:
    """As in `basins --params-file plate_fit.yaml`: its names are the simulator's."""
    table = definition_of("basins").table
    hint = r"parameter: got 'gravity'.* give a preset with -p preset:=FILE\."
    with pytest.raises(InputError, match=hint):
        option_values({"restitution": 0.7, "gravity": 9.8}, table)
    with pytest.raises(InputError, match="Did you mean restitution"):
        option_values({"restitutoin": 0.7}, table)


def test_a_motor_takes_a_preset_or_a_recorded_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    small: dict[str, Value] = {
        "x_axis": "brake_torque", "x_end": 0.001, "x_count": 2,
        "y_axis": "phase_lag", "y_begin": -1.0, "y_end": 1.0, "y_count": 2,
    }  # fmt: skip
    preset = "pizza_multiple_toss"
    of_preset = studied("motor", tmp_path / "p", preset=preset, friction=0.4, **small).attrs
    assert of_preset["parameter_frequency"] == 3.0
    assert of_preset["parameter_friction"] == 0.4, "what is given wins"
    assert "parameter_preset" not in of_preset
    run = str(period_one_bag(tmp_path / "run", 4.0, load_torque=1e-4))
    capsys.readouterr()
    of_bag = studied("motor", tmp_path / "b", bag=run, **small)
    said = capsys.readouterr()
    assert "T_L = 0.0001 N·m" in said.out
    assert said.err == ""
    assert of_bag.attrs["parameter_load_torque"] == 1e-4
    assert (of_bag["kind"].values == 0).all()
    with pytest.raises(InputError, match="preset: got 'swum', allowed: none with bag"):
        studied("motor", tmp_path / "x", bag=run, preset="swum")
    with pytest.raises(InputError, match="namespace: got '/left', allowed: none without bag"):
        studied("motor", tmp_path / "x", namespace="/left")
    with pytest.raises(InputError, match="hold: got True, allowed: false where ROS 2 is not"):
        studied("motor", tmp_path / "x", hold=True)
    with pytest.raises(InputError, match=r"scheduler: .* allowed: none for bifurcation"):
        studied("bifurcation", tmp_path / "x", scheduler="tcp://127.0.0.1:9", count=2)
