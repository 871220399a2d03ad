"""Intervals by a parametric bootstrap: the fitted model is simulated, and fitted again.

Flights are not exchangeable, so experiments are simulated as a whole, with the scatter and the
errors of one ratio ρ that is drawn by its weight. Each gives a deviation from the truth in its own
standard deviations; their quantiles make the interval ("bootstrap-t": Efron and Tibshirani, "An
introduction to the bootstrap", 1993, 12.5).
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from bouncing_disk_ros.errors import FailedError
from bouncing_disk_ros.measured.kernels.rest_laws import FREQUENCY, PHASE, RESTITUTION
from bouncing_disk_ros.measured.predict import flown_on
from bouncing_disk_ros.measured.profiles import LEVEL, Array, Interval, Node, Profiles

SEED = 20092


def bootstrapped(profiles: Profiles, count: int) -> dict[int, Interval]:
    """Intervals of the free parameters from so many experiments."""
    rng, free = np.random.default_rng(SEED), profiles.model.free
    weights = [node.weight for node in profiles.nodes]
    away: list[list[float]] = []
    for _ in range(2 * count):
        node = profiles.nodes[int(rng.choice(len(weights), p=weights))]
        found = _again(profiles, node, rng)
        if found is not None:
            estimate = found.estimate
            away.append([(estimate[i] - node.p[i]) / found.deviation(i) for i in free])
        if len(away) == count:
            break
    else:
        raise FailedError(f"bootstrap: {len(away)} of {2 * count} experiments without contact")
    tail = 50.0 * (1.0 - LEVEL)
    ends = np.percentile(np.array(away), [100.0 - tail, tail], axis=0)
    found_intervals = {}
    for place, index in enumerate(free):
        value, width = float(profiles.estimate[index]), profiles.deviation(index)
        low, high = (float(value - width * end) for end in ends[:, place])
        found_intervals[index] = Interval(value, low, high)
    return found_intervals


def _again(profiles: Profiles, node: Node, rng: np.random.Generator) -> Profiles | None:
    """The fit of one simulated experiment; None where the disk came into contact, or none fits."""
    data, model, scale = profiles.data, profiles.model, profiles.scale(node)
    times = node.times.copy()
    if node.rho > 0.0:
        each = node.p[RESTITUTION] + scale * node.rho * rng.standard_normal(len(times))
        if not _simulate(profiles, node.p, np.clip(each, 0.0, None), times):
            return None
    seen = times + np.where(data.missed, 0.0, scale * data.errors) * rng.standard_normal(len(times))
    if model.phase is not None:
        error = model.phase[1]
        model = replace(model, phase=(node.p[PHASE] + error * rng.standard_normal(), error))
    if not (np.diff(seen) > 0.0).all():
        return None
    found = Profiles(replace(data, times=seen), model, node.p)
    return found if found.cost(found.best) < math.inf else None


def _simulate(profiles: Profiles, p: Array, each: Array, times: Array) -> bool:
    """Replace the times after the first two of each part; whether no part came into contact."""
    data, g = profiles.data, profiles.model.gravity
    starts = [0, *(place + 1 for place in data.contacts)]
    period = math.tau / p[FREQUENCY] if p[FREQUENCY] > 0.0 else 0.0
    later = 0.0  # whole periods by which the parts before are longer than they were
    for start, end in zip(starts, [*starts[1:], len(times)], strict=True):
        part, own = times[start:end], each[start + 1 : end - 1]
        last = part[-1]
        part += later
        if len(part) < 3:
            continue
        if period == 0.0:
            flights = (part[1] - part[0]) * np.cumprod(own)
            part[2:] = part[1] + np.cumsum(flights * (1.0 + float(data.is_released)))
        else:
            found = flown_on(p, g, part[:2], own)
            if len(found) < len(own):
                return False
            part[2:] = found
            later = max(math.ceil((part[-1] - last) / period), 0) * period
    return True
