"""Pinned runs of the next-collision map and of single tosses."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros import parameters
from bouncing_disk_ros.core.model import Disk
from bouncing_disk_ros.maps.attractor_search import find_attractors
from bouncing_disk_ros.maps.attractors import AttractorKind, Attractors
from bouncing_disk_ros.maps.axial_map import axial_orbit
from bouncing_disk_ros.maps.basin_labels import (
    LaneRule,
    StartLabels,
    known_points,
    label_lanes,
    label_starts,
)
from bouncing_disk_ros.maps.basin_measures import (
    basin_entropy,
    box_dimension,
    uncertainty_exponent,
)
from bouncing_disk_ros.maps.best_lag import best_lag
from bouncing_disk_ros.maps.best_toss import extreme
from bouncing_disk_ros.maps.bifurcations import period_doublings
from bouncing_disk_ros.maps.lanes.attractor_lanes import measure_attractors
from bouncing_disk_ros.maps.lanes.axial_lanes import iterate_axial
from bouncing_disk_ros.maps.map_tangent import axial_tangent
from bouncing_disk_ros.maps.next_collision import MapState, NextCollisionMap
from bouncing_disk_ros.maps.periodic_orbit import PeriodicOrbit, fixed_point
from bouncing_disk_ros.maps.rotation_map import collision_orbit, measure_attractor
from bouncing_disk_ros.maps.settled_speed import settled_speeds
from bouncing_disk_ros.maps.toss_paths import toss_paths, toss_trajectory
from bouncing_disk_ros.maps.tosses import TossSetting, TossTable, toss
from support.digest import Near, nearly
from support.pinned_draws import Draw, Runs, plain, seeded

Floats = NDArray[np.float64]
PLATFORMS = ((0.30, 0.5), (0.36, 0.5), (0.45, 0.5), (0.488, 0.5), (0.55, 0.5), (0.7, 0.3),
             (0.34, 0.8), (1.2, 0.1), (0.45, 0.0), (0.25, 0.9))  # fmt: skip
"""Γ and ε: rest, chattering, period-1, period-2, fractal basins, chaos, and the ends."""


def drawn_starts(seed: int, count: int, columns: int) -> Floats:
    """τ, w and, if wanted, α̇ of so many starts."""
    draw = Draw(seed)
    rows = [(draw.number(0.0, 6.28318), draw.number(-5.0, -1e-3), draw.number(-1.5, 1.5))
            for _ in range(count)]  # fmt: skip
    return np.ascontiguousarray(np.array(rows)[:, :columns])


def drawn_parameters(seed: int, count: int, columns: int) -> Floats:
    """Γ, ε and, if wanted, θ and Γ_T of so many trajectories."""
    draw = Draw(seed)
    rows = [
        (draw.one_of(draw.number(0.0, 0.33), draw.number(0.3, 1.5), draw.number(0.3, 0.8)),
         draw.one_of(0.0, 1.0, draw.number(0.0, 1.0), draw.number(0.2, 0.8)),
         draw.number(-3.1, 3.1), draw.one_of(draw.decades(-1, 3), math.inf))
        for _ in range(count)
    ]  # fmt: skip
    return np.ascontiguousarray(np.array(rows)[:, :columns])


def grid(side: int, low: float = -5.0) -> Floats:
    """Centres of side × side pixels of the window."""
    centres = (np.arange(side) + 0.5) / side
    tau, w = np.meshgrid(math.tau * centres, low * (1.0 - centres))
    return np.stack([tau.ravel(), w.ravel()], axis=1)


def axial(seed: int) -> Any:
    """Impacts after (τ, w) at Γ, ε."""
    start, given = drawn_starts(seed, 6, 2), drawn_parameters(seed, 6, 2)
    out = np.zeros((6, 100, 4))
    return [[axial_orbit(*s, *p, 100, rows), rows]
            for s, p, rows in zip(start.tolist(), given.tolist(), out, strict=True)]  # fmt: skip


def rotating(seed: int) -> Any:
    """Impacts after (τ, w, α̇) at Γ, ε, θ, Γ_T."""
    start, given = drawn_starts(seed, 6, 3), drawn_parameters(seed, 6, 4)
    out = np.zeros((6, 100, 6))
    return [[collision_orbit(*s, *p, 100, rows), rows]
            for s, p, rows in zip(start.tolist(), given.tolist(), out, strict=True)]  # fmt: skip


def lanes(seed: int) -> Any:
    """Axial lanes, as many as fill some rounds and part of one."""
    n = 100 + 37 * seed
    tau, w = (column.copy() for column in drawn_starts(seed, n, 2).T)
    forcing, restitution = (column.copy() for column in drawn_parameters(seed, n, 2).T)
    counts = np.zeros((n, 2), np.int64)
    iterate_axial(tau, w, forcing, restitution, 50 + 10 * seed, counts)
    return [tau, w, counts]


def attractor(place: int) -> Any:
    """Attractors one by one: last state, impacts and means."""
    found = []
    for start in ([0.74, -1.33, 0.5], *drawn_starts(500 + place, 1, 3).tolist()):
        state, out, results = np.array([*start, 1.0, 0.0]), np.zeros((20, 6)), np.zeros(5)
        count = measure_attractor(state, *PLATFORMS[place], 0.3, 20.0, 500, 1000, out, results)
        # with its Lyapunov exponent, which takes logarithms of the C library
        found.append([count, state, out, np.delete(results, 2), Near(results[2])])
    return found


def attractor_lanes(seed: int) -> Any:
    n = 60 + 11 * seed
    starts, given = drawn_starts(600 + seed, n, 3), drawn_parameters(600 + seed, n, 4)
    states = np.hstack([starts, np.ones((n, 1)), np.zeros((n, 1))])
    out, results = np.zeros((n, 5, 6)), np.zeros((n, 5))
    measure_attractors(states, given, 100, 200, out, results)
    return [states, out, np.delete(results, 2, 1), nearly(results[:, 2])]


def derivatives(place: int) -> Any:
    """An orbit with its derivatives."""
    start, found = drawn_starts(700 + place, 1, 2)[0].tolist(), []
    for n in (1, 3, 10):
        states, tangent = np.zeros((n + 1, 3)), np.zeros((2, 4))
        found.append(
            [axial_tangent(*start, *PLATFORMS[place], n, states, tangent), states, tangent]
        )
    return found


@cache
def found(place: int) -> Attractors:
    starts = [(float(tau), float(w)) for tau, w in grid(6)]
    return find_attractors(NextCollisionMap(*PLATFORMS[place]), starts)


def attractors(place: int) -> Any:
    """Each kind by its place among the kinds."""
    kinds = list(AttractorKind)
    # points of periodic ones come from Newton's method, which solves equations by LAPACK
    rows = [
        [kinds.index(kind), cycles, nearly([multiplier]),
         nearly([phases, speeds]) if kind is AttractorKind.PERIODIC else [phases, speeds]]
        for kind, phases, speeds, cycles, multiplier in found(place).found
    ]  # fmt: skip
    return [rows, found(place).after_contact, found(place).unresolved]


def labels(place: int, side: int = 24) -> Any:
    tau, w = (column.copy() for column in grid(side).T)
    return list(label_starts(found(place), NextCollisionMap(*PLATFORMS[place]), tau, w))


def lane_labels(seed: int) -> Any:
    """The rule of the lanes with points that are given, not found."""
    points = np.array([[1.0, -1.3], [0.8, -1.2], [0.736624, -1.333333], [2.0, -2.0]])
    tau, w = (column.copy() for column in grid(20).T)
    given = StartLabels(np.zeros(400, np.int32), np.zeros(400, np.int32), np.zeros(400))
    known, rule = (
        known_points(points, np.array([0, 1, 2, 2], np.int32)),
        LaneRule(1e-3, 8.0, 98, 99, 400),
    )
    label_lanes(tau, w, (0.36, 0.45, 0.55)[seed], 0.5, known, rule, given)
    return list(given)


def boundary(place: int) -> Any:
    """Entropy, box dimension and uncertainty exponent."""
    label = labels(place, 40)[0].reshape(40, 40)
    found = basin_entropy(label), box_dimension(label), uncertainty_exponent(label)
    return nearly([list(one) for one in found])


def best_lags(place: int) -> Any:
    section = NextCollisionMap(*PLATFORMS[place], 0.0, 30.0)
    # a maximum is flat: where it lies is known to half of the digits
    return [[nearly(lag, 5), nearly(speed)]
            for lag, speed in (best_lag(one, section) for one in found(place).found)]  # fmt: skip


def speeds(place: int) -> Any:
    section = NextCollisionMap(*PLATFORMS[place], 0.2, 20.0)
    return settled_speeds(found(place), section, np.array([0.0, -2.0]))


def jacobian(place: int) -> Any:
    """An orbit of the map as an object, and its derivatives."""
    section = NextCollisionMap(*PLATFORMS[place], 0.4, 15.0)
    state = MapState(*drawn_starts(800 + place, 1, 3)[0].tolist())
    tau, w, slip, *rest = section.orbit(state, 2)
    return [tau, w, rest, nearly([slip, section.jacobian(state, 2)])]


def orbit_numbers(orbit: PeriodicOrbit) -> Any:
    sizes = [abs(one) for one in orbit.multipliers]
    return nearly([*orbit[1:], np.array(sizes), orbit.lyapunov_exponent], 8)


def periodic(forcing: float, restitution: float, lag: float, angular: float) -> Any:
    return orbit_numbers(fixed_point(forcing, restitution, lag, angular))


def doublings(axis: str, limit: float, count: int) -> Any:
    """Points of period doubling on the way to a limit."""
    found = period_doublings(fixed_point(0.45, 0.5), axis, limit, count)
    return [[nearly(point.value), orbit_numbers(point.orbit)] for point in found]


SETTINGS: tuple[tuple[float, float, dict[str, float]], ...] = (
    (0.25, 3.0, {}),
    (0.25, 3.0, {"friction": 0.05, "preload": 1.0}),
    (0.4, 2.0, {"load_torque": 0.01}),
    (0.01, 30.0, {"friction": 2.0, "preload": -1.0}),
)


def a_setting(seed: int) -> TossSetting:
    arc, frequency, values = SETTINGS[seed % len(SETTINGS)]
    whole = {**parameters.DEFAULTS, "gravity": 10.0, **values}
    return TossSetting(arc, frequency, Disk(*(float(whole[name]) for name in Disk._fields)))


def ridden(seed: int) -> Any:
    """Tosses of A, Φ, θ, τ, α̇."""
    draw, setting = Draw(900 + seed), a_setting(seed)
    arc, frequency, disk = setting
    rows = [
        (draw.number(0.2, 1.0) * arc, draw.number(0.0, 8.0) * arc, draw.number(-3.1, 3.1),
         draw.one_of(4.712389, draw.number(0.0, 6.28)),
         draw.one_of(0.0, draw.number(-3.0, 3.0) * frequency))
        for _ in range(40)
    ]  # fmt: skip
    table = TossTable(np.array(rows), frequency, disk)
    table.compute()
    return [*np.ascontiguousarray(table.out.T), table.code]


LAGS, ANGLES = np.linspace(-3.0, 3.0, 13), np.linspace(0.0, 1.5, 9)


def toss_map(seed: int) -> Any:
    start = {} if seed < 4 else {"angular_velocity": 3.0, "forcing_phase": 4.0}
    return nearly(list(toss(LAGS[:, None], ANGLES[None, :], a_setting(seed), **start)), 10)


def paths(seed: int) -> Any:
    """Paths of the hand."""
    return nearly(list(toss_paths(LAGS[:4], ANGLES[1:5], a_setting(seed), points=33)), 12)


def trajectory(seed: int) -> Any:
    # by whole nanoseconds, which the last digit of an amplitude may move by one
    found = toss_trajectory((0.0, 1.5, -0.3, 2.5)[seed], 0.6, a_setting(0), samples=60)
    return nearly(list(found), 7)


def best_toss(measure: str) -> Any:
    return nearly(getattr(extreme(measure, a_setting(0), phase_lag=0.0), measure))


def runs() -> Runs:
    """All of this file."""
    places = len(PLATFORMS)
    yield from seeded("map", "axial", 3, axial)
    yield from seeded("map", "rotating", 3, rotating)
    yield from seeded("map", "axial lanes", 4, lanes, in_lanes=True)
    yield from seeded("map", "attractor measured", places, attractor)
    yield from seeded("map", "attractors in lanes", 3, attractor_lanes, in_lanes=True)
    yield from seeded("map", "derivatives", 3, derivatives)
    yield from seeded("map", "attractors found", places, attractors, in_lanes=True)
    yield from seeded("map", "labels", places, labels, in_lanes=True)
    yield from seeded("map", "labels of lanes", 3, lane_labels, in_lanes=True)
    yield from seeded("map", "boundary", 2, lambda i: boundary((2, 4)[i]), in_lanes=True)
    yield from seeded("map", "best phase lags", 2, lambda i: best_lags((2, 3)[i]), in_lanes=True)
    yield from seeded("map", "mean speeds", 2, lambda i: speeds((2, 4)[i]), in_lanes=True)
    yield from seeded("map", "jacobian", 3, lambda i: jacobian((1, 2, 5)[i]))
    yield plain("map", "period-1", periodic, 0.45, 0.5, -0.5, 10.0)
    yield plain("map", "period-1 of weak friction", periodic, 0.6, 0.4, 0.3, 500.0)
    yield plain("map", "doublings over forcing", doublings, "axial_forcing", 0.55, 3)
    yield plain("map", "doublings over restitution", doublings, "restitution", 0.7, 1)
    yield from seeded("toss", "one by one", 4, ridden)
    yield from seeded("toss", "map", 6, toss_map)
    yield from seeded("toss", "paths", 3, paths)
    yield from seeded("toss", "in time", 3, trajectory)
    yield plain("toss", "fastest", best_toss, "airborne_speed")
    yield plain("toss", "most efficient", best_toss, "efficiency")
