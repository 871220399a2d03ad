"""Maps between clocks: exact, monotonic, and grids without drift."""

from __future__ import annotations

import math
from collections.abc import Mapping
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bouncing_disk_ros.run.time_map import Grid, TickPlan, TimeMap, nanoseconds, tick_period
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


def test_free_running_has_nothing_due_and_a_published_clock_is_that_of_the_simulation() -> None:
    line = TimeMap(100, 0, WALL, 0.0)
    assert line.due(10**12) == 100
    assert line.to_ros(100 + 5) == WALL + 5
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


def test_grid_counts_what_it_skips_and_seconds_become_the_nearest_nanosecond() -> None:
    grid = Grid(10.0, 0)
    assert grid.skip_to(NS) == 10
    assert grid.next_ns == NS + NS // 10
    assert nanoseconds(0.1) == 100_000_000
    assert nanoseconds(math.pi) == 3_141_592_654
    with pytest.raises(OverflowError):
        nanoseconds(math.inf)


# --- the phase of ticks ---------------------------------------------------------------------------
class SimulatedTimer:
    """A timer of rcl: its next call is a period after the last, whatever the callback takes."""

    def __init__(self, first_ns: int, period_ns: int) -> None:
        self.next_ns, self.period_ns = first_ns, period_ns

    def call(self, now_ns: int) -> None:
        """As rcl_timer_call: calls that were missed are skipped."""
        self.next_ns += self.period_ns
        if self.next_ns < now_ns:
            self.next_ns += -(-(now_ns - self.next_ns) // self.period_ns) * self.period_ns


def begins(rate: float, first_ns: int, stalls: Mapping[int, int], ticks: int = 30) -> list[float]:
    """How long after the sample before it each tick of a timer begins, ns; stalls by tick."""
    sample_ns = NS / rate
    period_ns = tick_period(sample_ns, 1_000_000, 10_000_000)
    timer = SimulatedTimer(first_ns, period_ns)
    found: list[float] = []
    for k in range(ticks):
        now = timer.next_ns + stalls.get(k, 0)
        timer.call(now)
        due = round(-(-now // sample_ns) * sample_ns)  # the next sample
        plan = TickPlan(period_ns, min(float(period_ns), sample_ns), due)
        found.append(timer.next_ns - plan.begin_before(timer.next_ns))
        assert 0.5 * period_ns <= plan.period_after(timer.next_ns) <= 1.5 * period_ns
        timer.period_ns = plan.period_after(timer.next_ns)
    return found


ROUNDING = 9
"""ns: half of one for each of the 15 ticks to a sample of 7 Hz, and of two instants."""


@pytest.mark.parametrize("rate", [7.0, 50.0, 100.0, 130.0, 200.0, 500.0, 1000.0, 3000.0, 40_000.0])
@pytest.mark.parametrize("first_ns", [1, 123_456, 3_000_000, 8_480_000, 9_999_999])
def test_ticks_are_in_phase_from_the_third_on_however_the_timer_began(
    rate: float, first_ns: int
) -> None:
    assert max(map(abs, begins(rate, 10**9 + first_ns, {})[1:])) <= ROUNDING


def test_a_tick_that_was_held_up_leaves_the_phase_as_it_was() -> None:
    late = begins(100.0, 10**9 + 50_000, {5: 3_000_000, 12: 47_123_456})
    assert max(map(abs, late)) <= ROUNDING


def test_a_tick_just_before_the_margin_is_no_late_one() -> None:
    plan = TickPlan(10_000_000, 1e7, due_ns=0)
    assert plan.begin_before(20_000_000) == plan.begin_before(29_999_999) == 20_050_000
    assert plan.begin_before(19_999_999) == 10_050_000  # that leaves the sample to the next one
    assert TickPlan(10_000_000).begin_before(7) == 7
    assert TickPlan(10_000_000).period_after(7) == 10_000_000
