"""The referee of motions with offsets: runs are proved, whatever is a little wrong is refuted."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import pytest
from flint import arb

from bouncing_disk_ros.core.model import Phase
from bouncing_disk_ros.proof.event_proof import prove
from bouncing_disk_ros.proof.event_trace import trace
from bouncing_disk_ros.proof.exact_records import Event, Kind, MotionRecord, OffsetPiece, State
from bouncing_disk_ros.proof.platforms import platform_of
from bouncing_disk_ros.proof.verdicts import Outcome
from reference.offset_path import Piece
from support.offset_runs import random_run

RUNS, EVENTS = 8, 30
AT_REST = MotionRecord(False, 0, 2**62, 0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)


def events(seeds: range) -> Iterator[Event]:
    for seed in seeds:
        yield from itertools.islice(trace(random_run(seed).start(), 10**9), EVENTS)


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
