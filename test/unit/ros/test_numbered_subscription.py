"""Messages that did not arrive are counted from the publishers' numbers."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bouncing_disk_ros.ros.numbered_subscription import LostMessages

A, B = frozenset([b"a"]), frozenset([b"b"])


class Graph:
    """Who publishes, and how often it was asked."""

    def __init__(self, *publishers: bytes) -> None:
        self.publishers, self.asked = frozenset(publishers), 0

    def __call__(self) -> frozenset[bytes]:
        self.asked += 1
        return self.publishers


@given(st.sets(st.integers(1, 200), min_size=1))
def test_gaps_of_one_publisher_are_lost_messages(numbers: set[int]) -> None:
    lost = LostMessages(Graph(b"a"))
    for number in sorted(numbers):
        lost.take(number)
    assert lost.lost == max(numbers) - min(numbers) + 1 - len(numbers)
    assert not lost.lower_bound


def test_the_graph_is_asked_only_where_a_number_is_missing() -> None:
    graph = Graph(b"a")
    lost = LostMessages(graph)
    for number in (*range(5, 100), *range(103, 200)):
        lost.take(number)
    assert graph.asked == 2
    assert lost.lost == 3


def test_a_new_publisher_begins_its_own_numbers() -> None:
    graph = Graph(b"a")
    lost = LostMessages(graph)
    for number in (1, 2, 3):
        lost.take(number)
    graph.publishers = B
    for number in (50, 51):  # its first ones went to others
        lost.take(number)
    graph.publishers = frozenset([b"c"])
    lost.take(1)
    assert lost.lost == 0
    lost.take(4)
    assert lost.lost == 2
    assert not lost.lower_bound


def test_a_publisher_that_has_left_is_counted() -> None:
    graph = Graph(b"a")
    lost = LostMessages(graph)
    lost.take(1)
    graph.publishers = frozenset()
    lost.take(4)  # it was on the way
    assert lost.lost == 2


def test_numbers_of_several_publishers_mix_and_are_not_counted() -> None:
    graph = Graph(b"a", b"b")
    lost = LostMessages(graph)
    for number in range(1, 1000, 7):
        lost.take(number)
    assert lost.lost == 0
    assert lost.lower_bound
    assert graph.asked == 1  # not for each message of a flood
    graph.publishers = A
    lost.look()
    for number in (20, 21, 25):
        lost.take(number)
    assert lost.lost == 3
    assert lost.lower_bound  # of before


@pytest.mark.parametrize("publishers", [(), (b"a",)])
def test_without_numbers_nothing_is_counted(publishers: tuple[bytes, ...]) -> None:
    lost = LostMessages(Graph(*publishers))
    for _ in range(3):
        lost.take(None)
    lost.look()
    assert lost.lost == 0
    assert lost.lower_bound
