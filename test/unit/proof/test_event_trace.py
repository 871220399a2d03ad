"""A traced run is the run itself, event by event; runs with offsets are proved."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import pytest
from flint import arb

from bouncing_disk_ros.core.model import Disk, InitialState, Motion, Phase, join_rows
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.proof.event_proof import prove
from bouncing_disk_ros.proof.event_trace import TracedEngine, trace
from bouncing_disk_ros.proof.exact_records import (
    Event,
    Kind,
    MotionRecord,
    OffsetPiece,
    State,
)
from bouncing_disk_ros.proof.platforms import platform_of
from bouncing_disk_ros.proof.verdicts import Outcome
from reference.offset_path import Piece
from support.random_runs import random_offset_run

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


# --- offsets --------------------------------------------------------------------------------------
RUNS, EVENTS = 8, 30
AT_REST = MotionRecord(False, 0, 2**62, 0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)


def events(seeds: range) -> Iterator[Event]:
    for seed in seeds:
        yield from itertools.islice(trace(random_offset_run(seed).start(), 10**9), EVENTS)


@pytest.mark.parametrize("degree", [0, 1, 3, 5])
def test_a_piece_is_the_polynomial_of_its_ends(degree: int) -> None:
    """Against Hermite's basis functions."""
    start, end = (0.3, -1.0, 7.0), (-0.2, 0.4, -3.0)
    piece = OffsetPiece(100_000_000, 350_000_000, start, end, degree)
    state = State(150_000_000, 0.25, 0, 0.0, Phase.FLIGHT, 0.0, 0.0, 0.0, 0.0)
    right = Piece(0.1, 0.35, (*start, *end), (degree + 1) // 2)
    platform = platform_of(AT_REST._replace(axial=piece, angular=piece), state)
    for t in (0.0, 0.07, 0.2):
        found = platform.mix(arb(2), arb(-3)).jet(arb(t))
        for order in range(3):
            expected = -float(right.at(0.15 + 0.25e-9 + t, order))
            assert float(found[order]) == pytest.approx(expected, rel=1e-12, abs=1e-12)


def test_random_runs_with_offsets_are_proved() -> None:
    kinds = set()
    for event in events(range(RUNS)):
        verdict = prove(event)
        assert verdict.outcome is Outcome.PROVED, (event, verdict)
        moved = [p for p in (event.motion.axial, event.motion.angular) if p is not None]
        if any(piece.degree > 1 for piece in moved):
            kinds.add(event.kind)
    assert kinds >= {Kind.IMPACT, Kind.SEPARATION, Kind.SLIP_ENDS, Kind.CHATTER, Kind.PROPAGATED}


def test_an_impact_on_another_offset_is_refuted() -> None:
    """Its end is 1e-9 of itself higher, or it has begun a microsecond earlier."""
    found = 0
    for event in events(range(RUNS)):
        piece = event.motion.axial
        if event.kind is not Kind.IMPACT or piece is None or piece.degree < 2 or event.delay < 1e-3:
            continue
        higher = piece._replace(end=(piece.end[0] * (1.0 + 1e-9), *piece.end[1:]))
        earlier = piece._replace(begin_ns=piece.begin_ns - 1000)
        refuted = [
            prove(event._replace(motion=event.motion._replace(axial=other))).outcome
            for other in (higher, earlier)
        ]
        found += refuted.count(Outcome.REFUTED)
    assert found > 10
