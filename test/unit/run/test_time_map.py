"""Maps between clocks: exact, monotonic, and grids without drift."""

from __future__ import annotations

import math
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bouncing_disk_ros.run.time_map import Grid, TimeMap, nanoseconds, tick_period
from bouncing_disk_ros.units import NS

WALL = 1_800_000_000 * NS
times = st.integers(0, 10**16)


@given(simulated=times, steady=times, elapsed=times)
def test_in_real_time_every_map_is_exact(simulated: int, steady: int, elapsed: int) -> None:
    line = TimeMap(simulated, steady, WALL, 1.0)
    assert line.due(steady + elapsed) == simulated + elapsed
    assert line.to_ros(simulated + elapsed) == WALL + elapsed
    assert line.to_simulated(WALL + elapsed) == simulated + elapsed


@given(factor=st.floats(1e-3, 1e3), elapsed=st.integers(0, 10**13))
def test_what_is_due_at_a_reading_is_due_then(factor: float, elapsed: int) -> None:
    line = TimeMap(5, 7, WALL, factor)
    back = line.due(line.to_steady(5 + elapsed))
    assert abs(back - (5 + elapsed)) <= 1 + factor + elapsed * 2**-51


@given(period=st.floats(1e-2, 1e18))
def test_ticks_and_samples_have_periods_of_whole_ratio(period: float) -> None:
    tick = tick_period(period, 1_000_000, 10_000_000)
    assert 1_000_000 <= tick <= 10_000_000
    ratio = period / tick if period > tick else tick / period
    assert round(ratio) * min(tick, period) == pytest.approx(max(tick, period), rel=1e-6)


@given(
    factor=st.floats(1e-3, 1e3),
    elapsed=st.integers(0, 10**13),
)
def test_other_factors_stretch_time_and_come_back(factor: float, elapsed: int) -> None:
    line = TimeMap(5, 7, WALL, factor)
    assert (
        abs(line.due(7 + elapsed) - (5 + Fraction(factor) * elapsed))
        <= 1 + elapsed * factor * 2**-52
    )
    back = line.to_simulated(line.to_ros(5 + elapsed))
    assert abs(back - (5 + elapsed)) <= 1 + factor + elapsed * 2**-51


def test_free_running_has_nothing_due_and_stamps_in_simulated_time() -> None:
    line = TimeMap(100, 0, WALL, 0.0)
    assert line.due(10**12) == 100
    assert line.to_ros(100 + 5) == WALL + 5


def test_a_published_clock_runs_with_simulated_time() -> None:
    line = TimeMap(0, 0, WALL, 0.25, clock_is_simulated=True)
    assert line.due(4 * NS) == NS
    assert line.to_ros(NS) == WALL + NS
    assert line.to_simulated(WALL + NS) == NS


@given(rate=st.floats(1e-3, 1e5), after=st.integers(-1, 10**15))
def test_grid_instants_are_those_of_exact_division(rate: float, after: int) -> None:
    grid = Grid(rate, after)
    period = Fraction(NS) / Fraction(rate)
    k = round(grid.next_ns / period)
    assert grid.next_ns == round(k * period)
    assert grid.next_ns > after
    assert round((k - 1) * period) <= after
    for i in range(1, 4):
        grid.advance()
        assert grid.next_ns == round((k + i) * period)


def test_grid_does_not_drift_after_a_day_at_a_third() -> None:
    grid = Grid(3.0, 86_400 * NS)
    assert grid.next_ns == 86_400 * NS + 333_333_333


def test_grid_counts_what_it_skips() -> None:
    grid = Grid(10.0, 0)
    assert grid.skip_to(NS) == 10
    assert grid.next_ns == NS + NS // 10


def test_seconds_become_the_nearest_nanosecond() -> None:
    assert nanoseconds(0.1) == 100_000_000
    assert nanoseconds(math.pi) == 3_141_592_654
    with pytest.raises(OverflowError):
        nanoseconds(math.inf)
