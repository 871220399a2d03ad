"""The protocol of a lockstep: what time waits for, what ends it, in which order inputs act."""

from __future__ import annotations

import itertools
import random
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.limits import GATE_BYTES, GATE_INPUTS
from bouncing_disk_ros.run.gates import Gates, State
from support.checks import refused

PAGE = Path(__file__).resolve().parents[3] / "docs" / "closed_loops.md"
TIMEOUT = 100


def gates(*controllers: int, publishers: Callable[[], int] = lambda: 2) -> Gates:
    made = Gates(controllers, TIMEOUT, publishers)
    made.close(0)
    return made


def nothing() -> None:
    """An input that does nothing."""


class Sender:
    """A controller: its publishers of one topic and of answers count from 1 on."""

    def __init__(self, made: Gates, number: int, topic: str = "a", name: str = "") -> None:
        self.gates, self.number, self.topic, self.name = made, number, topic, name
        self.sent = self.answers = 0

    def send(self, data: str = "") -> Sender:
        """Publish an input."""
        self.sent += 1
        self.gates.hold(self.topic, self.sent, (data or self.name).encode(), nothing)
        self.gates.drop_predecessors()
        return self

    def answer(self, inputs: int, gate: int | None = None) -> list[bytes]:
        """Answer the newest gate (or another one); what is dropped then."""
        self.answers += 1
        gate = self.gates.number if gate is None else gate
        self.gates.answer([self.number, gate, inputs], self.answers)
        return [one.data for one in self.gates.drop_predecessors()]


