"""A record of a run from its messages: offsets of the platform, and reports that are none."""

from __future__ import annotations

import json
import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from bouncing_disk_ros import parameters
from bouncing_disk_ros.core.model import join_rows
from bouncing_disk_ros.core.offset import CUBIC, LINE, QUINTIC, Knot, OffsetState
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.report.recorded_offset import axial_offset
from bouncing_disk_ros.report.run_record import UNKNOWN_DISK, RecordSource, RunRecord
from bouncing_disk_ros.report.run_record_builder import Parsed, RunRecordBuilder
from bouncing_disk_ros.report.run_report import report_of
from bouncing_disk_ros.run.input_records import to_json
from bouncing_disk_ros.run.session import Session
from bouncing_disk_ros.run.trajectory_validation import Splice

NS = 1_000_000_000
RESTITUTION = 0.6
SECONDS = 12.0


class Recorded:
    """A run on a platform that offsets move almost all the time, listened to."""

    def __init__(self) -> None:
        self.records: list[dict[str, Any]] = []
        values = {"restitution": RESTITUTION, "axial_amplitude": 0.02, "frequency": 5.0}
        values |= {"initial_height": 0.1, "initial_forcing_phase": 0.0}
        whole = parameters.complete(values)
        self.session = Session(whole, self.records.append, paused=True)
        self.record = RunRecord(UNKNOWN_DISK)
        self.record.motions.append(self.session.simulation.motion_in_force)
        self.samples: list[tuple[float, float, float]] = []
        self._move()
        builder = RunRecordBuilder(self.record)
        for one in self.records:
            builder.handlers["disk/inputs"](SimpleNamespace(data=to_json(one)))

    def _move(self) -> None:
        rng = np.random.default_rng(5)
        for k in range(int(SECONDS * 5)):
            at = self.session.time_ns + int(rng.integers(1, NS // 10))
            degree = (LINE, CUBIC, QUINTIC)[k % 3]
            rates = (1.0, 0.3, 2.0)[: (degree + 1) // 2]
            stated = [0.03 * float(rng.normal()) * rate for rate in rates]
            knot = Knot(at + int(rng.integers(NS // 20, NS // 5)), OffsetState(*stated), degree)
            self.session.trajectory(Splice(at, (knot,), None))
            if k % 20 == 10:
                self.session.snapshot()
            end = self.session.time_ns + NS // 5
            while self.session.time_ns < end:
                assert not self.session.advance(min(self.session.time_ns + NS // 93, end))
                now = self.session.simulation.sample()
                self.samples.append(
                    (self.session.time_ns / NS, now.platform_position, now.platform_velocity)
                )
        self.record.impacts.append(join_rows(self.session.take_rows()))


@pytest.fixture(scope="module")
def recorded() -> Recorded:
    return Recorded()


def test_positions_and_velocities_are_those_of_the_run(recorded: Recorded) -> None:
    times, positions, velocities = np.array(recorded.samples).T
    turn = math.tau * 5.0 * times
    offsets = recorded.record.offsets
    assert len(offsets) == 1 + len([r for r in recorded.records if r["kind"] == "trajectory"])
    found = axial_offset(times, offsets) + 0.02 * np.sin(turn)
    assert found == pytest.approx(positions, abs=1e-13)
    found = axial_offset(times, offsets, 1) + 0.02 * math.tau * 5.0 * np.cos(turn)
    assert found == pytest.approx(velocities, abs=1e-11)  # 10 m/s² × rounding of 10 s, and more


def test_without_inputs_an_offset_makes_restitution_unknown(recorded: Recorded) -> None:
    record = RunRecord(UNKNOWN_DISK)
    record.impacts.append(recorded.record.rows)
    record.motions.append(recorded.record.motions[0])
    RunRecordBuilder(record).handlers["platform/offset"](None)
    found = report_of(record, RecordSource("a")).restitution
    assert math.isnan(found.value)
    assert found.note == (
        "not identifiable: the platform's offset trajectories (disk/inputs) are not in this bag"
    )


def test_a_snapshot_after_a_reset_is_no_trajectory() -> None:
    """A report counted it as one that was accepted."""
    records: list[dict[str, Any]] = []
    session = Session(parameters.complete({}), records.append, paused=True)
    for reset in (True, False):
        at = session.time_ns
        knot = Knot(at + NS // 2, OffsetState(0.01), CUBIC)
        session.trajectory(Splice(at, (knot,), None))
        session.advance(at + NS)
        if reset:
            session.reset()
    session.snapshot()
    record = RunRecord(UNKNOWN_DISK)
    builder = RunRecordBuilder(record)
    for one in records:
        builder.take("disk/inputs", Parsed(0, one))
    times = [at for at, _ in record.offsets]
    assert times == [0, 0, NS, NS]


def test_between_a_lost_record_and_the_next_snapshot_the_offset_is_not_known(
    recorded: Recorded,
) -> None:
    """The offset before the gap was taken for that within it."""
    kinds = [record["kind"] for record in recorded.records]
    lost = next(i for i in range(5, len(kinds)) if kinds[i] == "trajectory")
    snapshot = kinds.index("snapshot", lost)
    record = RunRecord(UNKNOWN_DISK)
    builder = RunRecordBuilder(record)
    for one in [*recorded.records[:lost], *recorded.records[lost + 1 :]]:
        builder.take("disk/inputs", Parsed(0, one))
    times, positions, _ = np.array(recorded.samples).T
    found = axial_offset(times, record.offsets) + 0.02 * np.sin(math.tau * 5.0 * times)
    begin, end = (recorded.records[i]["time_ns"] / NS for i in (lost - 1, snapshot))
    is_open = (times >= begin) & (times < end)
    assert is_open.any()
    assert np.isnan(found[is_open]).all()
    assert found[~is_open] == pytest.approx(positions[~is_open], abs=1e-13)


def test_rows_at_a_jump_of_the_velocity_are_left_out() -> None:
    offsets = Recorded().record.offsets[:1]
    start = offsets[0][1]
    assert start is not None
    line = start.spliced(NS, 0, [Knot(2 * NS, OffsetState(1.0), LINE)])
    times = np.array([0.5, 1.0, 1.5, 2.0, 2.5])
    found = axial_offset(times, [(0, line)], 1)
    assert np.array_equal(np.isnan(found), [False, True, False, True, False])
    assert found[[0, 2, 4]].tolist() == [0.0, 1.0, 0.0]
    assert axial_offset(times, [(0, line)]).tolist() == [0.0, 0.0, 0.5, 1.0, 1.0]


def test_a_snapshot_with_another_offset_is_refused(recorded: Recorded) -> None:
    snapshot = json.loads(json.dumps([r for r in recorded.records if r["kind"] == "snapshot"][-1]))
    snapshot["state"]["offset"]["axial"] = [[[0, 1]]]
    with pytest.raises(InputError, match="snapshot: got 'of no offset"):
        RunRecordBuilder(RunRecord(UNKNOWN_DISK)).take("disk/inputs", Parsed(0, snapshot))


# --- reports on /diagnostics ----------------------------------------------------------------------
RIGHT = {
    "real time": {
        "simulated time (s)": "1.5", "lateness p50 (s)": "0.1", "lateness p99 (s)": "0.2",
        "lateness max (s)": "0.3", "behind (s)": "0.0", "samples skipped": "2",
    },
    "energy": {"residual / throughput": "1e-15", "residual (J)": "0.0"},
    "inputs": {"refused": "3"},
}  # fmt: skip


def heard(tasks: dict[str, dict[str, str]]) -> RunRecord:
    record = RunRecord(UNKNOWN_DISK)
    status = [
        DiagnosticStatus(
            name=f"bouncing_disk: {task}",
            values=[KeyValue(key=key, value=value) for key, value in values.items()],
        )
        for task, values in tasks.items()
    ]
    RunRecordBuilder(record).handlers["/diagnostics"](DiagnosticArray(status=status))
    return record


def test_a_report_is_kept() -> None:
    (health,) = heard(RIGHT).health
    assert (health.simulated, health.skipped, health.refused) == (1.5, 2, 3)


@pytest.mark.parametrize(
    ("task", "key", "value"),
    [
        ("real time", "simulated time (s)", "soon"),
        ("real time", "behind (s)", "a bit"),
        ("real time", "samples skipped", "many"),
        ("real time", "samples skipped", "9" * 5000),
        ("energy", "residual (J)", "none"),
        ("inputs", "refused", "1e400"),
    ],
)
def test_a_report_with_another_content_is_left_out(task: str, key: str, value: str) -> None:
    tasks: Any = {name: dict(values) for name, values in RIGHT.items()}
    tasks[task][key] = value
    assert heard(tasks).health == []
    del tasks["energy"]
    assert heard(tasks).health == []
