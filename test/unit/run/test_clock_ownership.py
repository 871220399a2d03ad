"""Of several publishers of /clock all but one stop, whenever they were started and are seen."""

from __future__ import annotations

import itertools
import random

import pytest

from bouncing_disk_ros.nodes.simulator.clocks import TURN_NS, YOUNG_NS, ClockOwnership
from bouncing_disk_ros.units import NS

STEP_NS = NS // 10
LEAVE_NS = NS // 2
"""How long it takes to see that another publisher has left."""


def last_ones(starts: list[int], delays: dict[tuple[int, int], int]) -> list[int]:
    """Those that stay of publishers started at instants, who see each other after delays (ns)."""
    owners: dict[int, ClockOwnership] = {}
    ended: dict[int, int] = {}
    for now in range(0, max(starts) + 20 * NS, STEP_NS):
        for one, begin in enumerate(starts):
            if begin > now or one in ended:
                continue
            owner = owners.setdefault(one, ClockOwnership(bytes([one]), now))
            seen = {
                bytes([other])
                for other, other_begin in enumerate(starts)
                if other != one
                and now >= max(begin, other_begin) + delays[one, other]
                and now < ended.get(other, now) + LEAVE_NS
            }
            lost = owner.is_lost(frozenset({bytes([one]), *seen}), now)
            if lost:
                ended[one] = now
    return [one for one in range(len(starts)) if one not in ended]


@pytest.mark.parametrize("apart", [0.0, 0.3, 1.0, 3.0, 5.0, 60.0])
@pytest.mark.parametrize("first", [0, 1])
def test_of_two_one_stays_and_it_is_the_one_that_was_there(apart: float, first: int) -> None:
    starts = [0, 0]
    starts[1 - first] = round(apart * NS)
    for one, other in itertools.product((0.1, 1.0, 3.1), repeat=2):
        delays = {(0, 1): round(one * NS), (1, 0): round(other * NS)}
        left = last_ones(starts, delays)
        assert len(left) == 1
        if apart * NS > YOUNG_NS:
            assert left == [first]


def test_of_three_started_together_one_stays() -> None:
    rng = random.Random(3)
    for _ in range(200):
        starts = [rng.randrange(NS) for _ in range(3)]
        delays = {
            (a, b): rng.randrange(NS // 10, NS) for a, b in itertools.permutations(range(3), 2)
        }
        assert len(last_ones(starts, delays)) == 1


def test_one_alone_goes_on_and_one_that_sees_another_leave_too() -> None:
    owner = ClockOwnership(b"b", 0)
    assert not any(owner.is_lost(frozenset({b"b"}), now) for now in range(0, 100 * NS, NS))
    owner = ClockOwnership(b"b", 0)
    assert not owner.is_lost(frozenset({b"a", b"b"}), NS)
    assert not owner.is_lost(frozenset({b"b"}), NS + TURN_NS)
    assert not owner.is_lost(frozenset({b"a", b"b"}), NS + 2 * TURN_NS)
