"""The best tosses: the extremes of the paper's setting, the ridge ν = 1."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.toss_extremes import extreme, ridge
from bouncing_disk_ros.maps.tosses import (
    LOWEST,
    PAPER,
    PAPER_DISK,
    TossSetting,
    separation_phase,
    toss,
)

EPS = float(np.finfo(float).eps)
WEAK = PAPER._replace(arc_amplitude=0.02)  # c ω² < g: never leaves


def test_largest_airborne_speed() -> None:
    """27.18 rad/s at φ_L = 0.2456π and θ = 0 (the paper: 27.1 at 0.248π)."""
    best = extreme("airborne_speed")
    assert best.airborne_speed == pytest.approx(27.18061769, abs=1e-8)
    assert best.amplitude_angle / math.pi == pytest.approx(0.24564234, abs=1e-8)
    assert best.phase_lag == pytest.approx(0.0, abs=1e-11)
    along = extreme("airborne_speed", phase_lag=math.pi)
    assert along.airborne_speed == pytest.approx(-best.airborne_speed, rel=1e-12)
    # no neighbour is faster, on a fine grid that the search did not use; the crease is steep: a θ
    # known to 1e-12 costs 13 rad/s of its height for each rad
    lags = np.linspace(-0.2, 0.2, 101)[:, None]
    angles = best.amplitude_angle + np.linspace(-0.1, 0.1, 101)
    assert np.abs(toss(lags, angles).airborne_speed).max() <= best.airborne_speed + 13e-12


def test_largest_efficiency() -> None:
    """0.344 at φ_L = 0.246π and θ = 0 (the paper prints 0.519)."""
    best = extreme("efficiency")
    assert best.efficiency == pytest.approx(0.3440212756, abs=1e-10)
    assert best.amplitude_angle / math.pi == pytest.approx(0.2460880, abs=1e-7)
    assert best.phase_lag == pytest.approx(0.0, abs=1e-11)


def test_largest_speed_ratio() -> None:
    """The paper's 0.995 is the largest along θ = 0, where 0.248π has 0.981; that of all is 1."""
    assert extreme("speed_ratio", phase_lag=0.0).speed_ratio == pytest.approx(0.995, abs=5e-4)
    assert toss(0.0, 0.248 * math.pi).speed_ratio == pytest.approx(0.981, abs=5e-4)
    best = extreme("speed_ratio")
    assert best.speed_ratio == pytest.approx(1.0, abs=4 * EPS)
    apart = best.phase_lag + separation_phase(best.amplitude_angle)
    assert apart == pytest.approx(0.0, abs=1e-6)  # flat: 1 − cos of it is below rounding


def test_ridge_without_slip() -> None:
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


OTHERS = [  # setting, α̇ and τ at the start: hills oblique to the grid, creases, a braked disk
    (TossSetting(0.12, 2.7, PAPER_DISK._replace(friction=0.13)), 8.0, 5.5),
    (TossSetting(0.33, 4.1, PAPER_DISK._replace(friction=0.9, load_torque=0.05)), -5.0, LOWEST),
    (TossSetting(0.45, 2.2, PAPER_DISK._replace(friction=1.3)), 0.0, 3.9),
    (TossSetting(0.08, 4.9, PAPER_DISK._replace(friction=0.3)), 0.0, LOWEST),
]


@pytest.mark.parametrize(("setting", "speed", "tau"), OTHERS)
@pytest.mark.parametrize("measure", ["airborne_speed", "efficiency"])
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


def test_a_ridge_may_be_missing_or_never_end() -> None:
    no_grip = TossSetting(disk=PAPER_DISK._replace(friction=0.0))
    assert math.isnan(ridge(no_grip, 50).end)
    gripping = TossSetting(disk=PAPER_DISK._replace(friction=1e6))
    line = ridge(gripping, 50)
    assert line.end == line.amplitude_angle[-1]
    np.testing.assert_allclose(line.speed_ratio, 1.0, rtol=0, atol=4 * EPS)


def test_what_cannot_be_used_is_refused() -> None:
    with pytest.raises(InputError, match=r"measure: got 'speed', allowed: one of airborne_speed"):
        extreme("speed")
    with pytest.raises(InputError, match=r"setting: .* one that throws the disk"):
        extreme("efficiency", WEAK)
    with pytest.raises(InputError, match="no bound as φ_L falls to 0"):
        extreme("speed_ratio", angular_velocity=1.0)
    with pytest.raises(InputError, match=r"setting: .* one that throws the disk"):
        ridge(WEAK)
    with pytest.raises(InputError, match="points: got 1"):
        ridge(points=1)
