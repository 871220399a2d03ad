"""Stable and unstable manifolds of saddles of the next-collision map, cut at grazes.

A branch of a manifold is one function of one number: with x(p) = saddle + δ Λᵖ v along the
eigenvector v for p in [0, 1), it is G^k(x(p)) at σ = k + p, where G is the map over one repetition
(two where the multiplier Λ is negative), backwards for the stable manifold. Points are put between
others until neighbours are near and the line turns little; no point is interpolated. Where they do
not come near, however close in σ they are, the map is not continuous there: a flight grazes the
platform. The branch is cut there, and both ends are kept.

The error of the linear start is of order δ² and shrinks along the way.
"""

from __future__ import annotations

import math
from enum import StrEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.analysis.dynamics.next_collision import NextCollisionMap
from bouncing_disk_ros.analysis.dynamics.periodic_orbit import PeriodicOrbit, followed
from bouncing_disk_ros.analysis.phases import wrap_to_pi
from bouncing_disk_ros.collision_map.inverse_map import iterate_backwards, iterate_forwards
from bouncing_disk_ros.errors import InputError

Array = NDArray[np.float64]

START = 1e-6
"""δ: distance from the saddle at which a branch begins."""
FASTEST = 1e3
"""A state that came from a faster impact (πg/ω) came from still faster ones: it is left out."""
_SAME = 1e-13
"""Points this near in σ are neighbours for good: the line is cut between them."""
_ROUNDS = 200
_MARGIN, _COARSE = 6.0, 0.5
"""Lines leave the window and come back: this far below it points are looked for, this near."""
_CLOSE = 0.2
"""Turning angles are not looked at where neighbours are nearer than this part of the distance."""


class Stability(StrEnum):
    """Which manifold of a saddle."""

    STABLE = "stable"  # of states that go to it
    UNSTABLE = "unstable"  # of states that came from it


class Manifold(NamedTuple):
    """One branch, as pieces: lines between cuts, in the order of their distance from the saddle."""

    stability: Stability
    pieces: tuple[Array, ...]  # of (m, 2): τ, continuous and so not always in [0, 2π), and w_A
    sigma: tuple[Array, ...]  # (m,) of each point: repetitions from the start, δ off the saddle
    complete: bool  # False: it was ended by the number of points

    def __repr__(self) -> str:
        """How many pieces and points."""
        points = sum(len(piece) for piece in self.pieces)
        return f"<{self.stability} manifold: {len(self.pieces)} pieces, {points} points>"

    @property
    def length(self) -> float:
        """Length of all pieces, τ in rad and w_A in πg/ω."""
        return sum(float(np.sum(np.hypot(*np.diff(piece, axis=0).T))) for piece in self.pieces)


class GrowthRule(NamedTuple):
    """How far manifolds are grown, and how finely."""

    distance: float = 0.02  # of neighbours, largest
    angle: float = 0.1  # rad, largest turning angle, where neighbours are not very near
    repetitions: float = 60.0  # how often the map is applied at most: σ
    lowest: float = -5.0  # w_A: below it there is nothing to see, and points are not refined
    most: int = 200_000  # points


def saddle_manifolds(
    saddle: PeriodicOrbit, stability: Stability | str, rule: GrowthRule | None = None
) -> list[Manifold]:
    """Both branches at each point of an unstable orbit, the stable or the unstable manifold.

    Raises InputError for an orbit that is no saddle (one multiplier outside the unit circle, one
    inside), holds contact, or at ε = 0, where no state has a past.

    >>> from bouncing_disk_ros import saddle_of, saddle_manifolds, fixed_point
    >>> saddle_manifolds(saddle_of(fixed_point(0.45, 0.5)), "stable")
    """
    rule = rule or GrowthRule()
    if stability not in tuple(Stability):
        raise InputError("stability", str(stability), "stable or unstable")
    outer, inner = saddle.multipliers
    if saddle.contacts or abs(outer) <= 1.0 or abs(inner) >= 1.0 or inner == 0.0:
        given = f"multipliers {abs(outer):.4g} and {abs(inner):.4g} in magnitude"
        raise InputError("saddle", given, "one above and one below 1, without contact, ε > 0")
    for name in ("distance", "angle", "repetitions", "most"):
        if not getattr(rule, name) > 0.0:
            raise InputError(name, getattr(rule, name), "a number > 0")
    which = Stability(stability)
    found = []
    for i in range(saddle.impacts):
        for sense in (1.0, -1.0):
            branch = _Branch(saddle, i, which, sense, rule)
            found.append(branch.grown())
    return found


