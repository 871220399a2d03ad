"""The loop hands over every sample, speed and impact once, in order, whatever the slices."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from bouncing_disk_ros import parameters
from bouncing_disk_ros.core.model import Motion, Sample, join_rows
from bouncing_disk_ros.run.loop import MAX_SAMPLES, Loop, Steps
from bouncing_disk_ros.run.session import Session
from bouncing_disk_ros.run.time_map import FAR_NS
from bouncing_disk_ros.units import NS


class Heard:
    """A sink that keeps everything."""

    def __init__(self) -> None:
        self.samples: list[Sample] = []
        self.speeds: list[tuple[Sample, Sample]] = []
        self.rows: list[NDArray[Any]] = []

    def sample(self, sample: Sample) -> None:
        self.samples.append(sample)

    def speed(self, first: Sample, second: Sample) -> None:
        self.speeds.append((first, second))

    def impacts(self, rows: NDArray[Any]) -> None:
        assert len(rows) > 0
        self.rows.append(rows)

    @property
    def times(self) -> list[int]:
        return [sample.time_ns for sample in self.samples]


def made(**values: parameters.Value) -> tuple[Loop, Heard]:
    heard = Heard()
    session = Session(parameters.complete(values), lambda _: None)
    return Loop(session, heard), heard


def counted(**values: parameters.Value) -> tuple[Loop, Heard]:
    """As `made`, with a clock that shows one millisecond more at each look."""
    heard, ticking = Heard(), itertools.count(0, 1_000_000)
    session = Session(parameters.complete(values), lambda _: None)
    return Loop(session, heard, clock=lambda: next(ticking)), heard


def grid(rate: int, until_ns: int) -> list[int]:
    instants = (round(k * NS / rate) for k in itertools.count())
    return list(itertools.takewhile(lambda instant: instant <= until_ns, instants))


@pytest.mark.parametrize("tick_ms", [1, 7, 100])
def test_samples_lie_on_the_grid_whatever_the_tick(tick_ms: int) -> None:
    loop, heard = made(state_rate=300.0)
    for tick in range(tick_ms, 1001, tick_ms):
        assert loop.slice(tick * 10**6, budget_ns=60 * NS)
    assert heard.times == grid(300, heard.times[-1])
    assert loop.session.time_ns - heard.times[-1] < NS // 300 + 1
    assert loop.skipped == 0


def test_results_do_not_depend_on_the_ticks() -> None:
    streams = []
    for tick in (10**6, 7 * 10**6, 90 * 10**6):
        loop, heard = made(axial_amplitude=0.06)
        for until in itertools.count(tick, tick):
            loop.slice(min(until, 3 * NS))
            if until >= 3 * NS:
                break
        streams.append((join_rows(heard.rows).tobytes(), heard.samples, heard.speeds))
    assert len(streams[0][0]) > 0
    assert streams[0] == streams[1] == streams[2]


def test_a_late_tick_hands_over_a_hundred_samples_and_counts_the_rest() -> None:
    loop, heard = made(state_rate=1000.0)
    assert loop.slice(5 * NS, budget_ns=60 * NS)
    assert len(heard.samples) == 1 + MAX_SAMPLES
    assert loop.skipped == 5000 - MAX_SAMPLES
    assert loop.session.time_ns == 5 * NS
    loop.slice(5 * NS + 10**6)
    assert heard.times[-1] == 5 * NS + 10**6


def test_a_slice_ends_when_its_time_is_up_also_without_events() -> None:
    loop, heard = counted()
    assert not loop.slice(100 * NS, budget_ns=3_000_000)
    assert heard.times == [0, 10_000_000, 20_000_000, 30_000_000]
    assert not loop.slice(100 * NS, budget_ns=2_000_000)
    assert heard.times[4:] == [40_000_000, 50_000_000]
    loop, heard = counted(axial_amplitude=0.0, angular_amplitude=0.0)
    assert not loop.slice(FAR_NS, budget_ns=300_000_000)
    assert len(heard.samples) == 1 + MAX_SAMPLES
    assert 100 * NS < loop.session.time_ns < 300 * NS


def test_samples_that_cost_a_millisecond_do_not_keep_the_motion_behind() -> None:
    """A free run with slow subscribers: slices held nothing but samples."""
    now_ns = 0

    class Slow(Heard):
        def sample(self, sample: Sample) -> None:
            nonlocal now_ns
            now_ns += 1_000_000
            super().sample(sample)

    def clock() -> int:
        nonlocal now_ns
        now_ns += 10_000
        return now_ns

    heard = Slow()
    loop = Loop(Session(parameters.complete({}), lambda _: None), heard, clock)
    while len(heard.samples) < 1 + MAX_SAMPLES:
        assert not loop.slice(FAR_NS)
    assert heard.times == grid(100, NS)  # none is passed over before that
    assert loop.session.time_ns > 500 * NS
    assert loop.skipped == loop.session.time_ns * 100 // NS - MAX_SAMPLES
    loop.slice(FAR_NS)
    assert len(heard.samples) > 1 + MAX_SAMPLES


def test_speeds_span_their_interval_and_leave_a_reset_out() -> None:
    loop, heard = made(rotor_speed_rate=10.0, initial_angular_velocity=2.0, friction=0.0)
    loop.slice(NS, budget_ns=60 * NS)
    spans = [(first.time_ns, second.time_ns) for first, second in heard.speeds]
    assert spans == [(k * NS // 10, (k + 1) * NS // 10) for k in range(10)]
    loop.slice(NS + NS // 20, budget_ns=60 * NS)
    loop.session.reset()
    loop.restart_speed()
    loop.slice(2 * NS, budget_ns=60 * NS)
    first, second = heard.speeds[10]
    assert (first.time_ns, second.time_ns) == (NS + NS // 20 + 1, NS + NS // 10)


def test_samples_stay_true_and_none_is_lost_when_inputs_fall_on_the_grid() -> None:
    loop, heard = made(state_rate=100.0)
    loop.slice(NS - 1, budget_ns=60 * NS)
    for _ in range(3):  # the inputs act at NS, NS + 1 and NS + 2
        loop.finish_samples()
        loop.session.command([(loop.session.input_ns, Motion(0.03, 0.1, 3.0, 0.0))])
    loop.slice(NS + NS // 100, budget_ns=60 * NS)
    assert heard.times == grid(100, NS + NS // 100)


def test_an_instant_passed_over_is_counted_and_the_loop_goes_on() -> None:
    loop, heard = made(state_rate=100.0)
    loop.session.advance(NS)  # behind the loop's back
    assert loop.slice(NS + NS // 100, budget_ns=60 * NS)
    assert heard.times == [0, NS, NS + NS // 100] or heard.times == [0, NS + NS // 100]
    assert loop.skipped + len(heard.samples) == 102


def test_many_rows_are_handed_over_in_between() -> None:
    loop, heard = made(frequency=40_000.0, axial_amplitude=1e-6, preload=1.1e4, mass=0.25)
    loop.slice(NS // 4, budget_ns=60 * NS)
    assert len(heard.rows) > 1
    index = join_rows(heard.rows)["index"]
    assert np.array_equal(index, np.arange(len(index)))


# --- steps ----------------------------------------------------------------------------------------
def test_steps_end_at_whole_periods_from_the_first_of_a_kind_without_drift() -> None:
    steps, now = Steps(), 500
    for k in range(1, 3001):
        now = steps.next_end(now, 3.0, 1)
        assert now == 500 + round(k * NS / 3)
    assert steps.next_end(now, 4.0, 2) == now + NS // 2  # another period
    assert steps.next_end(2 * now, 4.0, 2) == 2 * now + NS // 2  # another instant
