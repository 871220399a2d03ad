"""Curves of periodic orbits in (Γ, ε), by smooth equations of their impact times.

In this order: the equations, the systems of branches and of curves, pseudo-arclength continuation,
and the curves of folds, period doublings and grazes.

Between two impacts the flight is fixed by their times alone, for the gap is 0 at both; so an orbit
of n impacts in k periods is n times with n equations, the impact law v⁺ = (1 + ε)ṡ − ε v⁻ at each.
Unlike the map these equations have no first root to search for: they stay smooth where a flight is
tangent to the platform and beyond, where the orbit is no motion of a disk any more. Whether it is
one is said by `admissible`. They are analytic: values with an imaginary part of `STEP` give exact
derivatives (complex step), and whole batches are computed at once.

Time is phase, lengths are in πg/ω², velocities in πg/ω (gravity is 1/π).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.axial_flights import clearance_of
from bouncing_disk_ros.maps.scalar_search import root_between

Array = NDArray[np.float64]
Values = NDArray[Any]  # float64 or complex128

STEP = 1e-30
"""Imaginary part that gives derivatives: no difference is taken, so none is rounded."""
GRAVITY = 1.0 / math.pi
TOUCHES = 1e-12
"""A gap (πg/ω²) above the negative of it counts as not negative."""


class Flights(NamedTuple):
    """What follows from impact times; all (…, n), flight i begins at impact i."""

    defect: Values  # of the impact law, velocity: 0 on an orbit
    duration: Values  # rad
    launch: Values  # absolute velocity after impact i
    before: Values  # w_A before impact i
    after: Values  # w_A before impact i + 1


def _next(values: Values) -> Values:
    """Of each impact (…, n) the value of the one after it, the first after the last."""
    return np.concatenate((values[..., 1:], values[..., :1]), axis=-1)


def flights(times: Values, cycles: int, axial_forcing: Values, restitution: Values) -> Flights:
    """The flights between impacts at `times` (…, n), rad; Γ and ε (…, 1)."""
    following = np.concatenate((times[..., 1:], times[..., :1] + math.tau * cycles), axis=-1)
    duration = following - times
    height, speed = axial_forcing * np.sin(times), axial_forcing * np.cos(times)
    launch = (_next(height) - height) / duration + 0.5 * GRAVITY * duration
    arrived = launch - GRAVITY * duration
    arrival = np.concatenate((arrived[..., -1:], arrived[..., :-1]), axis=-1)
    defect = launch - (1.0 + restitution) * speed + restitution * arrival
    before = arrival - speed
    return Flights(defect, duration, launch, before, _next(before))


def trace(
    found: Flights, times: Values, axial_forcing: Values, restitution: Values
) -> NDArray[Any]:
    """Trace (…) of the derivatives of (τ, w) over one repetition, by map_tangent's formulas."""
    sine, cosine = np.sin(times), np.cos(times)
    later, cosine1 = _next(sine), _next(cosine)
    w1, d = found.after, found.duration
    bend = axial_forcing * later - GRAVITY
    by_phase = axial_forcing * (cosine1 - cosine + d * sine) / w1
    by_speed = -d / w1
    a, b = 1.0 + by_phase, -restitution * by_speed
    c = axial_forcing * (later - sine) + bend * by_phase
    e = -restitution * (1.0 + bend * by_speed)
    p, q, r, s = a[..., 0], b[..., 0], c[..., 0], e[..., 0]
    for i in range(1, times.shape[-1]):
        p, r = a[..., i] * p + b[..., i] * r, c[..., i] * p + e[..., i] * r
        q, s = a[..., i] * q + b[..., i] * s, c[..., i] * q + e[..., i] * s
    return np.asarray(p + s)


def touching(
    found: Flights, times: Values, axial_forcing: Values, flight: int, touch: Values
) -> tuple[Values, Values]:
    """Gap and its derivative (…) at the time `touch` (…) of one flight: both are 0 at a graze."""
    since = touch - times[..., flight]
    forcing = axial_forcing[..., 0]
    launch, height = found.launch[..., flight], forcing * np.sin(times[..., flight])
    gap = height + launch * since - 0.5 * GRAVITY * since * since - forcing * np.sin(touch)
    return gap, launch - GRAVITY * since - forcing * np.cos(touch)


