"""Which hits are impacts of one disk, and which are missed: the likeliest chain of flights.

From two impacts follows the take-off, and from that the next landing. A hit that lands there is an
impact; another one is false (an echo, a second ball). A landing without a hit is a missed impact.
Nothing is heard within the dead time of the detector after a hit. Chatter ends in contact: the disk
leaves where the platform falls with g, sin τ = 1/(πΓ), and flies without an impact before. Where so
many impacts are missed that the law leads to no hit, the chain has a gap: it begins anew, with the
same parameters.
The chain of least cost is found by dynamic programming (`kernels.chains`): an impact costs minus
the logarithm of its density around the landing, in parts of one over the flight; a false or missed
one costs `ODD`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.measured.kernels.chains import MOST_MISSED, ODD, likeliest_chain
from bouncing_disk_ros.measured.kernels.rest_laws import (
    AMPLITUDE,
    FREQUENCY,
    PARAMETERS,
    PHASE,
    RESTITUTION,
    SLOPE,
)
from bouncing_disk_ros.measured.predict import flies_above, flown_on
from bouncing_disk_ros.measured.profiles import Profiles

Array = NDArray[np.float64]
_ERRORS = np.array([1e-5, 1e-4, 1e-3])
"""Of landings, s."""
_FIRST = 100
"""Hits that find the restitution on a platform at rest."""
_SUSPECTED = 4
"""Hits with the largest residuals, of which one may be false."""
_FINER = 21
"""Restitutions near the best one: a long gap needs a thousandth."""
_CHANGES = np.linspace(-0.1, 0.2, 7)
"""Of the restitution, from the fastest impact to the slowest ones."""

_TRIED, _NEAR, _ALIKE = 256, 0.05, 0.01
"""Number of times between two hits at which a missed impact is looked for. Then two parts of the
time between these hits: how far from the second hit the last flight may land, since the parameters
are not yet fitted, and how far apart two times may be that lead to the same fit."""
_MOST_BEGUN = 3
"""Missed impacts after the first hit."""


class Change(NamedTuple):
    """Of a chain: `which` is the time of a missed impact, or a hit (of a contact: before it)."""

    kind: Literal["missed", "contact", "hit", "false"]
    which: float


@dataclass(frozen=True)
class Chain:
    """`kept`: indices of the hits that are impacts. `missed`: times of those without a hit, s.

    `contacts`: places in `kept` of hits before a contact or a gap. `parameters`: the chain's
    candidate. `evidence`: logarithm of how much likelier it is than hits of no law.
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

    def changes(self, heard: NDArray[np.int64]) -> list[Change]:
        """What may be wrong: each missed impact, each contact, each of the hits that is left out.

        `heard`: indices of all hits.
        """
        return [
            *(Change("missed", float(at)) for at in self.missed),
            *(Change("contact", int(hit)) for hit in self.kept[self.contacts]),
            *(Change("hit", int(hit)) for hit in np.setdiff1d(heard, self.kept)),
        ]

    def suspected(self, profiles: Profiles) -> list[Change]:
        """Hits that may be false: those with the largest residuals in the fit of the chain.

        None, where the fit without the largest residual is not likelier by two odd hits. Near a
        graze a false hit bends the fit, and its neighbours have larger residuals.
        """
        data, node = profiles.data, profiles.best
        sizes = ((data.times - node.times) / data.errors)[~data.missed] ** 2
        sizes[self.contacts] = sizes[self.contacts + 1] = 0.0  # a contact needs them
        worst = np.argsort(sizes)[: -_SUSPECTED - 1 : -1]
        without = replace(node, squares=node.squares - sizes[worst[0]])
        if profiles.cost(node) - profiles.cost(without) < 2.0 * 2.0 * ODD:
            return []
        return [Change("false", int(hit)) for hit in self.kept[worst]]

    def begins(
        self, heard: NDArray[np.int64], times: Array, tried: list[Array], gravity: float
    ) -> list[Chain]:
        """Chains with missed impacts after the first hit, by the law with any of these parameters.

        The first hit is the one of this chain, or the one before. Of times that are nearly alike
        the first parameters have them.
        """
        before, chains = heard[heard < self.kept[0]][-1:], list[Chain]()
        begun = [(self.with_hit(int(hit), times), self.kept[0]) for hit in before]
        if 0 not in self.contacts:
            begun.append((self, self.kept[1]))
        for chain, after in begun:
            begin, end = float(times[chain.kept[0]]), float(times[after])
            later, found = chain.missed[chain.missed > end], list[tuple[Array, Array]]()
            for parameters in tried:
                for missed in impacts_between(begin, end, parameters, gravity, _MOST_BEGUN):
                    if not any(
                        len(missed) == len(one)
                        and np.abs(missed - one).max() < _ALIKE * (end - begin)
                        for one, _ in found
                    ):
                        found.append((missed, parameters))
            chains += [replace(chain, missed=np.append(missed, later), parameters=parameters)
                       for missed, parameters in found]  # fmt: skip
        return chains

    def changed(self, change: Change, times: Array) -> Chain:
        """The chain without what the change names, or with a rejected hit."""
        if change.kind == "missed":
            return replace(self, missed=self.missed[self.missed != change.which])
        if change.kind == "contact":
            return replace(self, contacts=self.contacts[self.kept[self.contacts] != change.which])
        if change.kind == "false":
            return self.without_hit(int(change.which), times)
        return self.with_hit(int(change.which), times)

    def without_hit(self, hit: int, times: Array) -> Chain:
        """The chain with a missed impact near this hit in place of it, and none at its ends."""
        place = int(np.searchsorted(self.kept, hit))
        kept, missed = np.delete(self.kept, place), np.sort(np.append(self.missed, times[hit]))
        is_inside = (missed > times[kept[0]]) & (missed < times[kept[-1]])
        contacts = self.contacts - (self.contacts > place)
        return replace(self, kept=kept, missed=missed[is_inside], contacts=contacts)

    def with_hit(self, hit: int, times: Array) -> Chain:
        """The chain with this hit added, in place of the nearest missed impact of the same flight.

        Without one, the hit is one more impact.
        """
        place = int(np.searchsorted(self.kept, hit))
        before = times[self.kept[place - 1]] if place else -math.inf
        after = times[self.kept[place]] if place < len(self.kept) else math.inf
        inside = np.flatnonzero((self.missed > before) & (self.missed < after))
        nearest = inside[np.argsort(np.abs(self.missed[inside] - times[hit]))[:1]]
        return replace(
            self, kept=np.insert(self.kept, place, hit), missed=np.delete(self.missed, nearest),
            contacts=self.contacts + (self.contacts >= place),
        )  # fmt: skip

    def unheard_ends(self, hits: Array, speeds: Array, gravity: float) -> NDArray[np.int64]:
        """Places in `kept` of hits after which chatter may have ended, with no hit heard any more.

        The flights before shrink. If the next ones did too, the first would be shorter than any
        that was heard, and all would be over before the next hit. The disk leaves no faster than
        for such a flight. `hits`: times of `kept`; `speeds`: those that the restitution gives all
        but the first and the last of them, m/s.
        """
        flights = np.diff(hits)
        least, last, ratios = flights.min(), flights[1:-1], flights[1:-1] / flights[:-2]
        may_end = (speeds[1:] > 0.0) & (2.0 * speeds[1:] < gravity * least)
        may_end &= (ratios < 1.0) & (last * ratios < least)
        may_end &= last * ratios < (1.0 - ratios) * flights[2:]
        known = self.contacts[:, None] + np.arange(3)
        return np.setdiff1d(np.flatnonzero(may_end) + 2, known)

    def with_contacts(self, places: NDArray[np.int64], hits: Array) -> Chain:
        """The chain with a contact after each of these hits, and nothing missed there."""
        is_missed = ~np.isin(np.searchsorted(hits, self.missed) - 1, places)
        return replace(
            self, contacts=np.union1d(self.contacts, places), missed=self.missed[is_missed]
        )


