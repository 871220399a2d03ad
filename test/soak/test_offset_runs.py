"""Offset trajectories for long: a million flights by a second method, ten thousand splices.

make soak
BOUNCING_DISK_OFFSET_FLIGHTS=100000 make soak   # fewer flights
"""

from __future__ import annotations

import os
import time

import pytest

from reference.many_flights import ManyFlights, axial_run
from support.offset_runs import SECOND
from support.offset_splices import check_future_splice

FLIGHTS = int(os.environ.get("BOUNCING_DISK_OFFSET_FLIGHTS", "1000000"))
SPLICES = int(os.environ.get("BOUNCING_DISK_OFFSET_SPLICES", "10000"))
FIRST = 1_000_000
"""Seed of the first run: `make test` has those from 0 on."""
RUNS = 2000
"""Of one part, checked together."""

pytestmark = [pytest.mark.soak, pytest.mark.timeout(2 * 3600)]


def test_no_impact_of_a_million_flights_is_missed() -> None:
    begin, seed, count = time.monotonic(), FIRST, 0
    while count < FLIGHTS:
        many = ManyFlights()
        for one in range(seed, seed + RUNS):
            run = axial_run(one)
            rows, behind = run.start().advance(int(4 / run.motion.frequency * SECOND), 200_000)
            assert not behind
            many.add(run, rows)
        assert many.missed() == []
        count, seed = count + len(many), seed + RUNS
    took = time.monotonic() - begin
    print(f"\n{count} flights of {seed - FIRST} runs in {took:.0f} s: no impact missed")


def test_ten_thousand_future_splices_keep_the_position_continuous() -> None:
    begin = time.monotonic()
    for seed in range(FIRST, FIRST + SPLICES):
        check_future_splice(seed)
    print(f"\n{SPLICES} splices in {time.monotonic() - begin:.0f} s")
