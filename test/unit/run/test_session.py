"""A session records what drove it, and the record gives every impact again, bit for bit."""

from __future__ import annotations

import json
from typing import Any

import pytest
from numpy.typing import NDArray

from bouncing_disk_ros import parameters
from bouncing_disk_ros.core.model import Disk, InitialState, Motion, Sample, join_rows
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.run import input_records as records_of
from bouncing_disk_ros.run.loop import Loop
from bouncing_disk_ros.run.session import MAX_INPUTS_BETWEEN_SNAPSHOTS, Session
from bouncing_disk_ros.units import NS
from support.checks import refused
from support.driven import replayed

Record = dict[str, Any]


def started(**values: parameters.Value) -> tuple[Session, list[Record]]:
    records: list[Record] = []
    paused = bool(values.pop("paused", False))
    return Session(parameters.complete(values), records.append, paused=paused), records


def through_json(records: list[Record]) -> list[Record]:
    return [records_of.from_json(records_of.to_json(record)) for record in records]


@pytest.mark.parametrize(("paused", "later"), [(False, 1), (True, 0)])
def test_an_input_acts_after_what_was_simulated_or_at_the_held_instant(
    paused: bool, later: int
) -> None:
    session, records = started(paused=paused)
    session.advance(NS)
    session.apply_impulse(session.input_ns, 0.1, 0.0)
    assert session.time_ns == NS + later
    assert records[-1]["at_ns"] == records[-1]["time_ns"] == NS + later
    for _ in range(2):
        session.set_paused(True)
    assert [record["kind"] for record in records].count("pause") == int(not paused)


def test_many_inputs_bring_a_snapshot_and_a_crossfade_lasts_a_nanosecond_at_least() -> None:
    session, records = started(crossfade_duration=1e-12)
    session.command([(session.input_ns, Motion(0.05, 0.5, 3.0, 0.0))])
    assert records[-1]["crossfade_ns"] == 1
    session, records = started(paused=True)
    for _ in range(MAX_INPUTS_BETWEEN_SNAPSHOTS):
        session.apply_impulse(session.input_ns, 0.0, 0.0)
    assert [r["index"] for r in records if r["kind"] == "snapshot"] == [0, 501]


def test_reset_takes_the_parameters_as_they_are_now() -> None:
    session, records = started()
    session.advance(NS)
    session.set_parameters({"initial_height": 0.25, "frequency": 5.0})
    assert session.simulation.motion_in_force.target.frequency == 3.0
    session.reset()
    assert session.simulation.sample().gap == 0.25
    assert session.simulation.motion_in_force.target.frequency == 5.0
    assert records[-1]["initial"]["height"] == 0.25


# --- reading records ------------------------------------------------------------------------------
@pytest.mark.parametrize(
    "text",
    ["", "[]", "{}", '{"index":0,"time_ns":0}', '{"index":"a","time_ns":0,"kind":"pause"}',
     '{"index":0,"time_ns":0,"kind":"dance"}'],
)  # fmt: skip
def test_text_that_is_no_record_is_refused(text: str) -> None:
    refused("input record", records_of.from_json, text)


KNOT, POINT = [6, 1, 0.0, 0.0, 0.0], [6, [0.1, 0.1, 3.0, 0.0]]
DISK = {name: parameters.DEFAULTS[name] for name in Disk._fields}
INITIAL = {name: parameters.DEFAULTS[f"initial_{name}"] for name in InitialState._fields}
MOTION = {name: parameters.DEFAULTS[name] for name in Motion._fields}
WHOLE: dict[str, dict[str, Any]] = {
    "snapshot": {"state": {}, "parameters": DISK},
    "motion": {"points": [POINT], "crossfade_ns": 0},
    "trajectory": {"begin_ns": 5, "joints": {"platform_axial": [KNOT]}},
    "impulse": {"at_ns": 5, "axial_impulse": 0.1, "angular_impulse": 0.0},
    "parameters": {"values": {"friction": 0.5, "pacing": "x", "of_another": 1}, "disk": DISK},
    "pause": {"paused": True},
    "reset": {"initial": INITIAL, "motion": MOTION},
}
"""The fields of a record of each kind."""


