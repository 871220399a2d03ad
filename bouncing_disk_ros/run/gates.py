"""The protocol of a lockstep: gates at which simulated time stands until controllers have answered.

At a closed gate simulated time stands; once the gate is opened, time goes on. Each controller
answers a gate by its number and how many inputs it has published since its last answer. When all
have answered and exactly so many inputs have come, the gate is opened: the inputs are applied in an
order that does not depend on when they came. `State` lists what time can wait for;
docs/closed_loops.md has the same table with what ends each. Knows neither ROS nor a clock.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import NamedTuple

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.limits import COMMAND_BYTES, GATE_BYTES, GATE_INPUTS
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.run.time_map import nanoseconds
from bouncing_disk_ros.running_numbers import Publishers

FIELD = "~/proceed"


class Lockstep(StrEnum):
    """After what simulated time stands still."""

    OFF = "off"
    TICK = "tick"
    IMPACT = "impact"


class State(StrEnum):
    """What simulated time waits for."""

    MOVING = "moving"  # for nothing: no gate is closed
    ASKED = "asked"  # for the answers of controllers
    COUNTING = "counting"  # for inputs that were announced
    SURPLUS = "surplus"  # more inputs have come than were announced
    DOUBLED = "doubled"  # two publishers answer as one controller
    COMPLETE = "complete"  # for nothing more: the gate may be opened


class HeldInput(NamedTuple):
    """An input that waits for its gate to be complete."""

    topic: str
    number: int  # which its publisher gave it
    data: bytes
    act: Callable[[], object]
    is_first: bool = False  # of its publisher


@dataclass
class Controller:
    """Which publisher of ~/proceed speaks for a controller, and its answer to the closed gate."""

    publisher: int | None = None
    former: set[int] = field(default_factory=set)  # publishers that spoke for it before
    inputs: int | None = None  # that it has announced; None: it has not answered
    is_restarted: bool = False  # since the last gate was opened
    doubled: int = 0  # publishers when two of them answered by turns; 0: they did not
    answered: int = -1  # the newest gate with an answer that counts

    def hear(self, publisher: int) -> tuple[bool, bool]:
        """Take a publisher; whether it is another one than before, and spoke earlier."""
        before = self.publisher
        if publisher == before:
            return False, False
        spoke_before = publisher in self.former
        self.former.discard(publisher)
        if before is not None:
            self.former.add(before)
        self.publisher = publisher
        return before is not None, spoke_before

    def ask_again(self) -> None:
        """Forget who has spoken, and the answer."""
        self.publisher, self.inputs, self.doubled = None, None, 0
        self.former.clear()


class Gates:
    """Counts gates; keeps the answers and inputs of a closed one: meanwhile time stands."""

    def __init__(
        self,
        controllers: Iterable[int],
        timeout_ns: int,
        publishers: Callable[[], int] = int,
        announce: Callable[[int, int, int], object] = lambda *_: None,
        warn: Callable[[str], object] = lambda _: None,
    ) -> None:
        """The controllers' numbers; the wait that is not reported, ns of wall time.

        `publishers` counts those of ~/proceed. `announce` tells controllers the number of a gate,
        its simulated time (ns) and rows. `warn` is told what time waits for too long.
        """
        self.timeout_ns = timeout_ns
        self.number, self.rows, self._time_ns = -1, 0, 0
        self.is_closed = False
        self._first = 0  # of the gates since one was opened: the others were replaced
        self._publishers, self._announce, self._warn = publishers, announce, warn
        self._closed_ns = self._asked_ns = 0
        self._controllers = {number: Controller() for number in sorted(controllers)}
        self._announced_before = 0  # at gates that the closed one has replaced
        self._inputs: list[HeldInput] = []
        self._bytes = 0  # of them
        self._refused = 0  # inputs that have come and were refused
        self._senders: defaultdict[str, Publishers] = defaultdict(Publishers)  # by topic
        self._reported: set[State] = set()

    # --- the simulator closes and opens -----------------------------------------------------------
    def close(self, now_ns: int, rows: int = 0, time_ns: int = 0) -> int:
        """Close the next gate, at which so many rows have been published; its number.

        `time_ns` is the simulated time.

        It replaces one that is closed: what was announced and has come there counts here. Inputs
        that have come between gates belong to it.
        """
        if self.is_closed:
            self._announced_before = self._announced
        else:
            self._first = self.number + 1
        self.number, self.rows, self._time_ns = self.number + 1, rows, time_ns
        self.is_closed, self._closed_ns, self._asked_ns = True, now_ns, now_ns
        self._reported = set()
        for controller in self._controllers.values():
            controller.inputs = None
        self._announce(self.number, time_ns, rows)
        return self.number

    def watch(self, now_ns: int) -> None:
        """Announce the gate again where an answer is missing; warn once where time waits long."""
        if self.look(now_ns):
            self._announce(self.number, self._time_ns, self.rows)
        if words := self.newly_overdue(now_ns):
            wait = f"simulated time waits for longer than {self.timeout_ns / 1e9:g} s"
            self._warn(f"lockstep: {words}: {wait}")

    def set_timeout(self, values: Mapping[str, Value]) -> None:
        """Take over the parameter of the silence allowed."""
        self.timeout_ns = nanoseconds(float(values["lockstep_timeout"]))

    def open(self) -> list[HeldInput]:
        """Open the gate; its inputs in the order in which they are to act."""
        inputs = self.drop()
        self.is_closed = False
        for controller in self._controllers.values():
            controller.is_restarted = False
        self._announced_before = self._refused = 0
        return inputs

    def drop(self) -> list[HeldInput]:
        """Take away the inputs, in order.

        By topic, then in the order of publication; several publishers on one topic take turns, by
        what they say.
        """
        inputs, self._inputs, self._bytes = self._inputs, [], 0
        answers = [one.inputs for one in self._controllers.values() if one.inputs is not None]
        each_one = not self._announced_before and max(answers, default=2) == 1
        turns = {
            topic: {} if each_one else _turns(inputs, topic) for topic in {i.topic for i in inputs}
        }
        return sorted(
            inputs, key=lambda one: (one.topic, turns[one.topic].get(one.number, 0), one.data)
        )

    def refuse_all(self) -> list[HeldInput]:
        """Take away the inputs, which count as refused: those who sent them will announce them."""
        inputs = self.drop()
        self._refused += len(inputs)
        return inputs

    # --- controllers answer -----------------------------------------------------------------------
    def answer(self, values: Iterable[int], number: int | None = None) -> None:
        """An answer [controller, gate, inputs], `number` as its publisher counts.

        InputError for values that are no answer, or an answer that no gate will have. An answer to
        a gate that was opened changes nothing. An answer that was on its way when its gate was
        replaced counts at the new gate. Of several answers to one gate the first holds, unless
        another publisher sends the next: then the controller was started again.
        """
        given = list(values)
        if len(given) != 3:
            raise InputError(FIELD, given[:10], "controller, gate and number of inputs")
        name, gate, inputs = given
        controller = self._controllers.get(name)
        if controller is None:
            listed = ", ".join(map(str, self._controllers))
            raise InputError(f"{FIELD} controller", name, f"one in lockstep_controllers: {listed}")
        is_new = number is not None and self._is_new(controller, number)
        self._check(controller, gate, inputs)
        if gate < self._first or not self.is_closed:
            return
        controller.is_restarted |= is_new
        if gate < self.number:
            self._announced_before += inputs if gate > controller.answered else 0
        elif is_new or number is None or controller.inputs is None:
            controller.inputs = inputs
        controller.answered = max(gate, controller.answered)

    def _is_new(self, controller: Controller, number: int) -> bool:
        """Whether another publisher than before speaks for a controller; two by turns are noted."""
        likely = [one for one in (controller.publisher, *controller.former) if one is not None]
        is_new, spoke_before = controller.hear(self._senders[FIELD].take(number, likely)[0])
        if spoke_before:
            speakers = {one.publisher for one in self._controllers.values()} - {None}
            if self._publishers() > len(speakers):
                controller.doubled = controller.doubled or self._publishers()
        return is_new

    def _check(self, controller: Controller, gate: int, inputs: int) -> None:
        """InputError for an answer that can never come true."""
        if gate > self.number:
            raise InputError(f"{FIELD} gate", gate, f"at most {self.number}, the newest")
        here = self._announced - (controller.inputs or 0)
        most = GATE_INPUTS - (here if gate == self.number else self._announced_before)
        if inputs > most:
            allowed = f"at most {most}: {GATE_INPUTS} of all controllers at one gate"
            raise InputError(f"{FIELD} inputs", inputs, allowed)

    def hold(self, topic: str, number: int | None, data: bytes, act: Callable[[], object]) -> None:
        """Keep an input for the gate that is closed, or the next one.

        InputError for one beyond the limits, which is not kept, and counts as one that has come.
        """
        is_first = number is not None and self._senders[topic].take(number)[1]
        for given, most, unit in (
            (len(data), COMMAND_BYTES, "bytes"),
            (len(self._inputs) + 1, GATE_INPUTS, "inputs at one gate"),
            (self._bytes + len(data), GATE_BYTES, "bytes of inputs at one gate"),
        ):
            if given > most:
                self._refused += 1
                raise InputError(topic, f"{given} {unit}", f"at most {most}")
        self._bytes += len(data)
        order = len(self._inputs) if number is None else number
        self._inputs.append(HeldInput(topic, order, data, act, is_first))

    # --- what time waits for ----------------------------------------------------------------------
    @property
    def _announced(self) -> int:
        return self._announced_before + sum(one.inputs or 0 for one in self._controllers.values())

    @property
    def _come(self) -> int:
        return self._refused + len(self._inputs)

    @property
    def state(self) -> State:
        """What simulated time waits for."""
        if not self.is_closed:
            return State.MOVING
        if any(one.doubled for one in self._controllers.values()):
            return State.DOUBLED
        if any(one.inputs is None for one in self._controllers.values()):
            return State.ASKED
        if self._come != self._announced:
            return State.COUNTING if self._come < self._announced else State.SURPLUS
        return State.COMPLETE

    @property
    def is_complete(self) -> bool:
        """Whether all controllers have answered and their inputs have come."""
        return self.state is State.COMPLETE

    def drop_predecessors(self) -> list[HeldInput]:
        """Take away what a controller sent before it ended without an answer; nothing in doubt.

        Its successor's inputs came after them. Where other controllers have sent inputs too, those
        are meant that lie before the first of a new publisher on their topic, if they are as many.
        """
        restarted = [one for one in self._controllers.values() if one.is_restarted]
        if self.state is not State.SURPLUS or not restarted:
            return []
        surplus = self._come - self._announced
        if self._announced == sum(one.inputs or 0 for one in restarted):
            older = list(range(min(surplus, len(self._inputs))))
        else:
            firsts = {one.topic: k for k, one in enumerate(self._inputs) if one.is_first}
            older = [k for k, one in enumerate(self._inputs) if k < firsts.get(one.topic, 0)]
        if len(older) != surplus:
            return []
        dropped = [self._inputs[k] for k in older]
        self._inputs = [one for k, one in enumerate(self._inputs) if k not in set(older)]
        self._bytes -= sum(len(one.data) for one in dropped)
        return dropped

    def look(self, now_ns: int) -> bool:
        """Look around once in a while; whether the gate is to be published again.

        An answer may have been lost before its publisher was matched; of two that answered as one
        controller one may have left.
        """
        doubled = [one for one in self._controllers.values() if one.doubled]
        left = [one for one in doubled if self._publishers() < one.doubled]
        for controller in left:
            controller.ask_again()
        waited = now_ns - self._asked_ns >= self.timeout_ns
        if left or (waited and self.state is State.ASKED):
            self._asked_ns = now_ns
            return True
        return False

    def waited_ns(self, now_ns: int) -> int:
        """How long the gate has been closed, wall time."""
        return now_ns - self._closed_ns if self.is_closed else 0

    def is_overdue(self, now_ns: int) -> bool:
        """Whether time has waited for longer than is left unreported."""
        if self.waited_ns(now_ns) < self.timeout_ns:  # first: it is asked at every tick
            return False
        return self.state not in (State.MOVING, State.COMPLETE)

    def newly_overdue(self, now_ns: int) -> str:
        """The same in words: what it waits for, once for each state of a gate; else nothing."""
        if not self.is_overdue(now_ns) or self.state in self._reported:
            return ""
        self._reported.add(self.state)
        return self.waiting

    @property
    def waiting(self) -> str:
        """What simulated time waits for, in words; nothing while it moves."""
        come, announced, known = self._come, self._announced, self._controllers.items()
        senders = _controllers([name for name, one in known if one.inputs] or self._controllers)
        missing = _controllers(name for name, one in known if one.inputs is None)
        doubled = _controllers(name for name, one in known if one.doubled)
        words = {
            State.ASKED: f"no answer of {missing}",
            State.COUNTING: f"{come} of {announced} inputs of {senders} have come",
            State.SURPLUS: f"{come} inputs have come, {senders} announced {announced}; ~/reset "
            "drops them",
            State.DOUBLED: f"two publishers answer as {doubled}: end one of them",
        }.get(self.state)
        return f"gate {self.number}: {words}" if words else ""


def _controllers(numbers: Iterable[int]) -> str:
    listed = [*map(str, numbers)]
    if len(listed) < 2:
        return f"controller {''.join(listed)}"
    return f"controllers {', '.join(listed[:-1])} and {listed[-1]}"


def _turns(inputs: Iterable[HeldInput], topic: str) -> dict[int, int]:
    """The place of each number of a topic in the count of its publisher at this gate.

    Numbers of one publisher have no gap. So it does not matter where its count stands, and a
    controller that was started again has the turn that it would have had, unless the counts of two
    publishers meet.
    """
    turns: dict[int, int] = {}
    for number in sorted({one.number for one in inputs if one.topic == topic}):
        turns[number] = turns.get(number - 1, -1) + 1
    return turns
