"""Studies beside single runs of the simulator at random options: what differs, in words.

The runs are read here in the simplest way: rows of impacts and samples, none of what the studies
use. A start near a boundary goes where roundings take it: it counts only if runs from all around it
(NEAR) agree.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from bouncing_disk_ros.core.model import Disk, ImpactKind, InitialState, Motion, Phase
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.study import named, run

Options = dict[str, Any]
NEAR = 1e-10
"""Distance (rad) of the starts that must agree."""
ON = 1e-3
"""Distance (rad, πg/ω) of impacts from the orbit they are on; the studies' own is 1e-4."""
PERIOD_NS = math.tau * 1e9
EVENTS = 400_000
"""Events of one run: a chatter near ε = 1 may have more, and is not compared."""


class Start(NamedTuple):
    """An impact, and the disk's speed before it: units 1/ω, πg/ω, ωΦ."""

    tau: float
    w: float
    speed: float = 0.0


class Seen(NamedTuple):
    """A run of the simulator from an impact."""

    times: np.ndarray  # rad since the start, of single impacts
    tau: np.ndarray
    w: np.ndarray
    tails: np.ndarray  # times at which chatters ended in contact
    ends_in_contact: bool
    turned: np.ndarray  # angle of the disk after each whole period, Φ
    whole: bool  # False: its events ran out


def simulated(given: Mapping[str, float], start: Start) -> Simulation:
    """The simulator just before an impact; ω = 1, πg = 1, Φ = 1, a_e = a_g = 1: Γ_T = 1/μ.

    given: axial_forcing, restitution and the two of rotation, where friction acts.
    """
    forcing = given["axial_forcing"]
    friction = 1.0 / given.get("angular_forcing", math.inf)
    return Simulation(
        Motion(forcing, 1.0, 1.0 / math.tau, given.get("phase_lag", 0.0)),
        Disk(1.0, given["restitution"], friction, 1.0, 1.0, 1.0 / math.pi),
        InitialState(0.0, start.w + forcing * math.cos(start.tau), start.speed, 0.0, start.tau),
    )


def seen(given: Mapping[str, float], start: Start, periods: int) -> Seen:
    """Run from just before an impact for so many periods."""
    one = simulated(given, start)
    rows, angles = [], [0.0]
    budget, whole = EVENTS, True
    for k in range(1, periods + 1):
        part, behind = one.advance(round(k * PERIOD_NS), budget)
        rows.append(part)
        budget -= len(part) + 20
        if behind or budget <= 0:
            whole = False
            break
        angles.append(one.sample().unwrapped_angle)
    all_rows = np.concatenate(rows)
    single = all_rows[all_rows["kind"] == ImpactKind.IMPACT][1:]  # without that of the start
    tails = all_rows[all_rows["kind"] == ImpactKind.CHATTER_TAIL]
    return Seen(
        single["time"].copy(), single["forcing_phase"].copy(),
        single["axial_impact_velocity"].copy(), tails["time"].copy(),
        one.sample().phase is not Phase.FLIGHT, np.array(angles), whole,
    )  # fmt: skip


def apart(run_: Seen, k: int, points: np.ndarray) -> np.ndarray:
    """Distances (m,) of impact k from points (m, 2)."""
    phase = np.abs(np.remainder(run_.tau[k] - points[:, 0] + math.pi, math.tau) - math.pi)
    return np.maximum(phase, np.abs(run_.w[k] - points[:, 1]))


def on_orbit_since(run_: Seen, points: np.ndarray, near: float) -> int:
    """Index of the first impact from which on all lie on a periodic orbit, in its order."""
    k = len(run_.times) - 1
    expected = int(np.argmin(apart(run_, k, points))) if k >= 0 else 0
    while k >= 0 and apart(run_, k, points)[expected] <= near:
        k, expected = k - 1, (expected - 1) % len(points)
    return k + 1