def clearances(times: Array, cycles: int, axial_forcing: float, restitution: float) -> Array:
    """Least minimum (n,) of the gap inside each flight; inf: it has none, < 0: not a flight."""
    found = flights(times, cycles, np.array([axial_forcing]), np.array([restitution]))
    return np.array([
        clearance_of(float(tau) % math.tau, float(w), float(d), axial_forcing, restitution)
        for tau, w, d in zip(times, found.before, found.duration, strict=True)
    ])  # fmt: skip


def admissible(times: Array, cycles: int, axial_forcing: float, restitution: float) -> bool:
    """Whether a solution is a motion of a disk: it hits from above, and no flight is cut short."""
    found = flights(times, cycles, np.array([axial_forcing]), np.array([restitution]))
    if np.any(found.duration <= 0.0) or np.any(found.before >= 0.0):
        return False
    return bool(np.all(clearances(times, cycles, axial_forcing, restitution) > -TOUCHES))


# ------------------------------------------------------------------------------------------------
# The systems of equations behind branches of orbits and their curves in (Γ, ε).
#
# Unknowns are the n impact times; for a graze the time at which a flight touches; then the
# parameters that are free. All derivatives are exact (complex step).


PARAMETERS = ("axial_forcing", "restitution")
_CIRCLE = 16
_RADIUS = 0.02


class CurveKind(StrEnum):
    """Where a periodic orbit changes."""

    FOLD = "fold"  # it meets another orbit of its kind, multiplier 1
    DOUBLING = "doubling"  # multiplier −1
    GRAZE = "graze"  # a flight becomes tangent to the platform
    CONTACT_ONSET = "contact onset"  # of an orbit with contact: a chatter that is just complete


@dataclass(frozen=True)
class OrbitSystem:
    """Equations of an orbit of `impacts` impacts in `cycles` periods, and of its special kinds."""

    impacts: int
    cycles: int
    kind: CurveKind | None = None  # None: any orbit
    flight: int = 0  # the one that touches, of a graze
    free: tuple[str, ...] = PARAMETERS
    fixed: tuple[float, float] = (math.nan, math.nan)  # Γ and ε where they are not free

    @property
    def touches(self) -> int:
        """How many of the unknowns are times of a touch."""
        return int(self.kind is CurveKind.GRAZE)

    def split(self, unknowns: Values) -> tuple[Values, Values, Values, Values]:
        """Times (…, n), time of the touch (…, 0 or 1), Γ and ε (…, 1) of unknowns (…, N)."""
        n, m = self.impacts, self.impacts + self.touches
        columns, place = [], m
        for name, value in zip(PARAMETERS, self.fixed, strict=True):
            if name in self.free:
                columns.append(unknowns[..., place : place + 1])
                place += 1
            else:
                columns.append(np.full_like(unknowns[..., :1], value))
        return unknowns[..., :n], unknowns[..., n:m], columns[0], columns[1]

    def parameters(self, unknowns: Array) -> tuple[float, float]:
        """Γ and ε."""
        _, _, forcing, restitution = self.split(unknowns)
        return float(forcing[0]), float(restitution[0])

    def values(self, unknowns: Values) -> Values:
        """Residuals (…, m) of unknowns (…, N), complex or not."""
        times, touch, forcing, restitution = self.split(unknowns)
        found = flights(times, self.cycles, forcing, restitution)
        extra: list[Values] = []
        if self.kind in (CurveKind.FOLD, CurveKind.DOUBLING):
            size, sign = self._trace(found, times, forcing, restitution)
            extra = [size - sign] if self.kind is CurveKind.FOLD else [size + sign]
        elif self.kind is CurveKind.GRAZE:
            extra = list(touching(found, times, forcing, self.flight, touch[..., 0]))
        return np.concatenate((found.defect, *(one[..., None] for one in extra)), axis=-1)

    def __call__(self, unknowns: Array) -> tuple[Array, Array]:
        """Residuals (m,) and their derivatives (m, N)."""
        batch = unknowns + 1j * STEP * np.eye(len(unknowns))
        found = self.values(batch)
        return found[0].real, np.ascontiguousarray((found.imag / STEP).T)

    def _trace(
        self, found: Flights, times: Values, forcing: Values, restitution: Values
    ) -> tuple[Values, Values]:
        """Trace, and 1 + ε²ⁿ: they are equal at a fold, opposite at a doubling."""
        size = trace(found, times, forcing, restitution)
        return size, 1.0 + restitution[..., 0] ** (2 * self.impacts)

    def multiplier_defects(self, unknowns: Array) -> tuple[float, float]:
        """1 + T + ε²ⁿ, which is 0 at a doubling, and 1 − T + ε²ⁿ, which is 0 at a fold."""
        times, _, forcing, restitution = self.split(unknowns)
        found = flights(times, self.cycles, forcing, restitution)
        size, sign = self._trace(found, times, forcing, restitution)
        return float(sign + size), float(sign - size)


