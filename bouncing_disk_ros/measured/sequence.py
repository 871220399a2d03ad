"""Which hits are impacts of one disk, and which are missed: the likeliest chain of flights.

From two impacts follows the take-off, and from that the next landing. A hit that lands there is an
impact; another one is false (an echo, a second ball). A landing without a hit is a missed impact.
Nothing is heard within the dead time of the detector after a hit. Chatter ends in contact: the disk
leaves where the platform falls with g, sin τ = 1/(πΓ), and flies without an impact before.
The chain of least cost is found by dynamic programming: an impact costs minus the logarithm of its
density around the landing, in parts of one over the flight; a false or missed one costs `ODD`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.measured.kernels.rest_laws import (
    AMPLITUDE,
    FREQUENCY,
    PARAMETERS,
    PHASE,
    RESTITUTION,
    SLOPE,
)

Array = NDArray[np.float64]
ODD = 3.0
"""Of a false or missed impact: a part of 5 %."""
_SKIPPED, _MISSED = 4, 3
"""Hits to look ahead (three may be false), landings to look ahead (two may be missed).

Of parts of 5 %, four false ones in a row come once in 160 000 hits, three missed once in 8000.
"""
_CONTACT, _SLOTS = _MISSED, _MISSED + 1
"""Slots: of so many landings missed, and of contact."""
_ERRORS = np.array([1e-5, 1e-4, 1e-3])
"""Of landings, s."""
_PARTS = np.array([2e-3, 1.5e-2])
"""The same, in parts of the flight: of most landings, and of those that the law fits worse."""
_FAR = 600.0
"""Of half a squared deviation: beyond it nothing is likelier than something else."""
_FIRST = 100
"""Hits that find the restitution on a platform at rest."""
_CHANGES = np.linspace(-0.1, 0.2, 7)
"""Of the restitution, from the fastest impact to the slowest ones."""
_GRID = 64
"""Points of a flight where its height is looked at."""
_STEPS = 4
"""Of Newton's method, from the middle of a part: quadratic, so far below the least error."""
_HOPELESS = 12.0
"""Chains to the same hit that cost more than the best by this are not followed."""


@dataclass(frozen=True)
class Chain:
    """`kept`: indices of the hits that are impacts. `missed`: times of those without a hit, s.

    `contacts`: places in `kept` of hits before a contact. `parameters`: the chain's candidate.
    `evidence`: logarithm of how much likelier it is than hits of no law.
    """

    kept: NDArray[np.int64]
    missed: Array
    contacts: NDArray[np.int64]
    parameters: Array
    evidence: float = 0.0

    def holds_all(self, count: int) -> bool:
        """Whether it holds all of so many hits, and nothing is missed."""
        return len(self.kept) == count and not len(self.missed)

    def is_like(self, other: Chain) -> bool:
        """Whether it holds the same hits, with as many missed and the same contacts."""
        return (
            np.array_equal(self.kept, other.kept)
            and len(self.missed) == len(other.missed)
            and np.array_equal(self.contacts, other.contacts)
        )


def chain_of(times: Array, candidates: Array, gravity: float, dead_time: float = 0.0) -> Chain:
    """The likeliest chain under candidates (M, 6) for ε, A, φ, ω, 0, 0."""
    p = np.repeat(candidates, len(_ERRORS), axis=0)
    return _Search(times, p.T, gravity, np.tile(_ERRORS, len(candidates)), dead_time).chain()


def at_rest(times: Array, gravity: float, dead_time: float = 0.0) -> Chain:
    """The likeliest chain on a platform at rest, for any restitution, also one ε - ε₁v."""
    fastest = 0.5 * gravity * float(np.diff(times).max(initial=0.0))
    slopes = _CHANGES / max(fastest, 1e-9)
    found = chain_of(
        times[:_FIRST], _still(np.linspace(0.02, 0.99, 98), slopes), gravity, dead_time
    )
    if len(times) <= _FIRST:
        return found
    near = found.parameters[RESTITUTION] + np.linspace(-0.01, 0.01, 5)
    return chain_of(times, _still(near, found.parameters[[SLOPE]]), gravity, dead_time)


def _still(restitutions: Array, slopes: Array) -> Array:
    """Candidates with a platform at rest."""
    found = np.zeros((len(slopes), len(restitutions), PARAMETERS))
    found[..., RESTITUTION], found[..., SLOPE] = restitutions, slopes[:, None]
    return found.reshape(-1, PARAMETERS)