def ends_as(run_: Seen, kind: str, points: np.ndarray, cycles: int) -> bool:
    """Whether the end of a run is an attractor of this kind with these points (m, 2)."""
    end = run_.turned.size - 1.0
    late = math.tau * (end - max(40.0, 4.0 * cycles))
    if kind == "chattering" and len(run_.times) and not len(run_.tails):  # ε = 0 has no chatter
        return all(float(apart(run_, k, points).min()) < ON for k in range(-len(points), 0))
    if kind == "chattering" and not cycles:
        return bool(np.any(run_.tails > 0.3 * math.tau * end))
    if kind == "rest":
        return run_.ends_in_contact and not np.any(run_.times > math.tau * (end - 10.0))
    if kind == "chattering":
        return bool(np.any(run_.tails > late))
    if np.any(run_.tails > late):
        return False
    if kind == "periodic":
        return on_orbit_since(run_, points, ON) <= len(run_.times) - 2 * len(points) - 4
    tail = np.flatnonzero(run_.times > late)[-50:]
    scale = 0.05 * max(1.0, float(-points[:, 1].min()))
    return all(float(apart(run_, int(k), points).min()) < scale for k in tail)


class Known(NamedTuple):
    """An attractor of a result."""

    kind: str
    points: np.ndarray
    cycles: int


def known_of(result: xr.Dataset) -> list[Known]:
    """The attractors of a result of basins."""
    owner = result["point_attractor"].values
    after = result.attrs["parameter_velocity"] == "after"
    scale = float(result.attrs["parameter_restitution"]) if after else 1.0
    points = np.stack(
        (result["point_forcing_phase"].values, result["point_velocity"].values / scale), axis=1
    )
    kinds, cycles = (result[f"attractor_{n}"].values for n in ("kind", "cycles"))
    return [Known(str(kind), points[owner == i], int(cycles[i])) for i, kind in enumerate(kinds)]


def agreed(given: Mapping[str, float], start: Start, periods: int, known: Known) -> bool | None:
    """Whether runs around a start end on an attractor; None: they differ, or ran out."""
    ends = set()
    for shift in (0.0, NEAR, -NEAR):
        one = seen(given, start._replace(tau=start.tau + shift), periods)
        if not one.whole:
            return None
        ends.add(ends_as(one, *known))
    return ends.pop() if len(ends) == 1 else None


def platform_of(rng: np.random.Generator) -> Options:
    """Γ from 0.05 to 5 and ε from 0 to 0.95, for short runs; half of them near the paper."""
    if rng.random() < 0.5:
        return {"axial_forcing": float(rng.uniform(0.2, 0.8)),
                "restitution": float(rng.uniform(0.1, 0.8))}  # fmt: skip
    return {"axial_forcing": float(10.0 ** rng.uniform(-1.3, 0.7)),
            "restitution": float(rng.choice([0.0, rng.uniform(0.0, 0.95)]))}  # fmt: skip


def rotation_of(rng: np.random.Generator) -> Options:
    return {"phase_lag": float(rng.uniform(-4.0, 4.0)),
            "angular_forcing": float(10.0 ** rng.uniform(-1.0, 1.6))}  # fmt: skip


def computed(name: str, path: Path, **options: Any) -> xr.Dataset:
    """A study's result in full."""
    found = run(named(name, **options), path / "r.zarr", workers=1)
    assert found is not None
    return found.load()


def mean_speed(one: Seen, cycles: int) -> float:
    """Mean of α̇/(ωΦ) over the last whole repetitions of so many periods."""
    return float(one.turned[-1] - one.turned[-1 - cycles]) / (math.tau * cycles)