def defect_of(times: Values, cycles: int, forcing: float, restitution: float) -> Values:
    """The equations of an orbit alone, at (…, n) times."""
    given = np.full_like(times[..., :1], forcing), np.full_like(times[..., :1], restitution)
    return flights(times, cycles, *given).defect


def fold_coefficient(
    times: Array, cycles: int, forcing: float, restitution: float, towards: Array
) -> float:
    """½ pᵀF″(q, q) at a fold, q and p the null vectors of F′: it is 0 at a cusp.

    q has the sense of `towards`.
    """

    def function(t: Values) -> Values:
        return defect_of(t, cycles, forcing, restitution)

    left, right = _null_vectors(function, times, towards)
    return float(left @ _taylor(function, times, right)[2])


def flip_coefficient(times: Array, cycles: int, forcing: float, restitution: float) -> float:
    """Cubic coefficient of the orbit of 2n impacts at a doubling of that of n; 0: generalised flip.

    p·[F‴(q, q, q)/6 + F″(q, h)] of F of the doubled orbit, with q, p the null vectors, which change
    sign from one repetition to the next, and h = −½ F′⁻¹F″(q, q), which does not. Where it changes
    sign the fold of 2n impacts begins on the curve. At most 0: the doubled orbit is stable.
    """

    def doubled(t: Values) -> Values:
        return defect_of(t, 2 * cycles, forcing, restitution)

    twice = np.concatenate((times, times + math.tau * cycles))
    left, right = _null_vectors(doubled, twice, np.arange(len(twice), dtype=float))
    along = _taylor(doubled, twice, right)
    bordered = _bordered(_jacobian(doubled, twice), left, right)
    shift = np.linalg.solve(bordered, np.append(-along[2], 0.0))[:-1]
    # F″(q, h) by polarisation: the quadratic terms along q ± h
    mixed = _taylor(doubled, twice, right + shift)[2] - _taylor(doubled, twice, right - shift)[2]
    return float(left @ (along[3] + 0.5 * mixed))


def _bordered(matrix: Array, left: Array, right: Array) -> Array:
    return np.block([[matrix, left[:, None]], [right[None, :], np.zeros((1, 1))]])


def _jacobian(function: Callable[[Values], Values], place: Array) -> Array:
    found = function(place + 1j * STEP * np.eye(len(place)))
    return np.ascontiguousarray((found.imag / STEP).T)


def _null_vectors(
    function: Callable[[Values], Values], place: Array, towards: Array
) -> tuple[Array, Array]:
    """Left and right null vector: the right one towards a direction, the left one to fit.

    The determinant of the bordered matrix is never 0, so its sign fixes that of the left one.
    """
    matrix = _jacobian(function, place)
    left, _, right = np.linalg.svd(matrix)
    p, q = left[:, -1], right[-1]
    q = q if q @ towards > 0.0 else -q
    p = p if np.linalg.det(_bordered(matrix, p, q)) < 0.0 else -p
    return np.asarray(p), np.asarray(q)


def _taylor(function: Callable[[Values], Values], place: Array, along: Array) -> Array:
    """Taylor coefficients (4, n) of a function along a direction, by Cauchy's integral."""
    angles = np.exp(2j * math.pi * np.arange(_CIRCLE) / _CIRCLE)
    found = function(place + _RADIUS * angles[:, None] * along)
    rows = np.fft.fft(found, axis=0)[:4].real / _CIRCLE
    return np.asarray(rows / _RADIUS ** np.arange(4)[:, None])


# ------------------------------------------------------------------------------------------------
# Pseudo-arclength continuation: a curve of solutions of n equations in n + 1 unknowns.
#
# Each step goes along the tangent and is corrected by Newton's method in the plane normal to it (H.
# B. Keller, 1977), so folds are passed like any other point. Steps are kept short where the
# direction turns.


System = Callable[[Array], tuple[Array, Array]]
"""Of the unknowns (n + 1,): values (n,) and derivatives (n, n + 1)."""

