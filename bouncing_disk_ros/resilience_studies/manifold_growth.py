"""Stable and unstable manifolds of saddles of the next-collision map, cut at grazes.

A branch of a manifold is one function of one number: with x(p) = saddle + δ Λᵖ v along the
eigenvector v for p in [0, 1), it is G^k(x(p)) at σ = k + p, where G is the map over one repetition
(two where the multiplier Λ is negative), backwards for the stable manifold. Points are put between
others until neighbours are near and the line turns little; no point is interpolated. Where they do
not come near, however close in σ they are, the map is not continuous there: a flight grazes the
platform. The branch is cut there, and both ends are kept.

The next repetition begins with the points of this one, without the stretches that lead nowhere:
to contact, or (backwards) to impacts so fast that each one before was faster still, by
`no_return`. A branch is complete where no stretch is left.

The error of the linear start is of order δ² and shrinks along the way.
"""

from __future__ import annotations

import math
from enum import StrEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.inverse_map import iterate_backwards, iterate_forwards
from bouncing_disk_ros.maps.next_collision import NextCollisionMap
from bouncing_disk_ros.maps.periodic_orbit import PeriodicOrbit, followed
from bouncing_disk_ros.maps.phases import wrap_to_pi

Array = NDArray[np.float64]

START = 1e-6
"""δ: distance from the saddle at which a branch begins."""
FASTEST = 1e3
"""States from impacts this fast (πg/ω) are not computed: they are taken for this fast."""
_SAME = 1e-13
"""Points this near in σ are neighbours for good: the line is cut between them."""
_FIRST = 9
"""Points of the first repetition, before others are put between them."""
_BELOW = 0.5
"""Below what is looked at, neighbours may be farther apart, by this part of their depth."""
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
    ended: str  # why more of it may lie above `lowest`; empty: it is complete

    def __repr__(self) -> str:
        """How many pieces and points."""
        points = sum(len(piece) for piece in self.pieces)
        return f"<{self.stability} manifold: {len(self.pieces)} pieces, {points} points>"

    @property
    def length(self) -> float:
        """Length of all pieces, τ in rad and w_A in πg/ω."""
        return sum(float(np.sum(np.hypot(*np.diff(piece, axis=0).T))) for piece in self.pieces)

    @property
    def complete(self) -> bool:
        """Whether all that lies above `lowest` was found."""
        return not self.ended


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


def no_return(axial_forcing: float, restitution: float) -> float:
    """Speed |w_A| (πg/ω) of an impact above which all impacts before it were faster; inf: none.

    Backwards a flight begins with at least |w| − Γ in space, lands at most 2Γ higher and there has
    at most Γ less than its speed in space: 1/ε of that is more than |w| above the root of
    (1 − ε²)w² − 2Γ(1 + ε)w − 4Γ/π.
    """
    left = 1.0 - restitution * restitution
    if left <= 0.0:
        return math.inf
    half = axial_forcing * (1.0 + restitution)
    return (half + math.sqrt(half * half + left * 4.0 * axial_forcing / math.pi)) / left