# --- the table of states --------------------------------------------------------------------------
def test_the_page_has_a_row_for_each_state_in_its_order() -> None:
    rows = re.findall(r"^\| `(\w+)` \|", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    assert rows == [state.value for state in State]


def test_a_gate_goes_through_its_states_and_says_what_it_waits_for() -> None:
    made = Gates((1, 2), TIMEOUT, lambda: 2)
    one, two = Sender(made, 1), Sender(made, 2)
    assert (made.state, made.waiting) == (State.MOVING, "")
    made.close(0)
    assert made.waiting == "gate 0: no answer of controllers 1 and 2"
    one.answer(2)
    assert (made.state, made.waiting) == (State.ASKED, "gate 0: no answer of controller 2")
    two.answer(1)
    one.send()
    assert made.state.value == "counting"
    assert made.waiting == "gate 0: 1 of 3 inputs of controllers 1 and 2 have come"
    two.send()
    one.send()
    assert (made.state, made.waiting) == (State.COMPLETE, "")
    assert len(made.open()) == 3
    assert made.state is State.MOVING


def test_inputs_may_come_before_their_gate() -> None:
    made = gates(1)
    one = Sender(made, 1)
    one.answer(0)
    made.open()
    one.send()
    made.close(0)
    one.answer(1)
    assert made.is_complete


@pytest.mark.parametrize(
    ("prepare", "said"),
    [
        (lambda one: None, "gate 0: no answer of controller 1"),
        (lambda one: (one.answer(3), one.send(), one.send()),
         "gate 0: 2 of 3 inputs of controller 1 have come"),
        (lambda one: (one.send(), one.send(), one.answer(1)),
         "gate 0: 2 inputs have come, controller 1 announced 1; ~/reset drops them"),
    ],
)  # fmt: skip
def test_a_long_wait_is_reported_once_in_words(
    prepare: Callable[[Sender], object], said: str
) -> None:
    made = gates(1)
    prepare(Sender(made, 1))
    assert made.newly_overdue(TIMEOUT - 1) == ""
    assert not made.is_overdue(TIMEOUT - 1)
    assert made.newly_overdue(TIMEOUT) == said
    assert made.newly_overdue(2 * TIMEOUT) == ""
    assert made.is_overdue(2 * TIMEOUT)


def test_a_gate_comes_again_until_it_is_answered_not_an_earlier_one() -> None:
    made = gates(1)
    assert [made.look(now) for now in (99, 100, 150, 199, 200)] == [False, True, False, False, True]
    one = Sender(made, 1)
    one.answer(0)
    assert not made.look(1000)  # it has been heard
    made.open(), made.close(0)
    one.answer(0, gate=0)
    assert made.state is State.ASKED


@pytest.mark.parametrize("again", [0, 1, 5])
def test_the_first_answer_of_a_publisher_holds(again: int) -> None:
    """Also where a controller takes the gate that comes again for another one."""
    made = gates(1, 2)
    one, two = Sender(made, 1), Sender(made, 2)
    one.send()
    one.answer(1)
    one.answer(again)
    two.answer(0)
    assert made.is_complete


# --- restarts -------------------------------------------------------------------------------------
def test_a_controller_killed_before_its_answer_leaves_no_input() -> None:
    """One that was killed and started again gives what it would have given."""
    for killed_after, resent in itertools.product((0, 1, 2), (0, 1, 2)):
        made = gates(1)
        first = Sender(made, 1, name="old")
        for _ in range(3):
            first.send()
            first.answer(1)
            made.open()
            made.close(0)
        for _ in range(killed_after):
            first.send()
        second = Sender(made, 1, name="new")
        for _ in range(resent):
            second.send()
        assert second.answer(resent) == [b"old"] * killed_after
        assert made.is_complete
        assert [one.data for one in made.open()] == [b"new"] * resent


def test_a_controller_killed_after_its_answer_is_replaced_with_it() -> None:
    made = gates(1, 2)
    first, other = Sender(made, 1, name="old"), Sender(made, 2, topic="b", name="other")
    first.send()
    first.answer(1)
    second = Sender(made, 1, name="new")
    second.send().send().answer(2)
    other.answer(0)
    made.drop_predecessors()
    assert made.is_complete
    assert [one.data for one in made.open()] == [b"new", b"new"]


def test_of_two_controllers_one_that_is_killed_leaves_the_inputs_of_the_other() -> None:
    made = gates(1, 2)
    first, other = Sender(made, 1, name="old"), Sender(made, 2, topic="b", name="other")
    first.answer(0), other.answer(0)
    made.open(), made.close(0)
    first.send(), other.send(), other.answer(1)
    second = Sender(made, 1, name="new")
    second.send()
    assert second.answer(1) == [b"old"]
    assert made.is_complete
    assert [one.data for one in made.open()] == [b"new", b"other"]


def test_where_it_is_in_doubt_whose_an_input_is_time_stands_and_the_surplus_is_named() -> None:
    made = gates(1, 2)
    first, other = Sender(made, 1, name="old"), Sender(made, 2, name="other")  # on one topic
    first.answer(0), other.answer(0)
    made.open(), made.close(0)
    other.send(), other.answer(1), first.send()
    second = Sender(made, 1, name="new")
    second.send()
    assert second.answer(1) == []
    assert made.state is State.SURPLUS
    assert "3 inputs have come, controllers 1 and 2 announced 2" in made.waiting
    made = gates(1)
    Sender(made, 0, topic="b").send()  # of nobody
    Sender(made, 1).answer(0)
    assert made.state is State.SURPLUS


def test_a_reset_ends_any_wait_for_inputs() -> None:
    """Those that have come are dropped, and still count for those who will announce them."""
    made = gates(1, 2)
    one, two = Sender(made, 1), Sender(made, 2)
    one.send(), one.answer(2), two.send()  # one input on its way, another not announced yet
    assert len(made.refuse_all()) == 2
    made.close(0)
    one.send()  # which was on its way
    one.answer(0), two.answer(1)
    assert made.is_complete
    assert len(made.open()) == 1


def test_a_gate_that_replaces_one_has_what_came_there() -> None:
    """A service has brought about a row: it is a gate of its own, for all controllers."""
    made = gates(1, 2)
    one, two = Sender(made, 1), Sender(made, 2)
    one.send(), one.answer(1)
    made.close(0, rows=1)
    one.send()
    one.answer(1), two.answer(0)
    assert made.is_complete
    assert len(made.open()) == 2


def test_an_answer_on_its_way_when_its_gate_is_replaced_counts_at_the_new_one() -> None:
    """A reset came before input and answer arrived: time stood until another reset."""
    made = gates(1, 2)
    one, two = Sender(made, 1), Sender(made, 2)
    two.answer(0)
    made.refuse_all(), made.close(0)
    one.send(), one.answer(1, gate=0)
    one.answer(1, gate=0), two.answer(0, gate=0)  # the gate had been published twice
    one.send(), one.answer(1), two.answer(0)
    assert made.is_complete
    assert len(made.open()) == 2
    made.close(0)
    one.answer(0), two.answer(0)
    assert made.is_complete, "what was announced at a replaced gate counts once"


# --- two that answer as one -----------------------------------------------------------------------
@pytest.mark.parametrize("begin", [0, 1, 30])
def test_two_publishers_that_answer_as_one_controller_are_named(begin: int) -> None:
    count = 2
    made = gates(1, publishers=lambda: count)
    first, second = Sender(made, 1), Sender(made, 1)
    for _ in range(begin):
        first.answer(0)
        made.open(), made.close(0)
    for _ in range(3):
        gate = made.number
        for one in (first, second):
            one.answer(0, gate)
            if made.is_complete:
                made.open(), made.close(0)
    assert made.state is State.DOUBLED
    assert made.waiting.endswith("two publishers answer as controller 1: end one of them")
    assert not made.look(1)
    count = 1  # one has left: the other one is asked again
    assert made.look(2)
    assert made.state.value == "asked"
    second.answer(0)
    assert made.is_complete


def test_a_controller_that_is_started_again_and_again_is_no_second_one() -> None:
    """Whatever the counts of those that have ended; they may stay in the graph for a while."""
    made = gates(1, 2, publishers=lambda: 9)
    rng = random.Random(5)
    senders = [Sender(made, 1), Sender(made, 2)]
    for _ in range(400):
        for k in range(2):
            if rng.random() < 0.2:
                senders[k] = Sender(made, k + 1)
            senders[k].answer(0)
        assert made.is_complete
        made.open(), made.close(0)


def test_an_answer_by_hand_is_no_second_controller() -> None:
    made = gates(1, publishers=lambda: 1)
    one = Sender(made, 1)
    for _ in range(3):
        one.answer(0)
        made.open(), made.close(0)
    Sender(made, 1).answer(0)  # it has left when the controller answers again
    made.open(), made.close(0)
    one.answer(0)
    assert made.is_complete


# --- the order of inputs --------------------------------------------------------------------------
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
        for held in made.open():
            held.act()
        assert done == [("a", 1, b"x"), ("a", 1, b"y"), ("a", 2, b"x"), ("b", 1, b"x")]


def test_a_restarted_controller_has_the_turn_that_it_would_have_had() -> None:
    """Publishers on one topic take turns, whatever their counts are."""
    found = []
    for begin, other in ((1, 1), (40, 40), (1, 40), (40, 1)):
        made = gates(1)
        for k in range(3):
            made.hold("a", begin + k, f"one {k}".encode(), nothing)
            made.hold("a", other + k, f"two {k}".encode(), nothing)
        found.append([one.data.decode() for one in made.open()])
    assert found == [["one 0", "two 0", "one 1", "two 1", "one 2", "two 2"]] * 4


@pytest.mark.parametrize("begin", [1, 4, 5, 6])
def test_one_input_of_each_controller_has_the_same_order_where_counts_meet(begin: int) -> None:
    """The count of one was that of the other and one more: then it came after it."""
    made = gates(1, 2)
    made.hold("a", 5, b"x", nothing)
    made.hold("a", begin, b"a", nothing)
    made.answer([1, 0, 1])
    made.answer([2, 0, 1])
    assert made.is_complete
    assert [one.data for one in made.open()] == [b"a", b"x"]


def test_without_numbers_of_the_middleware_the_order_is_that_of_arrival() -> None:
    made = gates(1)
    for data in (b"z", b"y", b"x"):
        made.hold("a", None, data, nothing)
    made.answer([1, 0, 3])
    assert made.is_complete
    assert [one.data for one in made.open()] == [b"z", b"y", b"x"]


# --- what is refused ------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("answer", "said"),
    [
        ([3, 0, 0], "lockstep_controllers"),
        ([1, 5, 0], "newest"),
        ([1, 0], "number of inputs"),
        ([1, 0, 2**64 - 1], f"at most {GATE_INPUTS}: {GATE_INPUTS} of all controllers at one gate"),
    ],
)
def test_a_wrong_answer_is_refused(answer: list[int], said: str) -> None:
    made = gates(1)
    refused(said, made.answer, answer, 1)
    assert made.state is State.ASKED
    both = gates(1, 2)
    both.answer([1, 0, 600], 1)
    with pytest.raises(InputError, match="at most 400"):  # what one gate keeps, of all together
        both.answer([2, 0, 401], 1)


def test_inputs_beyond_a_limit_are_refused_before_they_are_kept_and_counted() -> None:
    made = gates(1)
    for k in range(1, GATE_INPUTS + 1):
        made.hold("a", k, b"", nothing)
    refused(f"at most {GATE_INPUTS}", made.hold, "a", GATE_INPUTS + 1, b"", nothing)
    assert len(made.open()) == GATE_INPUTS
    made.close(0)
    refused("100001 bytes', allowed: at most 100000", made.hold, "a", 1, bytes(100_001), nothing)
    big = bytes(100_000)
    for k in range(GATE_BYTES // len(big)):
        made.hold("a", k, big, nothing)
    refused(f"at most {GATE_BYTES}", made.hold, "a", 1, b"x", nothing)
    made.answer([1, 1, GATE_BYTES // len(big) + 2], 1)
    assert made.is_complete
