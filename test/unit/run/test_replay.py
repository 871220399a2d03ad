"""A replay finds every impact of a record again, and the one bit that differs."""

from __future__ import annotations

import random
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from bouncing_disk_ros.core.model import IMPACT_DTYPE, Phase, join_rows
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.run.input_records import from_json, to_json
from bouncing_disk_ros.run.presets import load_preset
from bouncing_disk_ros.run.replay import replay
from bouncing_disk_ros.units import NS
from support.driven import Driven, Record, flipped


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
    difference = replay(driven.record_list, batches).difference
    assert difference is not None
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
    difference = replay(
        driven.record_list, [changed[i : i + 1] for i in range(len(rows))]
    ).difference
    assert difference is not None
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


def test_a_row_that_the_replay_lacks_is_a_difference(driven: Driven) -> None:
    rows = join_rows(driven.batches)
    more = np.frombuffer(bytearray(rows[-1:].tobytes()), IMPACT_DTYPE)
    more["index"] += 1.0
    difference = replay(driven.record_list, [*driven.batches, more]).difference
    assert difference is not None
    assert (difference.field, difference.replayed) == ("index", None)
    assert difference.recorded == rows["index"][-1] + 1.0


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


def test_rows_without_a_snapshot_are_not_compared(driven: Driven) -> None:
    records = [record for record in driven.record_list if record["kind"] != "snapshot"]
    records = [{**record, "index": index} for index, record in enumerate(records)]
    found = replay(records, driven.batches)
    assert found.start_ns is None
    assert found.not_compared == sum(len(rows) for rows in driven.batches)
    assert found.rows == 0


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


def test_a_lost_record_without_a_later_snapshot_ends_the_comparison(driven: Driven) -> None:
    records = [r for r in driven.record_list if r["kind"] != "snapshot" or r["index"] == 0]
    found = replay(records, driven.batches)
    assert found.gaps[0].until_ns is None
    assert found.rows + found.not_compared == sum(len(rows) for rows in driven.batches)
    assert found.not_compared > 0


def test_a_wrong_snapshot_in_mid_run_is_found(driven: Driven) -> None:
    records = [from_json(to_json(record)) for record in driven.record_list]
    snapshots = [record for record in records[1:] if record["kind"] == "snapshot"]
    states = [record["state"]["engine"]["state"] for record in snapshots]
    place = next(i for i, state in enumerate(states) if state["phase"] == Phase.FLIGHT)
    later, state = snapshots[place], states[place]
    state["omega"] = float(np.nextafter(state["omega"], np.inf))
    difference = replay(records).difference
    assert difference is not None
    assert difference.where == f"snapshot (record {later['index']})"


def test_another_version_is_another_build(driven: Driven) -> None:
    records = [{**record} for record in driven.record_list]
    records[0]["version"] = "0.0.1"
    found = replay(records, driven.batches)
    assert found.identical
    assert found.version == "0.0.1"
    assert found.is_other_build


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
    with pytest.raises(InputError, match=said):
        replay(change(driven.record_list), rows)


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
