"""A changed run beside the recorded one: the same inputs, and the instant at which they part."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
import pytest

from bouncing_disk_ros import simulate
from bouncing_disk_ros.core.model import Motion
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.run.simulate import Result
from bouncing_disk_ros.run.what_if import (
    DETAIL_PERIODS,
    MAX_ROWS,
    SAMPLES,
    SPEED_SECONDS,
    changes_of,
    what_if,
)
from bouncing_disk_ros.units import NS
from support.driven import Driven

SECONDS = 10.0
STORY: dict[str, Any] = {
    "programme": [(1.0, {"axial_amplitude": 0.05}), (3.0, {"frequency": 3.5})],
    "impulses": [(4.0, 0.05, 0.001)],
}


@cache
def recorded() -> Result:
    return simulate(SECONDS, **STORY)


def test_without_a_change_the_two_are_one() -> None:
    run = recorded()
    runs = what_if(run.inputs, changes_of({}), 10 * NS)
    assert runs.divergence is None
    assert runs.divergence_time_ns is None
    assert runs.first.rows.tobytes() == runs.second.rows.tobytes() == run.impacts.tobytes()
    assert len(runs.first.detail) == 0


@pytest.mark.parametrize(
    "change",
    [{"friction": 0.1, "mass": 0.3}, {"axial_amplitude": 0.045}],
)
def test_a_change_from_the_start_is_a_run_with_that_parameter(change: dict[str, Any]) -> None:
    """The changed run is bit for bit what a simulation with that parameter would have been."""
    run = recorded()
    runs = what_if(run.inputs, changes_of(change), 10 * NS)
    story = STORY
    if set(change) & set(Motion._fields):
        programme = [(at, {**values, **change}) for at, values in STORY["programme"]]
        story = {**STORY, "programme": programme}
    changed = simulate(SECONDS, **story, **change)
    assert runs.first.rows.tobytes() == run.impacts.tobytes()
    assert runs.second.rows.tobytes() == changed.impacts.tobytes()
    assert runs.second.impacts == changed.impacts["count"].sum()


def test_the_first_row_that_differs_is_where_they_part() -> None:
    run = recorded()
    runs = what_if(run.inputs, changes_of({"restitution": 0.4}), 10 * NS)
    first, second = runs.first.rows, runs.second.rows
    count = min(len(first), len(second))
    place = next(i for i in range(count) if first[i].tobytes() != second[i].tobytes())
    assert runs.divergence is not None
    assert runs.divergence.where == f"row {place}"
    instant = min(float(first["time"][place]), float(second["time"][place]))
    assert runs.divergence_time_ns == round(instant * NS)


def test_samples_lie_on_one_grid_and_finer_where_they_part() -> None:
    run = recorded()
    runs = what_if(run.inputs, changes_of({"restitution": 0.4}), 10 * NS)
    for trace in (runs.first, runs.second):
        np.testing.assert_array_equal(trace.samples["time_ns"], np.arange(2001) * (10 * NS // 2000))
        assert len(trace.samples) == SAMPLES + 1
        steps = np.diff(trace.detail["time_ns"])
        assert np.ptp(steps) == 0
        assert runs.divergence_time_ns is not None
        assert trace.detail["time_ns"][0] <= runs.divergence_time_ns
        assert (
            trace.detail["time_ns"][-1] > runs.divergence_time_ns + (DETAIL_PERIODS - 1) * NS / 3.5
        )
    alone = simulate(SECONDS, sample_rate=200.0, **STORY)
    for name in ("axial_position", "angular_velocity", "platform_position"):
        np.testing.assert_array_equal(runs.first.samples[name], alone.samples[name])


def test_finer_samples_are_those_of_the_run() -> None:
    """What had passed when the parting was found is simulated again, to the same bits."""
    run = simulate(4000.0)  # the step of the even samples, 2 s, is longer than a period
    runs = what_if(run.inputs, changes_of({"friction": 0.3}), 4000 * NS)
    detail = runs.first.detail
    assert detail["time_ns"][-1] > 2 * NS > detail["time_ns"][0]
    again = Driven()
    for sample in detail:
        again.session.advance(int(sample["time_ns"]))
        assert tuple(again.session.simulation.sample())[1:] == tuple(sample)[1:]


def test_rotor_speed_is_the_mean_of_the_end() -> None:
    run = recorded()
    runs = what_if(run.inputs, changes_of({"friction": 0.1}), 10 * NS)
    samples = recorded_samples()
    begin, end = samples[round((SECONDS - SPEED_SECONDS) * 100)], samples[-1]
    turned = math.tau * (end["turns"] - begin["turns"]) + end["angle"] - begin["angle"]
    # three roundings of numbers of the size of the angle turned through, or less
    assert runs.first.rotor_speed == pytest.approx(turned / SPEED_SECONDS, rel=4e-16 * 3)
    assert runs.second.rotor_speed != runs.first.rotor_speed


def recorded_samples() -> Any:
    return simulate(SECONDS, sample_rate=100.0, **STORY).samples


def test_a_change_in_mid_run_begins_at_the_snapshot() -> None:
    run = Driven()
    run.advance(2.0)
    run.session.command([(run.session.input_ns + NS, Motion(0.05, 0.5, 3.0, 0.0))])
    run.session.snapshot()
    run.advance(5.0)
    start = run.record_list[2]["time_ns"]
    end = run.session.time_ns
    for change in ({"restitution": 0.3}, {"axial_amplitude": 0.03, "restitution": 0.3}):
        runs = what_if(run.record_list[2:], changes_of(change), end)
        assert runs.start_ns == start
        assert runs.divergence_time_ns is not None
        assert runs.divergence_time_ns > start
    motion = runs.second.samples["platform_position"][-600:].max()
    assert motion == pytest.approx(0.03, rel=1e-4)  # of 600 samples over 6 periods, the largest


def test_it_ends_where_a_record_is_lost() -> None:
    run = Driven().drive(8)
    records = run.record_list
    runs = what_if(records[:9] + records[10:], changes_of({"restitution": 0.3}), 10**12)
    assert runs.end_ns == records[8]["time_ns"]


def test_memory_is_bounded() -> None:
    run = simulate(0.6, preset="swum")
    assert len(run.impacts) > MAX_ROWS
    runs = what_if(run.inputs, changes_of({"friction": 0.1}), 6 * NS // 10)
    assert len(runs.first.rows) == MAX_ROWS
    np.testing.assert_array_equal(runs.first.rows["index"], run.impacts["index"][-MAX_ROWS:])
    assert runs.first.impacts == run.impacts["count"].sum()


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({"restitution": 1.4}, "restitution: got 1.4, allowed: a finite number >= 0 and <= 1"),
        ({"restitutoin": 0.4}, "what-if: got 'restitutoin'.*Did you mean restitution"),
        ({"real_time_factor": 2.0}, "what-if: got 'real_time_factor', allowed: mass, restitution"),
        ({"preload": -3.0}, "preload: got -3"),  # with that mass
        ({}, "no snapshot"),
    ],
)
def test_wrong_changes_and_records_are_refused(change: dict[str, float], line: str) -> None:
    records = recorded().inputs
    with pytest.raises(InputError, match=line):
        what_if(records if change else records[1:], changes_of(change), NS)


def test_records_out_of_order_are_refused_as_by_a_replay() -> None:
    records = [*recorded().inputs[:2], recorded().inputs[1]]
    with pytest.raises(InputError, match="rising index and time"):
        what_if(records, changes_of({}), 10 * NS)