RESIDUAL = 1e-11
"""A solution has residuals below this where Newton's method gets no closer."""
_ITERATIONS = 12
_LARGEST_TURN = math.cos(0.25)  # rad, between the tangents of points in a row
_EASY = math.cos(0.08)


class Point(NamedTuple):
    """One solution and the unit tangent there."""

    unknowns: Array
    tangent: Array


def corrected(system: System, guess: Array, normal: Array, level: float) -> Array | None:
    """The solution near `guess` with normal·unknowns = level, by Newton's method; None: none."""
    unknowns, best, kept = guess.copy(), math.inf, guess
    for _ in range(_ITERATIONS):
        values, matrix = system(unknowns)
        values = np.append(values, normal @ unknowns - level)
        residual = float(np.max(np.abs(values)))
        if not math.isfinite(residual):
            return None
        if residual < best:
            best, kept = residual, unknowns
        elif best < RESIDUAL:
            break
        if residual < 1e-15:
            break
        try:
            step = np.linalg.solve(np.vstack((matrix, normal)), values)
        except np.linalg.LinAlgError:
            return None
        if not np.all(np.isfinite(step)):
            return None
        unknowns = unknowns - step * min(1.0, 0.5 / max(float(np.max(np.abs(step))), 1e-300))
    return kept if best < RESIDUAL else None


def tangent_at(system: System, unknowns: Array, towards: Array) -> Array:
    """The unit tangent of the curve of solutions, on the side of `towards`."""
    matrix = system(unknowns)[1]
    tangent = np.asarray(np.linalg.svd(matrix)[2][-1])
    return tangent if tangent @ towards >= 0.0 else -tangent


def stepped(system: System, point: Point, length: float) -> Point | None:
    """The point at `length` along the tangent of another; None where none is found near."""
    guess = point.unknowns + length * point.tangent
    found = corrected(system, guess, point.tangent, float(point.tangent @ guess))
    if found is None or np.linalg.norm(found - guess) > max(abs(length), 1e-9):
        return None
    return Point(found, tangent_at(system, found, point.tangent))


def continued(system: System, start: Point, largest: float, smallest: float) -> Iterator[Point]:
    """The points that follow `start`, not further apart than `largest`; ends where none is found.

    Steps below `smallest` are not taken.
    """
    point, length = start, 0.25 * largest
    while length >= smallest:
        found = stepped(system, point, length)
        turn = -1.0 if found is None else float(found.tangent @ point.tangent)
        if found is None or turn < _LARGEST_TURN:
            length *= 0.5
            continue
        yield found
        point = found
        if turn > _EASY:
            length = min(1.5 * length, largest)


# ------------------------------------------------------------------------------------------------
# Curves of special orbits in the plane of Γ and ε: folds, period doublings and grazes.
#
# The equations above know no first root: a graze is two smooth equations more, the gap and its
# derivative at the time of the touch (the virtual impact of R. Ghosh and D. Simpson, arXiv
# 2510.16218), where Newton's method on the return map fails on its square root. Points found are
# certain to about 1e-12; on a curve they are no further apart than asked for.


LARGEST_STEP, SMALLEST_STEP = 0.02, 1e-7
MOST_POINTS = 4000
"""Of one curve to one side."""
_VANISHED = 1e-5
"""A coefficient that changes its sign is 0 there, or it jumps: it must come below this."""
_SLOW = 1e-5
"""A curve ends where an impact is this weak (πg/ω), or a flight this short (rad)."""


class Window(NamedTuple):
    """Part of the plane that curves are followed in."""

    axial_forcing: tuple[float, float] = (0.3, 0.7)
    restitution: tuple[float, float] = (0.2, 0.8)

    def sides(self) -> Array:
        """Lower and upper ends, (2, 2): rows Γ, ε."""
        return np.array([self.axial_forcing, self.restitution], float)

    def checked(self) -> Window:
        """The window, if it is one. Raises InputError."""
        low, high = float(self.axial_forcing[0]), float(self.axial_forcing[1])
        if not 0.0 <= low < high < math.inf:
            raise InputError("window", self.axial_forcing, "two forcings, 0 <= first < second")
        low, high = float(self.restitution[0]), float(self.restitution[1])
        if not 0.0 <= low < high <= 1.0:
            raise InputError("window", self.restitution, "two restitutions, 0 <= first < second")
        return self


