"""A branch: one periodic orbit along Γ or ε, through folds, with what happens on the way."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.periodic_orbit import PeriodicOrbit, followed
from bouncing_disk_ros.orbit_studies.arclength import Point, continued, corrected, tangent_at
from bouncing_disk_ros.orbit_studies.orbit_curves import (
    LARGEST_STEP,
    Array,
    Curve,
    Window,
    traced_curve,
)
from bouncing_disk_ros.orbit_studies.orbit_equations import (
    PARAMETERS,
    CurveKind,
    OrbitSystem,
)

_STEP, _SMALLEST, _MOST = 0.01, 1e-7, 3000
KINDS = (CurveKind.FOLD, CurveKind.DOUBLING, CurveKind.GRAZE)


class Start(NamedTuple):
    """A solution that a curve goes through."""

    system: OrbitSystem
    unknowns: Array


def orbit_curve(
    orbit: PeriodicOrbit,
    kind: CurveKind | str,
    window: Window | None = None,
    *,
    largest_step: float = LARGEST_STEP,
) -> Curve:
    """Fold, doubling or graze of a periodic orbit as a curve in the plane of Γ and ε.

    The orbit is followed along Γ, then along ε, to the nearest point of that kind within the
    window; from there the curve goes to both sides. Points in a row are at most `largest_step`
    apart (phases in rad, Γ and ε together). Raises InputError for an orbit with contact, or where
    there is no such point.

    >>> orbit_curve(fixed_point(0.45, 0.5), "doubling").axial_forcing
    """
    found: list[Curve] = []
    add_curves(found, orbit, [kind], window or Window(), largest_step)
    if not found:
        allowed = "a kind that the orbit meets along Γ or ε within the window"
        raise InputError("kind", str(kind), allowed, "This orbit has none there")
    return found[0]


def add_curves(
    found: list[Curve],
    orbit: PeriodicOrbit,
    kinds: Sequence[CurveKind | str],
    window: Window,
    largest_step: float,
) -> None:
    """Add the curves of an orbit, as `orbit_curve` gives them, that are not among those found."""
    window = window.checked()
    wanted = [_kind_of(kind) for kind in kinds]
    if orbit.contacts:
        raise InputError("orbit", f"{orbit.contacts} phases of contact", "an orbit of flights")
    if not 0.0 < largest_step < math.inf:
        raise InputError("largest_step", largest_step, "a number > 0")
    for start in starts_of(orbit, window):
        known = any(_lies_on(start, curve, largest_step) for curve in found)
        if start.system.kind in wanted and not known:
            found.append(traced_curve(start.system, start.unknowns, window, largest_step))


def _kind_of(kind: CurveKind | str) -> CurveKind:
    if kind not in KINDS:
        raise InputError("kind", str(kind), ", ".join(KINDS))
    return CurveKind(kind)


def _lies_on(start: Start, curve: Curve, largest_step: float) -> bool:
    """Whether a solution is on a curve that is known, between two of its points."""
    system = start.system
    if (system.kind, system.impacts, system.cycles) != curve[:3]:
        return False
    place = system.parameters(start.unknowns)
    phases = start.unknowns[: system.impacts]
    from_start = np.stack((curve.axial_forcing - place[0], curve.restitution - place[1]), axis=1)
    chord = np.diff(from_start, axis=0, append=from_start[-1:])
    along = -np.sum(from_start * chord, axis=1) / np.maximum(np.sum(chord**2, axis=1), 1e-300)
    far = np.linalg.norm(from_start + np.clip(along, 0.0, 1.0)[:, None] * chord, axis=1)
    nearest = int(np.argmin(far))
    apart = [
        np.max(np.abs(np.angle(np.exp(1j * (np.roll(phases, k) - curve.forcing_phase[nearest])))))
        for k in range(system.impacts)
    ]
    return bool(far[nearest] < LARGEST_STEP and min(apart) < 3.0 * max(LARGEST_STEP, largest_step))


def starts_of(orbit: PeriodicOrbit, window: Window) -> Iterator[Start]:
    """Special solutions on the branches of an orbit along Γ and along ε, to both sides."""
    states, _, _ = followed(orbit.map, *orbit.state[:2], orbit.impacts)
    times = np.cumsum([states[0, 0], *states[1:-1, 2]])  # of the impacts of one repetition, rad
    own = orbit.map.axial_parameters
    for axis in PARAMETERS:
        index = PARAMETERS.index(axis)
        system = OrbitSystem(orbit.impacts, orbit.cycles, None, 0, (axis,), own)
        normal = np.zeros(len(times) + 1)
        normal[-1] = 1.0
        unknowns = corrected(system, np.append(times, own[index]), normal, own[index])
        if unknowns is None:
            allowed = "one whose impact times solve its equations"
            raise InputError("orbit", repr(orbit), allowed, "Newton's method moved away from it")
        low, high = window.sides()[index]
        for sense in (1.0, -1.0):
            tangent = tangent_at(system, unknowns, sense * normal)
            yield from _along(system, Point(unknowns, tangent), (low, high))


def _along(system: OrbitSystem, start: Point, limits: tuple[float, float]) -> Iterator[Start]:
    """Special solutions from `start` on, to the window's side or to where the orbit ends."""
    before, values = start, _tests(system, start)
    for count, point in enumerate(continued(system, start, _STEP, _SMALLEST)):
        after = _tests(system, point)
        for kind in (CurveKind.FOLD, CurveKind.DOUBLING):
            if values[kind] * after[kind] < 0.0:
                yield from _refined(system, before, point, kind)
        if not system.is_motion(point.unknowns):
            yield from _graze(system, before, point)
            return
        if not limits[0] <= point.unknowns[-1] <= limits[1] or count > _MOST:
            return
        before, values = point, after


