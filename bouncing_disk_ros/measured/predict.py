"""Draws from what a fit leaves open: what follows from it, and the impacts to come, with intervals.

A draw takes a ratio ρ by its weight, a scale, parameters, and true times given these (Gaussian at
the mode; Durbin and Koopman, "A simple and efficient simulation smoother", Biometrika 2002).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.errors import FailedError
from bouncing_disk_ros.measured.kernels.chains import contact_landings
from bouncing_disk_ros.measured.kernels.likelihood import solve_factored
from bouncing_disk_ros.measured.kernels.rest_laws import AMPLITUDE, FREQUENCY, PHASE, RESTITUTION
from bouncing_disk_ros.measured.profiles import LEVEL, Array, Interval, Node, Profiles

SEED = 20090
MOST_IMPACTS = 20
"""That are predicted."""
_POINTS = 64
"""Of a flight, where its height over the platform is looked at."""
_TAIL = 100.0 * (1.0 - LEVEL) / 2.0
FEW, MANY, LONG = 400, 2000, 50
"""Draws that decide, draws of results, and times in a recording from which on these are the same.

An interval of 95 % by one set of 400 draws holds 92 to 97 %, as its set happens to be.
"""
_LEAST = 100
"""Draws in the longest recordings."""


@dataclass(frozen=True)
class Draws:
    """Parameters (M, 6), true times (M, N), scatter and scale of errors (M) of all draws."""

    parameters: Array
    times: Array
    scatter: Array
    scale: Array


@dataclass(frozen=True)
class Prediction:
    """Times of the impacts to come, s, with the ends of their intervals: arrays of one length.

    It ends where an interval is as long as the flight before it, or a flight is over in contact.
    """

    times: Array
    low: Array
    high: Array


NOTHING = Prediction(np.empty(0), np.empty(0), np.empty(0))


def interval_of(values: Array) -> Interval:
    """Median and interval of draws."""
    ends = np.nan_to_num(values, posinf=np.finfo(float).max / 4.0)  # no nan between two infinities
    ends = np.percentile(ends, [_TAIL, 50.0, 100.0 - _TAIL], method="weibull")  # unbiased shares
    low, middle, high = np.where(ends > 1e300, np.inf, ends)
    return Interval(float(middle), float(low), float(high))


def draws_of(profiles: Profiles, most: int = FEW) -> Draws:
    """Draws; as many as take about as long for long recordings as for short ones."""
    data, rng = profiles.data, np.random.default_rng(SEED)
    count = int(np.clip(FEW * LONG // len(data.times), _LEAST, most))
    chosen = rng.choice(len(profiles.nodes), count, p=[node.weight for node in profiles.nodes])
    roots = {i: _root(profiles.covariance(profiles.nodes[i])) for i in set(chosen)}
    rows = [row for i in chosen if (row := _draw(profiles, profiles.nodes[i], roots[i], rng))]
    if not rows:
        hint = "is the frequency right? if so, leave out scatter:=0.0, or fit a part of the times"
        raise FailedError(f"no motion near the likeliest one has such impacts; {hint}")
    parameters, times, scatter, scale = zip(*rows, strict=True)
    return Draws(np.array(parameters), np.array(times), np.array(scatter), np.array(scale))


def _root(covariance: Array) -> Array:
    """A matrix that makes draws with this covariance from independent ones."""
    sizes, axes = np.linalg.eigh(covariance)
    return np.asarray(axes * np.sqrt(np.maximum(sizes, 0.0)))


def _draw(
    profiles: Profiles, node: Node, root: Array, rng: np.random.Generator
) -> tuple[Array, Array, float, float] | None:
    """A draw from one node; None where there are no such true times."""
    data, free = profiles.data, list(profiles.model.free)
    spread = 1.0
    if not data.is_absolute and profiles.degrees > 0:
        spread = math.sqrt(profiles.degrees / rng.chisquare(profiles.degrees))
    p, n = node.p.copy(), len(data.times) - 2
    p[free] += spread * root @ rng.standard_normal(len(free))
    scale = spread * profiles.scale(node)
    found = profiles.fit(node.rho, p, node.times, ())
    if found.squares > 1e299:
        return None
    th, b, low = found.times, found.slopes, found.factor
    noise = scale * data.errors * rng.standard_normal(n + 2)
    sides = sum(b[:, m] * noise[m : n + m] for m in range(3))
    sides = sides + scale * node.rho * rng.standard_normal(n)
    solve_factored(low, sides)
    for m in range(3):
        noise[m : n + m] -= data.errors[m : n + m] ** 2 * b[:, m] * sides
    return p, th + noise, scale * node.rho, scale


def part_possible(profiles: Profiles, draws: Draws) -> float:
    """The part of the draws in which the disk is never below the platform on any flight.

    Other flights are those of a wrong frequency, or of a contact that was not found.
    """
    p, times = draws.parameters, draws.times
    if p[0, FREQUENCY] == 0.0:
        return 1.0
    flown = np.delete(np.arange(times.shape[1] - 1), profiles.data.contacts)
    w, a, phase = (p[:, i, None] for i in (FREQUENCY, AMPLITUDE, PHASE))
    start, duration = times[:, flown], np.diff(times)[:, flown]
    is_above = flies_above(start, duration, (a, w, phase), profiles.model.gravity)
    return float(is_above.all(axis=1).mean())


def flies_above(
    start: Array, duration: Array, motion: tuple[Array, Array, Array], gravity: float
) -> NDArray[np.bool_]:
    """Whether the disk is never below the platform, of each flight; `motion`: A, ω and φ."""
    a, w, phase = motion
    begin, end = (a * np.sin(w * (start + part * duration) + phase) for part in (0.0, 1.0))
    is_above = np.ones(begin.shape, bool)
    for part in np.arange(1, _POINTS) / _POINTS:
        fall = 0.5 * gravity * part * (1.0 - part) * duration**2
        height = begin + part * (end - begin) + fall
        is_above &= ~(height < a * np.sin(w * (start + part * duration) + phase))
    return is_above


def is_reached(draws: Draws, gravity: float, before: float, hit: float) -> bool:
    """Whether a hit can be the first one after a contact that began with the one before.

    That is among the landings of the draws, at the level of the intervals. The disk leaves at the
    first or second separation.
    """
    landings = np.empty(len(draws.times))
    contact_landings(before, draws.parameters, gravity, landings)
    landings = landings[np.isfinite(landings)]
    if len(landings) < (1.0 - LEVEL) * len(draws.times):
        return False
    period = math.tau / float(draws.parameters[:, FREQUENCY].mean())
    low, high = np.percentile(landings, [_TAIL, 100.0 - _TAIL])
    return bool(low <= hit <= high or low <= hit - period <= high)


def rest_parameters(
    draws: Draws, gravity: float, height: float, is_released: bool
) -> dict[str, Interval]:
    """What follows at rest: first flight, end of all bounces, height of the release.

    With the height of the release known, gravity in its place. The drop takes as long as the first
    time tells, where it is that of the release, else T₀/(2ε).
    """
    eps = draws.parameters[:, RESTITUTION]
    begun = int(is_released)
    first = draws.times[:, begun + 1] - draws.times[:, begun]
    drop = draws.times[:, 1] - draws.times[:, 0] if is_released else 0.5 * first / eps
    last = draws.times[:, -1] - draws.times[:, -2]
    end = np.where(eps < 1.0, draws.times[:, -1] + last * eps / np.maximum(1.0 - eps, 1e-9), np.inf)
    released = 0.5 * drop**2
    found = {"first_flight": interval_of(first), "end": interval_of(end)}
    if height > 0.0:
        return found | {"gravity": interval_of(height / released)}
    return found | {"first_height": interval_of(gravity * released)}


def predicted(profiles: Profiles, draws: Draws) -> Prediction:
    """The impacts after the last one."""
    rng = np.random.default_rng(SEED)
    at_rest = draws.parameters[0, FREQUENCY] == 0.0
    coming = (_at_rest if at_rest else _vibrating)(profiles, draws, rng)
    rows = []
    before = float(np.median(draws.times[:, -1]))
    for column in coming.T:
        if not np.isfinite(column).all():
            break
        found = interval_of(column)
        if found.high - found.low > found.value - before:
            break
        rows.append((found.value, found.low, found.high))
        before = found.value
    values = np.array(rows).reshape(-1, 3)
    return Prediction(values[:, 0], values[:, 1], values[:, 2])


def _restitutions(draws: Draws, rng: np.random.Generator) -> Array:
    noise = rng.standard_normal((len(draws.scatter), MOST_IMPACTS))
    each = draws.parameters[:, RESTITUTION, None] + draws.scatter[:, None] * noise
    return np.asarray(np.clip(each, 0.0, 1.0))


def _at_rest(_profiles: Profiles, draws: Draws, rng: np.random.Generator) -> Array:
    last = draws.times[:, -1] - draws.times[:, -2]
    flights = last[:, None] * np.cumprod(_restitutions(draws, rng), axis=1)
    return np.asarray(draws.times[:, -1:] + np.cumsum(flights, axis=1))


def _vibrating(profiles: Profiles, draws: Draws, rng: np.random.Generator) -> Array:
    """By the next-collision map, an impact at a time: each has its own restitution."""
    g, coming = profiles.model.gravity, np.full((len(draws.times), MOST_IMPACTS), np.nan)
    for i, each in enumerate(_restitutions(draws, rng)):
        found = flown_on(draws.parameters[i], g, draws.times[i, -2:], each)
        coming[i, : len(found)] = found
    return coming


def flown_on(p: Array, g: float, last: Array, restitutions: Array) -> Array:
    """Times of impacts after the last two, each with its restitution; fewer, where contact comes.

    The platform vibrates with parameters p.
    """
    from bouncing_disk_ros.maps.axial_map import (
        MAP_REST,
        ORBIT_DELAY,
        ORBIT_KIND,
        ORBIT_TAU,
        ORBIT_W,
        axial_orbit,
    )

    (before, at), found = last, []
    w, a = p[FREQUENCY], abs(p[AMPLITUDE])
    phase = p[PHASE] + (math.pi if p[AMPLITUDE] < 0.0 else 0.0)
    here, there = w * at + phase, w * before + phase
    fall = a * (math.sin(here) - math.sin(there)) / (at - before) - 0.5 * g * (at - before)
    tau, speed = here % math.tau, min((fall - a * w * math.cos(here)) * w / (math.pi * g), 0.0)
    forcing, row = a * w * w / (math.pi * g), np.zeros((1, ORBIT_KIND + 1))
    for restitution in restitutions:
        axial_orbit(tau, speed, forcing, float(restitution), 1, row)
        if row[0, ORBIT_KIND] == MAP_REST:
            break
        tau, speed = row[0, ORBIT_TAU], row[0, ORBIT_W]
        at += row[0, ORBIT_DELAY] / w
        found.append(at)
    return np.array(found)