def impacts_between(
    before: float, after: float, parameters: Array, gravity: float, most: int
) -> list[Array]:
    """Times of one to `most` impacts that lead nearly from one impact to another, without contact.

    Each series of times has another first flight. Flights nearby do not end nearer.
    """
    eps, a, w, phase = parameters[[RESTITUTION, AMPLITUDE, FREQUENCY, PHASE]]
    if not 0.0 <= eps <= 1.0:
        return []
    tried, each = np.linspace(before, after, _TRIED + 2)[1:-1], np.full(most, eps)
    found = np.full((_TRIED, 1 + most), np.inf)
    found[:, 0] = tried
    is_flight = flies_above(np.full(_TRIED, before), tried - before, (a, w, phase), gravity)
    for i in np.flatnonzero(is_flight):
        flown = flown_on(parameters, gravity, np.array([before, tried[i]]), each)
        found[i, 1 : 1 + len(flown)] = flown
    away = np.pad(np.abs(found - after), ((1, 1), (0, 0)), constant_values=np.inf)
    is_near = away[1:-1] <= np.minimum(away[:-2], away[2:])
    is_near &= away[1:-1] < _NEAR * (after - before)
    counts = range(1, 1 + most)
    return [found[i, :count] for count in counts for i in np.flatnonzero(is_near[:, count])]


