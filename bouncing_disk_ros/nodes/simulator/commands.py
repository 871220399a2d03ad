"""The topics that command a simulator's node."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Protocol

from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.limits import INPUTS_AHEAD
from bouncing_disk_ros.ros.command_bytes import (
    impulse_from_bytes,
    programme_from_bytes,
    trajectory_from_bytes,
    value_from_bytes,
)
from bouncing_disk_ros.ros.numbered_subscription import NumberedSubscription
from bouncing_disk_ros.run.apply_request import Request, apply_request
from bouncing_disk_ros.run.command_validation import Instant
from bouncing_disk_ros.run.session import Session
from bouncing_disk_ros.run.work_turns import PERIOD_NS, WorkTurns
from bouncing_disk_ros.topics import MOTION_NAMES, TOPICS, Topic
from bouncing_disk_ros.units import NS


class CommandNode(Protocol):
    """What commands need of the simulator's node."""

    def arrival(self, field: str) -> tuple[Session, Instant]:
        """The session that accepts inputs now, and the instant of arrival; else InputError."""

    def hold(self, topic: str, number: int | None, data: bytes, act: Callable[[], object]) -> bool:
        """Keep an input for a gate of a lockstep; False: it is to act at once."""

    def publish_consequences(self) -> None:
        """Publish what an accepted input has brought about."""

    def refuse(self, error: InputError) -> None:
        """Count and log a refused input."""

    def log_accepted(self, field: str, line: str, remark: str = "") -> None:
        """Log an accepted input; a remark makes it a warning."""


class Commands:
    """Subscribes to the command topics, validates what arrives and gives it to the session.

    It subscribes from the start, so that an inactive node can say why it refuses. The session is
    asked only when everything else about a command is right.
    """

    def __init__(self, node: Node, target: CommandNode, *, keep_all: bool = False) -> None:
        """Subscribe as `node`; `target` is the same node, or stands for it in tests.

        `keep_all`: see the method.
        """
        self._node, self._target, self._keeps_all = node, target, keep_all
        self.subscriptions: dict[str, NumberedSubscription] = {}
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._turn = node.create_timer(PERIOD_NS / NS, self._on_turn, clock=steady)
        self._turn.cancel()
        self.turns = WorkTurns(self._wake)
        self._subscribe("platform/command", programme_from_bytes)
        self._subscribe("platform/joint_trajectory", trajectory_from_bytes)
        self._subscribe("disk/impulse", impulse_from_bytes)
        for name in MOTION_NAMES:
            self._subscribe(f"platform/{name}", partial(value_from_bytes, name))

    def _subscribe(self, topic: str, parse: Callable[[str, bytes], Request]) -> None:
        def take(data: bytes) -> bool:
            number = self.subscriptions[topic].number
            if self._target.hold(topic, number, data, lambda: act(data)):
                return True
            return self._in_turn(topic, data, lambda: act(data))

        def act(data: bytes) -> bool:
            try:
                request = parse(topic, data)
            except InputError as error:
                self._target.refuse(error)
                return False
            return self.accept(request)

        row = self._row(topic)
        self.subscriptions[topic] = NumberedSubscription(self._node, row, take)

    def _row(self, topic: str) -> Topic:
        row = TOPICS[topic]
        return replace(row, qos=replace(row.qos, depth=0)) if self._keeps_all else row

    def keep_all(self, keep: bool) -> None:
        """Lose no message of a burst (in lockstep, where each one is waited for), or go on."""
        self._keeps_all = keep
        for name, subscription in self.subscriptions.items():
            subscription.set_qos(self._row(name).qos)

    def _in_turn(self, topic: str, data: bytes, act: Callable[[], bool]) -> bool:
        try:
            return self.turns.take(topic, len(data), act)
        except InputError as error:
            self._target.refuse(error)
            return False

    def _wake(self) -> None:
        if self._turn.is_canceled():
            self._turn.reset()

    def _on_turn(self) -> None:
        if not self.turns.turn():
            self._turn.cancel()

    def drop_waiting(self) -> None:
        """Refuse what waits for its turn: a reset came after it."""
        for field in self.turns.drop():
            self._target.refuse(InputError(field, "an input before the reset", "inputs after it"))

    def accept(self, request: Request) -> bool:
        """Validate a request and apply it; False when it is refused."""
        try:
            line, remark = apply_request(request, lambda: self._arrival(request.field))
        except InputError as error:
            self._target.refuse(error)
            return False
        self._target.log_accepted(request.field, line, remark)
        self._target.publish_consequences()
        return True

    def _arrival(self, field: str) -> tuple[Session, Instant]:
        """The session and the instant, unless too many inputs have not acted yet."""
        session, instant = self._target.arrival(field)
        ahead = max(session.waiting, session.simulation.queued_impulses)
        if ahead >= INPUTS_AHEAD:
            given = f"a command behind {ahead} that have not acted yet"
            raise InputError(field, given, f"at most {INPUTS_AHEAD} of them", "Wait, or reset.")
        return session, instant

    # --- what did not arrive ----------------------------------------------------------------------
    def recount_publishers(self) -> None:
        """Count publishers again where several of them made the count of losses uncertain."""
        for subscription in self.subscriptions.values():
            subscription.lost.look()

    @property
    def lost(self) -> tuple[int, list[str]]:
        """Messages lost on the way, and the topics of which there may be more."""
        uncertain = [one.topic for one in self.subscriptions.values() if one.lost.why_not]
        return sum(one.lost.lost for one in self.subscriptions.values()), uncertain
