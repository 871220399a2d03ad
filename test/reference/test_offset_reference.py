"""Runs with offset trajectories against 40 digits: each impact is a root, and the first one.

A flight's end may be off by what rounding makes of its length over |w_A|: the distance from the
platform there is at most 1e-12 of the length of the model, πg/ω², and most are 1e-15.
"""

from __future__ import annotations

import pytest

from reference.cases import examples
from reference.offset_flights import Checked, flights
from support.offset_runs import SECOND, random_run

_FLIGHTS = 30  # of one run: those of a chatter are many
_WITHIN = 1e-12
_RESIDUAL = 1e-12  # of throughput, far below the 1e-10 that the model promises


@pytest.mark.parametrize("block", range(4))
def test_impacts_are_first_roots_and_the_energy_is_booked(block: int) -> None:
    count = 0
    number = examples(15)
    for seed in range(block * number, (block + 1) * number):
        run = random_run(seed)
        simulation = run.start()
        rows, behind = simulation.advance(int(4 / run.motion.frequency * SECOND), 200_000)
        assert not behind
        energy = simulation.energy()
        assert abs(energy.residual) <= _RESIDUAL * energy.throughput, run
        found = list(flights(run, rows))[:_FLIGHTS]
        check = Checked(run) if found else None
        for flight in found:
            assert check is not None
            assert abs(check.distance(flight)) <= _WITHIN * check.unit, (run, flight)
            assert check.missed(flight) is None, (run, flight)
            count += 1
    assert count > 5 * number
