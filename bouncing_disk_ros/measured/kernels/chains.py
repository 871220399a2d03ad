"""The likeliest chain of flights through hits: kernels.

A chain that ends with hits j - a - 1 and j has the slot (a, m) of hit j, with m missed impacts in
between. The last m stands for a contact. The best chain of each slot stays (dynamic programming).
A chain may also begin anew after a gap, where the law leads to no hit any more.
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

ODD, GAP = 3.0, 9.0
"""Costs of a false or missed impact, a part of 5 %, and of a gap: three are missed, or more."""
MOST_MISSED = 12
"""Missed impacts between two hits of a chain, at most."""
_SKIPPED, _LANDINGS, _LANDINGS_AT_REST = 4, 3, MOST_MISSED + 1
"""Hits to look ahead (three may be false), landings to look ahead (two may be missed).

Of parts of 5 %, four false ones in a row come once in 160 000 hits, three missed once in 8000. At
rest errors do not grow from flight to flight. A chain there whose second impact is missed begins
before so many hits.
"""
MOST_ODD = 3
"""Missed impacts in a row that count: more are missed for one reason."""
_BEGUN, _ANEW = -1, -2
"""Sources of chains of two hits: at the first hits, and after a gap."""
_NARROW, _WIDE = 2e-3, 1.5e-2
"""Errors in parts of the flight: of most landings, and of those that the law fits worse."""
_FAR = 600.0
"""Of half a squared deviation: beyond it nothing is likelier than something else."""
_GRID = 64
"""Points of a flight where its height is looked at."""
_GRAZE = 1e-6
"""Least speed of a landing, in parts of the change of speed in the flight."""
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
def _takeoff(
    before: float, at: float, own: NDArray[np.float64], g: float
) -> tuple[float, float, float]:
    """Velocity after the landing of a flight, and its derivatives by the end and the begin."""
    start, begun = _platform(own, before)
    end, speed = _platform(own, at)
    duration = at - before
    mean, bend = (end - start) / duration, -own[FREQUENCY] * own[FREQUENCY] * end
    fall = mean - 0.5 * g * duration - speed
    eps = own[RESTITUTION] + 2.0 * own[SLOPE] * fall
    by_end = bend - eps * ((speed - mean) / duration - 0.5 * g - bend)
    by_begin = -eps * ((mean - begun) / duration + 0.5 * g)
    return speed - (own[RESTITUTION] + own[SLOPE] * fall) * fall, by_end, by_begin


@kernel
def _landing(before: float, takeoff: float, own: NDArray[np.float64], g: float) -> float:
    """Time of the end of a flight, nan if there is none."""
    a = abs(own[AMPLITUDE])
    start, speed = _platform(own, before)
    longest = (takeoff + sqrt(max(takeoff * takeoff + 2.0 * g * (start + a), 0.0))) / g
    if a == 0.0:
        return before + longest
    if not 0.0 < longest < inf:
        return np.nan
    above, points = sqrt(max(takeoff * takeoff + 2.0 * g * (start - a), 0.0)), _GRID / (g * longest)
    first, last = ceil((takeoff - above) * points), int((takeoff + above) * points)
    w, is_above, i = own[FREQUENCY], False, 0
    by_cos, by_sin = cos(w * longest / _GRID), sin(w * longest / _GRID)
    x, y = start, speed / w  # of the platform: turned by a step, which is faster than its sine
    while i < _GRID:
        i += 1
        if first <= i < last:  # in between the disk is higher than the platform ever is
            is_above, i = True, last
            x, y = _platform(own, before + longest * i / _GRID)
            y /= w
        else:
            x, y = x * by_cos + y * by_sin, y * by_cos - x * by_sin
        since = longest * i / _GRID
        height = start + takeoff * since - 0.5 * g * since * since
        was_above, is_above = is_above, height > x
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


@rare_kernel
def _begin(
    before: float, after: float, missed: int, own: NDArray[np.float64], g: float
) -> tuple[float, float, float, float]:
    """The first flight with impacts missed between two hits at rest.

    Also the take-off of the later hit, as `_takeoff` has it. On a vibrating platform several
    flights are possible: nan.
    """
    if own[AMPLITUDE] != 0.0:
        return np.nan, np.nan, np.nan, np.nan
    flight = last = after - before
    for _ in range(_STEPS):
        last = total = flight
        for _ in range(missed):
            last *= own[RESTITUTION] - own[SLOPE] * 0.5 * g * last
            total += last
        flight *= (after - before) / total
    takeoff, by_end, by_at = _takeoff(after - last, after, own, g)
    part = last / (after - before)
    return flight, takeoff, by_end + by_at * (1.0 - part), by_at * part


@rare_kernel
def _moved(
    before: float,
    landing: float,
    takeoff: float,
    moves: NDArray[np.float64],
    own: NDArray[np.float64],
    g: float,
) -> float:
    """How far errors of one move a hit and its landing apart.

    Replaces moves (2, 2) of the begin of the flight and of its take-off velocity by those of the
    landing and of the take-off there: by the time of the hit before it, and by the one before that.
    """
    began = _platform(own, before)[1]
    end, speed = _platform(own, landing)
    duration = landing - before
    fall, bend = takeoff - g * duration - speed, -own[FREQUENCY] * own[FREQUENCY] * end
    eps, total = own[RESTITUTION] + 2.0 * own[SLOPE] * fall, 1.0
    for i in range(2):
        start, up = moves[0, i], moves[1, i]
        at = ((began - speed - fall) * start + duration * up) / max(-fall, _GRAZE * g * duration)
        moves[0, i] = at
        moves[1, i] = bend * at - eps * (up - g * (at - start) - bend * at)
        total += at * at
    return sqrt(total)


@kernel
def _size(flight: float, error: float, part: float) -> float:
    """Size of the errors of a landing, which times have, and the law as a part of the flight."""
    return sqrt(error * error + (part * flight) ** 2)


@kernel
def _half_square(away: float, size: float) -> float:
    return min(0.5 * (away / size) ** 2, _FAR)


@kernel
def _law(flight: float, error: float, times: float) -> tuple[float, float, float, float, float]:
    """Two sizes of the errors of a landing, their shares, and the logarithm of both together.

    The density is in parts of one over the flight. `error`: from those of times; `times`: by which
    the errors of the law are larger.
    """
    narrow, wide = _size(flight, error, times * _NARROW), _size(flight, error, times * _WIDE)
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
    x, y = _half_square(away, wide), _half_square(away, narrow)
    if not before - top + x < most:
        return inf
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
    slots = costs.shape[1] // _SKIPPED
    w, phase = own[FREQUENCY], own[PHASE]
    turn, law = ceil((w * times[j] + phase - angle) / tau), _law(flight, error, 1.0)
    for later in range(2):
        left = (angle + tau * (turn + later) - phase) / w
        for k in range(j + 1, min(j + _SKIPPED + 1, times.size)):
            a, since = k - j - 1, times[k] - left
            if not since > 0.0:
                continue
            slot, before = a * slots + slots - 1, costs[j, best] + ODD * (1 + a)
            cost = _cost(since - flight, law, before, costs[k, slot])
            if cost < costs[k, slot]:
                place, there = _platform(own, times[k])
                fall, bend = speed - g * since - there, -w * w * place
                costs[k, slot], sources[k, slot] = cost, best
                takeoffs[k, slot, 0] = there - own[RESTITUTION] * fall
                takeoffs[k, slot, 1] = bend + own[RESTITUTION] * (g + bend)
                takeoffs[k, slot, 2] = 0.0


@rare_kernel
def _go_on(
    times: NDArray[np.float64],
    j: int,
    source: int,
    own: NDArray[np.float64],
    error: float,
    g: float,
    dead: float,
    most: float,
    costs: NDArray[np.float64],
    takeoffs: NDArray[np.float64],
    sources: NDArray[np.int64],
) -> None:
    """From the chain that ends in slot `source` of hit j to later hits.

    A landing that has its hit is not missed. Chains that cannot cost less than `most` in the end
    are left out.
    """
    before, takeoff, spent = times[j], takeoffs[j, source, 0], costs[j, source]
    slots, end = costs.shape[1] // _SKIPPED, min(j + _SKIPPED + 1, times.size)
    moves = np.empty((2, 2))
    moves[0, 0], moves[0, 1] = 1.0, 0.0
    moves[1, 0], moves[1, 1] = takeoffs[j, source, 1], takeoffs[j, source, 2]
    for m in range(slots - 1):
        if not times[end - 1] > before:
            return
        landing = _landing(before, takeoff, own, g)
        flight = landing - before
        if not flight > 0.0:
            return
        begun = sqrt(moves[0, 0] ** 2 + moves[0, 1] ** 2)
        spread = _moved(before, landing, takeoff, moves, own, g) * error
        wide, is_reached = _size(flight, spread, (1.0 + m) * _WIDE), False
        for k in range(j + 1, end):
            a, away = k - j - 1, times[k] - landing
            is_reached |= abs(away) < 2.0 * wide
            slot, cost = a * slots + m, spent + ODD * a
            below = min(costs[k, slot], most + _MOST * (times.size - 1 - k))
            if times[k] > before and cost - _MOST + _half_square(away, wide) < below:
                cost = _cost(away, _law(flight, spread, 1.0 + m), cost, below)
                if cost < below:
                    costs[k, slot], sources[k, slot] = cost, source
                    u, by_end, by_begin = _takeoff(before, times[k], own, g)
                    takeoffs[k, slot, 0] = u
                    takeoffs[k, slot, 1], takeoffs[k, slot, 2] = by_end, begun * by_begin
        if is_reached:
            return
        takeoff = _takeoff(before, landing, own, g)[0]
        before = landing
        if before - times[j] > dead and m < MOST_ODD:
            spent += ODD


@rare_kernel
def _begin_with(
    times: NDArray[np.float64],
    j: int,
    own: NDArray[np.float64],
    g: float,
    costs: NDArray[np.float64],
    takeoffs: NDArray[np.float64],
    sources: NDArray[np.int64],
    anew: NDArray[np.float64],
) -> None:
    """Chains that begin with hit j and one before, at the first hits or after a gap."""
    slots = costs.shape[1] // _SKIPPED
    for a in range(min(_SKIPPED, j)):
        first, slot = j - a - 1, a * slots
        cost, source = ODD * (j - 1), _BEGUN
        if anew[first] + ODD * a < cost:
            cost, source = anew[first] + ODD * a, _ANEW
        if cost < costs[j, slot]:
            costs[j, slot], sources[j, slot] = cost, source
            u, by_end, by_begin = _takeoff(times[first], times[j], own, g)
            takeoffs[j, slot, 0] = u
            takeoffs[j, slot, 1], takeoffs[j, slot, 2] = by_end, by_begin
        for m in range(1, _LANDINGS if j <= _SKIPPED else 1):  # missed in between
            slot, cost = a * slots + m, ODD * (j - 1 + m)
            if cost < costs[j, slot]:
                flight, u, by_end, by_begin = _begin(times[first], times[j], m, own, g)
                if flight > 0.0:
                    costs[j, slot], sources[j, slot] = cost, _BEGUN
                    takeoffs[j, slot, 0] = u
                    takeoffs[j, slot, 1], takeoffs[j, slot, 2] = by_end, by_begin


@rare_kernel
def _ends(j: int, costs: NDArray[np.float64], sources: NDArray[np.int64]) -> tuple[int, int]:
    """Slots of the likeliest chains that may end with hit j, and that may end there before a gap.

    -1: none. A hit after a contact tells nothing, nor do two after a gap or before one.
    """
    slots, end, before_gap = costs.shape[1] // _SKIPPED, -1, -1
    for slot in range(costs.shape[1]):
        source = sources[j, slot]
        if slot % slots == slots - 1 or source == _ANEW or not costs[j, slot] < inf:
            continue
        if end < 0 or costs[j, slot] < costs[j, end]:
            end = slot
        if source != _BEGUN and (before_gap < 0 or costs[j, slot] < costs[j, before_gap]):
            before_gap = slot
    return end, before_gap


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
    anew: NDArray[np.float64],
    ended: NDArray[np.int64],
) -> tuple[float, int, int]:
    """Fill the slots of all hits (N, slots); the least cost, and the hit and slot where it ends.

    takeoffs (N, slots, 3): with derivatives by the times of the hit and of the one before. anew
    (N): least cost of chains that ended before a gap, after which each hit may begin anew; ended
    (N): their hits and slots. It stops where no chain can cost less than `most` any more: a chain
    has one of the last hits, or begins after them, or has ended, and each later hit lowers its cost
    by `_MOST` at most.
    """
    costs[:], sources[:] = inf, _BEGUN
    anew[:], ended[:] = inf, 0
    separation, found, hit, end = _separation(own, g), inf, 0, 0
    for j in range(1, times.size):
        _begin_with(times, j, own, g, costs, takeoffs, sources, anew)
        best = np.argmin(costs[j])
        _leave(times, j, best, separation, own, error, g, costs, takeoffs, sources)
        # a chain that costs more here cannot become the likeliest one
        bound = min(found, most)
        useless = bound + _MOST * (times.size - 1 - j)
        for slot in range(costs.shape[1]):
            if costs[j, slot] < min(costs[j, best] + _HOPELESS, useless):
                _go_on(times, j, slot, own, error, g, dead, bound, costs, takeoffs, sources)
        slot, before_gap = _ends(j, costs, sources)
        left = ODD * (times.size - 1 - j)
        if slot >= 0 and costs[j, slot] + left < found:
            found, hit, end = costs[j, slot] + left, j, slot
        if j + 1 == times.size:
            break
        anew[j + 1], ended[j + 1] = anew[j] + ODD, ended[j]
        if own[AMPLITUDE] != 0.0 and before_gap >= 0 and costs[j, before_gap] + GAP < anew[j + 1]:
            anew[j + 1], ended[j + 1] = costs[j, before_gap] + GAP, j * costs.shape[1] + before_gap
        least = min(ODD * j, anew[j + 1], costs[max(j - _SKIPPED + 1, 1) : j + 1].min())
        if min(found, least - _MOST * (times.size - 1 - j)) >= most:
            break
    return found, hit, end


@rare_kernel
def _fill_missed(
    at: float, takeoff: float, count: int, own: NDArray[np.float64], g: float,
    missed: NDArray[np.float64],
) -> None:  # fmt: skip
    """Fill missed with so many landings."""
    for i in range(count):
        landing = _landing(at, takeoff, own, g)
        takeoff = _takeoff(at, landing, own, g)[0]
        missed[i] = at = landing


@entry(
    f"float64({_ARRAY}, float64[:, ::1], {_ARRAY}, float64, float64, float64, {_PLACES}, "
    f"{_ARRAY}, {_PLACES}, {_PLACES})"
)
def likeliest_chain(
    times: NDArray[np.float64],
    candidates: NDArray[np.float64],
    errors: NDArray[np.float64],
    g: float,
    dead: float,
    most: float,
    kept: NDArray[np.int64],
    missed: NDArray[np.float64],
    contacts: NDArray[np.int64],
    found: NDArray[np.int64],
) -> float:
    """Least cost of a chain under any of the candidates (G, 6) with errors of landings (G).

    inf, and nothing is filled, if none costs less than `most`.
    Fills kept (N) and contacts (N) with hits of the chain, and those before a contact or a gap,
    from the last one on, missed (N times MOST_MISSED) with times of impacts without a hit, and
    found (4): the candidate, and how many there are of each.
    """
    landings = _LANDINGS if candidates[:, AMPLITUDE].any() else _LANDINGS_AT_REST
    slots = landings + 1  # and of contact
    width = _SKIPPED * slots
    costs, takeoffs = np.empty((times.size, width)), np.zeros((times.size, width, 3))
    sources, anew = np.empty((times.size, width), np.int64), np.empty(times.size)
    ended, least, best = np.empty(times.size, np.int64), most, -1
    for i in range(errors.size):
        cost = _chains(
            times, candidates[i], errors[i], g, dead, least, costs, takeoffs, sources, anew, ended
        )[0]
        if cost < least:
            least, best = cost, i
    if best < 0:
        return inf
    own = candidates[best]
    _, j, slot = _chains(
        times, own, errors[best], g, dead, inf, costs, takeoffs, sources, anew, ended
    )
    found[:] = 0
    found[0], found[1], kept[0] = best, 1, j
    while True:
        source, before, m = sources[j, slot], j - slot // slots - 1, slot % slots
        kept[found[1]] = before
        found[1] += 1
        if source == _ANEW:
            source, before = ended[before] % width, ended[before] // width
            kept[found[1]], contacts[found[3]] = before, before
            found[1] += 1
            found[3] += 1
        elif m == slots - 1:
            contacts[found[3]] = before
            found[3] += 1
        elif m:
            if source == _BEGUN:
                takeoff = 0.5 * g * _begin(times[before], times[j], m, own, g)[0]
            else:
                takeoff = takeoffs[before, source, 0]
            _fill_missed(times[before], takeoff, m, own, g, missed[found[2] :])
            found[2] += m
        if source == _BEGUN:
            break
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
