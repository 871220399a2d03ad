"""The clocks of the simulator's node: ticks of the steady clock, and the ownership of /clock."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

from rclpy.clock import Clock
from rclpy.node import Node
from rclpy.timer import Timer

from bouncing_disk_ros.niceness import hand_on_the_lock
from bouncing_disk_ros.run.time_map import MARGIN_NS, TickPlan
from bouncing_disk_ros.units import NS

IGNORED_NS = 5_000
"""Error of a tick's phase that is left alone: reading two clocks takes some microseconds."""


class TickTimer:
    """Calls `tick` with the instant and its lateness, once in a period of `plan` while it runs.

    The timer keeps whatever phase its first call had, and that is late when the machine is busy. So
    each tick compares the timer's next call with the plan and sets the period after it.
    """

    def __init__(
        self,
        node: Node,
        clock: Clock,
        tick: Callable[[int, int], None],
        plan: Callable[[], TickPlan],
    ) -> None:
        """`tick(now, late)`: readings of `time.monotonic_ns`, ns."""
        self._node, self._clock, self._tick, self._plan = node, clock, tick, plan
        self._timer: Timer | None = None
        self._period_ns = self._due_ns = 0

    @property
    def running(self) -> bool:
        """Whether it ticks."""
        return self._timer is not None

    def start(self) -> None:
        """Tick from now on."""
        self.stop()
        hand_on_the_lock()
        plan, now = self._plan(), time.monotonic_ns()
        self._due_ns = plan.begin_before(now + plan.period_ns)
        first_ns = max(1, self._due_ns - now)
        self._timer = self._node.create_timer(first_ns / NS, self._on_call, clock=self._clock)
        self._set_period(plan.period_ns)  # from the first call on

    def stop(self) -> None:
        """Tick no more."""
        if self._timer is not None:
            self._node.destroy_timer(self._timer)
            self._timer = None

    def _set_period(self, period_ns: int) -> None:
        assert self._timer is not None
        self._timer.timer_period_ns = self._period_ns = period_ns

    def _on_call(self) -> None:
        now, due = time.monotonic_ns(), self._due_ns
        self._steer()
        self._tick(now, max(0, now - due))

    def _steer(self) -> None:
        """Note when the next tick should begin; set the period that follows it."""
        if self._timer is None:
            return
        before = time.monotonic_ns()
        left = self._timer.time_until_next_call()
        took = time.monotonic_ns() - before
        plan, next_ns = self._plan(), before + took // 2 + left
        self._due_ns = plan.begin_before(next_ns)
        period_ns = plan.period_after(next_ns)
        if took < MARGIN_NS and abs(period_ns - self._period_ns) > IGNORED_NS:
            self._set_period(period_ns)


# ------------------------------------------------------------------------------------------------
# Which of several publishers of /clock stops, decided by each of them from what it sees alone.


YOUNG_NS = 4 * NS
"""Discovery has been seen to take up to 3.1 s: publishers that were started together see each other
within this time."""
TURN_NS = 4 * NS
"""Longer than one of two may see the other before it is seen, and than it takes to see it leave."""


class ClockOwnership:
    """The ownership of /clock by one publisher. The older one of two stays.

    None knows how old another is. So each waits for the other to leave: one that is young not at
    all, or for a turn where its identity is the greater one; one that is old for two turns, or for
    good. No two wait equally long.
    """

    def __init__(self, own: bytes, now_ns: int) -> None:
        """`own`: the identity of the publisher in the graph."""
        self._own, self._begin_ns = own, now_ns
        self._seen_ns: int | None = None

    def is_lost(self, publishers: frozenset[bytes], now_ns: int) -> bool:
        """Whether to stop, with these publishers of the topic in the graph."""
        others = publishers - {self._own}
        if not others:
            self._seen_ns = None
            return False
        if self._seen_ns is None:
            self._seen_ns = now_ns
        is_greater = self._own > max(others)
        if self.is_silent:
            patience: float = TURN_NS if is_greater else 0
        else:
            patience = math.inf if is_greater else 2 * TURN_NS
        return now_ns - self._seen_ns >= patience

    def is_young(self, now_ns: int) -> bool:
        """Whether publishers that were started together may still be unseen."""
        return now_ns - self._begin_ns <= YOUNG_NS

    @property
    def is_shared(self) -> bool:
        """Whether another publisher was there at the last look."""
        return self._seen_ns is not None

    @property
    def is_silent(self) -> bool:
        """Whether to publish nothing: another one is there, and may have been before."""
        return self._seen_ns is not None and self._seen_ns - self._begin_ns <= YOUNG_NS