def chain_of(
    times: Array, candidates: Array, gravity: float, dead_time: float = 0.0,
    least: float = -math.inf,
) -> Chain:  # fmt: skip
    """The likeliest chain under candidates (M, 6) for ε, A, φ, ω, 0, 0.

    One of no hits, with evidence -inf, if none has more than the least evidence.
    """
    tried = np.repeat(candidates, len(_ERRORS), axis=0)
    errors, count = np.tile(_ERRORS, len(candidates)), len(times)
    kept, contacts = np.empty(count, np.int64), np.empty(count, np.int64)
    missed, found = np.empty(MOST_MISSED * count), np.empty(4, np.int64)
    cost = likeliest_chain(
        times, tried, errors, gravity, dead_time, -least, kept, missed, contacts, found
    )
    if not cost < math.inf:
        return Chain(kept[:0], missed[:0], contacts[:0], tried[0], -math.inf)
    best, *counts = (int(x) for x in found)
    kept, missed, contacts = kept[: counts[0]][::-1], missed[: counts[1]], contacts[: counts[2]]
    return Chain(kept, missed, np.searchsorted(kept, contacts[::-1]), tried[best], -cost)


def at_rest(
    times: Array, gravity: float, dead_time: float = 0.0, least: float = -math.inf
) -> Chain:
    """The likeliest chain on a platform at rest, for any restitution, also one ε - ε₁v."""
    fastest = 0.5 * gravity * float(np.diff(times).max(initial=0.0))
    slopes = _CHANGES / max(fastest, 1e-9)
    tried = np.linspace(0.02, 0.99, 98)
    ratios = np.diff(times)[1:] / np.diff(times)[:-1]
    tried = tried[np.argsort(np.abs(tried - np.median(ratios)), kind="stable")]  # likely ones first
    found = chain_of(times[:_FIRST], _still(tried, slopes), gravity, dead_time, least)
    if not len(found.kept):
        return found
    near = found.parameters[RESTITUTION] + np.linspace(-0.01, 0.01, _FINER)
    return chain_of(times, _still(near, found.parameters[[SLOPE]]), gravity, dead_time)


def _still(restitutions: Array, slopes: Array) -> Array:
    """Candidates with a platform at rest."""
    found = np.zeros((len(slopes), len(restitutions), PARAMETERS))
    found[..., RESTITUTION], found[..., SLOPE] = restitutions, slopes[:, None]
    return found.reshape(-1, PARAMETERS)
