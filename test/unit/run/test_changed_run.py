"""A changed run beside the recorded one: the same inputs, and the instant at which they part."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

from bouncing_disk_ros import simulate
from bouncing_disk_ros.core.model import Motion
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.run.programmes import ANY_MOTION
from bouncing_disk_ros.run.simulate import Result
from bouncing_disk_ros.run.what_if import (
    KEPT_ROWS,
    changed_start,
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


def test_values_that_are_in_force_in_mid_run_change_nothing() -> None:
    """A cross-fade to the same motion, or a chatter cut by the same disk, gave other bits."""
    run = Driven(axial_amplitude=0.02, initial_height=0.01)
    run.advance(0.2)
    run.session.snapshot()
    run.advance(2.0)
    changes = changes_of({"axial_amplitude": 0.02, "restitution": 0.5, "phase_lag": 0.0})
    runs = what_if(run.record_list[1:], changes, run.session.time_ns)
    assert runs.divergence is None
    assert runs.first.samples.tobytes() == runs.second.samples.tobytes()


@pytest.mark.parametrize("seconds", [0.0, 1.5])
def test_pending_cross_fades_keep_their_duration(seconds: float) -> None:
    run = Driven(crossfade_duration=seconds)
    run.session.command([(5 * NS, Motion(0.05, 0.5, 3.0, 0.0)), (8 * NS, ANY_MOTION)])
    run.advance(1.0)
    run.session.snapshot()
    whole = changed_start(run.record_list[2], changes_of({"angular_amplitude": 0.2}))
    assert whole.motion_in_force.target.angular_amplitude == 0.2
    for new, old in zip(whole.pending, run.session.simulation.pending, strict=True):
        assert new == old._replace(target=old.target._replace(angular_amplitude=0.2))


def test_it_ends_where_a_record_is_lost() -> None:
    run = Driven().drive(8)
    records = run.record_list
    runs = what_if(records[:9] + records[10:], changes_of({"restitution": 0.3}), 10**12)
    assert runs.end_ns == records[8]["time_ns"]


def test_memory_is_bounded() -> None:
    run = simulate(0.6, preset="swum")
    assert len(run.impacts) > KEPT_ROWS
    runs = what_if(run.inputs, changes_of({"friction": 0.1}), 6 * NS // 10)
    assert len(runs.first.rows) == KEPT_ROWS
    np.testing.assert_array_equal(runs.first.rows["index"], run.impacts["index"][-KEPT_ROWS:])
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
