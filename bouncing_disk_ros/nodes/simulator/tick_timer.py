"""The timer of the loop: periodic ticks of the steady clock, just after samples are due."""

from __future__ import annotations

import time
from collections.abc import Callable

from rclpy.clock import Clock
from rclpy.node import Node
from rclpy.timer import Timer

from bouncing_disk_ros.units import NS

MARGIN_NS = 50_000
"""How long after a sample is due its tick begins: a tick that came before it would leave it to the
next one. Clocks of different kinds drift apart by some ten microseconds in a second."""
EARLIEST_NS, LATEST = 10_000, 0.2
"""Bounds of what becomes of that margin, in ns and in periods, before the ticks are set anew."""


class TickTimer:
    """Calls `tick` once in a period while it runs."""

    def __init__(self, node: Node, clock: Clock, tick: Callable[[], None]) -> None:
        self._node, self._clock, self._tick = node, clock, tick
        self._timer: Timer | None = None
        self._period_ns = 0

    @property
    def running(self) -> bool:
        """Whether it ticks."""
        return self._timer is not None

    def start(self, period_ns: int, due_ns: int | None = None) -> None:
        """Tick from now on; with `due_ns` just after that instant (and others whole periods away).

        `due_ns` is a reading of `time.monotonic_ns`.
        """
        self.stop()
        first_ns = self._period_ns = period_ns
        if due_ns is not None:
            first_ns = (due_ns + MARGIN_NS - time.monotonic_ns()) % period_ns or period_ns
        self._timer = self._node.create_timer(first_ns / NS, self._tick, clock=self._clock)
        self._timer.timer_period_ns = period_ns  # from the first tick on

    def stop(self) -> None:
        """Tick no more."""
        if self._timer is not None:
            self._node.destroy_timer(self._timer)
            self._timer = None

    def comes_after(self, due_ns: int) -> bool:
        """Whether ticks come shortly after an instant (and others whole periods away)."""
        assert self._timer is not None
        next_ns = time.monotonic_ns() + self._timer.time_until_next_call()
        margin = (next_ns - due_ns) % self._period_ns
        return EARLIEST_NS <= margin <= max(LATEST * self._period_ns, 4 * MARGIN_NS)
