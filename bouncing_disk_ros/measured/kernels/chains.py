"""The likeliest chain of flights through hits: kernels.

A chain that ends with hits j - a - 1 and j has the slot (a, m) of hit j, with m missed impacts in
between, or contact for m = `_CONTACT`. The best chain of each slot stays (dynamic programming).
"""

from __future__ import annotations

from math import asin, ceil, cos, exp, inf, log, pi, sin, sqrt, tau

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.core.compilation import entry, kernel, rare_kernel
from bouncing_disk_ros.measured.kernels.rest_laws import (
    AMPLITUDE,
    FREQUENCY,
    PHASE,
    RESTITUTION,
    SLOPE,
)

ODD = 3.0
"""Of a false or missed impact: a part of 5 %."""
_SKIPPED, _MISSED = 4, 3
"""Hits to look ahead (three may be false), landings to look ahead (two may be missed).

Of parts of 5 %, four false ones in a row come once in 160 000 hits, three missed once in 8000.
"""
_CONTACT, _SLOTS = _MISSED, _MISSED + 1
"""Slots: of so many landings missed, and of contact."""
_NARROW, _WIDE = 2e-3, 1.5e-2
"""Errors in parts of the flight: of most landings, and of those that the law fits worse."""
_FAR = 600.0
"""Of half a squared deviation: beyond it nothing is likelier than something else."""
_GRID = 64
"""Points of a flight where its height is looked at."""
_STEPS = 4
"""Of Newton's method, from the middle of a part: quadratic, so far below the least error."""
_MOST = log(0.2 / _NARROW + 0.2 / _WIDE)
"""That a hit can lower the cost: by the density at its landing."""
_HOPELESS = 12.0
"""Chains to the same hit that cost more than the best by this are not followed."""
_ARRAY, _PLACES = "float64[::1]", "int64[::1]"


@kernel
def _platform(own: NDArray[np.float64], at: float) -> tuple[float, float]:
    """Position and velocity."""
    a, w = own[AMPLITUDE], own[FREQUENCY]
    if a == 0.0:
        return 0.0, 0.0
    angle = w * at + own[PHASE]
    return a * sin(angle), a * w * cos(angle)


@kernel
def _takeoff(before: float, at: float, own: NDArray[np.float64], g: float) -> float:
    """Velocity after the landing of a flight."""
    end, speed = _platform(own, at)
    duration = at - before
    fall = (end - _platform(own, before)[0]) / duration - 0.5 * g * duration - speed
    return speed - (own[RESTITUTION] + own[SLOPE] * fall) * fall


@kernel
def _landing(before: float, takeoff: float, own: NDArray[np.float64], g: float) -> float:
    """Time of the end of a flight, nan if there is none."""
    a, start = abs(own[AMPLITUDE]), _platform(own, before)[0]
    longest = (takeoff + sqrt(max(takeoff * takeoff + 2.0 * g * (start + a), 0.0))) / g
    if a == 0.0:
        return before + longest
    is_above = False
    for i in range(1, _GRID + 1):
        since = longest * i / _GRID
        height = start + takeoff * since - 0.5 * g * since * since
        was_above, is_above = is_above, height > _platform(own, before + since)[0]
        if was_above and not is_above:
            break
    else:
        return np.nan
    since -= 0.5 * longest / _GRID
    for _ in range(_STEPS):
        there, speed = _platform(own, before + since)
        height = start + takeoff * since - 0.5 * g * since * since - there
        since -= height / (takeoff - g * since - speed)
    return before + since


@kernel
def _law(flight: float, error: float, times: float) -> tuple[float, float, float, float, float]:
    """Two sizes of the errors of a landing, their shares, and the logarithm of both together.

    The density is in parts of one over the flight. `times`: by which the errors are larger.
    """
    narrow = times * sqrt(error * error + (_NARROW * flight) ** 2)
    wide = times * sqrt(error * error + (_WIDE * flight) ** 2)
    near, far = max(flight, narrow) / (5.0 * narrow), max(flight, wide) / (5.0 * wide)
    return narrow, wide, near, far, log(near + far)


