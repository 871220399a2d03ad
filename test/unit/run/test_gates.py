"""Gates of a lockstep: when one is complete, and in which order its inputs act."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import pytest

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.run.gates import Gates


def gates(*controllers: int, timeout_ns: int = 100) -> Gates:
    made = Gates(controllers, timeout_ns)
    made.open(0)
    return made


def nothing() -> None:
    """An input that does nothing."""


def test_a_gate_is_complete_when_all_have_answered_and_their_inputs_have_come() -> None:
    made = gates(1, 2)
    made.answer([1, 0, 2])
    assert not made.is_complete
    made.answer([2, 0, 0])
    assert not made.is_complete
    made.hold("a", 1, b"", nothing)
    assert not made.is_complete
    made.hold("a", 2, b"", nothing)
    assert made.is_complete


def test_inputs_may_come_before_the_answers() -> None:
    made = gates(1)
    made.hold("a", 1, b"", nothing)
    assert not made.is_complete
    made.answer([1, 0, 1])
    assert made.is_complete


def test_the_order_of_arrival_does_not_matter() -> None:
    inputs = [("b", 1, b"x"), ("a", 2, b"x"), ("a", 1, b"y"), ("a", 1, b"x")]
    for order in itertools.permutations(inputs):
        made = gates(1)
        done: list[tuple[str, int, bytes]] = []

        def act(
            what: tuple[str, int, bytes], to: list[tuple[str, int, bytes]] = done
        ) -> Callable[[], None]:
            return lambda: to.append(what)

        for one in order:
            made.hold(*one, act(one))
        for held in made.close():
            held.act()
        assert done == [("a", 1, b"x"), ("a", 1, b"y"), ("a", 2, b"x"), ("b", 1, b"x")]


def test_without_numbers_of_the_middleware_the_order_is_that_of_arrival() -> None:
    made = gates(1)
    for data in (b"z", b"y", b"x"):
        made.hold("a", None, data, nothing)
    assert [one.data for one in made.close()] == [b"z", b"y", b"x"]


@pytest.mark.parametrize(
    ("answer", "said"),
    [([3, 0, 0], "lockstep_controllers"), ([1, 5, 0], "newest"), ([1, 0], "number of inputs")],
)
def test_a_wrong_answer_is_refused(answer: list[int], said: str) -> None:
    made = gates(1)
    with pytest.raises(InputError, match=said):
        made.answer(answer)
    assert not made.is_complete


def test_an_answer_to_an_earlier_gate_changes_nothing() -> None:
    made = gates(1)
    made.answer([1, 0, 0])
    made.close()
    made.open(0)
    made.answer([1, 0, 0])
    assert not made.is_complete


def test_silence_is_reported_once_for_each_gate() -> None:
    made = gates(1, 2)
    made.answer([2, 0, 0])
    assert made.newly_silent(99) == []
    assert made.newly_silent(100) == [1]
    assert made.newly_silent(200) == []
    assert made.silent(200) == [1]
