"""What did not arrive is counted: messages by their publisher's numbers, rows by their index."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bouncing_disk_ros.running_numbers import Gaps, MessageLoss, Publishers

A, B = frozenset([b"a"]), frozenset([b"b"])


class Graph:
    """Who publishes."""

    def __init__(self, *publishers: bytes) -> None:
        self.publishers = frozenset(publishers)

    def __call__(self) -> frozenset[bytes]:
        return self.publishers


@given(st.sets(st.integers(1, 200), min_size=1))
def test_gaps_of_one_publisher_are_lost_messages(numbers: set[int]) -> None:
    lost = MessageLoss(Graph(b"a"))
    for number in sorted(numbers):
        lost.note(number)
    assert lost.lost == max(numbers) - min(numbers) + 1 - len(numbers)
    assert not lost.why_not


def test_a_new_publisher_begins_its_own_numbers() -> None:
    graph = Graph(b"a")
    lost = MessageLoss(graph)
    for number in (1, 2, 3):
        lost.note(number)
    graph.publishers = B
    for number in (50, 51):  # its first ones went to others
        lost.note(number)
    graph.publishers = frozenset([b"c"])
    lost.note(1)
    assert lost.lost == 0
    lost.note(4)
    assert lost.lost == 2
    graph.publishers = frozenset()
    lost.note(6)  # it was on the way when its publisher left
    assert lost.lost == 3
    assert not lost.why_not


def test_numbers_of_several_publishers_mix_and_are_not_counted() -> None:
    graph = Graph(b"a", b"b")
    lost = MessageLoss(graph)
    for number in range(1, 1000, 7):
        lost.note(number)
    assert lost.lost == 0
    assert lost.why_not
    graph.publishers = A
    lost.look()
    for number in (20, 21, 25):
        lost.note(number)
    assert lost.lost == 3
    assert lost.why_not  # of before


@pytest.mark.parametrize("publishers", [(), (b"a",)])
def test_without_numbers_nothing_is_counted(publishers: tuple[bytes, ...]) -> None:
    lost = MessageLoss(Graph(*publishers))
    for _ in range(3):
        lost.note(None)
    lost.look()
    assert lost.lost == 0
    assert lost.why_not


def test_rows_are_counted_by_their_index() -> None:
    rows = Gaps()
    for taken, missing in (
        ((5, 14, 10), 0),  # joined late
        ((17, 20, 3), 3),  # two before it, one within it
        ((0, 4, 5), -21),  # a new run
        ((5, 9, 5), 0),
    ):
        assert rows.take(*taken) == missing
    rows.restart()
    assert rows.take(100) == 0
    assert rows.lost == 3


def test_publishers_of_a_topic_are_told_apart_by_their_counts() -> None:
    known = Publishers()
    assert [known.take(number) for number in (1, 2, 1, 3, 2)] == [
        (0, True), (0, False), (1, True), (0, False), (1, False),
    ]  # fmt: skip
    known.take(3)
    assert known.take(4, [1]) == (1, False)  # the next one of either
    assert known.take(9) == (2, True)