@pytest.mark.parametrize(
    ("kind", "changes", "said"),
    [
        ("pause", {"index": -1}, "index: got -1"),
        ("pause", {"index": 2**53 + 1}, "index: got 9007199254740993"),
        ("pause", {"index": True}, "index: got True"),
        ("pause", {"time_ns": -1}, "time_ns: got -1"),
        ("pause", {"time_ns": 2**63 - 1}, "time_ns: got 9223372036854775807"),
        ("pause", {"paused": 1}, "paused: got 1, allowed: true or false"),
        ("snapshot", {"state": []}, "state: got \\[\\], allowed: a JSON object"),
        ("snapshot", {"version": "x" * 1025}, "version: got 'xxx"),
        ("snapshot", {"parameters": {}}, "parameters mass: got 'nothing'"),
        ("snapshot", {"parameters": {**DISK, "mass": 0.0}}, "mass: got 0.0"),
        ("motion", {"points": 5}, "points: got 5, allowed: a list"),
        ("motion", {"points": [POINT, POINT]}, "points, instant: got 6"),
        ("motion", {"points": [[6, [0.1, 0.1, 3.0]]]}, "points: got .*0.1, 3.0"),
        ("motion", {"points": [[6, [0.1, 0.1, 0.0, 0.0]]]}, "frequency: got 0.0"),
        ("motion", {"crossfade_ns": -1}, "crossfade_ns: got -1"),
        ("motion", {"crossfade_ns": 10**15 + 1}, "crossfade_ns: got 1000000000000001"),
        ("trajectory", {"begin_ns": 4}, "begin_ns: got 4"),
        ("trajectory", {"joints": {"arm": []}}, "got 'arm', allowed: platform_axial, platform_r"),
        ("trajectory", {"joints": {"platform_axial": [KNOT, KNOT]}}, "instant: got 6"),
        ("trajectory", {"joints": {"platform_axial": [KNOT[:4]]}}, "platform_axial: got"),
        ("trajectory", {"joints": {"platform_axial": [[6, 2, *KNOT[2:]]]}}, "degree: got 2"),
        *(("trajectory", {"joints": {"platform_axial": [[*KNOT[:at], 1e30, *KNOT[at + 1:]]]}},
           "knot: got 1e\\+30") for at in (2, 3, 4)),
        ("impulse", {"at_ns": 4}, "at_ns: got 4"),
        ("impulse", {"axial_impulse": 1e300}, "axial_impulse: got 1e\\+300"),
        ("impulse", {"angular_impulse": -1e300}, "angular_impulse: got -1e\\+300"),
        ("parameters", {"values": {"mass": "1"}}, "mass: got '1'"),
        ("parameters", {"values": {"mass": True}}, "mass: got True"),
        ("parameters", {"values": {"mass": -1.0}}, "mass: got -1.0"),
        ("parameters", {"values": {"of_another": []}}, "of_another: got"),
        ("parameters", {"disk": {**DISK, "height": 1.0}}, "disk: got 'height'"),
        ("parameters", {"disk": {**DISK, "mass": -1.0}}, "disk mass: got -1.0"),
        ("reset", {"initial": {}}, "initial height: got"),
        ("reset", {"motion": {**MOTION, "frequency": 0.0}}, "motion frequency: got 0.0"),
    ],
)  # fmt: skip
def test_a_record_with_a_field_that_none_has_is_refused(
    kind: str, changes: dict[str, Any], said: str
) -> None:
    whole = {"index": 0, "time_ns": 5, "kind": kind, **WHOLE[kind]}
    assert records_of.from_json(json.dumps(whole))["kind"] == kind
    refused(f"input record.*{said}", records_of.from_json, json.dumps({**whole, **changes}))