def attack_basins(rng: np.random.Generator, path: Path) -> list[str]:
    """Labels, times and mean speeds of some starts."""
    platform, rotation = platform_of(rng), rotation_of(rng)
    after = bool(rng.random() < 0.3) and platform["restitution"] > 0.0
    begin = float(rng.uniform(-7.0, 5.0))
    options = {
        **platform, **rotation, "width": 4, "height": 3, "angular_velocities": "0.5",
        "velocity": "after" if after else "before", "velocity_begin": -float(rng.uniform(1.0, 6.0)),
        "phase_begin": begin, "phase_end": begin + float(rng.uniform(0.5, 7.0)),
    }  # fmt: skip
    result = computed("basins", path, **options)
    known = known_of(result)
    given = {**platform, **rotation}
    said = []
    for i, j in rng.permutation([(i, j) for i in range(3) for j in range(4)])[:4]:
        label = int(result["label"].values[i, j])
        if label < 0:
            continue
        w = float(result["velocity"].values[i]) / (platform["restitution"] if after else 1.0)
        start = Start(float(result["forcing_phase"].values[j]) % math.tau, w, 0.5)
        own, time = known[label], float(result["time"].values[i, j]) / math.tau
        periods = math.ceil((0.0 if math.isnan(time) else time) + 150 + 8 * own.cycles)
        periods += 8 * len(own.points) if own.kind == "chattering" else 0
        if periods > 4000:
            continue
        where = f"basins({options}) at [{i}, {j}]"
        agrees = agreed(given, start, periods, own)
        if agrees is False:
            said.append(f"{where}: not {own.kind} {len(own.points)}")
        if agrees:
            said += [f"{where}: {one}" for one in _numbers_of_start(
                result, (int(i), int(j)), own, partial(seen, given, start), periods)]  # fmt: skip
    return said


def _numbers_of_start(
    result: xr.Dataset, place: tuple[int, int], own: Known, follow: Callable[[int], Seen],
    periods: int,
) -> list[str]:  # fmt: skip
    """Time, impacts and mean speed of a start, beside its run."""
    said = []
    one = follow(periods)
    time, speed = float(result["time"].values[place]), float(result["mean_speed"].values[0][place])
    # without a bounce contact leaves no row of its own
    if own.kind == "periodic" and not len(one.tails) and result.attrs["parameter_restitution"]:
        k = on_orbit_since(one, own.points, 1e-4) + 7
        if int(result["impacts"].values[place]) != k + 1 or abs(one.times[k] - time) > 1e-3:
            said.append(f"time {time}, {one.times[k]} seen")
    if own.kind in ("periodic", "chattering") and own.cycles:
        found = mean_speed(one, own.cycles)
        if abs(found - speed) > 1e-6:  # friction may be slow
            found = mean_speed(follow(20 * periods), own.cycles)
        if abs(found - speed) > 1e-6:
            said.append(f"mean speed {speed}, {found} seen")
    if own.kind == "rest" and not math.isnan(speed):
        said.append(f"mean speed {speed} at rest")
    return said


def attack_parameter_map(rng: np.random.Generator, path: Path) -> list[str]:
    """Kind, period, cycles, contacts and mean speed of one start at one point."""
    platform, rotation = platform_of(rng), rotation_of(rng)
    start = Start(float(rng.uniform(0.0, math.tau)), -float(rng.uniform(0.1, 4.0)))
    # the study begins without slip
    start = start._replace(speed=math.cos(start.tau + rotation["phase_lag"]))
    options = {
        **rotation, "start": "given", "initial_phase": start.tau, "initial_velocity": start.w,
        "settling": 3000, "x_axis": "axial_forcing", "y_axis": "restitution", "x_count": 1,
        "x_begin": platform["axial_forcing"], "x_end": platform["axial_forcing"], "y_count": 1,
        "y_begin": platform["restitution"], "y_end": platform["restitution"],
    }  # fmt: skip
    result = computed("parameter_map", path, **options)
    kind = int(result["kind"].values[0, 0])
    cycles, period = (int(result[n].values[0, 0]) for n in ("cycles", "period"))
    # contact that repeats late or, without a bounce, leaves no row of its own
    if kind < 0 or (kind == 1 and not (cycles and platform["restitution"])):
        return []
    given = {**platform, **rotation}
    ends = []
    for shift in (0.0, NEAR, -NEAR):
        one = seen(given, start._replace(tau=start.tau + shift), 400 + 8 * cycles)
        if not one.whole:
            return []
        ends.append(_sort_of(one, cycles, period))
    if len(set(ends)) > 1:
        return []
    said = [] if ends[0] == kind else [f"kind {kind}, {ends[0]} seen"]
    if not said and kind in (1, 2) and cycles:
        speed = float(result["mean_speed"].values[0, 0])
        found = mean_speed(seen(given, start, 3000 + 8 * cycles), cycles)
        # friction may be slow, and then neither has settled
        change = abs(float(result["mean_speed_change"].values[0, 0]))
        if abs(found - speed) > 1e-6 + 10.0 * change:
            said.append(f"mean speed {speed}, {found} seen")
    return [f"parameter_map({options}): {one}" for one in said]


