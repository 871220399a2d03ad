"""Stable and unstable manifolds of saddles of the next-collision map, and the share they enclose.

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
from collections.abc import Sequence
from enum import StrEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.angles import wrap_to_pi
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.axial_iteration import iterate_backwards, iterate_forwards
from bouncing_disk_ros.maps.next_collision import NextCollisionMap
from bouncing_disk_ros.maps.periodic_orbit import PeriodicOrbit, followed

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
    """Rule that says how far manifolds are grown, and how finely."""

    distance: float = 0.02  # of neighbours, largest
    angle: float = 0.1  # rad, largest turning angle, where neighbours are not very near
    repetitions: float = 60.0  # how often the map is applied at most: σ
    lowest: float = -5.0  # w_A: below it there is nothing to see, and points are not refined
    most: int = 200_000  # points


def saddle_manifolds(
    saddle: PeriodicOrbit, stability: Stability | str, rule: GrowthRule | None = None
) -> list[Manifold]:
    """Branches of the stable or the unstable manifold at each point of an unstable orbit.

    Raises InputError for an orbit that is no saddle (one multiplier outside the unit circle, one
    inside), an orbit with contact, and at ε = 0, where no state has a past.

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
        self.platform = section.axial_parameters
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


# ------------------------------------------------------------------------------------------------
# The part of a window that the stable manifold of a saddle encloses: the share of a basin.
#
# The map backwards keeps the sense of rotation, so the basin lies on one side of a branch all along
# it. With both branches, and w_A = `lowest` below, the enclosed area is the integral of the height
# above `lowest` along them. Between points the line is Hermite's cubic with the slopes of parabolas
# through three points, integrated exactly: the error falls with the fourth power of their distance.
# Other windows are cut out of it.


BESIDE = 1e-6
"""Distance (rad and πg/ω) from a manifold at which its sides are looked at."""
_HALVINGS = 45
"""Halvings of a part that crosses an edge of the window: what is left is below rounding."""
_NODES = (np.array(np.polynomial.legendre.leggauss(8)[0]) + 1.0) / 2.0
_WEIGHTS = np.array(np.polynomial.legendre.leggauss(8)[1]) / 2.0


class Window(NamedTuple):
    """A part of the plane of states: forcing phases (rad) and velocities w_A (πg/ω)."""

    lowest: float = -5.0
    highest: float = 0.0
    phase_begin: float = 0.0
    phase_end: float = math.tau


class Enclosed(NamedTuple):
    """The part of a window between the branches of a stable manifold."""

    share: float
    inside: int  # which of the two results of `sides` lies in it: 0 or 1


def enclosed_share(branches: Sequence[Manifold], lowest: float = -5.0) -> float:
    """Share of the window τ ∈ [0, 2π), w_A ∈ (lowest, 0) between the branches of a saddle.

    `branches`: the stable manifold of one saddle, in the order of `saddle_manifolds` (pairs of
    opposite senses), grown to below `lowest`. Raises InputError where a branch is not complete, or
    is cut inside the window: then it alone encloses nothing. It is the share of a basin where these
    branches are the whole boundary of the basin; `sides` decides this.

    >>> saddle = saddle_of(fixed_point(0.45, 0.5))
    >>> enclosed_share(saddle_manifolds(saddle, "stable", GrowthRule(distance=0.01)))
    """
    return enclosed_part(branches, Window(lowest)).share


def enclosed_part(branches: Sequence[Manifold], window: Window) -> Enclosed:
    """As `enclosed_share`, for any window, and which side of the branches it is."""
    if not window.lowest < window.highest <= 0.0:
        allowed = f"less than the highest velocity, {window.highest:g}"
        raise InputError("lowest", window.lowest, allowed)
    total = 0.0
    for k, branch in enumerate(branches):
        if branch.stability is not Stability.STABLE:
            raise InputError("branches", str(branch.stability), "branches of a stable manifold")
        if why := why_open(branch, window.lowest):
            raise InputError("branches", f"one that encloses nothing: {why}", "complete ones")
        part = sum(
            _height_integral(piece, sigma, window)
            for piece, sigma in zip(branch.pieces, branch.sigma, strict=True)
        )
        total += part if k % 2 == 0 else -part
    size = (window.phase_end - window.phase_begin) * (window.highest - window.lowest)
    # along the second branch and then the first, the integral is less than 0 around the left
    return Enclosed(abs(total) / size, 0 if total < 0.0 else 1)