class SpecialKind(StrEnum):
    """Points on a curve where something else happens too."""

    CUSP = "cusp"  # two folds meet
    GENERALISED_FLIP = "generalised flip"  # the fold of 2n impacts touches the doubling of n
    GRAZE_AND_DOUBLING = "graze meets doubling"
    GRAZE_AND_FOLD = "graze meets fold"
    SECOND_GRAZE = "two grazes"  # another flight touches as well


class SpecialPoint(NamedTuple):
    """One of them."""

    kind: SpecialKind
    axial_forcing: float
    restitution: float


class Curve(NamedTuple):
    """A curve in the plane of Γ and ε; arrays (m,) along it."""

    kind: CurveKind
    impacts: int  # of the orbit in one repetition
    cycles: int  # periods of the platform in one repetition
    axial_forcing: Array
    restitution: Array
    forcing_phase: Array  # (m, impacts) τ of the orbit at each point, rad
    admissible: NDArray[np.bool_]  # whether the orbit is a motion of a disk, or is cut short
    special: tuple[SpecialPoint, ...]

    def __repr__(self) -> str:
        """What it is of, how long, what is on it."""
        about = f"{self.kind} of {self.impacts} impact(s) in {self.cycles} cycle(s)"
        return f"<curve {about}: {len(self.axial_forcing)} points, {len(self.special)} special>"


def traced_curve(
    system: OrbitSystem, unknowns: Array, window: Window, largest: float = LARGEST_STEP
) -> Curve:
    """The curve through one solution of a system with both parameters free, to both sides.

    It ends at the sides of the window, where an impact of the orbit vanishes, or where it closes.
    """
    towards = np.zeros(len(unknowns))
    towards[-2] = 1.0
    start = Point(unknowns, tangent_at(system, unknowns, towards))
    tracer = _Tracer(system, window.checked(), largest)
    forward, closed = tracer.followed(start)
    points = [start, *forward]
    if not closed:
        back, _ = tracer.followed(Point(start.unknowns, -start.tangent))
        points = [Point(p.unknowns, -p.tangent) for p in reversed(back)] + points
    special = tracer.special_points(points)
    rows = np.array([p.unknowns for p in points])
    n = system.impacts
    allowed = [_admissible(system, row) for row in rows]
    return Curve(
        system.kind or CurveKind.FOLD, n, system.cycles, rows[:, -2].copy(), rows[:, -1].copy(),
        rows[:, :n] % math.tau, np.array(allowed, bool), tuple(special),
    )  # fmt: skip


def _admissible(system: OrbitSystem, unknowns: Array) -> bool:
    times, _, forcing, restitution = system.split(unknowns)
    return admissible(times, system.cycles, float(forcing[0]), float(restitution[0]))


