"""Single tosses: runs of the stepper, their measures, paths, extremes and refusals."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from bouncing_disk_ros.core.model import Phase
from bouncing_disk_ros.maps.best_toss import MEASURES, extreme, height_of, ridge
from bouncing_disk_ros.maps.single_toss import (
    RESULT_AIRBORNE_SPEED,
    TOSS_NONE,
    TOSS_SLID,
    TOSS_STAYS,
    TOSS_STUCK,
    TOSS_UNRESOLVED,
)
from bouncing_disk_ros.maps.toss_paths import toss_paths, toss_trajectory
from bouncing_disk_ros.maps.tosses import (
    CODES,
    LOWEST,
    PAPER,
    PAPER_DISK,
    Toss,
    TossSetting,
    TossTable,
    separation_phase,
    toss,
)
from support.checks import refused

EPS = float(np.finfo(float).eps)
OMEGA = math.tau * PAPER.frequency
WEAK = PAPER._replace(arc_amplitude=0.02)  # c ω² < g: never leaves


def test_one_toss_without_arrays_has_the_bits_of_the_map() -> None:
    speed, tau = 3.0, -1e-17
    lags, angles = np.linspace(-3.0, 3.0, 5), np.array([0.0, 0.3, 0.8, 1.2, 1.5])
    found = toss(lags[:, None], angles, angular_velocity=speed, forcing_phase=tau)
    for measure in MEASURES:
        height = height_of(measure, PAPER, speed, tau)
        one = [[height(float(lag), float(angle)) for angle in angles] for lag in lags]
        table = getattr(found, measure)
        np.testing.assert_array_equal(one, table if measure == "efficiency" else np.abs(table))
        assert not np.isnan(table).all()


def test_how_a_toss_ends() -> None:
    """Γ = 1/π at cos φ_L = g/(ω²c); at τ = π/2 the platform is already falling away."""
    limit = math.acos(10.0 / OMEGA**2 / 0.25)
    angles = np.array([limit - 1e-9, limit + 1e-9, math.pi / 2])
    stays = toss(0.0, angles)
    assert stays.code.tolist() == [TOSS_SLID, TOSS_STAYS, TOSS_STAYS]
    for name in Toss._fields[:-1]:
        values = getattr(stays, name)
        assert not np.isnan(values[0])
        assert np.isnan(values[1:]).all()
    assert np.isnan(separation_phase(angles)).tolist() == [False, True, True]
    at_once = toss(0.3, 0.5, angular_velocity=7.0, forcing_phase=math.pi / 2)
    assert at_once.code == TOSS_NONE
    assert list(map(float, at_once[:1] + at_once[4:6])) == [7.0, 0.0, 0.0]
    assert np.isnan(at_once.efficiency)
    lifted = toss(0.0, 0.0)
    assert lifted.code == TOSS_STUCK
    assert lifted.airborne_speed == 0.0
    assert np.isnan(lifted.speed_ratio)
    start = np.array([[0.2, 1.0, 1.5, LOWEST, 0.0]])  # slip, and slip the other way
    few, enough = (TossTable(start, 3.0, PAPER_DISK, events) for events in (1, 5))
    for table in (few, enough):
        table.compute()
    assert few.code[0] == TOSS_UNRESOLVED
    assert np.isnan(few.out[0, RESULT_AIRBORNE_SPEED])
    assert enough.code[0] == TOSS_SLID
    assert set(CODES) == {TOSS_SLID, TOSS_STUCK, TOSS_NONE, TOSS_STAYS, TOSS_UNRESOLVED}


@pytest.mark.parametrize(
    ("call", "arguments", "words"),
    [
        (toss, {"phase_lag": math.nan}, "phase_lag"),
        (toss, {"phase_lag": "north"}, "phase_lag"),
        (toss, {"amplitude_angle": -0.1}, "amplitude_angle"),
        (toss, {"amplitude_angle": [0.1, math.nan]}, "amplitude_angle"),
        (toss, {"angular_velocity": math.inf}, "angular_velocity"),
        (toss, {"forcing_phase": math.nan}, "forcing_phase"),
        (toss, {"phase_lag": [0.0, 1.0], "amplitude_angle": [0.1, 0.2, 0.3]}, "toss"),
        (toss, {"setting": PAPER._replace(arc_amplitude=0.0)}, "arc_amplitude"),
        (toss, {"setting": PAPER._replace(frequency=-3.0)}, "frequency"),
        (toss, {"setting": TossSetting(disk=PAPER_DISK._replace(mass=-1.0))}, "mass"),
        (toss, {"setting": TossSetting(disk=PAPER_DISK._replace(preload=-9.0))}, "preload"),
        (toss_trajectory, {"amplitude_angle": 1.5}, "amplitude_angle"),
        (toss_trajectory, {"samples": 1}, "samples"),
        (toss_trajectory, {"duration": 0.0}, "duration"),
        (toss_paths, {"points": 1}, "points"),
        (toss, {"phase_lag": np.ma.masked_array([0.0, 1.0], [True, False])}, "phase_lag: got"),
        (toss, {"amplitude_angle": [0.5 + 0.1j]}, "amplitude_angle: got"),
        (toss_paths, {"phase_lag": math.nan}, "phase_lag"),
        (extreme, {"measure": "speed"}, "measure: got 'speed', allowed: one of airborne_speed"),
        (extreme, {"setting": WEAK}, "a setting whose platform throws the disk"),
        (extreme, {"measure": "speed_ratio", "angular_velocity": 1.0}, "no bound as φ_L falls to"),
        (ridge, {"setting": WEAK}, "a setting whose platform throws the disk"),
        (ridge, {"points": 1}, "points: got 1"),
    ],
)
def test_what_cannot_be_used_is_refused(
    call: Callable[..., Any], arguments: dict[str, Any], words: str
) -> None:
    defaults: dict[str, Any] = {"phase_lag": 0.0, "amplitude_angle": 0.5}
    if call in (extreme, ridge):
        defaults = {"measure": "efficiency"} if call is extreme else {}
    refused(re.escape(words), call, **{**defaults, **arguments})


def test_a_duration_may_be_given() -> None:
    run = toss_trajectory(0.3, 0.7, duration=0.2, samples=21)
    assert run.time[-1] == pytest.approx(0.2, abs=1e-9)
    assert math.isnan(run.landing_time)
    rest = toss_trajectory(0.3, math.pi / 2, duration=1.0, samples=21)
    assert math.isnan(rest.separation_time)
    assert math.isnan(rest.airborne_speed)
    assert (rest.phase != Phase.FLIGHT).all()
    again = toss_trajectory(0.3, 0.7, duration=2.0, samples=21)
    late = toss_trajectory(0.3, 0.7)
    assert again.landing_time == late.landing_time < 2.0
    assert float(separation_phase(0.7)) == pytest.approx(
        math.tau * 3.0 * late.separation_time - math.pi / 2, rel=1e-13
    )


def test_a_flight_of_many_periods_ends_and_one_without_end_is_cut() -> None:
    setting = PAPER._replace(disk=PAPER_DISK._replace(gravity=1e-4))
    run = toss_trajectory(0.0, 0.7, setting, samples=3)
    assert run.landing_time == pytest.approx(run.time[-1], abs=2e-9)
    speed = run.axial_velocity[1] + 1e-4 * run.time[1]
    assert run.landing_time == pytest.approx(2.0 * speed / 1e-4, abs=1e4)
    setting = PAPER._replace(disk=PAPER_DISK._replace(gravity=1e-7))
    cut = toss_trajectory(0.0, 0.7, setting, samples=3)
    assert math.isnan(cut.landing_time)
    assert 1e6 <= cut.time[-1] < 2e6


def test_ridge_without_slip_or_none_or_one_without_end() -> None:
    """ν = 1 along θ = −τ_sep as long as friction can brake the disk with the platform to the end.

    Rule 5: |Ṙ| ≤ μ a_e |Ṅ| at separation, a_g² Φ ≤ μ a_e A cos τ_sep.
    """
    line = ridge(points=2000)
    stuck = line.amplitude_angle <= line.end
    np.testing.assert_allclose(line.speed_ratio[stuck], 1.0, rtol=0, atol=4 * EPS)
    assert (line.speed_ratio[~stuck] < 1.0).all()
    assert (np.diff(line.speed_ratio[~stuck]) < 0.0).all()
    np.testing.assert_array_equal(line.phase_lag, -separation_phase(line.amplitude_angle))
    k = PAPER_DISK
    grip = k.friction * (k.friction_radius / k.gyration_radius) ** 2
    limit = grip * math.cos(float(separation_phase(line.end)))
    assert math.tan(line.end) == pytest.approx(limit, abs=2e-7)
    no_grip = TossSetting(disk=PAPER_DISK._replace(friction=0.0))
    assert math.isnan(ridge(no_grip, 50).end)
    gripping = TossSetting(disk=PAPER_DISK._replace(friction=1e6))
    line = ridge(gripping, 50)
    assert line.end == line.amplitude_angle[-1]
    np.testing.assert_allclose(line.speed_ratio, 1.0, rtol=0, atol=4 * EPS)


OTHERS = [  # setting, α̇ and τ at the start: hills oblique to the grid, creases, a braked disk
    (TossSetting(0.12, 2.7, PAPER_DISK._replace(friction=0.13)), 8.0, 5.5),
    (TossSetting(0.45, 2.2, PAPER_DISK._replace(friction=1.3)), 0.0, 3.9),
]


@pytest.mark.parametrize(
    ("measure", "setting", "speed", "tau"),
    [("airborne_speed", *OTHERS[0]), ("efficiency", *OTHERS[1])],
)
def test_no_toss_beats_the_best(
    measure: str, setting: TossSetting, speed: float, tau: float
) -> None:
    """Neither on a grid over the whole map nor close by, in windows that shrink onto it."""
    start = {"angular_velocity": speed, "forcing_phase": tau}
    best = extreme(measure, setting, **start)
    top = getattr(best, measure)
    top = top if measure == "efficiency" else abs(top)
    lags, angles = np.linspace(-math.pi, math.pi, 301), np.linspace(0.0, math.pi / 2, 201)
    grids = [(lags, angles)]
    for size in (0.1, 1e-2, 1e-3, 1e-4):
        near = best.amplitude_angle + np.linspace(-size, size, 41)
        grids.append((best.phase_lag + np.linspace(-size, size, 41), np.clip(near, 0.0, 1.57)))
    for x, y in grids:
        found = getattr(toss(x[:, None], y, setting, **start), measure)
        found = found if measure == "efficiency" else np.abs(found)  # η itself, |α̇| otherwise
        assert np.nanmax(found) <= top + abs(top) * 1e-9