class _Search:
    """Costs of chains that end with two impacts, for all candidates (G) at once.

    A slot (a, m) of hit j stands for chains whose last impact but one is hit j - a - 1, with m
    missed in between, or contact for m = _CONTACT; `costs`, `takeoffs`: (N, slots, G).
    """

    def __init__(
        self, times: Array, p: Array, gravity: float, errors: Array, dead_time: float
    ) -> None:
        self.times, self.p, self.g, self.errors, self.dead = times, p, gravity, errors, dead_time
        self.is_still = not p[AMPLITUDE].any()
        self.platform = self._platform(times[:, None], slice(None))  # (N, G) at all hits
        shape = (len(times), _SKIPPED, _SLOTS, p.shape[1])
        self.costs, self.takeoffs = np.full(shape, np.inf), np.zeros(shape)
        self.sources = np.full(shape, -1, np.int16)

    def chain(self) -> Chain:
        count = len(self.times)
        self._begin()
        for j in range(count):
            self._go_on(j)
        ends = self.costs + ODD * np.arange(count - 1, -1, -1)[:, None, None, None]
        ends[:, :, _CONTACT] = np.inf  # one hit after a contact tells nothing
        j, a, m, candidate = (int(x) for x in np.unravel_index(int(np.argmin(ends)), ends.shape))
        kept, missed, contacts, one = [j], [], [], slice(candidate, candidate + 1)
        while True:
            source, before = int(self.sources[j, a, m, candidate]), j - a - 1
            kept.append(before)
            if source < 0:
                break
            slot = divmod(source, _SLOTS)
            if m == _CONTACT:
                contacts.append(before)
                j, (a, m) = before, slot
                continue
            takeoff = self.takeoffs[before, slot[0], slot[1], one]
            at = np.full(1, self.times[before])
            for _ in range(m):
                at, takeoff = self._flown(at, takeoff, one)
                missed.append(float(at[0]))
            j, (a, m) = before, slot
        hits = np.array(kept[::-1])
        return Chain(hits, np.array(missed), np.searchsorted(hits, contacts[::-1]),
                     self.p[:, candidate], -float(ends.min()))  # fmt: skip

    def _begin(self) -> None:
        """Chains that begin with each hit and one before it."""
        for a in range(min(_SKIPPED, len(self.times) - 1)):
            hits = np.arange(a + 1, len(self.times))
            self.costs[hits, a, 0] = ODD * (hits[:, None] - 1)
            self.takeoffs[hits, a, 0] = self._takeoff_at(self.times[hits - a - 1][:, None], hits)

    def _go_on(self, j: int) -> None:
        """From chains that end with hit j to later hits."""
        hits = np.arange(j + 1, min(j + _SKIPPED + 1, len(self.times)))
        costs = self.costs[j].reshape(-1, self.p.shape[1])
        alive = np.flatnonzero((costs < costs.min(axis=0) + _HOPELESS).any(axis=1))
        if len(hits) == 0 or len(alive) == 0:
            return
        if not self.is_still:
            self._leave(j, hits, costs)
        takeoff = self.takeoffs[j].reshape(costs.shape)[alive]
        before = np.full(takeoff.shape, self.times[j])
        ours, at = np.arange(self.p.shape[1]), self.times[hits][:, None, None]
        unheard = np.zeros(before.shape)
        for m in range(_MISSED):
            landing, up = self._flown(before, takeoff, slice(None))
            flight = landing - before
            sizes = np.hypot(self.errors, _PARTS[:, None, None] * flight) * (1.0 + m)
            sums = costs[alive] + unheard - self._log_density(at - landing, sizes, flight)
            sums[(at <= before) | np.isnan(sums)] = np.inf
            best = np.argmin(sums, axis=1)
            least = np.take_along_axis(sums, best[:, None], axis=1)[:, 0]
            start = self._takeoff_at(before[best, ours], hits)
            self._offer(j, hits, m, alive[best], least, start)
            reached = (abs(at - landing) < 2.0 * sizes.max(axis=0)).any(axis=(0, 2))
            if reached.all():  # a landing that has its hit is not missed
                return
            alive, before, takeoff = alive[~reached], landing[~reached], up[~reached]
            unheard = unheard[~reached] + ODD * (before - self.times[j] > self.dead)

    def _leave(self, j: int, hits: NDArray[np.int64], costs: Array) -> None:
        """From chains that end with hit j to later ones by contact, up to the second separation."""
        a, w, phase = self.p[AMPLITUDE], self.p[FREQUENCY], self.p[PHASE]
        with np.errstate(all="ignore"):
            angle = np.arcsin(self.g / (a * w * w))
            angle = np.where(a > 0.0, angle, math.pi - angle)
            turns = np.ceil((w * self.times[j] + phase - angle) / math.tau)
        if not np.isfinite(turns).any():
            return
        best = np.argmin(costs, axis=0)
        least = np.take_along_axis(costs, best[None], axis=0)[0] + ODD
        at, platform = self.times[hits][:, None], self.platform[1][hits]
        for later in (0.0, 1.0):
            left = (angle + math.tau * (turns + later) - phase) / w
            speed = self._platform(left, slice(None))[1]
            landing, _ = self._flown(left, speed, slice(None))
            flight = landing - left
            sizes = np.hypot(self.errors, _PARTS[:, None] * flight)
            sums = least - self._log_density(at - landing, sizes, flight)
            fall = speed - self.g * (at - left) - platform
            up = platform - self.p[RESTITUTION] * fall
            sums[~np.isfinite(sums) | (at <= left)] = np.inf
            self._offer(j, hits, _CONTACT, np.broadcast_to(best, sums.shape), sums, up)

    def _offer(
        self, j: int, hits: NDArray[np.int64], slot: int, sources: NDArray[np.int64],
        costs: Array, takeoff: Array,
    ) -> None:  # fmt: skip
        """Chains from hit j to each of `hits`, with those between false; the best ones stay."""
        a = hits - j - 1
        costs = costs + ODD * a[:, None]
        better = costs < self.costs[hits, a, slot]
        for kept, new in (
            (self.costs, costs), (self.takeoffs, takeoff), (self.sources, sources)
        ):  # fmt: skip
            kept[hits, a, slot] = np.where(better, new, kept[hits, a, slot])

    @staticmethod
    def _log_density(away: Array, sizes: Array, flight: Array) -> Array:
        """Of hits so far from a landing (the first axis), in parts of one over the flight."""
        share = np.maximum(flight, sizes) / (2.5 * sizes) / len(_PARTS)
        exponents = np.minimum(0.5 * (away / sizes[:, None]) ** 2, _FAR)
        return np.asarray(np.log((share[:, None] * np.exp(-exponents)).sum(axis=0)))

    def _platform(self, at: float | Array, which: slice) -> tuple[Array, Array]:
        a, w, angle = self.p[AMPLITUDE, which], self.p[FREQUENCY, which], self.p[PHASE, which]
        if self.is_still:
            nothing = np.zeros(np.broadcast_shapes(np.shape(at), a.shape))
            return nothing, nothing
        return a * np.sin(w * at + angle), a * w * np.cos(w * at + angle)

    def _height(self, at: Array, which: slice) -> Array:
        """Of the platform."""
        if self.is_still:
            return np.zeros(self.p[AMPLITUDE, which].shape)
        return np.asarray(
            self.p[AMPLITUDE, which]
            * np.sin(self.p[FREQUENCY, which] * at + self.p[PHASE, which])
        )  # fmt: skip

    def _takeoff(self, before: Array, at: Array, which: slice) -> Array:
        """Velocity after the landing of a flight."""
        return self._takeoff_from(before, at, self._platform(at, which), which)

    def _takeoff_at(self, before: Array, hits: NDArray[np.int64]) -> Array:
        """The same where the landings are hits, for all candidates: (hits, G)."""
        end = self.platform[0][hits], self.platform[1][hits]
        return self._takeoff_from(before, self.times[hits][:, None], end, slice(None))

    def _takeoff_from(
        self, before: Array, at: float | Array, platform: tuple[Array, Array], which: slice
    ) -> Array:
        (end, speed), start = platform, self._height(before, which)
        duration = at - before
        with np.errstate(all="ignore"):
            fall = (end - start) / duration - 0.5 * self.g * duration - speed
        return np.asarray(speed - (self.p[RESTITUTION, which] + self.p[SLOPE, which] * fall) * fall)

    def _flown(self, at: Array, takeoff: Array, which: slice) -> tuple[Array, Array]:
        """Time of the landing, nan if there is none, and velocity after it."""
        start, a = self._height(at, which), np.abs(self.p[AMPLITUDE, which])
        root = np.sqrt(np.maximum(takeoff**2 + 2.0 * self.g * (start + a), 0.0))
        longest = (takeoff + root) / self.g
        landing = at + longest
        if not self.is_still:
            part = np.linspace(0.0, 1.0, _GRID + 1)[1:].reshape(-1, *(1,) * at.ndim)

            def height(since: Array) -> Array:
                there = self._height(at + since, which)
                return np.asarray(start + takeoff * since - 0.5 * self.g * since**2 - there)

            with np.errstate(all="ignore"):
                above = height(longest * part) > 0.0
                down = above[:-1] & ~above[1:]
                first = np.argmax(down, axis=0)
                since = longest * (part[first].reshape(at.shape) + 0.5 / _GRID)
                for _ in range(_STEPS):
                    there, speed = self._platform(at + since, which)
                    above_it = start + takeoff * since - 0.5 * self.g * since**2 - there
                    since = since - above_it / (takeoff - self.g * since - speed)
            landing = np.where(down.any(axis=0), at + since, np.nan)
        return landing, self._takeoff(at, landing, which)