def _sort_of(one: Seen, cycles: int, period: int) -> int:
    """Kind of the end of a run, as a study numbers them."""
    end = math.tau * (one.turned.size - 1.0)
    if not np.any(one.times > 0.9 * end) and not np.any(one.tails > 0.9 * end):
        return 0
    if np.any(one.tails > 0.3 * end):
        return 1
    points = np.stack((one.tau, one.w), axis=1)
    for n in range(1, 65):
        if len(points) > 3 * n and all(
            apart(one, len(points) - 1 - k, points[[len(points) - 1 - k - n]])[0] < ON
            for k in range(2 * n)
        ):
            return 2 if n == period or not period else -2
    return 3


def attack_basin_shares(rng: np.random.Generator, path: Path) -> list[str]:
    """Shares of the window by kind of attractor, and of its starts that come to contact."""
    platform, n = platform_of(rng), 3
    platform["restitution"] = max(platform["restitution"], 0.05)  # else contact leaves no row
    low, forcing = -float(rng.uniform(1.0, 5.0)), platform["axial_forcing"]
    options = {"along": "axial_forcing", "begin": forcing, "end": forcing, "count": 1,
               "restitution": platform["restitution"], "samples": n,
               "velocity_begin": low}  # fmt: skip
    result = computed("basin_shares", path, **options)
    shares = result["fraction"].values[0]
    by_kind = np.array([shares[0], shares[1], shares[2] + shares[3], shares[4]])
    of_contact, unknown = float(result["share_in_contact"].values[0]), float(shares[5])
    direct = float(np.nansum(result["share_without_contact"].values[0]))
    said = []
    if abs(direct + of_contact + unknown - 1.0) > 1e-9:
        said.append(f"{direct} without contact, {of_contact} with it, {unknown} unresolved")
    if abs(float(np.nansum(result["share_of_attractor"].values[0])) + unknown - 1.0) > 1e-9:
        said.append(f"shares of attractors {result['share_of_attractor'].values[0]}")
    starts = [Start(math.tau * (j + 0.5) / n, low * (1.0 - (i + 0.5) / n))
              for i in range(n) for j in range(n)]  # fmt: skip
    ends = [_end_of(platform, start) for start in starts]
    known = [end for end in ends if end is not None]
    room = len(ends) - len(known) + unknown * n**2 + 1e-6
    for kind, share in enumerate(by_kind):
        sure = sum(end[0] == kind for end in known)
        if not -room <= share * n**2 - sure <= room:
            said.append(f"kind {kind}: {share}, {sure} of {len(known)} seen")
    sure = sum(end[1] for end in known)
    if not -room <= of_contact * n**2 - sure <= room:
        said.append(f"share in contact {of_contact}, {sure} of {len(known)} seen")
    return [f"basin_shares({options}): {one}" for one in said]


def _end_of(given: Options, start: Start) -> tuple[int, bool] | None:
    """Kind of the end of a run, and whether contact comes; None: runs close by differ, or slow."""
    runs = [seen(given, start._replace(tau=start.tau + d), 1500) for d in (0.0, NEAR, -NEAR)]
    ends = {(_sort_of(one, 0, 0), bool(len(one.tails)) or one.ends_in_contact) for one in runs}
    if len(ends) > 1 or not all(one.whole for one in runs):
        return None
    end = ends.pop()
    last = min(len(one.w) for one in runs) - 1
    if end[0] == 3 and np.ptp([one.w[last] for one in runs]) < ON:  # slow, or long
        return None
    return end
