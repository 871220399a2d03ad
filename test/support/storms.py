"""Storms of random commands on a session in this process: it stays alive, finite and replayable."""

from __future__ import annotations

import random
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.core.model import IMPACT_DTYPE, join_rows
from bouncing_disk_ros.run import input_records as records_of
from bouncing_disk_ros.run.input_records import Record
from bouncing_disk_ros.run.session import EVENTS_AT_ONCE
from bouncing_disk_ros.run.time_map import FAR_NS
from support.commanded import WALL_NS, CommandedSession
from support.random_commands import RandomCommands, RandomTrajectories, between
from support.replayed import replayed

COMMANDS = 1000
"""Commands of one storm: each begins with a new session, so that memory does not grow."""


class Storm(NamedTuple):
    """What a storm came to."""

    accepted: int
    refused: int
    rows: NDArray[np.void]
    records: list[Record]
    end_ns: int


def storm(seed: int, commands: int = COMMANDS, *, offsets: bool = False) -> Storm:
    """A session under random commands, half of them wrong; every other seed to the table's ends.

    `offsets`: half of the commands are offset trajectories.

    AssertionError, with the seed, where a number is not finite, the ledger does not close or the
    run has ended.
    """
    rng = random.Random(seed)
    draw = RandomCommands(rng, wild=seed % 2 == 1 and not offsets)
    trajectories = RandomTrajectories(rng) if offsets else draw
    commanded = CommandedSession(
        restitution=rng.choice([0.0, 0.5, 0.9, 1.0]), crossfade_duration=rng.choice([0.0, 1e-3])
    )
    session = commanded.session
    accepted = 0
    for _ in range(commands):
        now_ns = WALL_NS + session.time_ns
        chosen = trajectories if offsets and rng.random() < 0.5 else draw
        command = chosen.valid(now_ns) if rng.random() < 0.5 else chosen.wrong(now_ns)
        accepted += commanded.take(*command)
        if session.resolve_waiting():
            ahead = round(between(rng, 1.0, 1e8))
            session.advance(min(session.time_ns + ahead, FAR_NS), EVENTS_AT_ONCE)
        session.checked_energy()
        assert not session.fault, f"seed {seed}: {session.fault}"
        assert all(map(np.isfinite, session.simulation.sample())), f"seed {seed}"
        if rng.random() < 0.05:
            session.reset()
    while not session.resolve_waiting():  # what waits goes on record when it acts
        pass
    rows = join_rows(session.take_rows())
    assert all_finite(rows), f"seed {seed}"
    lines = [records_of.to_json(record) for record in commanded.records]
    records = [records_of.from_json(line) for line in lines]
    return Storm(accepted, commanded.refused, rows, records, session.time_ns)


def all_finite(rows: NDArray[np.void]) -> bool:
    """Whether every number of the rows is finite."""
    return all(bool(np.isfinite(rows[name]).all()) for name in IMPACT_DTYPE.names or ())


def check_storm(seed: int, commands: int = COMMANDS, *, offsets: bool = False) -> Storm:
    """A storm that replays bit by bit, and in which commands were both accepted and refused."""
    found = storm(seed, commands, offsets=offsets)
    again = replayed(found.records, found.end_ns)[0]
    assert again.tobytes() == found.rows.tobytes(), f"seed {seed}: the replay differs"
    assert found.accepted > commands // 10, f"seed {seed}"
    assert found.refused > commands // 10, f"seed {seed}"
    return found
