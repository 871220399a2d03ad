"""Restitution and friction: exact without noise, covered with it, honest without data."""

from __future__ import annotations

import math
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray

from bouncing_disk_ros import simulate
from bouncing_disk_ros.core.model import Disk, ImpactKind, Motion
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.report.estimate import (
    LEAST_ROWS,
    Estimate,
    friction_of,
    platform_velocities,
    restitution_of,
)
from bouncing_disk_ros.report.orbit import orbit_of
from bouncing_disk_ros.run.session import motion_of
from reference.cases import covers, in_soak

Rows = NDArray[np.void]


class Run(NamedTuple):
    rows: Rows
    disk: Disk
    motion: Motion


@cache
def run(restitution: float = 0.5, friction: float = 0.15, amplitude: float = 0.0475) -> Run:
    """200 s of impacts of many speeds: chaos and chatter (or, ε = 1, endless bounces)."""
    result = simulate(
        200.0,
        axial_amplitude=amplitude,
        angular_amplitude=1.0,
        restitution=restitution,
        friction=friction,
        initial_height=0.3 if restitution == 1.0 else 0.0,
    )
    values = result.parameters
    disk = Disk.of(values)
    return Run(result.impacts, disk, motion_of(values))


def by_velocities(rows: Rows, motion: Motion) -> Estimate:
    return restitution_of(rows, platform_velocities(rows, motion))


def measured(rows: Rows, disk: Disk, noise: float, rng: np.random.Generator) -> Rows:
    """The same rows with independent errors in every column (m/s, and 10 rad/s for each m/s)."""
    rows, n = rows.copy(), len(rows)
    rows["axial_impact_velocity"] += rng.normal(0.0, noise, n)
    rows["axial_velocity"] += rng.normal(0.0, noise, n)
    rows["angular_impact_velocity"] += rng.normal(0.0, 10.0 * noise, n)
    rows["axial_impulse"] += disk.mass * rng.normal(0.0, noise, n)
    inertia = disk.mass * disk.gyration_radius**2
    rows["angular_impulse"] += inertia * rng.normal(0.0, 10.0 * noise, n)
    return rows


@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
def test_restitution_without_noise_is_exact(restitution: float) -> None:
    rows, disk, motion = run(restitution, amplitude=0.02 if restitution == 1.0 else 0.0475)
    for found in (by_velocities(rows, motion), restitution_of(rows, mass=disk.mass)):
        assert found.value == pytest.approx(restitution, abs=1e-14)
        assert found.low <= restitution <= found.high
        assert found.high - found.low < 1e-13
        assert found.impacts == np.sum(rows["kind"] == ImpactKind.IMPACT)
        assert not found.note or found.note.startswith("left out")


@pytest.mark.parametrize("friction", [0.0, 0.15])
def test_friction_without_noise_is_exact(friction: float) -> None:
    rows, disk, _ = run(friction=friction)
    found = friction_of(rows, disk)
    assert found.value == pytest.approx(friction, abs=1e-14)
    assert found.low <= friction <= found.high
    assert found.high - found.low < 1e-13
    inertia = disk.mass * disk.gyration_radius**2
    slips = inertia * np.abs(rows["angular_impact_velocity"]) > (
        friction * disk.friction_radius * rows["axial_impulse"] * (1.0 + 1e-9)
    )
    assert found.impacts == np.sum(slips & (rows["count"] == 1))


@pytest.mark.parametrize(
    ("restitution", "noise"),
    [(0.0, 0.1), (0.5, 1e-3), *in_soak((0.0, 1e-3), (0.5, 0.1), (1.0, 1e-3), (1.0, 0.1))],
)
def test_restitution_intervals_cover(restitution: float, noise: float) -> None:
    rows, disk, motion = run(restitution, amplitude=0.02 if restitution == 1.0 else 0.0475)
    rows = rows[(rows["count"] == 1)][:40]

    def trial(rng: np.random.Generator) -> bool:
        some = measured(rows, disk, noise, rng)
        found = by_velocities(some, motion)
        other = restitution_of(some, mass=disk.mass)
        assert 0.0 <= found.low <= found.value <= found.high <= 1.0 or found.note
        return found.low <= restitution <= found.high and other.low <= restitution <= other.high

    covers(trial, 0.9, poor=0.65)  # both: at least 1 − 2 · 0.05


