"""Curves of special orbits in the plane of Γ and ε: folds, period doublings and grazes.

The equations of `orbit_equations` know no first root: a graze is two smooth equations more, the gap
and its derivative at the time of the touch (the virtual impact of R. Ghosh and D. Simpson, arXiv
2510.16218), where Newton's method on the return map fails on its square root. Points found are
certain to about 1e-12; on a curve they are no further apart than asked for.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from enum import StrEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.orbit_studies.arclength import (
    Point,
    continued,
    corrected,
    stepped,
    tangent_at,
)
from bouncing_disk_ros.orbit_studies.orbit_equations import (
    CurveKind,
    OrbitSystem,
    flip_coefficient,
    fold_coefficient,
)
from bouncing_disk_ros.scalar_search import root_between

Array = NDArray[np.float64]

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
    allowed = [system.is_motion(row) for row in rows]
    return Curve(
        system.kind or CurveKind.FOLD, n, system.cycles, rows[:, -2].copy(), rows[:, -1].copy(),
        rows[:, :n] % math.tau, np.array(allowed, bool), tuple(special),
    )  # fmt: skip


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
        times, touch, _, _ = self.system.split(point.unknowns)
        found = self.system.flights(point.unknowns)
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
            for (a, va), (b, vb) in itertools.pairwise(zip(points, values, strict=True)):
                place = self._located(function, a, va, b, vb) if va * vb < 0.0 else None
                if place is not None:
                    found.append(SpecialPoint(kind, *self.system.parameters(place.unknowns)))
        return found

    def _located(
        self, function: Callable[[Point], float], a: Point, va: float, b: Point, vb: float
    ) -> Point | None:
        """The point between two others where a function, of other signs there, is 0."""
        length = float(a.tangent @ (b.unknowns - a.unknowns))
        sign, missed = math.copysign(1.0, va), False

        def value(s: float) -> float:
            nonlocal missed
            point = stepped(self.system, a, s)
            missed = missed or point is None
            return math.nan if point is None else sign * function(point)

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
        found = self.system.clearances(point.unknowns)[:, 0]
        if self.system.touches:
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