class _Branch:
    """One branch as a function of σ."""

    def __init__(
        self, saddle: PeriodicOrbit, i: int, which: Stability, sense: float, rule: GrowthRule
    ) -> None:
        self.rule, self.which = rule, which
        section = saddle.map
        self.platform = float(section.axial_forcing), float(section.restitution)
        self.place = np.array([saddle.forcing_phase[i], saddle.axial_impact_velocity[i]])
        outer, inner = (m.real for m in saddle.multipliers)
        size = 1.0 / inner if which is Stability.STABLE else outer
        self.each = saddle.impacts * (2 if size < 0.0 else 1)
        self.growth = size * size if size < 0.0 else size
        vector = eigenvector(section, self.place, saddle.impacts, which)
        self.vector = sense * vector

    def at(self, sigma: Array) -> Array:
        """Points (m, 2) at σ; nan where a state came from impacts that are too fast."""
        whole = np.floor(sigma)
        away = START * self.growth ** (sigma - whole)
        states = np.ascontiguousarray(self.place + away[:, None] * self.vector)
        states[:, 0] %= math.tau
        counts = (whole * self.each).astype(np.int64)
        if self.which is Stability.STABLE:
            iterate_backwards(states, counts, *self.platform, FASTEST)
        else:
            iterate_forwards(states, counts, *self.platform)
        return states

    def grown(self) -> Manifold:
        """Put points between others, repetition by repetition."""
        sigma, points = np.array([0.0]), self.at(np.array([0.0]))
        complete = True
        for k in range(math.ceil(self.rule.repetitions)):
            new = np.linspace(k, min(k + 1.0, self.rule.repetitions), 9)
            new_points = self.at(new)
            new, new_points, enough = self.refined(new, new_points, self.rule.most - len(sigma))
            sigma = np.concatenate((sigma, new[1:]))
            points = np.concatenate((points, new_points[1:]))
            if not enough:
                complete = False
                break
            if not self.seen(new_points, _MARGIN).any():
                break
        return self.cut(sigma, points, complete=complete)

    def seen(self, points: Array, margin: float = 0.0) -> NDArray[np.bool_]:
        """Points above the lowest w_A that is looked at, less a margin."""
        with np.errstate(invalid="ignore"):
            return np.asarray(points[:, 1] >= self.rule.lowest - margin)

    def refined(self, sigma: Array, points: Array, room: int) -> tuple[Array, Array, bool]:
        """One stretch of σ with points put in between; whether there was room for them."""
        for _ in range(_ROUNDS):
            wide = self.wide(sigma, points)
            if not wide.any():
                return sigma, points, True
            if len(sigma) + np.count_nonzero(wide) > room:
                return sigma, points, False
            places = np.flatnonzero(wide)
            middle = 0.5 * (sigma[places] + sigma[places + 1])
            sigma = np.insert(sigma, places + 1, middle)
            points = np.insert(points, places + 1, self.at(middle), axis=0)
        return sigma, points, True

    def wide(self, sigma: Array, points: Array) -> NDArray[np.bool_]:
        """Between which neighbours a point is missing."""
        step = np.diff(points, axis=0)
        step[:, 0] = wrap_to_pi(step[:, 0])
        size = np.hypot(*step.T)
        seen = self.seen(points)
        either = seen[1:] | seen[:-1]
        near = self.seen(points, _MARGIN)
        with np.errstate(invalid="ignore", divide="ignore"):
            far = ~(size <= np.where(either, self.rule.distance, _COARSE))
            direction = step / size[:, None]
            turn = np.abs(
                np.arctan2(
                    direction[:-1, 0] * direction[1:, 1] - direction[:-1, 1] * direction[1:, 0],
                    np.sum(direction[:-1] * direction[1:], axis=1),
                )
            )
            bent = np.append(turn > self.rule.angle, False) | np.append(
                False, turn > self.rule.angle
            )
            bent &= size > _CLOSE * self.rule.distance
        gap = np.diff(sigma)
        worth = either | near[1:] | near[:-1]
        return np.asarray(
            worth & (far | (bent & either)) & (gap > _SAME * np.maximum(sigma[1:], 1.0))
        )

    def cut(self, sigma: Array, points: Array, *, complete: bool) -> Manifold:
        """The pieces between the cuts and outside of what is not seen."""
        step = np.diff(points, axis=0)
        step[:, 0] = wrap_to_pi(step[:, 0])
        with np.errstate(invalid="ignore"):
            joined = np.hypot(*step.T) <= self.rule.distance * 1.5
        seen = self.seen(points)
        joined &= seen[1:] | seen[:-1]
        pieces, sigmas = [], []
        for run in np.split(np.arange(len(sigma)), np.flatnonzero(~joined) + 1):
            if len(run) > 1:
                piece = points[run].copy()
                steps = wrap_to_pi(np.diff(piece[:, 0]))
                piece[1:, 0] = piece[0, 0] + np.cumsum(steps)
                pieces.append(piece)
                sigmas.append(sigma[run])
        return Manifold(self.which, tuple(pieces), tuple(sigmas), complete)


def eigenvector(section: NextCollisionMap, place: Array, impacts: int, which: Stability) -> Array:
    """Unit eigenvector (2,) of the derivatives over one repetition, towards larger τ."""
    _, tangent, _ = followed(section, float(place[0]), float(place[1]), impacts)
    values, vectors = np.linalg.eig(tangent[:, :2])
    chosen = int(
        np.argmin(np.abs(values)) if which is Stability.STABLE else np.argmax(np.abs(values))
    )
    vector = np.real(vectors[:, chosen])
    vector = vector / float(np.hypot(*vector))
    return np.asarray(vector if vector[0] >= 0.0 else -vector)