class _Tracer:
    """Follows one curve and finds what is on it."""

    def __init__(self, system: OrbitSystem, window: Window, largest: float) -> None:
        self.system, self.window, self.largest = system, window, largest
        self.sides = window.sides()

    def followed(self, start: Point) -> tuple[list[Point], bool]:
        """The points after `start` to where the curve ends; whether it closed."""
        found: list[Point] = []
        smallest = min(SMALLEST_STEP, 0.1 * self.largest)
        for point in continued(self.system, start, self.largest, smallest):
            if self._broken(point):
                return found, False
            if self._outside(point):
                end = self._at_side(found[-1] if found else start, point)
                return [*found, end] if end is not None else found, False
            found.append(point)
            if len(found) > 8 and self._closes(start, point, found[-2]):
                return [*found, start], True
            if len(found) >= MOST_POINTS:
                break
        return found, False

    def _broken(self, point: Point) -> bool:
        """Whether an impact has vanished: the orbit is one of fewer impacts from there on."""
        times, touch, forcing, restitution = self.system.split(point.unknowns)
        found = flights(times, self.system.cycles, forcing, restitution)
        if np.any(found.duration < _SLOW) or np.any(found.before > -_SLOW):
            return True
        if len(touch):
            since = float(touch[0] - times[self.system.flight])
            return not _SLOW < since < float(found.duration[self.system.flight]) - _SLOW
        return False

    def _outside(self, point: Point) -> bool:
        place = point.unknowns[-2:]
        return bool(np.any(place < self.sides[:, 0]) or np.any(place > self.sides[:, 1]))

    def _at_side(self, before: Point, after: Point) -> Point | None:
        """Where the curve meets the side of the window between two of its points."""
        a, b = before.unknowns, after.unknowns
        first, reached = 1.0, None
        for k in (0, 1):
            for side in self.sides[k]:
                way = b[k - 2] - a[k - 2]
                part = (side - a[k - 2]) / way if way != 0.0 else -1.0
                crosses = (a[k - 2] - side) * (b[k - 2] - side) < 0.0
                if crosses and 0.0 < part <= first:
                    first, reached = part, (k, float(side))
        if reached is None:
            return None
        normal = np.zeros(len(a))
        normal[reached[0] - 2] = 1.0
        found = corrected(self.system, a + first * (b - a), normal, reached[1])
        return None if found is None else Point(found, after.tangent)

    def _closes(self, start: Point, point: Point, before: Point) -> bool:
        """Whether the curve has come back to its start, perhaps a whole period later."""
        n = self.system.impacts + self.system.touches
        way = start.unknowns - before.unknowns
        turns = math.tau * round(float(way[0]) / math.tau)
        way = way - np.append(np.full(n, turns), np.zeros(2))
        step = float(np.linalg.norm(point.unknowns - before.unknowns))
        along = float(way @ before.tangent)
        return 0.0 < along <= step and float(np.linalg.norm(way)) < 1.1 * step

    def special_points(self, points: list[Point]) -> list[SpecialPoint]:
        """Where a test function changes its sign along the curve: looked at LARGEST_STEP apart."""
        found: list[SpecialPoint] = []
        apart = max(1, int(LARGEST_STEP / self.largest))
        points = [*points[:-1:apart], points[-1]]
        for kind, function in self._tests().items():
            values = [function(p) for p in points]
            for a, va, vb in zip(points, values, values[1:], strict=False):
                if not va * vb < 0.0:
                    continue
                if (place := self._located(a, points, function, va, vb)) is not None:
                    found.append(SpecialPoint(kind, *self.system.parameters(place.unknowns)))
        return found

    def _located(
        self, a: Point, points: list[Point], function: Callable[[Point], float],
        va: float, vb: float,
    ) -> Point | None:  # fmt: skip
        """The point between `a` and the next one where a function is 0."""
        b = next(after for before, after in itertools.pairwise(points) if before is a)
        length = float(a.tangent @ (b.unknowns - a.unknowns))
        missed = False

        def value(s: float) -> float:
            nonlocal missed
            point = stepped(self.system, a, s)
            missed = missed or point is None
            return math.nan if point is None else math.copysign(1.0, va) * function(point)

        sign = math.copysign(1.0, va)
        va, vb = max(min(va, 1e3), -1e3), max(min(vb, 1e3), -1e3)
        root = root_between(value, 0.0, sign * va, length, sign * vb)
        point = stepped(self.system, a, root)
        if missed or point is None or not abs(function(point)) < _VANISHED:
            return None
        return point

    def _tests(self) -> dict[SpecialKind, Callable[[Point], float]]:
        kind = self.system.kind
        if kind is CurveKind.FOLD:
            return {SpecialKind.CUSP: self._cusp, SpecialKind.GRAZE_AND_FOLD: self._clearance}
        if kind is CurveKind.DOUBLING:
            return {
                SpecialKind.GENERALISED_FLIP: self._flip,
                SpecialKind.GRAZE_AND_DOUBLING: self._clearance,
            }
        return {
            SpecialKind.GRAZE_AND_DOUBLING: lambda p: self._defects(p)[0],
            SpecialKind.GRAZE_AND_FOLD: lambda p: self._defects(p)[1],
            SpecialKind.SECOND_GRAZE: self._clearance,
        }

    def _defects(self, point: Point) -> tuple[float, float]:
        return self.system.multiplier_defects(point.unknowns)

    def _clearance(self, point: Point) -> float:
        """Least gap within a flight; of a graze, within the flights that do not touch."""
        times, touch, forcing, restitution = self.system.split(point.unknowns)
        found = clearances(times, self.system.cycles, float(forcing[0]), float(restitution[0]))
        if len(touch):
            found[self.system.flight] = math.inf
        return float(np.min(found))

    def _cusp(self, point: Point) -> float:
        times = self.system.split(point.unknowns)[0]
        place = self.system.parameters(point.unknowns)
        towards = point.tangent[: self.system.impacts]
        return fold_coefficient(times, self.system.cycles, *place, towards)

    def _flip(self, point: Point) -> float:
        times = self.system.split(point.unknowns)[0]
        return flip_coefficient(times, self.system.cycles, *self.system.parameters(point.unknowns))