@kernel
def _cost(
    away: float, law: tuple[float, float, float, float, float], before: float, most: float
) -> float:
    """Cost of a chain with a hit so far from its landing; inf where that is not below `most`.

    `before`: its cost without that hit.
    """
    narrow, wide, near, far, top = law
    x = min(0.5 * (away / wide) ** 2, _FAR)
    if not before - top + x < most:
        return inf
    y = min(0.5 * (away / narrow) ** 2, _FAR)
    return before - log(near * exp(-y) + far * exp(-x))


@rare_kernel
def _separation(own: NDArray[np.float64], g: float) -> tuple[float, float, float]:
    """Where the disk leaves after contact: ωt + φ, take-off velocity, and duration of the flight.

    nan where it never comes into contact.
    """
    a, w = own[AMPLITUDE], own[FREQUENCY]
    if not abs(a) * w * w > g:
        return np.nan, np.nan, np.nan
    angle = asin(g / (a * w * w))
    if a < 0.0:
        angle = pi - angle
    left, speed = (angle - own[PHASE]) / w, a * w * cos(angle)
    return angle, speed, _landing(left, speed, own, g) - left


@rare_kernel
def _leave(
    times: NDArray[np.float64],
    j: int,
    best: int,
    separation: tuple[float, float, float],
    own: NDArray[np.float64],
    error: float,
    g: float,
    costs: NDArray[np.float64],
    takeoffs: NDArray[np.float64],
    sources: NDArray[np.int64],
) -> None:
    """From the chain that ends in slot `best` of hit j to later hits by contact.

    Up to the second separation.
    """
    angle, speed, flight = separation
    if not flight > 0.0:
        return
    w, phase = own[FREQUENCY], own[PHASE]
    turn, law = ceil((w * times[j] + phase - angle) / tau), _law(flight, error, 1.0)
    for later in range(2):
        left = (angle + tau * (turn + later) - phase) / w
        for k in range(j + 1, min(j + _SKIPPED + 1, times.size)):
            a, since = k - j - 1, times[k] - left
            if not since > 0.0:
                continue
            slot, before = a * _SLOTS + _CONTACT, costs[j, best] + ODD * (1 + a)
            cost = _cost(since - flight, law, before, costs[k, slot])
            if cost < costs[k, slot]:
                there = _platform(own, times[k])[1]
                fall = speed - g * since - there
                costs[k, slot], sources[k, slot] = cost, best
                takeoffs[k, slot] = there - own[RESTITUTION] * fall


@rare_kernel
def _go_on(
    times: NDArray[np.float64],
    j: int,
    source: int,
    own: NDArray[np.float64],
    error: float,
    g: float,
    dead: float,
    costs: NDArray[np.float64],
    takeoffs: NDArray[np.float64],
    sources: NDArray[np.int64],
) -> None:
    """From the chain that ends in slot `source` of hit j to later hits.

    A landing that has its hit is not missed.
    """
    before, takeoff, spent = times[j], takeoffs[j, source], costs[j, source]
    for m in range(_MISSED):
        landing = _landing(before, takeoff, own, g)
        flight = landing - before
        if not flight > 0.0:
            return
        law, is_reached = _law(flight, error, 1.0 + m), False
        for k in range(j + 1, min(j + _SKIPPED + 1, times.size)):
            a, away = k - j - 1, times[k] - landing
            is_reached |= abs(away) < 2.0 * law[1]
            slot = a * _SLOTS + m
            if times[k] > before:
                cost = _cost(away, law, spent + ODD * a, costs[k, slot])
                if cost < costs[k, slot]:
                    costs[k, slot], sources[k, slot] = cost, source
                    takeoffs[k, slot] = _takeoff(before, times[k], own, g)
        if is_reached:
            return
        takeoff = _takeoff(before, landing, own, g)
        before = landing
        if before - times[j] > dead:
            spent += ODD


