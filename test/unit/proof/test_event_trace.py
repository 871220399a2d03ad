"""A traced run is the run itself, event by event."""

from __future__ import annotations

import itertools

import pytest

from bouncing_disk_ros.core.model import Disk, InitialState, Motion, Phase, join_rows
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.proof.event_trace import TracedEngine, trace
from bouncing_disk_ros.proof.exact_records import Event, Kind

NS = 1_000_000_000


def run() -> Simulation:
    """Tosses, chatter, contact and slips, a cross-fade and an impulse in the midst of it."""
    made = Simulation(
        Motion(0.08, 1.0, 2.0, 0.3), Disk(0.5, 0.4, 0.5, 0.1, 0.1, 9.81), InitialState()
    )
    made.command([(2 * NS, Motion(0.05, 1.5, 3.0, -0.2))], crossfade_ns=NS)
    made.apply_impulse(2_500_000_000, 0.5, 0.01)
    return made


def test_tracing_changes_no_bit() -> None:
    plain, traced = run(), run()
    TracedEngine.of(traced)
    rows = []
    for simulation in (plain, traced):
        parts, behind = [], True
        while behind:
            some, behind = simulation.advance(4 * NS, 3)
            parts.append(some)
        rows.append(join_rows(parts).tobytes())
    assert rows[0] == rows[1]
    assert len(rows[0])
    assert plain.snapshot() == traced.snapshot()


@pytest.mark.parametrize("slice_events", [1, 7, 10_000])
def test_events_follow_each_other(slice_events: int) -> None:
    events = list(trace(run(), 4 * NS, slice_events))
    assert events == list(trace(run(), 4 * NS))
    assert {event.kind for event in events} >= {
        Kind.IMPACT, Kind.SEPARATION, Kind.SLIP_ENDS, Kind.CHATTER, Kind.PROPAGATED
    }  # fmt: skip
    for event, following in itertools.pairwise(events):
        assert event.after is not None
        assert _instant(event.after) == _instant(following.before)
        if event.kind is not Kind.PROPAGATED:  # no input between the two
            assert event.after == following.before
    last = events[-1]
    assert last.after is None or last.after.ns >= 4 * NS or last.kind is Kind.CHATTER


def _instant(state: object) -> tuple[int, float]:
    return state.ns, state.sub  # type: ignore[attr-defined]


def test_a_trace_goes_on_where_one_has_ended() -> None:
    whole = list(trace(run(), 4 * NS))
    made, parts = run(), []
    for until in range(0, 4 * NS + 1, NS // 7):
        parts += list(trace(made, until, is_end=False))
    parts += list(trace(made, 4 * NS))
    assert parts == whole


def test_the_scale_of_a_slip_is_inherited() -> None:
    """α̇ of a slip that reverses is known to the rounding of the α̇ that it began with."""
    made = Simulation(
        Motion(1e-9, 0.003, 0.01, 0.5),
        Disk(1.0, 0.0, 0.2, 0.02, 0.02, 9.81, load_torque=0.1),
        InitialState(angular_velocity=6.0),
    )
    events: list[Event] = list(itertools.islice(trace(made, 100 * NS), 3))
    sliding = [event for event in events if event.before.phase is Phase.SLIDING]
    assert sliding[0].inherited == 0.0
    assert sliding[0].kind is Kind.SLIP_ENDS
    assert events[events.index(sliding[0]) + 1].inherited == 6.0
