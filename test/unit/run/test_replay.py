"""A replay finds every impact of a record again; a changed run, where the two part."""

from __future__ import annotations

import random
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest

from bouncing_disk_ros import simulate
from bouncing_disk_ros.core.model import IMPACT_DTYPE, Motion, Phase, join_rows
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.run.input_records import Record, from_json, to_json
from bouncing_disk_ros.run.presets import load_preset
from bouncing_disk_ros.run.programmes import ANY_MOTION
from bouncing_disk_ros.run.replay import replay
from bouncing_disk_ros.run.simulate import Result
from bouncing_disk_ros.run.what_if import (
    KEPT_ROWS,
    changed_start,
    changes_of,
    what_if,
)
from bouncing_disk_ros.units import NS
from support.checks import refused, there
from support.driven import Driven, flipped


@pytest.fixture(scope="module")
def driven() -> Driven:
    return Driven().drive(5)


@pytest.mark.parametrize("seed", range(3))
def test_inputs_of_every_kind_replay_identical_with_snapshots_in_mid_run(seed: int) -> None:
    run = Driven().drive(seed, trajectories=0.2)
    found = replay(run.record_list, run.batches)
    assert found.difference is None
    assert found.impacts == run.impacts
    assert found.records == len(run.records)
    kinds = [record["kind"] for record in run.record_list]
    assert found.snapshots == kinds.count("snapshot") - 1
    assert (found.missing, found.not_compared, found.gaps) == (0, 0, [])


@pytest.mark.parametrize("field", IMPACT_DTYPE.names or ())
def test_one_flipped_bit_is_found(driven: Driven, field: str) -> None:
    rows = join_rows(driven.batches)
    place = len(rows) // 2
    changed = flipped(rows, place, field)
    batches = [changed[first : first + 3] for first in range(0, len(rows), 3)]
    difference = there(replay(driven.record_list, batches).difference)
    assert difference.field == field
    if field != "index":  # else the row has lost its name
        assert difference.where == f"row {place}"
        assert difference.recorded == pytest.approx(changed[place][field].item(), nan_ok=True)
        assert difference.replayed == rows[place][field].item()


@pytest.mark.parametrize("index", [3.0, 60.0, -1.0, np.nan])
@pytest.mark.parametrize("place", [0, -1])
def test_a_wrong_index_of_a_row_sent_alone_is_found(
    driven: Driven, index: float, place: int
) -> None:
    rows = join_rows(driven.batches)
    if index in (rows["index"][place], 60.0):
        index = rows["index"][place] + 3.0
    changed = np.frombuffer(bytearray(rows.tobytes()), IMPACT_DTYPE)
    changed["index"][place] = index
    difference = there(
        replay(driven.record_list, [changed[i : i + 1] for i in range(len(rows))]).difference
    )
    assert difference.field == "index"


def test_lost_rows_are_counted_and_those_before_the_bag_are_not_missing(driven: Driven) -> None:
    batches = driven.batches
    lost = (2, 3, 6)
    found = replay(driven.record_list, [rows for i, rows in enumerate(batches) if i not in lost])
    assert found.identical
    assert found.missing == sum(len(batches[i]) for i in lost)
    assert found.rows == sum(map(len, batches)) - found.missing
    found = replay(driven.record_list, batches[3:])
    assert found.identical
    assert found.missing == 0
    assert found.first_row == int(batches[3]["index"][0])


def test_a_row_that_the_replay_lacks_is_a_difference_and_none_without_a_snapshot(
    driven: Driven,
) -> None:
    rows = join_rows(driven.batches)
    more = np.frombuffer(bytearray(rows[-1:].tobytes()), IMPACT_DTYPE)
    more["index"] += 1.0
    difference = there(replay(driven.record_list, [*driven.batches, more]).difference)
    assert (difference.field, difference.replayed) == ("index", None)
    assert difference.recorded == rows["index"][-1] + 1.0
    records = [record for record in driven.record_list if record["kind"] != "snapshot"]
    records = [{**record, "index": index} for index, record in enumerate(records)]
    found = replay(records, driven.batches)
    assert found.start_ns is None
    assert found.not_compared == sum(len(rows) for rows in driven.batches)
    assert found.rows == 0


def test_it_begins_at_the_first_snapshot() -> None:
    run = Driven().drive(21, 15)
    cut = len(run.records)
    run.session.apply_impulse(
        run.session.input_ns, 0.1, 0.0
    )  # not in the record: before the snapshot
    run.flush()
    run.session.snapshot()
    first = run.session.simulation.rows_total
    run.drive(22, 15)
    found = replay(run.record_list[cut:], run.batches)
    assert found.identical
    assert found.first_row == first
    assert found.not_compared == first
    assert found.start_ns == run.record_list[cut + 1]["time_ns"]


