"""Pinned runs of the next-collision map and of single tosses."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from support import pinned
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
    start, given = drawn_starts(seed, 6, 2), drawn_parameters(seed, 6, 2)
    return [pinned.orbit(s, p, 100) for s, p in zip(start.tolist(), given.tolist(), strict=True)]


def rotating(seed: int) -> Any:
    start, given = drawn_starts(seed, 6, 3), drawn_parameters(seed, 6, 4)
    return [pinned.orbit(s, p, 100) for s, p in zip(start.tolist(), given.tolist(), strict=True)]


def lanes(seed: int) -> Any:
    """Axial lanes, as many as fill some rounds and part of one."""
    n = 100 + 37 * seed
    return pinned.carried(drawn_starts(seed, n, 2), drawn_parameters(seed, n, 2), 50 + 10 * seed)


def attractor(place: int) -> Any:
    axial_forcing, restitution = PLATFORMS[place]
    starts = [[0.74, -1.33, 0.5], *drawn_starts(500 + place, 1, 3).tolist()]
    given = (axial_forcing, restitution, 0.3, 20.0)
    return [pinned.measured(start, given, 500, 1000) for start in starts]


def attractor_lanes(seed: int) -> Any:
    n = 60 + 11 * seed
    starts, given = drawn_starts(600 + seed, n, 3), drawn_parameters(600 + seed, n, 4)
    return pinned.measured_in_lanes(starts, given, 100, 200)


def derivatives(place: int) -> Any:
    axial_forcing, restitution = PLATFORMS[place]
    start = drawn_starts(700 + place, 1, 2)[0].tolist()
    return [pinned.derivatives(start, (axial_forcing, restitution), n) for n in (1, 3, 10)]


@cache
def found(place: int) -> Any:
    return pinned.attractors_of(*PLATFORMS[place], grid(6))


def attractors(place: int) -> Any:
    return pinned.described(found(place))


def labels(place: int) -> Any:
    return pinned.basins(found(place), *PLATFORMS[place], grid(24))


def lane_labels(seed: int) -> Any:
    """The rule of the lanes with points that are given, not found."""
    points = np.array([[1.0, -1.3], [0.8, -1.2], [0.736624, -1.333333], [2.0, -2.0]])
    axial_forcing = (0.36, 0.45, 0.55)[seed]
    return pinned.labelled(grid(20), axial_forcing, 0.5, points, [0, 1, 2, 2], 400)


def boundary(place: int) -> Any:
    label = pinned.basins(found(place), *PLATFORMS[place], grid(40))[0]
    return pinned.boundary(label.reshape(40, 40))


def best_lags(place: int) -> Any:
    return pinned.best_phase_lags(found(place), *PLATFORMS[place], 30.0)


def speeds(place: int) -> Any:
    return pinned.speeds(found(place), (0.0, -2.0), (*PLATFORMS[place], 0.2, 20.0))


def jacobian(place: int) -> Any:
    start = drawn_starts(800 + place, 1, 3)[0].tolist()
    return pinned.jacobian((*PLATFORMS[place], 0.4, 15.0), start, 2)


SETTINGS: tuple[tuple[float, float, dict[str, float]], ...] = (
    (0.25, 3.0, {}),
    (0.25, 3.0, {"friction": 0.05, "preload": 1.0}),
    (0.4, 2.0, {"load_torque": 0.01}),
    (0.01, 30.0, {"friction": 2.0, "preload": -1.0}),
)


def drawn_tosses(seed: int, count: int) -> Floats:
    draw = Draw(900 + seed)
    arc, frequency, _ = SETTINGS[seed % len(SETTINGS)]
    rows = [
        (draw.number(0.2, 1.0) * arc, draw.number(0.0, 8.0) * arc, draw.number(-3.1, 3.1),
         draw.one_of(4.712389, draw.number(0.0, 6.28)),
         draw.one_of(0.0, draw.number(-3.0, 3.0) * frequency))
        for _ in range(count)
    ]  # fmt: skip
    return np.array(rows)


def a_setting(seed: int) -> Any:
    arc, frequency, values = SETTINGS[seed % len(SETTINGS)]
    return pinned.setting(arc, frequency, **values)


def ridden(seed: int) -> Any:
    return pinned.ridden(drawn_tosses(seed, 40), a_setting(seed))


LAGS, ANGLES = np.linspace(-3.0, 3.0, 13), np.linspace(0.0, 1.5, 9)


def toss_map(seed: int) -> Any:
    start = {} if seed < 4 else {"angular_velocity": 3.0, "forcing_phase": 4.0}
    return pinned.toss_map(LAGS, ANGLES, a_setting(seed), **start)


def paths(seed: int) -> Any:
    return pinned.paths(LAGS[:4], ANGLES[1:5], a_setting(seed), 33)


def trajectory(seed: int) -> Any:
    return pinned.trajectory((0.0, 1.5, -0.3, 2.5)[seed], 0.6, a_setting(0), 60)


def best_toss(measure: str, lag: float) -> Any:
    return pinned.best_toss(measure, a_setting(0), phase_lag=lag)


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
    yield plain("map", "period-1", pinned.periodic, 0.45, 0.5, -0.5, 10.0)
    yield plain("map", "period-1 of weak friction", pinned.periodic, 0.6, 0.4, 0.3, 500.0)
    yield plain(
        "map", "doublings over forcing", pinned.doublings, 0.45, 0.5, "axial_forcing", 0.55, 3
    )
    yield plain(
        "map", "doublings over restitution", pinned.doublings, 0.45, 0.5, "restitution", 0.7, 1
    )
    yield from seeded("toss", "one by one", 4, ridden)
    yield from seeded("toss", "map", 6, toss_map)
    yield from seeded("toss", "paths", 3, paths)
    yield from seeded("toss", "in time", 3, trajectory)
    yield plain("toss", "fastest", best_toss, "airborne_speed", 0.0)
    yield plain("toss", "most efficient", best_toss, "efficiency", 0.0)
