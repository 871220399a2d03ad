"""The orbit of a start is a run of the simulator, and a run can be begun at it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from bouncing_disk_ros.parameters import DEFAULTS
from bouncing_disk_ros.run.input_records import Record
from bouncing_disk_ros.run.session import Session
from bouncing_disk_ros.run.simulate import simulate
from bouncing_disk_ros.workbench.start_plane import (
    IMPACT_PERIODS,
    PATH_PERIODS,
    SAMPLES,
    orbit_of,
    section_of,
    start_at,
)

VALUES = {name: value for name, value in DEFAULTS.items() if isinstance(value, float)}
LOADED = {**VALUES, "load_torque": 0.003, "brake_torque": 0.001, "phase_lag": -0.6,
          "friction": 0.2, "preload": 0.4, "initial_angular_velocity": 2.0,
          "initial_height": 0.3}  # fmt: skip


def starts(count: int) -> list[tuple[float, float]]:
    draw = np.random.default_rng(15)
    return [(draw.uniform(-1.0, 8.0), draw.uniform(-5.0, -1e-6)) for _ in range(count)]


@pytest.mark.parametrize("values", [VALUES, LOADED], ids=["default", "loaded"])
def test_an_orbit_is_what_simulate_gives_bit_by_bit(values: dict[str, float]) -> None:
    frequency = values["frequency"]
    for place in starts(6):
        start = start_at(values, *place)
        orbit = orbit_of(values, start)
        whole: dict[str, Any] = {**values, **start.parameters}
        path = simulate(PATH_PERIODS / frequency, sample_rate=SAMPLES * frequency, **whole)
        np.testing.assert_array_equal(orbit.height, path.samples["axial_position"])
        np.testing.assert_array_equal(orbit.platform, path.samples["platform_position"])
        np.testing.assert_array_equal(orbit.time, path.samples["time_ns"] * 1e-9)
        rows = simulate(IMPACT_PERIODS / frequency, **whole).impacts
        assert len(rows) > 3
        np.testing.assert_array_equal(orbit.impacts, rows)


@pytest.mark.parametrize("values", [VALUES, LOADED], ids=["default", "loaded"])
def test_a_run_begun_at_a_start_has_that_first_impact(values: dict[str, float]) -> None:
    for phase, velocity in starts(40):
        start = start_at(values, phase, velocity)
        whole: dict[str, Any] = {**values, **start.parameters}
        first = simulate(0.0, **whole).impacts[0]
        assert first["forcing_phase"] == start.forcing_phase == phase % math.tau
        assert first["axial_impact_velocity"] == start.impact_velocity
        # three roundings of numbers up to the sum of the platform's speed and the impact's
        size = abs(velocity) + math.pi * section_of(values).axial_forcing
        assert start.velocity == pytest.approx(velocity, abs=3.0 * 2.0**-53 * size)


def test_a_reset_in_a_run_goes_to_the_start() -> None:
    """As the node does it: parameters first, then ~/reset, at any instant."""
    records: list[Record] = []
    session = Session({**DEFAULTS, "start_paused": False}, records.append)
    session.advance(1_234_567_891)
    session.take_rows()
    moved = {**VALUES, "axial_amplitude": 0.05, "frequency": 2.5}
    start = start_at(moved, 4.0, -0.7)
    session.set_parameters(start.parameters)
    session.reset()
    session.advance(session.time_ns + 10**9)
    session.resolve_waiting()
    first = next(row for rows in session.take_rows() for row in rows if row["time"] > 1.2345)
    assert first["forcing_phase"] == start.forcing_phase
    assert first["axial_impact_velocity"] == start.impact_velocity
    assert session.simulation.latest_target.axial_amplitude == 0.05


def test_a_start_as_slow_as_roundings_begins_in_contact() -> None:
    """Where w_A is below the roundings of the platform's speed the disk starts with that."""
    start = start_at(VALUES, 0.1, -1e-300)
    assert -1e-14 < start.impact_velocity < 0.0
    whole: dict[str, Any] = {**VALUES, **start.parameters}
    assert simulate(1.0, **whole).impacts[0]["time"] > 0.0
