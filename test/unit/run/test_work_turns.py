"""Work in turns: at once while it is little, in order, so much at a time."""

from __future__ import annotations

import threading

import pytest

from bouncing_disk_ros.limits import TURNS_BYTES
from bouncing_disk_ros.run.work_turns import TURN_NS, WorkTurns
from bouncing_disk_ros.units import NS
from support.checks import refused


class Clocks:
    """A clock on the wall and one of the processor; each piece of work costs `cost` ns of it.

    Other programs make that `slow` times as long on the wall.
    """

    def __init__(self, cost: int, slow: int = 1) -> None:
        self.now, self.spent, self.cost, self.slow = 0, 0, cost, slow
        self.done: list[int] = []
        self.woken = 0
        self.turns = WorkTurns(self.wake, lambda: self.now, lambda: self.spent)

    def wake(self) -> None:
        self.woken += 1

    def work(self, number: int) -> bool:
        self.now += self.cost * self.slow
        self.spent += self.cost
        self.done.append(number)
        return number % 2 == 0

    def take(self, number: int, size: int = 100) -> bool:
        return self.turns.take("topic", size, lambda: self.work(number))


def test_little_work_is_done_at_once() -> None:
    clocks = Clocks(TURN_NS // 10)
    for number in range(100):
        assert clocks.take(number) == (number % 2 == 0)
        clocks.now += TURN_NS // 10
    assert clocks.done == list(range(100))
    assert clocks.woken == 0


@pytest.mark.parametrize("slow", [1, 2, 10])
def test_much_work_is_done_in_order_and_leaves_half_of_the_time(slow: int) -> None:
    """A turn ends after its processor time, however long other programs make it."""
    clocks = Clocks(TURN_NS // 4, slow)
    for number in range(100):
        assert clocks.take(number) or len(clocks.done) == number + 1
    assert len(clocks.done) == 4
    turns, left = 0, 0
    while clocks.turns.turn():
        assert clocks.take(100 + len(clocks.done)), "behind all that waits"
        clocks.turns._waiting.pop()
        clocks.now += TURN_NS // 10
        turns, left = turns + 1, left + TURN_NS // 10
    assert clocks.done == list(range(100))
    assert turns >= 24
    assert left >= 0.9 * 96 * clocks.cost


def test_one_turn_ends_with_the_piece_that_exceeds_it() -> None:
    clocks = Clocks(7 * TURN_NS)
    for number in range(4):
        clocks.take(number)
    assert clocks.done == [0]
    clocks.now += 100 * TURN_NS
    assert clocks.turns.turn()
    assert clocks.done == [0, 1]


def test_what_waits_is_bounded_and_can_be_dropped() -> None:
    clocks = Clocks(9 * TURN_NS)
    clocks.take(0)
    for number in range(10):
        assert clocks.take(number, TURNS_BYTES // 10)
    refused(r"that wait for their turn.*Send less at a time", clocks.take, 99, TURNS_BYTES // 10)
    assert clocks.turns.drop() == ["topic"] * 10
    assert clocks.turns.waiting == 0
    assert not clocks.turns.turn()
    assert clocks.done == [0]


def test_waiting_costs_no_turn() -> None:
    """The clock of spent time is the processor's: work that only waits leaves the turn as it is."""
    turns = WorkTurns(lambda: None)
    assert turns.take("a", 1, lambda: threading.Event().wait(4 * TURN_NS / NS)) is False
    assert turns.take("b", 1, lambda: True)
    assert turns.waiting == 0