@rare_kernel
def _chains(
    times: NDArray[np.float64],
    own: NDArray[np.float64],
    error: float,
    g: float,
    dead: float,
    most: float,
    costs: NDArray[np.float64],
    takeoffs: NDArray[np.float64],
    sources: NDArray[np.int64],
) -> tuple[float, int, int]:
    """Fill the slots of all hits (N, slots); the least cost, and the hit and slot where it ends.

    It stops where no chain can cost less than `most` any more: a chain has one of the last hits, or
    begins after them, or has ended, and each later hit lowers its cost by `_MOST` at most.
    """
    costs[:], sources[:] = inf, -1
    separation = _separation(own, g)
    found, hit, end = inf, 0, 0
    for j in range(1, times.size):
        for a in range(min(_SKIPPED, j)):  # chains that begin with this hit and one before
            slot, cost = a * _SLOTS, ODD * (j - 1)
            if cost < costs[j, slot]:
                costs[j, slot], sources[j, slot] = cost, -1
                takeoffs[j, slot] = _takeoff(times[j - a - 1], times[j], own, g)
        best = np.argmin(costs[j])
        _leave(times, j, best, separation, own, error, g, costs, takeoffs, sources)
        for slot in range(costs.shape[1]):
            if costs[j, slot] < costs[j, best] + _HOPELESS:
                _go_on(times, j, slot, own, error, g, dead, costs, takeoffs, sources)
            cost = costs[j, slot] + ODD * (times.size - 1 - j)
            if cost < found and slot % _SLOTS != _CONTACT:  # a hit after a contact tells nothing
                found, hit, end = cost, j, slot
        least = min(ODD * j, costs[max(j - _SKIPPED + 1, 1) : j + 1].min())
        if min(found, least - _MOST * (times.size - 1 - j)) >= most:
            break
    return found, hit, end


@entry(
    f"float64({_ARRAY}, float64[:, ::1], {_ARRAY}, float64, float64, {_PLACES}, {_ARRAY}, "
    f"{_PLACES}, {_PLACES})"
)
def likeliest_chain(
    times: NDArray[np.float64],
    candidates: NDArray[np.float64],
    errors: NDArray[np.float64],
    g: float,
    dead: float,
    kept: NDArray[np.int64],
    missed: NDArray[np.float64],
    contacts: NDArray[np.int64],
    found: NDArray[np.int64],
) -> float:
    """Least cost of a chain under any of the candidates (G, 6) with errors of landings (G).

    Fills kept (N) and contacts (N) with hits of the chain, and those before a contact, from the
    last one on, missed (2N) with times of impacts without a hit, and found (4): the candidate, and
    how many there are of each.
    """
    slots = _SKIPPED * _SLOTS
    costs, takeoffs = np.empty((times.size, slots)), np.zeros((times.size, slots))
    sources = np.empty((times.size, slots), np.int64)
    least, best = inf, 0
    for i in range(errors.size):
        cost = _chains(times, candidates[i], errors[i], g, dead, least, costs, takeoffs, sources)[0]
        if cost < least:
            least, best = cost, i
    own = candidates[best]
    _, j, slot = _chains(times, own, errors[best], g, dead, inf, costs, takeoffs, sources)
    found[:] = 0
    found[0], found[1], kept[0] = best, 1, j
    while j >= 0:
        source, before, m = sources[j, slot], j - slot // _SLOTS - 1, slot % _SLOTS
        kept[found[1]] = before
        found[1] += 1
        if source < 0:
            break
        if m == _CONTACT:
            contacts[found[3]] = before
            found[3] += 1
        else:
            at, takeoff = times[before], takeoffs[before, source]
            for _ in range(m):
                landing = _landing(at, takeoff, own, g)
                takeoff = _takeoff(at, landing, own, g)
                at = landing
                missed[found[2]] = at
                found[2] += 1
        j, slot = before, source
    return least


@entry(f"void(float64, float64[:, ::1], float64, {_ARRAY})")
def contact_landings(
    at: float, candidates: NDArray[np.float64], g: float, landings: NDArray[np.float64]
) -> None:
    """Fill landings (G) with times after a contact that ends at the first separation after `at`.

    nan where the disk with parameters candidates (G, 6) never comes into contact.
    """
    for i in range(landings.size):
        own = candidates[i]
        angle, _, flight = _separation(own, g)
        w, phase = own[FREQUENCY], own[PHASE]
        turn = ceil((w * at + phase - angle) / tau)
        landings[i] = (angle + tau * turn - phase) / w + flight