def _tests(system: OrbitSystem, point: Point) -> dict[CurveKind, float]:
    doubling, fold = system.multiplier_defects(point.unknowns)
    return {CurveKind.DOUBLING: doubling, CurveKind.FOLD: fold}


def _refined(system: OrbitSystem, before: Point, after: Point, kind: CurveKind) -> Iterator[Start]:
    """The fold or doubling between two points of a branch."""
    special = OrbitSystem(system.impacts, system.cycles, kind)
    a, b = _tests(system, before)[kind], _tests(system, after)[kind]
    part = a / (a - b)
    guess = before.unknowns + part * (after.unknowns - before.unknowns)
    yield from _solved(system, special, guess[: system.impacts], guess, np.empty(0))


def _graze(system: OrbitSystem, before: Point, after: Point) -> Iterator[Start]:
    """The graze between the last motion of a disk on a branch and what follows.

    A flight touches the platform on the way; or an impact comes to speed 0: then it is a graze of
    the orbit without that impact.
    """
    before_impacts = system.flights(after.unknowns).before
    weakest = int(np.argmax(before_impacts))
    if before_impacts[weakest] >= 0.0:
        yield from _lost_impact(system, before, weakest)
        return
    flight = int(np.argmin(system.clearances(after.unknowns)[:, 0]))
    special = OrbitSystem(system.impacts, system.cycles, CurveKind.GRAZE, flight)
    for point in (before, after):
        own = system.split(point.unknowns)[0]
        touch = np.array([own[flight] + system.clearances(point.unknowns)[flight, 1]])
        solved = list(_solved(system, special, own, point.unknowns, touch))
        if solved:
            yield from solved
            return


def _lost_impact(system: OrbitSystem, before: Point, weakest: int) -> Iterator[Start]:
    """The graze of the orbit of one impact fewer that an impact of speed 0 is."""
    n = system.impacts
    if n == 1:
        return
    times = system.split(before.unknowns)[0]
    touch, kept = float(times[weakest]), np.delete(times, weakest)
    if weakest == 0:
        touch += math.tau * system.cycles
    flight = (weakest - 1) % n if weakest else n - 2
    special = OrbitSystem(n - 1, system.cycles, CurveKind.GRAZE, flight)
    yield from _solved(system, special, kept, before.unknowns, np.array([touch]))


def _solved(
    branch: OrbitSystem, special: OrbitSystem, times: Array, near: Array, touch: Array
) -> Iterator[Start]:
    """The solution of a special system near a point of a branch, on that branch's line."""
    place = branch.parameters(near)
    guess = np.concatenate((times, touch, place))
    held = next(i for i, name in enumerate(PARAMETERS) if name not in branch.free)
    normal = np.zeros(len(guess))
    normal[held - 2] = 1.0
    found = corrected(special, guess, normal, place[held])
    if found is not None and float(np.max(np.abs(found - guess))) < 0.2:
        yield Start(special, found)
