"""The studies `manifolds` and `curves` beside single runs of the simulator."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

from bouncing_disk_ros.core.model import ImpactKind
from support.studied import (
    PERIOD_NS,
    Options,
    Start,
    agreed,
    apart,
    computed,
    known_of,
    seen,
    simulated,
)

ENDS = 40
"""Starts whose ends are compared with an enclosed share."""
MOST = 20_000
"""Events of one run."""
LONG = 2_000_000 * PERIOD_NS
"""ns, end of a run whose events do not run out."""


class Impacts(NamedTuple):
    """Impacts of a run one by one, without that of the start."""

    time: np.ndarray  # rad since the start
    tau: np.ndarray
    w: np.ndarray
    contact: np.ndarray  # whether the disk was in contact before


def impacts_of(given: Mapping[str, float], start: Start, most: int = MOST) -> Impacts:
    """Follow a run for so many events at most."""
    one = simulated(given, start)
    rows, _ = one.advance(round(LONG), most)
    single = rows["kind"] == ImpactKind.IMPACT
    tails = np.concatenate([[0], np.cumsum(rows["kind"] == ImpactKind.CHATTER_TAIL)])
    place = np.flatnonzero(single)
    contact = np.diff(tails[place], prepend=0) > 0
    tau, w = rows["forcing_phase"][place], rows["axial_impact_velocity"][place]
    if given["restitution"] == 0.0:  # contact leaves no row: it begins wherever the load is > 0
        contact[1:] = math.pi * given["axial_forcing"] * np.sin(tau[:-1]) < 1.0
    columns = (rows["time"][place], tau, w, contact)
    return Impacts(*(column[1:].copy() for column in columns))


def derivatives(given: Options, start: Start, impacts: int) -> np.ndarray | None:
    """∂(τ, w) after so many impacts by (τ, w), by differences; None: contact, or other flights."""
    columns = []
    step = 1e-6
    for d_tau, d_w in ((step, 0.0), (0.0, step)):
        ends = []
        for side in (1.0, -1.0):
            one = impacts_of(given, Start(start.tau + side * d_tau, start.w + side * d_w),
                             40 * impacts + 100)  # fmt: skip
            if len(one.time) < impacts or one.contact[:impacts].any():
                return None
            ends.append((float(one.tau[impacts - 1]), float(one.w[impacts - 1])))
        turn = math.remainder(ends[0][0] - ends[1][0], math.tau)
        columns.append((turn / (2.0 * step), (ends[0][1] - ends[1][1]) / (2.0 * step)))
    return np.array(columns).T


def attack_manifolds(rng: np.random.Generator, path: Path) -> list[str]:
    """Saddles, points of their stable manifolds, and the share that these enclose."""
    given: Options = {"axial_forcing": float(rng.uniform(0.2, 1.2)),
                      "restitution": float(rng.uniform(0.2, 0.8))}  # fmt: skip
    begin = float(rng.uniform(-7.0, 5.0))
    options = {
        **given, "width": 2, "height": 2, "pairs": 1, "points": 2000, "distance": 0.05,
        "repetitions": float(rng.uniform(3.0, 40.0)),
        "velocity_begin": -float(rng.uniform(2.0, 8.0)), "phase_begin": begin,
        "phase_end": begin + float(rng.uniform(2.0, math.tau)),
    }  # fmt: skip
    result = computed("manifolds", path, **options)
    said = []
    for i in range(result.sizes.get("saddle", 0)):
        said += _saddle(result, i, given, rng)
        said += _enclosed(result, i, given, options, rng)
    return [f"manifolds({options}): {one}" for one in said]


def _saddle(result: xr.Dataset, i: int, given: Options, rng: np.random.Generator) -> list[str]:
    own = result["saddle_point_saddle"].values == i
    points = np.stack([result[f"saddle_point_{name}"].values[own]
                       for name in ("forcing_phase", "velocity")], axis=1)  # fmt: skip
    n, start = len(points), Start(float(points[0, 0]), float(points[0, 1]))
    multiplier = float(result["saddle_multiplier"].values[i])
    matrix = derivatives(given, start, n)
    if matrix is None or abs(multiplier) > 1e4:
        return []
    said, one = [], impacts_of(given, start, 40 * n + 100)
    back = apart(seen(given, start, 2 + int(result["saddle_cycles"].values[i])), n - 1, points[:1])
    if float(back[0]) > 1e-6 * abs(multiplier):
        said.append(f"saddle {points[0]} comes back to {one.tau[n - 1], one.w[n - 1]}")
    found = np.linalg.eigvals(matrix)
    if float(np.min(np.abs(found - multiplier))) > 1e-3 * abs(multiplier):
        said.append(f"multiplier {multiplier}, {found} seen")
    pieces = np.flatnonzero((result["piece_saddle"].values == i)
                            & (result["piece_stability"].values == 0))  # fmt: skip
    lines = np.flatnonzero(np.isin(result["manifold_piece"].values, pieces))
    for k in rng.permutation(lines)[:4]:
        tau, w = (float(result[f"manifold_{name}"].values[k])
                  for name in ("forcing_phase", "velocity"))  # fmt: skip
        if w >= -1e-3:
            continue
        run_ = seen(given, Start(tau % math.tau, w), 200)
        least = min((float(apart(run_, j, points).min()) for j in range(len(run_.times))),
                    default=0.0)  # fmt: skip
        if run_.whole and least > 0.05:
            said.append(f"the stable manifold's {tau, w} comes no nearer than {least}")
    return said


def _enclosed(
    result: xr.Dataset, i: int, given: Options, options: Options, rng: np.random.Generator
) -> list[str]:
    share, basin = float(result["saddle_share"].values[i]), int(result["saddle_basin"].values[i])
    if math.isnan(share):
        return []
    known = known_of(result)[basin]
    if known.kind not in ("periodic", "rest") or len(known.points) > 8:
        return []
    ends = []
    for _ in range(ENDS):
        start = Start(float(rng.uniform(options["phase_begin"], options["phase_end"])) % math.tau,
                      float(rng.uniform(options["velocity_begin"], 0.0)))  # fmt: skip
        end = agreed(given, start, 300, known)
        if end is not None:
            ends.append(end)
    if len(ends) < ENDS // 2:
        return []
    seen_, error = float(np.mean(ends)), math.sqrt(max(share * (1.0 - share), 0.01) / len(ends))
    if abs(share - seen_) > 5.0 * error:
        return [f"{known.kind} {len(known.points)} has {share} of the window, {seen_} seen"]
    return []


def attack_curves(rng: np.random.Generator, path: Path) -> list[str]:
    """Points of the curves of single impacts, and the map behind them."""
    middle, restitution = float(10.0 ** rng.uniform(-0.6, 0.3)), float(rng.uniform(0.1, 0.85))
    options: Options = {
        "axial_forcing": middle, "restitution": restitution, "doublings": 0, "largest_step": 0.05,
        "axial_forcing_begin": 0.8 * middle, "axial_forcing_end": 1.25 * middle,
        "restitution_begin": max(0.0, restitution - 0.1), "restitution_end": restitution + 0.1,
        "axial_forcing_count": 2, "restitution_count": 2,
    }  # fmt: skip
    result = computed("curves", path, **options)
    owner = result["point_curve"].values
    places = np.flatnonzero((result["curve_impacts"].values[owner] == 1)
                            & (result["point_admissible"].values > 0))  # fmt: skip
    said = []
    for k in rng.permutation(places)[:6]:
        said += _on_curve(result, int(k))
    said += _behind(result)
    return [f"curves({options}): {one}" for one in said]


def _on_curve(result: xr.Dataset, k: int) -> list[str]:
    """One impact in k periods: cos τ = k(1 − ε)/((1 + ε)Γ), w_A = −2k/(1 + ε)."""
    curve = int(result["point_curve"].values[k])
    kind = str(result["curve_kind"].values[curve])
    cycles = int(result["curve_cycles"].values[curve])
    forcing, restitution, tau = (float(result[f"point_{name}"].values[k]) for name in
                                 ("axial_forcing", "restitution", "forcing_phase"))  # fmt: skip
    given: Options = {"axial_forcing": forcing, "restitution": restitution}
    start = Start(tau % math.tau, -2.0 * cycles / (1.0 + restitution))
    where = f"{kind} of 1 impact in {cycles} at {forcing, restitution}, τ = {tau}"
    least = cycles * (1.0 - restitution) / (1.0 + restitution)
    if abs(forcing * math.cos(tau) - least) > 1e-6:
        return [f"{where}: not the closed form"]
    if kind not in ("fold", "doubling"):
        return []
    matrix = derivatives(given, start, 1)
    if matrix is None:
        return []
    unit = np.eye(2) if kind == "fold" else -np.eye(2)
    distance = abs(float(np.linalg.det(matrix - unit)))
    return [f"{where}: det {distance}"] if distance > 1e-3 * (1.0 + forcing) else []


def _behind(result: xr.Dataset) -> list[str]:
    """What the points of the map settle on: contact, or so many impacts."""
    said = []
    for i, restitution in enumerate(result["restitution"].values):
        for j, forcing in enumerate(result["axial_forcing"].values):
            given: Options = {"axial_forcing": float(forcing), "restitution": float(restitution)}
            kind, period = (int(result[name].values[i, j]) for name in ("kind", "period"))
            least = (1.0 - given["restitution"]) / (1.0 + given["restitution"])
            if given["axial_forcing"] < least or kind != 2:
                continue
            tau = math.acos(least / given["axial_forcing"]) + 1e-3
            one = impacts_of(given, Start(tau, -2.0 / (1.0 + given["restitution"])), MOST)
            points = np.stack((one.tau, one.w), axis=1)[-2 * period :]
            turn = np.abs(np.remainder(points[:period] - points[period:] + math.pi, math.tau)
                          - math.pi)  # fmt: skip
            if one.contact[-1000:].any() or float(turn.max()) > 1e-3:
                said.append(f"period {period} at {given}, not seen")
    return said
