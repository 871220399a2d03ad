"""Gates of a lockstep: instants at which simulated time stands until its controllers have answered.

Each controller answers a gate by its number and how many inputs it has published there. A gate is
complete when all have answered and as many inputs have come; then the inputs are applied in an
order that does not depend on when they came. Knows neither ROS nor a clock.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from enum import StrEnum
from typing import NamedTuple

from bouncing_disk_ros.errors import InputError

FIELD = "~/proceed"


class Lockstep(StrEnum):
    """After what simulated time stands still."""

    OFF = "off"
    TICK = "tick"
    IMPACT = "impact"


class HeldInput(NamedTuple):
    """An input that waits for its gate to be complete."""

    topic: str
    number: int  # which its publisher gave it
    data: bytes
    act: Callable[[], object]


class Gates:
    """Counts gates, and keeps the answers and inputs of the one that is open."""

    def __init__(self, controllers: Iterable[int], timeout_ns: int) -> None:
        """The controllers' numbers; how long none of them may be silent, ns of wall time."""
        self.controllers, self.timeout_ns = frozenset(controllers), timeout_ns
        self.number = -1
        self.is_open = False
        self._opened_ns = 0
        self._answers: dict[int, int] = {}
        self._inputs: list[HeldInput] = []
        self._is_reported = False

    def open(self, now_ns: int) -> int:
        """Open the next gate; its number. Inputs that have come between gates belong to it."""
        self.number += 1
        self.is_open, self._opened_ns, self._is_reported = True, now_ns, False
        self._answers = {}
        return self.number

    def answer(self, values: Iterable[int]) -> None:
        """An answer [controller, gate, inputs]; InputError for one that is none.

        One of an earlier gate, of a controller that has been started again, changes nothing.
        """
        given = list(values)
        if len(given) != 3:
            raise InputError(FIELD, given[:10], "controller, gate and number of inputs")
        controller, gate, inputs = given
        if controller not in self.controllers:
            allowed = "any of lockstep_controllers: " + ", ".join(
                map(str, sorted(self.controllers))
            )
            raise InputError(f"{FIELD} controller", controller, allowed)
        if gate > self.number:
            raise InputError(f"{FIELD} gate", gate, f"at most {self.number}, the newest")
        if gate == self.number and self.is_open:
            self._answers[controller] = inputs

    def hold(self, topic: str, number: int | None, data: bytes, act: Callable[[], object]) -> None:
        """Keep an input for the gate that is open, or the next one."""
        order = len(self._inputs) if number is None else number
        self._inputs.append(HeldInput(topic, order, data, act))

    @property
    def is_complete(self) -> bool:
        """Whether all controllers have answered and their inputs have come."""
        answers = self._answers
        return self.is_open and (
            answers.keys() >= self.controllers and len(self._inputs) >= sum(answers.values())
        )

    def close(self) -> list[HeldInput]:
        """Close the gate; its inputs in the order in which they are to act.

        By topic, then in the order of publication; several publishers on one topic take turns, by
        what they say.
        """
        self.is_open = False
        return self.drop()

    def drop(self) -> list[HeldInput]:
        """Take away the inputs, in order."""
        inputs, self._inputs = self._inputs, []
        return sorted(inputs, key=lambda one: one[:3])

    def go_on(self) -> None:
        """Close the gate if it is complete: for those who have one to go on with."""

    def silent(self, now_ns: int) -> list[int]:
        """Controllers that have said nothing for longer than allowed."""
        if not self.is_open or now_ns - self._opened_ns < self.timeout_ns:
            return []
        return sorted(self.controllers - self._answers.keys())

    def newly_silent(self, now_ns: int) -> list[int]:
        """The same, once for each gate."""
        found = [] if self._is_reported else self.silent(now_ns)
        self._is_reported |= bool(found)
        return found