class _Stretch(NamedTuple):
    """Points of a branch in the order of σ, and between which neighbours it was followed."""

    sigma: Array  # (m,)
    points: Array  # (m, 2)
    followed: NDArray[np.bool_]  # (m - 1,)


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
        slowest = no_return(*self.platform) if which is Stability.STABLE else math.inf
        self.deepest = max(slowest, -rule.lowest)
        self.fastest = max(FASTEST, 4.0 * self.deepest)

    def at(self, sigma: Array) -> Array:
        """Points (m, 2) at σ. w_A is −`fastest` beyond it, nan where contact came before."""
        whole = np.floor(sigma)
        away = START * self.growth ** (sigma - whole)
        states = np.ascontiguousarray(self.place + away[:, None] * self.vector)
        states[:, 0] %= math.tau
        counts = (whole * self.each).astype(np.int64)
        if self.which is Stability.STABLE:
            iterate_backwards(states, counts, *self.platform, self.fastest)
            states[~(states[:, 1] > -self.fastest), 1] = -self.fastest
        else:
            iterate_forwards(states, counts, *self.platform)
        return states

    def grown(self) -> Manifold:
        """Put points between others, repetition by repetition, until no stretch leads on."""
        sigma = np.linspace(0.0, 1.0, _FIRST)
        new = _Stretch(sigma, self.at(sigma), np.ones(_FIRST - 1, bool))
        found: list[_Stretch] = []
        while True:
            room = self.rule.most - sum(len(one.sigma) for one in found)
            new, enough = self.refined(new, room)
            if len(new.sigma) <= room:
                found.append(new)
            on = self.leads_on(new)
            if not enough:
                ended = f"its points ran out, {self.rule.most} of them"
            elif not on.any():
                ended = ""
            elif len(found) >= self.rule.repetitions:
                ended = f"it was followed for {len(found)} repetitions only"
            else:
                new = self.next_repetition(new, on)
                continue
            return self.cut(found, ended)

    def next_repetition(self, last: _Stretch, on: NDArray[np.bool_]) -> _Stretch:
        """The images of the stretches of a repetition that lead on."""
        kept = np.append(on, False) | np.append(False, on)
        sigma = last.sigma[kept] + 1.0
        return _Stretch(sigma, self.at(sigma), on[kept[:-1]][: len(sigma) - 1])

    def leads_on(self, one: _Stretch) -> NDArray[np.bool_]:
        """Between which neighbours there are states whose images may lie above `lowest`."""
        size, _ = _steps(one.points)
        w = one.points[:, 1]
        with np.errstate(invalid="ignore"):
            near = np.fmax(w[1:], w[:-1]) > -(self.deepest + size)
        return np.asarray(one.followed & near & self.can_be_split(one.sigma))

    @staticmethod
    def can_be_split(sigma: Array) -> NDArray[np.bool_]:
        """Neighbours that are not next to each other by rounding."""
        return np.asarray(np.diff(sigma) > _SAME * np.maximum(sigma[1:], 1.0))

    def refined(self, one: _Stretch, room: int) -> tuple[_Stretch, bool]:
        """A stretch with points put in between; whether there was room for them."""
        sigma, points, followed = one
        while True:
            wide = followed & self.can_be_split(sigma) & self.wide(points)
            if len(sigma) + np.count_nonzero(wide) > room:
                return _Stretch(sigma, points, followed), False
            if not wide.any():
                return _Stretch(sigma, points, followed), True
            places = np.flatnonzero(wide)
            middle = 0.5 * (sigma[places] + sigma[places + 1])
            sigma = np.insert(sigma, places + 1, middle)
            points = np.insert(points, places + 1, self.at(middle), axis=0)
            followed = np.insert(followed, places + 1, True)

    def wide(self, points: Array) -> NDArray[np.bool_]:
        """Between which neighbours a point is missing."""
        size, step = _steps(points)
        w = points[:, 1]
        with np.errstate(invalid="ignore", divide="ignore"):
            depth = np.maximum(self.rule.lowest - np.fmax(w[1:], w[:-1]), 0.0)
            far = ~(size <= self.rule.distance + _BELOW * depth)
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
            bent &= (size > _CLOSE * self.rule.distance) & (depth == 0.0)
        flown = ~(np.isnan(w[1:]) & np.isnan(w[:-1]))
        return np.asarray(flown & (far | bent))

    def cut(self, found: list[_Stretch], ended: str) -> Manifold:
        """The pieces between the cuts and outside of what is not seen."""
        sigma, points, followed = _joined(found)
        size, _ = _steps(points)
        with np.errstate(invalid="ignore"):
            seen = points[:, 1] >= self.rule.lowest
            joined = followed & (size <= self.rule.distance * 1.5) & (seen[1:] | seen[:-1])
        pieces, sigmas = [], []
        for run in np.split(np.arange(len(sigma)), np.flatnonzero(~joined) + 1):
            if len(run) > 1:
                piece = points[run].copy()
                steps = wrap_to_pi(np.diff(piece[:, 0]))
                piece[1:, 0] = piece[0, 0] + np.cumsum(steps)
                pieces.append(piece)
                sigmas.append(sigma[run])
        return Manifold(self.which, tuple(pieces), tuple(sigmas), ended)


def _steps(points: Array) -> tuple[Array, Array]:
    """Distances (m - 1,) of neighbours and the steps (m - 1, 2) between them."""
    step = np.diff(points, axis=0)
    step[:, 0] = np.nan_to_num(wrap_to_pi(step[:, 0]))  # unknown beside states that are too fast
    return np.hypot(*step.T), step


def _joined(found: list[_Stretch]) -> _Stretch:
    """Repetitions one after the other: the end of each is the begin of the next one, if kept."""
    sigma, points, followed = found[0]
    for one in found[1:]:
        same = one.sigma[0] - sigma[-1] <= _SAME * sigma[-1]
        sigma = np.concatenate((sigma, one.sigma[1 if same else 0 :]))
        points = np.concatenate((points, one.points[1 if same else 0 :]))
        link = [] if same else [False]
        followed = np.concatenate((followed, np.array(link, bool), one.followed))
    return _Stretch(sigma, points, followed)


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
