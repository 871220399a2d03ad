"""The studies `bifurcation` and `basin_shares` beside single runs of the simulator."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

from bouncing_disk_ros.core.model import ImpactKind, Phase
from support.studied import NEAR, ON, PERIOD_NS, Options, Start, computed, simulated

MOST = 20_000
"""Events of one run."""
LONG = 2_000_000 * PERIOD_NS
"""ns, end of a run whose events do not run out."""
REST, CHATTERING, PERIOD_ONE, OTHER, CHAOTIC = range(5)


def wide_platform(rng: np.random.Generator) -> Options:
    """Γ from 10⁻³ to 10³ and ε from 0 to 0.999; half of them near the paper."""
    if rng.random() < 0.5:
        return {"axial_forcing": float(rng.uniform(0.2, 0.8)),
                "restitution": float(rng.uniform(0.0, 0.9))}  # fmt: skip
    odd = [0.0, rng.uniform(0.0, 1.0), 1.0 - 10.0 ** rng.uniform(-3.0, -1.0)]
    return {"axial_forcing": float(10.0 ** rng.uniform(-3.0, 3.0)),
            "restitution": float(rng.choice(odd))}  # fmt: skip


def wide_rotation(rng: np.random.Generator) -> Options:
    """θ and Γ_T over all that studies take; half of them as in experiments."""
    if rng.random() < 0.5:
        return {"phase_lag": float(rng.uniform(-4.0, 4.0)),
                "angular_forcing": float(10.0 ** rng.uniform(-1.0, 2.0))}  # fmt: skip
    return {"phase_lag": float(rng.uniform(-1e3, 1e3)),
            "angular_forcing": float(10.0 ** rng.uniform(-9.0, 12.0))}  # fmt: skip


class Impacts(NamedTuple):
    """Impacts of a run one by one, without that of the start."""

    time: np.ndarray  # rad since the start
    tau: np.ndarray
    w: np.ndarray
    speed: np.ndarray  # α̇/(ωΦ) before
    contact: np.ndarray  # whether the disk was in contact before
    rests: bool  # contact lasts for good


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
    speed = rows["angular_impact_velocity"][place] + np.cos(tau + given.get("phase_lag", 0.0))
    # contact ends within a period, or never
    waits = one.time_ns - 1e9 * float(rows["time"][-1]) > 2.0 * PERIOD_NS
    rests = waits and one.sample().phase is not Phase.FLIGHT
    time, tau, w, speed, contact = (
        column[1:].copy() for column in (rows["time"][place], tau, w, speed, contact)
    )
    return Impacts(time, tau, w, speed, contact, rests)


def end_of(given: Mapping[str, float], start: Start) -> tuple[int, bool] | None:
    """Class of the end of a run, and whether contact comes; None: runs close by differ, or slow."""
    ends = set()
    runs = [impacts_of(given, start._replace(tau=start.tau + d)) for d in (0.0, NEAR, -NEAR)]
    for one in runs:
        contacts = int(one.contact.sum())
        touches = contacts > 0 or one.rests
        if one.rests:
            ends.add((REST, touches))
        elif contacts > 1:
            ends.add((CHATTERING, touches))
        elif contacts == 0 and len(one.time) > 1000:
            ends.add((_repeats(one), touches))
        else:
            return None
    if len(ends) > 1:
        return None
    kind, touches = ends.pop()
    if kind == CHAOTIC:
        last = min(len(one.time) for one in runs) - 1
        w = [float(one.w[last]) for one in runs]
        if max(w) - min(w) < ON:  # they have not parted: slow, or long
            return None
    return kind, touches


def _repeats(one: Impacts) -> int:
    """Class of an orbit without contact by its last impacts."""
    for n in range(1, 65):
        turn = np.abs(np.remainder(one.tau[-65:] - one.tau[-65 - n : -n] + math.pi, math.tau)
                      - math.pi)  # fmt: skip
        if float(max(turn.max(), np.abs(one.w[-65:] - one.w[-65 - n : -n]).max())) < ON:
            lasts = (one.time[-1] - one.time[-1 - n]) / math.tau
            return PERIOD_ONE if n == 1 and round(float(lasts)) == 1 else OTHER
    return CHAOTIC


def attack_basin_shares(rng: np.random.Generator, path: Path) -> list[str]:
    """Shares of the window by kind, share in contact, best phase lag and speed there."""
    own = {**wide_platform(rng), "angular_forcing": wide_rotation(rng)["angular_forcing"]}
    along = str(rng.choice(["axial_forcing", "restitution", "angular_forcing"]))
    n, low = 3, -float(10.0 ** rng.uniform(-2.0, 2.0))
    options: Options = {"along": along, "count": 1, "samples": n, "velocity_begin": low}
    options |= {name: value for name, value in own.items() if name != along}
    value = min(own[along], 1e6)
    result = computed("basin_shares", path, **options, begin=value, end=value)
    own[along] = value
    starts = [Start(math.tau * (j + 0.5) / n, low * (1.0 - (i + 0.5) / n))
              for i in range(n) for j in range(n)]  # fmt: skip
    said = _speeds_at_best_lag(result, own, rng)
    ends = [end_of(own, start) for start in starts]
    shares = result["fraction"].values[0]
    for kind in range(5):
        sure = sum(end is not None and end[0] == kind for end in ends) / n**2
        open_ = sum(end is None for end in ends) / n**2
        seen = f"{sure:.3f} to {sure + open_:.3f} seen"
        unknown = float(shares[-1])
        if not sure - unknown - 1e-9 <= float(shares[kind]) <= sure + open_ + 1e-9:
            said.append(f"share of {result['kind'].attrs['long_name']} {shares}: {kind}, {seen}")
    sure = sum(end is not None and end[1] for end in ends) / n**2
    in_contact = float(result["share_in_contact"].values[0])
    if not sure - 1e-9 <= in_contact + float(shares[-1]) or not (
        in_contact <= sure + sum(end is None for end in ends) / n**2 + 1e-9
    ):
        said.append(f"share in contact {in_contact}, {sure} seen")
    return [f"basin_shares({options}, {value}): {one}" for one in said]


def _speeds_at_best_lag(
    result: xr.Dataset, own: Options, rng: np.random.Generator
) -> list[str]:  # fmt: skip
    """The main attractor's speed: repeats at the best lag, and is no larger at others."""
    kinds, shares = (result[f"{n}_of_attractor"].values[0] for n in ("kind", "share"))
    there = [i for i in range(len(kinds)) if int(kinds[i]) >= 2]
    lag, best = (float(result[f"best_{n}"].values[0]) for n in ("phase_lag", "speed"))
    if not there:
        return [] if math.isnan(best) else [f"best speed {best} without an attractor"]
    main = max(there, key=lambda i: float(shares[i]))
    impacts, cycles = (int(result[f"{n}_of_attractor"].values[0, main])
                       for n in ("impacts", "cycles"))  # fmt: skip
    tau = float(result["point_forcing_phase"].values[0, main, 0])
    w = float(result["point_velocity"].values[0, main, 0])
    if not cycles or not math.isfinite(tau):
        return [] if abs(best) <= 1.0 else [f"best speed {best}"]
    said = []
    for other in [lag, *(lag + rng.uniform(-3.0, 3.0, 2))]:
        given = {**own, "phase_lag": float(other)}
        if impacts > 1:
            low_, high = sorted(_mean_after(given, Start(tau, w, speed), impacts, cycles)
                                for speed in (-1.0, 1.0))  # fmt: skip
            if low_ > best + 1e-6 or (other == lag and high < best - 1e-6):
                said.append(f"best speed {best} at lag {lag}, {low_, high} at {other}")
            continue
        # from above what repeats a speed never grows, from below it never falls
        margin = 1e-3 if other == lag else 0.0
        for side in (1.0, -1.0):
            start = Start(tau, w, best + side * margin)
            one = impacts_of(given, start, 2 * impacts + 4)
            if len(one.speed) < impacts or one.contact[:impacts].any():
                return said
            change = float(one.speed[impacts - 1]) - start.speed
            if side * change > 1e-9 and (other == lag or side > 0.0):
                said.append(f"at lag {other} the speed {start.speed} changes by {change}, best "
                            f"{best} at {lag}")  # fmt: skip
    return said


