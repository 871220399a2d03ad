"""Sessions under random commands: finite, replayed to the bit, not disturbed by wrong ones."""

from __future__ import annotations

import random
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.run import inputs
from bouncing_disk_ros.run.records import from_json, to_json
from support.commanded import WALL_NS, CommandedSession
from support.random_commands import RandomCommands, between

EVENTS = 2000
"""Most events between two commands: a motion of a megahertz shall not take all the time."""
ADVANCE_NS = (1.0, 1e9)


class Outcome(NamedTuple):
    """What a block of commands came to."""

    accepted: int
    refused: int
    rows: int
    fault: str


def run_block(seed: int, count: int, *, wild: bool = False) -> Outcome:
    """Give `count` commands, half of them wrong; AssertionError, with the seed, for any fault.

    A second session is given those that were accepted alone, at the same instants: it must have the
    same records, rows and state, to the bit.
    """
    where = f"seed {seed}{', wild' if wild else ''}"
    rng = random.Random(seed)
    draw = RandomCommands(rng, wild=wild)
    first, second = CommandedSession(), CommandedSession()
    rows: tuple[list[Any], list[Any]] = ([], [])
    for number in range(count):
        now = WALL_NS + first.session.time_ns
        command = draw.valid(now) if rng.random() < 0.5 else draw.wrong(now)
        refused = first.refused
        accepted = first.take(*command)
        assert accepted == (first.refused == refused), (where, number, command)
        if accepted:
            assert second.take(*command), (where, number, command)
        if rng.random() < 0.02:
            first.session.reset()
            second.session.reset()
        step, budget = round(between(rng, *ADVANCE_NS)), rng.randrange(1, EVENTS)
        for commanded, into in ((first, rows[0]), (second, rows[1])):
            _advance(commanded, step, budget)
            into.extend(commanded.session.take_rows())
        if first.session.fault:
            break
    assert first.session.fault == second.session.fault, where
    assert wild or not first.session.fault, (where, first.session.fault)
    mine, other = inputs.joined(rows[0]), inputs.joined(rows[1])
    assert mine.tobytes() == other.tobytes(), where
    assert first.records == second.records, where
    _check_finite(mine, where)
    if not first.session.fault:
        assert first.session.simulation.snapshot() == second.session.simulation.snapshot(), where
        _check_replay(first, mine, where)
    return Outcome(first.session.accepted, first.refused, len(mine), first.session.fault)


def _advance(commanded: CommandedSession, step: int, budget: int) -> None:
    session = commanded.session
    if session.resolve_waiting():
        session.advance(session.time_ns + step, budget)


def _check_finite(rows: NDArray[np.void], where: str) -> None:
    for name in rows.dtype.names or ():
        column = rows[name]
        assert np.isfinite(column.astype(float)).all(), (where, name)
    index = rows["index"]
    assert np.array_equal(index, np.arange(len(rows))), where


def _check_replay(commanded: CommandedSession, rows: NDArray[np.void], where: str) -> None:
    """The records, as JSON has them, give every row again."""
    session = commanded.session
    while not session.resolve_waiting():
        assert not session.fault, where
    rows = inputs.joined([rows, *session.take_rows()])
    records = [from_json(to_json(record)) for record in commanded.records]
    again = inputs.replay(records, session.time_ns)
    assert again.tobytes() == rows.tobytes(), where
