"""The study `motor`: maps that hold the closed forms, however they are cut; clear refusals."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from bouncing_disk_ros.maps import motor_curves
from bouncing_disk_ros.motor_study.compute import Motor, derived, stall
from bouncing_disk_ros.motor_study.options import DEFINITION
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.run.presets import load_preset
from bouncing_disk_ros.study import named, run

SMALL: dict[str, Value] = {"x_count": 9, "y_begin": 21.0, "y_end": 30.0, "y_count": 4}


def result_of(path: Path, **given: Value) -> tuple[Motor, xr.Dataset]:
    study = named("motor", **given)
    assert isinstance(study, Motor)
    found = run(study, path / "motor.zarr")
    assert found is not None
    return study, found


def test_the_defaults_are_the_preset_swum() -> None:
    preset = load_preset("swum")
    table = DEFINITION.options
    shared = {name: value for name, value in preset.items() if name in table}
    assert len(shared) == 10
    assert {name: table[name].default for name in shared} == shared


def test_a_map_of_preload_and_load_has_stall_and_no_load_speed(tmp_path: Path) -> None:
    study, found = result_of(tmp_path, **SMALL)
    assert found["mean_speed"].dims == ("preload", "load_torque")
    assert found["mean_speed"].attrs["units"] == "rad/s"
    for i, preload in enumerate(found["preload"].values):
        motion, disk = study.motor_at({"preload": preload, "load_torque": 0.0})
        assert float(found["no_load_speed"][i]) == pytest.approx(
            motor_curves.no_load_speed(motion, disk), rel=1e-9
        )
        assert float(found["stall_torque"][i]) == pytest.approx(
            motor_curves.friction_limit(disk), rel=1e-9
        )
        row = found["mean_speed"].values[i]
        beyond = found["load_torque"].values > motor_curves.friction_limit(disk)
        assert np.isnan(row).tolist() == beyond.tolist()
        assert ((found["kind"].values[i] == 4) == beyond).all()
    best = found["efficiency"].max("load_torque")
    np.testing.assert_array_equal(found["best_efficiency"].values, best.values)
    regimes = motor_curves.preload_regimes(*study.motor_at({"preload": 21.0, "load_torque": 0.0}))
    assert found.attrs["preload_doubling"] == regimes.doubling


def test_the_best_phase_lag_meets_the_impact(tmp_path: Path) -> None:
    """θ = −τ_imp; half a turn beside it the rotor turns as fast, but backwards."""
    _, found = result_of(
        tmp_path, x_axis="phase_lag", x_begin=-1.0, x_end=-0.4, x_count=61, y_begin=22.3,
        y_end=22.3, y_count=1,
    )  # fmt: skip
    assert float(found["best_phase_lag"][0]) == pytest.approx(-0.7384, abs=0.006)
    assert float(found["best_speed"][0]) == pytest.approx(100.53, rel=1e-4)
    assert "stall_torque" not in found


def test_a_load_that_turns_the_rotor_back_has_no_part_in_the_best_phase_lag() -> None:
    speed = xr.DataArray([[40.0, 60.0, 20.0], [-90.0, 10.0, -100.0]], dims=("load", "phase_lag"))
    result = xr.Dataset({"mean_speed": speed}, {"phase_lag": [-1.5, -0.7, 1.5]})
    found = derived(result, "load", "phase_lag", lambda _: np.zeros(0))
    assert found["best_phase_lag"].values.tolist() == [-0.7, -0.7]
    assert found["best_speed"].values.tolist() == [60.0, 10.0]


def test_stall_is_where_the_speed_is_0_or_friction_gives_way() -> None:
    loads = np.linspace(-2.0, 4.0, 7)
    falling = 2.0 - loads
    assert stall(loads, falling, 10.0) == pytest.approx(2.0)
    assert stall(loads, np.where(loads > 1.5, np.nan, falling), 1.5) == 1.5
    assert math.isnan(stall(loads, falling + 10.0, 10.0)), "the axis ends before"
    assert stall(loads, -1.0 - loads, 10.0) == pytest.approx(-1.0), "it turns the other way"
    assert math.isnan(stall(loads[4:], falling[4:], 10.0)), "0 is not on the axis"
    assert stall(loads, -loads, 10.0) == 0.0


def test_a_plane_that_moves_at_some_point_is_taken() -> None:
    named("motor", x_begin=-0.1, x_end=0.1)
    named("motor", y_begin=25.0, y_end=40.0, brake_torque=1.0)
    named("motor", x_axis="angular_amplitude", x_begin=0.0, x_end=1e-3)
