"""Maps between the steady clock, simulated time and ROS time (all whole nanoseconds)."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple

from bouncing_disk_ros.units import NS

FAR_NS = 4 * 10**18
"""No instant of simulated time lies beyond this (126 years): it fits 64 bits with room to spare."""


@functools.lru_cache(maxsize=256)
def nanoseconds(seconds: float) -> int:
    """Whole nanoseconds nearest to a time in seconds."""
    return round(Fraction(seconds) * NS)


@dataclass(frozen=True)
class TimeMap:
    """A straight line through one anchor: where simulated time stands for a clock reading.

    `factor` is the real-time factor (0: free running, nothing is ever due). With
    `clock_is_simulated` ROS time is the published /clock and runs with simulated time.
    """

    simulated_ns: int
    steady_ns: int
    ros_ns: int
    factor: float
    clock_is_simulated: bool = False

    @property
    def slope(self) -> float:
        """Simulated time passed per ROS time."""
        return 1.0 if self.clock_is_simulated or self.factor == 0.0 else self.factor

    def due(self, steady_ns: int) -> int:
        """Simulated time that should be reached at a reading of the steady clock."""
        return min(self.simulated_ns + scaled(steady_ns - self.steady_ns, self.factor), FAR_NS)

    def to_steady(self, simulated_ns: int) -> int:
        """Reading of the steady clock at which an instant of simulated time is due."""
        return self.steady_ns + scaled(simulated_ns - self.simulated_ns, 1.0 / self.factor)

    def to_ros(self, simulated_ns: int) -> int:
        """ROS time at which an instant of simulated time is due."""
        return self.ros_ns + scaled(simulated_ns - self.simulated_ns, 1.0 / self.slope)

    def to_simulated(self, ros_ns: int) -> int:
        """The instant of simulated time due at a ROS time."""
        return self.simulated_ns + scaled(ros_ns - self.ros_ns, self.slope)


SIMULATED = TimeMap(0, 0, 0, 1.0)
"""The line of stamps that are simulated time."""


def scaled(interval_ns: int, factor: float) -> int:
    """An interval times a factor, exact where the factor is 1."""
    return interval_ns if factor == 1.0 else round(interval_ns * factor)


def tick_period(sample_period_ns: float, fastest_ns: int, slowest_ns: int) -> int:
    """A period of ticks between two bounds, of which samples come every n or of n-th samples.

    So ticks that fall on one sample fall on all (of those that a tick may hand over alone).
    """
    if sample_period_ns > slowest_ns:
        return round(sample_period_ns / math.ceil(sample_period_ns / slowest_ns))
    if sample_period_ns < fastest_ns:
        return round(sample_period_ns * math.ceil(fastest_ns / sample_period_ns))
    return round(sample_period_ns)


MARGIN_NS = 50_000
"""How long after a sample is due its tick begins: a tick that came before it would leave it to the
next one. Clocks of different kinds drift apart by some ten microseconds in a second."""


class TickPlan(NamedTuple):
    """When ticks should begin: MARGIN_NS after `due_ns` and after instants whole steps away.

    Half a step after them where steps are that short.

    Readings of the steady clock, ns. `due_ns` None: nothing is due, any instant will do.
    """

    period_ns: int
    step_ns: float = 1.0
    due_ns: int | None = None

    def begin_before(self, at_ns: int) -> int:
        """The latest instant up to `at_ns` at which a tick should begin.

        A tick that is early by less than the margin still comes after the sample: it counts as one
        that begins with it.
        """
        if self.due_ns is None:
            return at_ns
        return self._begin(math.floor((at_ns - self.due_ns) / self.step_ns))

    def period_after(self, next_ns: int) -> int:
        """The period after a tick at `next_ns`, so that the tick after that one is in phase."""
        if self.due_ns is None:
            return self.period_ns
        late = next_ns - self._begin(0)
        count = math.ceil((late + self.period_ns) / self.step_ns - 0.5)
        return self._begin(count) - next_ns

    def _begin(self, count: int) -> int:
        assert self.due_ns is not None
        return self.due_ns + round(min(MARGIN_NS, self.step_ns / 2) + count * self.step_ns)


class Grid:
    """The instants round(k / rate) of simulated time, k = 1, 2, ..., without drift."""

    def __init__(self, rate: float, after_ns: int) -> None:
        """The grid of a rate in Hz; `next_ns` is its first instant later than `after_ns`."""
        self._period = Fraction(NS) / Fraction(rate)
        self.rate = rate
        self.skip_to(after_ns)

    def skip_to(self, after_ns: int) -> int:
        """Move on to the first instant later than `after_ns`; how many were passed over."""
        before = getattr(self, "_k", 0)
        self._k = int(after_ns // self._period)
        while self._instant(self._k) <= after_ns:
            self._k += 1
        self.next_ns = self._instant(self._k)
        return max(0, self._k - before)

    def skip_past(self, now_ns: int) -> int:
        """Skip what lies at or before an instant, if anything does; how many instants."""
        return self.skip_to(now_ns) if self.next_ns <= now_ns else 0

    def advance(self) -> None:
        """Move on by one instant."""
        self._k += 1
        self.next_ns = self._instant(self._k)

    def _instant(self, index: int) -> int:
        return round(index * self._period)