def sides(branches: Sequence[Manifold], lowest: float, count: int = 64) -> tuple[Array, Array]:
    """States (m, 2) just to the left and just to the right of branches in a window, to be labelled.

    Left of a branch, and right of the opposite one. If all of one side go to one attractor and all
    of the other to another, the branches are the boundary between these.
    """
    left, right = [np.empty((0, 2))], [np.empty((0, 2))]
    for k, branch in enumerate(branches):
        for piece in branch.pieces:
            places = np.unique(np.linspace(1, len(piece) - 1, count).astype(int))
            places = places[piece[places, 1] > lowest + BESIDE]
            way = piece[places] - piece[places - 1]
            normal = np.stack((-way[:, 1], way[:, 0]), axis=1)
            normal *= BESIDE / np.hypot(*way.T)[:, None]
            pair = piece[places] + normal, piece[places] - normal
            left.append(pair[k % 2])
            right.append(pair[1 - k % 2])
    found = np.concatenate(left), np.concatenate(right)
    for states in found:
        states[:, 0] %= math.tau
    return found


def why_open(branch: Manifold, lowest: float) -> str:
    """Why a branch encloses no part of what lies above `lowest`; empty: it does."""
    ends = [piece[k] for piece in branch.pieces for k in (0, -1)][1:]
    inside = sum(float(end[1]) > lowest for end in ends)
    return branch.ended or (f"grazes cut it at {inside} places" if inside else "")


def _height_integral(piece: Array, sigma: Array, window: Window) -> float:
    """∫ of the part of the window below a piece, over τ: parts that cross its edges are halved."""
    cubic = _cubics(piece, sigma)
    start, end = np.zeros(len(piece) - 1), np.ones(len(piece) - 1)
    total = 0.0
    for halvings in range(_HALVINGS + 1):
        crossing = np.any(
            _edges(cubic, start, window) != _edges(cubic, end, window), axis=0
        ) & (halvings < _HALVINGS)  # fmt: skip
        total += _integral(cubic[~crossing], start[~crossing], end[~crossing], window)
        if not crossing.any():
            break
        cubic = np.repeat(cubic[crossing], 2, axis=0)
        middle = 0.5 * (start[crossing] + end[crossing])
        start = np.stack((start[crossing], middle), axis=1).ravel()
        end = np.stack((middle, end[crossing]), axis=1).ravel()
    return total


def _integral(cubic: Array, start: Array, end: Array, window: Window) -> float:
    """∫ over parts of cubics within which no edge of the window is crossed."""
    total = np.zeros(len(cubic))
    for node, weight in zip(_NODES, _WEIGHTS, strict=True):
        at = start + node * (end - start)
        tau, w = _values(cubic, at)
        rate = cubic[:, 1, 0] + at * (2.0 * cubic[:, 2, 0] + 3.0 * at * cubic[:, 3, 0])
        height = np.clip(w, window.lowest, window.highest) - window.lowest
        total += weight * height * _times(tau, window) * rate * (end - start)
    return float(np.sum(total))


def _values(cubic: Array, at: Array) -> tuple[Array, Array]:
    """τ and w_A of the cubics (m, 4, 2) at (m,) values from 0 to 1."""
    t = at[:, None]
    found = cubic[:, 0] + t * (cubic[:, 1] + t * (cubic[:, 2] + t * cubic[:, 3]))
    return found[:, 0], found[:, 1]


def _times(tau: Array, window: Window) -> Array:
    """How often the window holds a forcing phase, any number of turns apart."""
    ends = np.array([window.phase_begin, window.phase_end])[:, None]
    first, last = np.floor((tau - ends) / math.tau)
    return np.asarray(first - last)


def _edges(cubic: Array, at: Array, window: Window) -> Array:
    """On which side of the edges of the window the cubics are: equal where none is between."""
    tau, w = _values(cubic, at)
    ends = np.array([window.phase_begin, window.phase_end])[:, None]
    turns = np.floor((tau - ends) / math.tau)
    return np.concatenate((turns, [w < window.lowest], [w > window.highest]))


def _cubics(piece: Array, sigma: Array) -> Array:
    """Coefficients (m - 1, 4, 2) of Hermite's cubics between the points of a piece."""
    step, way = np.diff(sigma), np.diff(piece, axis=0)
    slope = _slopes(piece, step) if len(piece) > 2 else np.repeat(way / step[:, None], 2, axis=0)
    m0, m1 = slope[:-1] * step[:, None], slope[1:] * step[:, None]
    return np.stack((piece[:-1], m0, 3.0 * way - 2.0 * m0 - m1, m0 + m1 - 2.0 * way), axis=1)


def _slopes(piece: Array, step: Array) -> Array:
    """Derivatives (m, 2) by σ, of the parabolas through neighbours."""
    rate = np.diff(piece, axis=0) / step[:, None]
    before, after = step[:-1, None], step[1:, None]
    inner = (after * rate[:-1] + before * rate[1:]) / (before + after)
    first = 2.0 * rate[0] - inner[0]
    last = 2.0 * rate[-1] - inner[-1]
    return np.concatenate((first[None], inner, last[None]))