@pytest.mark.parametrize("seed", [31])
def test_after_a_lost_record_it_goes_on_at_the_next_snapshot(seed: int) -> None:
    run = Driven().drive(seed)
    lost = next(
        i for i, r in enumerate(run.record_list) if i > 8 and r["kind"] in ("motion", "impulse")
    )
    records = run.record_list[:lost] + run.record_list[lost + 1 :]
    following = next(r for r in records[lost:] if r["kind"] == "snapshot")
    found = replay(records, run.batches)
    assert found.difference is None
    before, after = records[lost - 1]["time_ns"], following["time_ns"]
    assert found.gaps == [(lost, lost, before, after)]
    rows = join_rows(run.batches)
    sure = (rows["time"] < before / 1e9) | (
        rows["index"] >= following["state"]["engine"]["state"]["rows"]
    )
    assert found.rows >= sure.sum()
    assert found.rows + found.not_compared == len(rows)


def test_a_wrong_snapshot_in_mid_run_is_found(driven: Driven) -> None:
    records = [from_json(to_json(record)) for record in driven.record_list]
    snapshots = [record for record in records[1:] if record["kind"] == "snapshot"]
    states = [record["state"]["engine"]["state"] for record in snapshots]
    place = next(i for i, state in enumerate(states) if state["phase"] == Phase.FLIGHT)
    later, state = snapshots[place], states[place]
    state["omega"] = float(np.nextafter(state["omega"], np.inf))
    difference = there(replay(records).difference)
    assert difference.where == f"snapshot (record {later['index']})"


def test_another_version_is_another_build_and_a_lost_record_may_end_the_comparison(
    driven: Driven,
) -> None:
    records = [{**record} for record in driven.record_list]
    records[0]["version"] = "0.0.1"
    found = replay(records, driven.batches)
    assert found.identical
    assert found.version == "0.0.1"
    assert found.is_other_build
    records = [r for r in driven.record_list if r["kind"] != "snapshot" or r["index"] == 0]
    found = replay(records, driven.batches)
    assert found.gaps[0].until_ns is None
    assert found.rows + found.not_compared == sum(len(rows) for rows in driven.batches)
    assert found.not_compared > 0


def laid_out_otherwise(records: list[Record]) -> list[Record]:
    first = {**records[0], "version": "9.9.9"}
    return [{**first, "state": {**first["state"], "format": 77}}]


def back_in_time(records: list[Record]) -> list[Record]:
    later = {**records[1], "time_ns": records[1]["time_ns"] + 1}
    return [records[0], later, {**records[1], "index": later["index"] + 1}]


@pytest.mark.parametrize(
    ("change", "rows", "said"),
    [
        (laid_out_otherwise, [], r"snapshot: got .*9\.9\.9.*77.*another build"),
        (lambda records: [*records[:3], records[1]], [], "rising index and time"),
        (back_in_time, [], "rising index and time"),
        (list, [np.zeros(1, [("index", "f8")])], "IMPACT_DTYPE with count, kind, time"),
    ],
)
def test_what_cannot_be_of_one_run_is_refused_in_one_line(
    driven: Driven, change: Callable[[list[Record]], list[Record]], rows: list[Any], said: str
) -> None:
    refused(said, replay, change(driven.record_list), rows)


# --- what made runs differ ------------------------------------------------------------------------
@pytest.mark.parametrize("seed", range(3))
def test_a_pause_between_two_slices_of_late_work_replays(seed: int) -> None:
    """A slice may end in the midst of a nanosecond; an input while paused must not act before."""
    rng = random.Random(seed)
    preset: dict[str, Any] = {**load_preset("swum")}
    run = Driven(**preset)
    for _ in range(20):
        assert run.session.advance(run.session.time_ns + NS, rng.randrange(1, 300))
        run.session.set_paused(True)
        run.session.apply_impulse(run.session.input_ns, rng.uniform(0.0, 1e-3), 1e-6)
        run.flush()
        run.session.set_paused(False)
    run.advance(1e-6)
    found = replay(run.record_list, run.batches)
    assert found.difference is None
    assert found.impacts > 1000


# --- a changed run --------------------------------------------------------------------------------
SECONDS = 10.0
STORY: dict[str, Any] = {
    "programme": [(1.0, {"axial_amplitude": 0.05}), (3.0, {"frequency": 3.5})],
    "impulses": [(4.0, 0.05, 0.001)],
}


@cache
def recorded() -> Result:
    return simulate(SECONDS, **STORY)


def test_without_a_change_the_two_are_one_and_records_out_of_order_refused() -> None:
    run = recorded()
    runs = what_if(run.inputs, changes_of({}), 10 * NS)
    assert runs.divergence is None
    assert runs.divergence_time_ns is None
    assert runs.first.rows.tobytes() == runs.second.rows.tobytes() == run.impacts.tobytes()
    assert len(runs.first.detail) == 0
    records = [*recorded().inputs[:2], recorded().inputs[1]]
    refused("rising index and time", what_if, records, changes_of({}), 10 * NS)


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