def _mean_after(given: Options, start: Start, impacts: int, cycles: int) -> float:
    """Mean of α̇/(ωΦ) over the last repetition of many, without contact."""
    one, angles = simulated(given, start), []
    last = cycles * (MOST // (2 * impacts))
    for k in (last - cycles, last):
        one.advance(round(k * PERIOD_NS), MOST)
        angles.append(one.sample().unwrapped_angle)
    return float(angles[1] - angles[0]) / (math.tau * cycles)


def attack_bifurcation(rng: np.random.Generator, path: Path) -> list[str]:
    """Impacts, means and exponent of what follows a state, or of some starts."""
    own: Options = {**wide_platform(rng), **wide_rotation(rng)}
    along = str(rng.choice(list(own)))
    value = min(own.pop(along), 5e5)
    starts = int(rng.choice([0, 0, 2]))
    measured = int(rng.integers(1, 40))
    options: Options = {**own, "along": along, "count": 2, "starts": starts, "doublings": 0,
                        "begin": value, "settling": 0, "measured": measured,
                        "kept": measured}  # fmt: skip
    options["end"] = value * 1.01 + 1e-6 if along != "restitution" else 0.999 * value
    if along == "restitution" and value == 0.0:
        options["end"] = 1e-3
    if starts:
        options["velocity_begin"] = -float(10.0 ** rng.uniform(-1.0, 2.0))
    else:
        options |= {"initial_phase": float(rng.uniform(-10.0, 10.0)),
                    "initial_velocity": -float(10.0 ** rng.uniform(-2.0, 2.0))}  # fmt: skip
    result = computed("bifurcation", path, **options)
    said = []
    for i, at in enumerate(result["value"].values):
        given = {**own, along: float(at)}
        for j in range(starts or 1):
            one = result.isel(value=i)
            one = one.isel(start=j) if starts else one
            start = _start_of(options, given, result, (i, j), starts)
            if start is not None:
                said += _what_follows(one, given, start, first=i == 0 or starts > 0)
    return [f"bifurcation({options}): {one}" for one in said]


def _start_of(
    options: Options, given: Options, result: xr.Dataset, place: tuple[int, int], starts: int
) -> Start | None:
    """Where the study begins at a value; None: from rest."""
    if starts:
        tau, w = _spread(starts, options["velocity_begin"])[place[1]]
    elif place[0]:
        tau, w, speed = (float(x) for x in result["state"].values[place[0] - 1, :3])
        return Start(tau, w, speed) if w < 0.0 else None
    else:
        tau, w = options["initial_phase"] % math.tau, options["initial_velocity"]
    return Start(tau, w, math.cos(tau + given["phase_lag"]))


def _spread(count: int, lowest: float) -> list[tuple[float, float]]:
    """As the page of the study says: starts spread evenly over forcing phase and velocity."""
    from bouncing_disk_ros.maps.next_collision import spread_starts

    return [(one.forcing_phase, one.axial_impact_velocity) for one in spread_starts(count, lowest)]


def _what_follows(
    one: xr.Dataset, given: Options, start: Start, *, first: bool
) -> list[str]:  # fmt: skip
    """The impacts of a study beside those of the run from the same state."""
    n = one.sizes["impact"]
    most = 60 * n + 4000
    mine = impacts_of(given, start, most)
    # contact forgets the start: the platform differs too
    other = {**given, "axial_forcing": given["axial_forcing"] * (1.0 + 1e-12)}
    near = impacts_of(other, start._replace(tau=start.tau + NEAR), most)
    tau, w, speed = (one[name].values for name in
                     ("forcing_phase", "axial_impact_velocity", "angular_velocity"))  # fmt: skip
    contact = one["contact"].values
    if np.isnan(w).all():
        return [] if mine.rests else ["rest, not seen"]
    said: list[str] = []
    k = 0
    for i in range(n):
        while contact[i] and k < len(mine.time) and not mine.contact[k]:
            k += 1  # the last impacts of a chatter are summed by both, not in the same number
        if k >= min(len(mine.time), len(near.time)):
            return said if mine.rests or k >= most // 2 else [*said, f"{k} impacts seen"]
        scale = 1.0 + abs(float(w[i]))
        spread = max(abs(mine.w[k] - near.w[k]), abs(mine.tau[k] - near.tau[k]))
        if spread > 1e-6 * scale or mine.contact[k] != near.contact[k]:
            return said  # roundings grow too large
        if mine.contact[k] and not contact[i]:
            continue
        turn = abs(math.remainder(float(tau[i] - mine.tau[k]), math.tau))
        apart = max(turn, abs(w[i] - mine.w[k]) / scale)
        if apart > 1e-5 or abs(speed[i] - mine.speed[k]) > 1e-5 + 10.0 * spread:
            seen = f"{mine.tau[k], mine.w[k], mine.speed[k]} seen"
            return [*said, f"impact {i} {tau[i], w[i], speed[i]}, {seen}"]
        k += 1
    return said + _means_of(one, given, start, mine, k, first=first)


def _means_of(
    one: xr.Dataset, given: Options, start: Start, mine: Impacts, k: int, *, first: bool
) -> list[str]:  # fmt: skip
    """Means and exponent over all n impacts, the last of which is impact k − 1 of the run."""
    said: list[str] = []
    n = one.sizes["impact"]
    speeds = float(np.mean(one["angular_velocity"].values))
    if math.isnan(float(one["mean_speed"].values)) and mine.contact.any():
        return said  # roundings decide it
    if abs(float(one["mean_speed_per_impact"].values) - speeds) > 1e-12 * (1.0 + abs(speeds)):
        said.append("mean speed of the impacts")
    contacts = float(np.mean(one["contact"].values))
    if abs(float(one["contacts"].values) - contacts) > 1e-12:
        said.append("contacts")
    run_ = simulated(given, start)
    end = round(float(mine.time[k - 1]) * 1e9)
    _, behind = run_.advance(end, 60 * n + 4000)
    mean = run_.sample().unwrapped_angle / float(mine.time[k - 1])
    found = float(one["mean_speed"].values)
    if not behind and math.isfinite(found) and abs(found - mean) > 1e-5:
        said.append(f"mean speed {found}, {mean} seen")
    exponent = float(one["lyapunov_exponent"].values)
    if contacts:
        return said if exponent == -math.inf else [*said, f"exponent {exponent} with contact"]
    if first:
        step = 1e-7
        sides = [impacts_of(given, start._replace(tau=start.tau + d), 60 * n + 4000)
                 for d in (step, -step)]  # fmt: skip
        if any(len(side.time) < k or side.contact[:k].any() for side in sides):
            return said
        change = np.hypot(
            math.remainder(float(sides[0].tau[k - 1] - sides[1].tau[k - 1]), math.tau),
            sides[0].w[k - 1] - sides[1].w[k - 1],
        )
        growth = float(change) / (2.0 * step)
        if 1e-3 < growth < 1e2 and abs(exponent * n - math.log(growth)) > 1e-2:
            said.append(f"exponent {exponent}, {math.log(growth) / n} seen")
    return said