@pytest.mark.parametrize(
    ("friction", "noise", "n"),
    [
        *[(0.0, 0.05, 40), (0.15, 0.05, 400)],
        *in_soak((0.0, 1e-3, 40), (0.02, 0.05, 40), (0.15, 1e-3, 40), (0.15, 0.05, 40)),
    ],
)
def test_friction_intervals_cover(friction: float, noise: float, n: int) -> None:
    """Also with many rows, where a bias of the choice of rows would show first."""
    rows, disk, _ = run(friction=friction)

    def trial(rng: np.random.Generator) -> bool:
        begin = int(rng.integers(0, len(rows) - n))
        found = friction_of(measured(rows[begin : begin + n], disk, noise, rng), disk)
        return math.isfinite(found.value) and found.low <= friction <= found.high

    covers(trial, 0.92, poor=0.7)  # all but a few are identified


@pytest.mark.parametrize(
    ("friction", "noise"),
    [(0.05, 3.0), *in_soak((0.02, 1.0), (0.02, 3.0), (0.05, 1.0), (0.15, 1.0), (0.15, 3.0))],
)
def test_locked_impacts_that_look_like_slipping_ones_do_not_exclude_the_truth(
    friction: float, noise: float
) -> None:
    """One in ten of the impacts of a chattering orbit sticks; w_T has errors (rad/s), Ĥ hardly."""
    rows, disk, _ = run(friction=friction, amplitude=0.04)
    rows = rows[rows["count"] == 1][-800:]
    inertia = disk.mass * disk.gyration_radius**2

    def trial(rng: np.random.Generator) -> bool:
        some = measured(rows, disk, 1e-3, rng)
        some["angular_impulse"] += inertia * rng.normal(0.0, 0.05, len(rows))
        some["angular_impact_velocity"] += rng.normal(0.0, noise, len(rows))
        found = friction_of(some, disk)
        return found.low <= friction <= found.high or "too noisy" in found.note

    covers(trial, 0.95, poor=0.5)


def test_the_halves_by_demand_seldom_differ_where_the_choice_is_right() -> None:
    rows, disk, _ = run()

    def trial(rng: np.random.Generator) -> bool:
        begin = int(rng.integers(0, len(rows) - 100))
        found = friction_of(measured(rows[begin : begin + 100], disk, 1e-3, rng), disk)
        return "too noisy" not in found.note

    # the half is as often outside the interval of 95 % as its difference to the whole is unlikely
    covers(trial, 0.93, poor=0.7)


@pytest.mark.parametrize("noise", [0.0, 1e-3, 0.05])
def test_where_every_impact_sticks_there_is_a_lower_bound(noise: float) -> None:
    rows, disk, _ = run(friction=3.0)
    inertia = disk.mass * disk.gyration_radius**2
    push = disk.friction_radius * rows["axial_impulse"]
    demand = np.max(inertia * np.abs(rows["angular_impact_velocity"]) / push)
    found = friction_of(measured(rows, disk, noise, np.random.default_rng(1)), disk)
    assert math.isnan(found.value)
    assert found.high == math.inf
    assert found.note.startswith("not identifiable: ")
    assert 0.0 <= found.low <= 3.0
    if not noise:
        assert demand * (1.0 - 1e-12) < found.low <= demand
        assert "every impact sticks" in found.note


def test_float32_columns_are_known_by_their_rounding() -> None:
    """The same impact again and again has the same rounding error: chance cannot bound it."""
    rows, disk, motion = run(friction=0.05)
    short = np.tile(rows[-1:], 50)
    for name in rows.dtype.names or ():
        if rows.dtype[name] == np.float64:
            short[name] = short[name].astype(np.float32)
    for found in (by_velocities(short, motion), restitution_of(short, mass=disk.mass)):
        assert found.low <= 0.5 <= found.high
        assert found.high - found.low < 1e-4
    found = friction_of(short, disk)
    assert found.low <= 0.05 <= found.high


def test_change_in_mid_run_is_said_and_spanned() -> None:
    before, after = run(), run(restitution=0.6, friction=0.2)
    rows = np.concatenate((before.rows[:200], after.rows[:100]))
    rows["index"] = np.arange(300)
    for found in (
        by_velocities(rows, before.motion),
        restitution_of(measured(rows, before.disk, 0.01, np.random.default_rng(2)), mass=0.25),
    ):
        assert "not one value: 0.5" in found.note
        assert found.low <= 0.5
        assert found.high >= 0.599  # with noise 0.6 ± 0.002; the seed is fixed
    assert "from about index 200 on" in by_velocities(rows, before.motion).note
    friction = friction_of(rows, before.disk)
    assert "not one value: 0.15 before, 0.2" in friction.note
    assert friction.low <= 0.15 < 0.2 <= friction.high


