"""Work that comes from outside in turns: so much at a time, the rest waits in order.

Between turns a node does what else it has to: ticks, services. Knows neither ROS nor a timer.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.limits import TURNS_BYTES

TURN_NS = 5_000_000
"""Processor time after which a turn ends; the piece of work that exceeds it is finished."""
PERIOD_NS = 2 * TURN_NS
"""Between the begins of turns while work waits: half of the time is left to everything else."""

Work = Callable[[], bool]


class WorkTurns:
    """Does work at once while it is little, else in turns; `wake` asks for the next turn."""

    def __init__(
        self,
        wake: Callable[[], object],
        clock: Callable[[], int] = time.monotonic_ns,
        spent: Callable[[], int] = time.thread_time_ns,
    ) -> None:
        self._wake, self._clock, self._spent = wake, clock, spent
        self._waiting: deque[tuple[str, int, Work]] = deque()
        self._bytes = 0
        self._debt, self._last = (
            0,
            clock(),
        )  # processor time that is not made up for, and since when

    @property
    def waiting(self) -> int:
        """Pieces of work that wait."""
        return len(self._waiting)

    def take(self, field: str, size: int, work: Work) -> bool:
        """Do a piece of work, or keep it (True). InputError where too much waits.

        `size` of what it keeps in memory, in bytes.
        """
        if not self._waiting and self._may_work():
            return self._do(work)
        if self._bytes + size > TURNS_BYTES:
            given = f"{size} bytes behind {self._bytes} that wait for their turn"
            raise InputError(field, given, f"at most {TURNS_BYTES} bytes", "Send less at a time.")
        self._waiting.append((field, size, work))
        self._bytes += size
        self._wake()
        return True

    def turn(self) -> bool:
        """Work for one turn; whether some still waits."""
        while self._waiting and self._may_work():
            _, size, work = self._waiting.popleft()
            self._bytes -= size
            self._do(work)
        return bool(self._waiting)

    def drop(self) -> list[str]:
        """Take away what waits; the field of each."""
        dropped = [field for field, _, _ in self._waiting]
        self._waiting.clear()
        self._bytes = 0
        return dropped

    def _may_work(self) -> bool:
        now = self._clock()
        self._debt = max(0, self._debt - (now - self._last))
        self._last = now
        return self._debt < TURN_NS

    def _do(self, work: Work) -> bool:
        begin = self._spent()
        try:
            return work()
        finally:
            self._debt += self._spent() - begin
            self._last = self._clock()  # only what passes between pieces makes up for them
