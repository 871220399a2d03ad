"""Offset trajectories: piecewise polynomials of degree up to 5, spliced in time.

An offset p(t) of the platform is added to the sinusoid of one joint: s = A sin τ + p, or
β = Φ sin(τ + θ) + q. Between two knots it is a line, a cubic or a quintic: whichever the knot at
its end states values for. What a knot does not state is 0. After the last knot its position is
held. All is immutable: a splice makes a new lane and leaves the old one.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from fractions import Fraction
from functools import lru_cache
from typing import Any, NamedTuple

_NEVER = 2**63 - 1  # layout.NEVER, which needs numba: tools without kernels read trajectories
_GIGA = 10**9
CONSTANT, LINE, CUBIC, QUINTIC = 0, 1, 3, 5
"""Degrees of a segment."""
DEGREES = (LINE, CUBIC, QUINTIC)
"""Degrees of the way to a knot."""


class OffsetState(NamedTuple):
    """Position, velocity and acceleration of an offset at one instant (m or rad, and per s)."""

    position: float = 0.0
    velocity: float = 0.0
    acceleration: float = 0.0


class Knot(NamedTuple):
    """A point of a trajectory: when, what is stated there, and the degree of the way to it."""

    at_ns: int
    state: OffsetState
    degree: int


class Extremes(NamedTuple):
    """Largest absolute position, velocity and acceleration of an offset, and jump of velocity."""

    position: float
    velocity: float
    acceleration: float
    jump: float


class Segment(NamedTuple):
    """One polynomial, from begin_ns to end_ns; a hold lasts until something replaces it."""

    begin_ns: int
    end_ns: int
    start: OffsetState
    end: OffsetState
    degree: int

    @property
    def duration(self) -> Fraction:
        """Seconds, exactly; 1 for a hold, which has no end."""
        if self.degree == CONSTANT:
            return Fraction(1)
        return Fraction(self.end_ns - self.begin_ns, _GIGA)

    @property
    def begin_velocity(self) -> float:
        """Velocity just after its begin."""
        if self.degree == LINE:
            return float(coefficients(self)[1] / self.duration)
        return 0.0 if self.degree == CONSTANT else self.start.velocity

    @property
    def end_velocity(self) -> float:
        """Velocity just before its end."""
        return self.begin_velocity if self.degree in (CONSTANT, LINE) else self.end.velocity

    def at(self, ns: int) -> OffsetState:
        """The state at an instant within it, rounded once; at its begin and end what is stated."""
        if ns <= self.begin_ns or self.degree == CONSTANT:
            return self.start
        if ns >= self.end_ns:
            return self.end
        x = Fraction(ns - self.begin_ns, self.end_ns - self.begin_ns)
        c, t = coefficients(self), self.duration
        position = _horner(c, x)
        velocity = _horner(derivative(c), x) / t
        acceleration = _horner(derivative(derivative(c)), x) / t**2
        return OffsetState(float(position), float(velocity), float(acceleration))

    def velocity_after(self, ns: int) -> float:
        """Velocity just after an instant within it, its begin included."""
        return self.at(ns).velocity if ns > self.begin_ns else self.begin_velocity

    def velocity_before(self, ns: int) -> float:
        """Velocity just before an instant within it."""
        if ns >= self.end_ns:
            return self.end_velocity
        return self.at(ns).velocity if ns > self.begin_ns else self.begin_velocity


Coefficients = tuple[Fraction, ...]


def _horner(c: Sequence[Fraction], x: Fraction) -> Fraction:
    total = Fraction(0)
    for coefficient in reversed(c):
        total = total * x + coefficient
    return total


def derivative(c: Sequence[Fraction]) -> Coefficients:
    """Coefficients of the derivative of a polynomial."""
    return tuple(k * coefficient for k, coefficient in enumerate(c))[1:]


def quintic_coefficients(rise: Any, v0: Any, v1: Any, a0: Any, a1: Any) -> tuple[Any, Any, Any]:
    """Coefficients 3 to 5 of a quintic over [0, 1]; fractions, or floats in kernels.

    By how much it rises, the velocities and half of the accelerations at both ends.
    """
    return (
        10 * rise - 6 * v0 - 4 * v1 - 3 * a0 + a1,
        -15 * rise + 8 * v0 + 7 * v1 + 3 * a0 - 2 * a1,
        6 * rise - 3 * v0 - 3 * v1 - a0 + a1,
    )


@lru_cache(maxsize=256)
def coefficients(segment: Segment) -> Coefficients:
    """The six coefficients of a segment over x = (t − begin)/duration in [0, 1], exactly."""
    t = segment.duration
    p0, v0, a0 = (Fraction(value) for value in segment.start)
    p1, v1, a1 = (Fraction(value) for value in segment.end)
    rise = p1 - p0
    zero = Fraction(0)
    if segment.degree == CONSTANT:
        return (p0, zero, zero, zero, zero, zero)
    if segment.degree == LINE:
        return (p0, rise, zero, zero, zero, zero)
    v0, v1 = v0 * t, v1 * t
    if segment.degree == CUBIC:
        return (p0, v0, 3 * rise - 2 * v0 - v1, v0 + v1 - 2 * rise, zero, zero)
    a0, a1 = a0 * t * t / 2, a1 * t * t / 2
    return (p0, v0, a0, *quintic_coefficients(rise, v0, v1, a0, a1))


_PASCAL = ((1,), (1, 1), (1, 2, 1), (1, 3, 3, 1), (1, 4, 6, 4, 1), (1, 5, 10, 10, 5, 1))


def highest(c: Sequence[Fraction]) -> float:
    """A bound from above of a polynomial on [0, 1]: the largest of its Bernstein coefficients."""
    most = _PASCAL[len(c) - 1]
    sums = (
        sum((Fraction(row[k], most[k]) * c[k] for k in range(len(row))), Fraction(0))
        for row in _PASCAL[: len(c)]
    )
    return float(max(sums))


# --- lanes ----------------------------------------------------------------------------------------
class Plan(NamedTuple):
    """One accepted trajectory of a joint: segments without a break, the last of them a hold."""

    segments: tuple[Segment, ...]

    @property
    def begin_ns(self) -> int:
        """When it takes over."""
        return self.segments[0].begin_ns

    def segment_at(self, ns: int) -> Segment:
        """The segment that begins at or holds an instant not before its begin."""
        i = bisect_right(self.segments, ns, key=lambda segment: segment.begin_ns)
        return self.segments[max(i - 1, 0)]


def hold(begin_ns: int, position: float) -> Segment:
    """A segment that holds a position."""
    state = OffsetState(position)
    return Segment(begin_ns, _NEVER, state, state, CONSTANT)


class Lane(NamedTuple):
    """The offset of one joint: the trajectory in force and those that take over after it."""

    plans: tuple[Plan, ...] = (Plan((hold(0, 0.0),)),)

    def _plan_at(self, ns: int) -> Plan:
        i = bisect_right(self.plans, ns, key=lambda plan: plan.begin_ns)
        return self.plans[max(i - 1, 0)]

    def segment_at(self, ns: int) -> Segment:
        """The segment in force just after an instant."""
        return self._plan_at(ns).segment_at(ns)

    def boundary_after(self, ns: int) -> int:
        """The next instant at which another segment begins; NEVER if there is none."""
        i = bisect_right(self.plans, ns, key=lambda plan: plan.begin_ns)
        takeover = self.plans[i].begin_ns if i < len(self.plans) else _NEVER
        return min(self.segment_at(ns).end_ns, takeover)

    def spliced(self, begin_ns: int, knots: Sequence[Knot]) -> Lane:
        """A lane that follows this one up to begin_ns, and then the knots (rising, later)."""
        kept = self._up_to(begin_ns)
        segments = []
        start, since = kept.state_before(begin_ns), begin_ns
        for knot in knots:
            segments.append(Segment(since, knot.at_ns, start, knot.state, knot.degree))
            start, since = knot.state, knot.at_ns
        segments.append(hold(since, start.position))
        return Lane((*kept.plans, Plan(tuple(segments))))

    def _up_to(self, begin_ns: int) -> Lane:
        """What leads up to a splice."""
        earlier = tuple(plan for plan in self.plans if plan.begin_ns < begin_ns)
        return Lane(earlier or self.plans[:1])

    def spliced_state(self, begin_ns: int) -> OffsetState:
        """The state from which a trajectory spliced at begin_ns would start."""
        return self._up_to(begin_ns).state_before(begin_ns)

    def state_before(self, ns: int) -> OffsetState:
        """The state at an instant of what leads up to it; a knot has what is stated there."""
        plan = self.plans[-1]
        segment = plan.segment_at(ns)
        if segment.begin_ns == ns and ns > plan.begin_ns:
            before = plan.segment_at(ns - 1)
            return before.end
        return segment.at(ns)

    def jump_at(self, ns: int) -> float:
        """By how much the velocity jumps at an instant."""
        before, after = self.segment_at(ns - 1), self.segment_at(ns)
        return 0.0 if before == after else after.begin_velocity - before.velocity_before(ns)

    def cancelled(self, now_ns: int) -> Lane:
        """A lane without the trajectories that have not begun."""
        return Lane(tuple(plan for plan in self.plans if plan.begin_ns <= now_ns))

    def since(self, now_ns: int) -> Lane:
        """The same lane without what is over."""
        first = max(bisect_right(self.plans, now_ns, key=lambda plan: plan.begin_ns) - 1, 0)
        return Lane(self.plans[first:]) if first else self

    def trimmed(self, now_ns: int) -> Lane:
        """The same lane with no more of the past than a splice at now_ns can need."""
        first, *others = self.since(now_ns).plans
        i = bisect_right(first.segments, now_ns, key=lambda segment: segment.begin_ns)
        return Lane((Plan(first.segments[max(i - 2, 0) :]), *others))


class Offset(NamedTuple):
    """The offsets of both joints."""

    axial: Lane = Lane()
    angular: Lane = Lane()

    @classmethod
    def at_rest(cls, begin_ns: int) -> Offset:
        """Offsets of 0 from an instant on."""
        lane = Lane((Plan((hold(begin_ns, 0.0),)),))
        return cls(lane, lane)

    def segments_at(self, ns: int) -> tuple[Segment, Segment]:
        """The segments in force just after an instant: axial, angular."""
        return self.axial.segment_at(ns), self.angular.segment_at(ns)

    @property
    def pieces(self) -> int:
        """How many segments there are, those of trajectories that take over later included."""
        return sum(len(plan.segments) for lane in self for plan in lane.plans)

    def boundary_after(self, ns: int) -> int:
        """The next instant at which a segment of either joint begins; NEVER if there is none."""
        return min(self.axial.boundary_after(ns), self.angular.boundary_after(ns))

    def spliced(
        self,
        begin_ns: int,
        now_ns: int,
        axial: Sequence[Knot] | None = None,
        angular: Sequence[Knot] | None = None,
    ) -> Offset:
        """Follow other knots from begin_ns on, at now_ns; see `Simulation.trajectory`."""
        return Offset(*(
            lane if knots is None else _spliced(lane, begin_ns, now_ns, knots)
            for lane, knots in zip(self, (axial, angular), strict=True)
        ))  # fmt: skip

    def takeovers_after(self, ns: int) -> list[int]:
        """The instants after one at which accepted trajectories take over, rising."""
        plans = (plan for lane in self for plan in lane.plans)
        return sorted({plan.begin_ns for plan in plans if plan.begin_ns > ns})

    def trimmed(self, now_ns: int) -> Offset:
        """The same with no more of the past than a splice at now_ns can need."""
        return Offset(self.axial.trimmed(now_ns), self.angular.trimmed(now_ns))

    def since(self, now_ns: int) -> Offset:
        """The same without what is over."""
        return Offset(self.axial.since(now_ns), self.angular.since(now_ns))


def _spliced(lane: Lane, begin_ns: int, now_ns: int, knots: Sequence[Knot]) -> Lane:
    if not knots:
        return lane.cancelled(now_ns)
    ahead = [knot for knot in knots if knot.at_ns > begin_ns]
    return lane.spliced(begin_ns, ahead) if ahead else lane