@pytest.mark.parametrize("n", [1, 3, LEAST_ROWS - 1])
def test_too_few_impacts_have_no_interval(n: int) -> None:
    rows, disk, motion = run(friction=0.01)
    found = by_velocities(rows[-n:], motion)
    assert found.value == pytest.approx(0.5, abs=1e-14)
    assert (found.low, found.high) == (0.0, 1.0)
    assert found.note.startswith(f"too few impacts ({n})")
    friction = friction_of(rows[-n:], disk)
    assert math.isnan(friction.value)
    assert f"of {n} impacts slip for sure" in friction.note
    assert friction.low <= 0.01 < friction.high


def test_summed_rows_and_missing_values_are_left_out_and_impossible_ones_said() -> None:
    rows, disk, motion = run()
    rows = rows[rows["count"] == 1].copy()
    rows["kind"][3:5], rows["count"][3:5] = ImpactKind.CHATTER_TAIL, 7
    rows["axial_impulse"][3:5] *= 9.0
    found = restitution_of(rows, mass=disk.mass)
    assert found.note == "left out 2 rows of summed impacts"
    assert found.value == pytest.approx(0.5, abs=1e-14)
    assert found.impacts == len(rows) - 2
    velocities = platform_velocities(rows, motion)
    velocities[:3] = math.nan
    assert "left out 3 rows without a value" in restitution_of(rows, velocities).note
    assert "left out 2 rows" in friction_of(rows, disk).note
    found = restitution_of(rows, mass=0.5 * disk.mass)  # 1 + ε reads 3
    assert found.value == pytest.approx(2.0, abs=1e-13)
    assert found.note.startswith("outside 0 to 1: check mass")


@pytest.mark.parametrize(
    ("wrong", "line"),
    [
        (lambda rows: rows[None], r"got 'an array of shape \(1, 20\)', allowed: an array \(n,\)"),
        (lambda rows: rows[0:1][0], "rows: got 'void', allowed"),
        (lambda rows: np.array(rows[0]), r"got 'an array of shape \(\)'"),
        (lambda rows: rows[["x", "time"]], "rows: got 'rows without y', allowed"),
        (pd.DataFrame, r"got 'DataFrame'.*to_records\(index=False\)"),
    ],
)
def test_what_is_no_array_of_rows_is_refused(wrong: Any, line: str) -> None:
    """These were tracebacks; of a frame, differences and places of rows meant others."""
    rows, disk, motion = run()
    for use in (
        lambda given: restitution_of(given, mass=disk.mass),
        lambda given: friction_of(given, disk),
        lambda given: platform_velocities(given, motion),
        orbit_of,
    ):
        with pytest.raises(InputError, match=line):
            use(wrong(rows[:20]))
        records: Any = pd.DataFrame(rows[:100]).to_records(index=False)  # the way out
        assert repr(use(records)) == repr(use(rows[:100]))


def test_velocities_a_mass_and_numbers_of_other_kinds() -> None:
    """Masked velocities counted, true was 1 kg, and most of these were tracebacks."""
    rows, disk, motion = run()
    velocities = platform_velocities(rows, motion)
    wanted = restitution_of(rows, velocities)
    for one in (velocities.tolist(), velocities.astype(object), velocities.astype(">f8")):
        assert restitution_of(rows, one) == wanted
    kilograms: Any = np.array(disk.mass)
    assert restitution_of(rows, mass=kilograms) == restitution_of(rows, mass=disk.mass)
    masked: Any = np.ma.array(velocities, mask=velocities < 0.1)
    wrong: list[tuple[str, Any]] = [
        ("platform_velocity", masked), ("platform_velocity", velocities[:-1]),
        ("platform_velocity", velocities.astype(str)), ("mass", True), ("mass", "0.25"),
        ("mass", math.nan), ("mass", 0.0),
    ]  # fmt: skip
    for name, value in wrong:
        with pytest.raises(InputError, match=f"^{name}: got "):
            restitution_of(rows, **{name: value})
    numbers: list[tuple[str, Any]] = [
        ("tolerance", math.nan), ("longest", 200.0), ("longest", True)
    ]  # fmt: skip
    for name, value in numbers:
        with pytest.raises(InputError, match=f"^{name}: got "):
            orbit_of(rows, **{name: value})