def test_numbers_that_are_none_never_reach_the_record() -> None:
    with pytest.raises(ValueError, match="JSON"):
        records_of.to_json({"value": float("nan")})


# --- inputs whose instant takes long --------------------------------------------------------------
def dense() -> tuple[Session, list[Record]]:
    """A disk of ε = 1 that bounces a million times in a nanosecond: no slice resolves one."""
    return started(
        axial_amplitude=0.0,
        angular_amplitude=0.0,
        restitution=1.0,
        initial_with_platform=False,
        initial_axial_velocity=5e-15,
        friction=0.0,
    )


def test_an_input_waits_until_its_instant_is_resolved() -> None:
    session, records = dense()
    session.advance(1, 10)
    before = len(records)
    session.set_parameters({"restitution": 0.5})
    session.command([(5 * NS, Motion(0.03, 0.1, 3.0, 0.0))])
    assert session.waiting == 2
    assert len(records) == before
    assert session.latest_target == Motion(0.03, 0.1, 3.0, 0.0)
    while not session.resolve_waiting(1_000_000):
        pass
    assert session.waiting == 0
    kinds = [record["kind"] for record in records[before:]]
    assert kinds == ["parameters", "motion"]
    assert [record["time_ns"] for record in records[before:]] == [1, 2]
    again = replayed(through_json(records), 2)[0]
    assert again.tobytes() == join_rows(session.take_rows()).tobytes()


class Nobody:
    """A sink that keeps nothing."""

    def sample(self, sample: Sample) -> None:
        """Leave a sample."""

    def speed(self, first: Sample, second: Sample) -> None:
        """Leave a speed."""

    def impacts(self, rows: NDArray[Any]) -> None:
        """Leave rows."""


def test_what_comes_after_waiting_parameters_has_their_values() -> None:
    """A reset behind them went to the old start; a rate was never taken over."""
    session, records = dense()
    session.advance(1, 10)
    loop = Loop(session, Nobody())
    session.set_parameters({"initial_height": 0.2, "crossfade_duration": 0.7, "state_rate": 7.0})
    loop.set_rates()
    session.command([(5 * NS, Motion(0.03, 0.1, 3.0, 0.0))])
    session.reset()
    assert session.waiting == 3
    while not session.resolve_waiting(1_000_000):
        pass
    motion, reset = records[-2:]
    assert motion["crossfade_ns"] == 700_000_000
    assert reset["initial"]["height"] == 0.2
    assert loop.next_sample_ns == round(NS / 7.0)


def test_a_pause_waits_in_its_place() -> None:
    session, _ = dense()
    session.advance(1, 10)
    session.set_paused(True)
    assert not session.paused
    session.set_paused(False)
    session.set_paused(True)
    assert session.waiting == 3
    while not session.resolve_waiting(1_000_000):
        pass
    assert session.paused


def test_a_run_whose_state_is_not_finite_stands_still() -> None:
    session, records = started()
    session.advance(NS)
    session.simulation._engine.state["u"] = float("nan")
    session.simulation._engine.invalidate_next_event()
    assert session.advance(2 * NS)
    assert "u nan" in session.fault
    stood, count = session.time_ns, len(records)
    session.reset()
    assert session.advance(3 * NS)
    assert session.time_ns == stood
    assert len(records) == count


def test_a_run_whose_ledger_does_not_close_stands_still(monkeypatch: pytest.MonkeyPatch) -> None:
    session, _ = started()
    assert session.checked_energy().relative_residual < 1e-12
    energy = session.simulation.energy()._replace(residual=1.0)
    monkeypatch.setattr(Simulation, "energy", lambda _: energy)
    session.checked_energy()
    assert session.fault.startswith("the energy ledger does not close: a residual of 1 J, ")
    assert session.advance(NS)
    assert session.time_ns == 0
