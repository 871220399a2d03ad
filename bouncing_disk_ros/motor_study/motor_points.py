"""Steady means of motors: speed, powers and losses of many disks with their platforms and loads."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.core import platform
from bouncing_disk_ros.core.layout import (
    DISK_DTYPE,
    L_AXIAL,
    L_BRAKE,
    L_FRICTION,
    L_SLIDING,
    PLATFORM_DTYPE,
    W_ANGULAR,
    W_AXIAL,
    disk_record,
)
from bouncing_disk_ros.core.model import Disk, Motion
from bouncing_disk_ros.core.restitution import rebounded
from bouncing_disk_ros.maps.motor_curves import friction_limit, runs_away
from bouncing_disk_ros.maps.period_one import period_one
from bouncing_disk_ros.maps.scales import velocity_scale
from bouncing_disk_ros.motor_study.motor_cell import (
    BATCHES,
    BEGINS,
    CARRIED,
    CONTACT_RATE,
    CONTACT_SHARE,
    CYCLE,
    CYCLE_IMPACTS,
    IMPACT_RATE,
    LOOK_AT,
    MEAN_SPEED,
    MEANS_COLUMNS,
    NOT_SETTLED,
    OUTCOME,
    PERIODS,
    POWERS,
    PRECISION_PART,
    RISE,
    RISES,
    SPEED_ERROR,
    measure_motors,
    standard_error,
    workspace,
)

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

UNKNOWN_KIND, BOUNCES, CHATTERS, CONTACT_ONLY, NOT_PERIODIC, RUNS_AWAY, UNSETTLED = range(-1, 6)
KINDS: Mapping[int, str] = {
    UNKNOWN_KIND: "unresolved",
    BOUNCES: "periodic",
    CHATTERS: "chattering",
    CONTACT_ONLY: "contact_only",
    NOT_PERIODIC: "not_periodic",
    RUNS_AWAY: "runs_away",
    UNSETTLED: "not_settled",
}
"""periodic: impacts alone, that repeat; chattering: impacts and contact, that repeat; not_settled:
what the rotor began with is not forgotten within the periods allowed, or nothing settles it."""
_BESIDE = 1e-3
"""A start so far (rad) from the period-1 orbit leaves it where it is not stable."""
_COUNTED = 0.01
"""Impacts slower than this part of πg/ω, the last ones of a chatter, count as one."""
_FLIGHTS = 4.0
"""Periods in which a load alone acts on the rotor, for speeds on either side of all it may have."""


MEANS = (
    "mean_speed", "output_power", "brake_power", "axial_power", "angular_power", "efficiency",
    "impact_loss", "impact_friction_loss", "sliding_loss", "friction_work_per_turn",
    "contact_share", "impact_rate",
)  # fmt: skip
"""Means that have a standard error; of what repeats, by roundings."""


class Run(NamedTuple):
    """How each motor is run."""

    start: str = "period-1"  # or rest, or followed
    settling: int = 300  # periods left out, at least
    measured: int = 512  # periods of the first stretch
    longest: int = 20_000  # periods in all


def measure(
    motors: Sequence[tuple[Motion, Disk]], run: Run, row: int = 0
) -> dict[str, NDArray[Any]]:
    """The steady means of n motors by the names of the study's fields, arrays (n,), SI units.

    nan where the rotor runs away. With start `followed` in rows of `row`, each motor goes on from
    the one before. Losses and powers are of the platform; rise times from rest are those on the
    settled axial motion, stop times on a platform that rests.
    """
    n = len(motors)
    motions, disks = np.zeros(n, PLATFORM_DTYPE), np.zeros(n, DISK_DTYPE)
    begins = np.zeros((n, BEGINS))
    for i, (motion, disk) in enumerate(motors):
        motions[i] = _motion_record(motion)[0]
        disks[i] = disk_record(disk, _COUNTED * velocity_scale(motion, disk))[0]
        begins[i] = _begin(motion, disk, run)
    out, batches = np.empty((n, MEANS_COLUMNS)), np.empty((n, BATCHES, MEANS_COLUMNS))
    followed = row if run.start == "followed" else 0
    order = np.arange(n)
    if not followed:  # those with the same axial motion one after the other
        order = np.lexsort((motions["a"], motions["f"], disks["g"], disks["restitution"]))
    found, parts = np.empty_like(out), np.empty_like(batches)
    measure_motors(
        workspace(), motions[order], disks[order], begins[order], followed, run.measured,
        run.longest, parts, found,
    )  # fmt: skip
    out[order], batches[order] = found, parts
    return _means(out, batches, [disk for _, disk in motors])


@lru_cache(1024)
def _motion_record(motion: Motion) -> NDArray[np.void]:
    return platform.without_offset(platform.steady(motion, 0, 0, 0.0))


def _begin(motion: Motion, disk: Disk, run: Run) -> tuple[float, ...]:
    """The row of `measure_motors` that says where a motor starts and how long it settles."""
    momentum = disk.inertia * math.tau * motion.frequency
    scale = math.tau * motion.frequency * motion.angular_amplitude
    scale = scale or (friction_limit(disk) + disk.brake_torque) / momentum or 1.0
    bound = scale + _FLIGHTS * math.tau * abs(disk.load_torque) / momentum
    if runs_away(disk):
        return LOOK_AT, 0.0, -1.0, PRECISION_PART * scale, bound
    orbit = period_one(motion, disk) if run.start != "rest" else None
    begin = (LOOK_AT, 0.0)
    if orbit is not None:
        begin = (
            orbit.forcing_phase + _BESIDE,
            rebounded(orbit.axial_impact_velocity, disk.restitution),
        )
    return *begin, float(run.settling), PRECISION_PART * scale, bound


def _rates(rows: Floats, loads: Floats) -> dict[str, Floats]:
    """Means that are linear in what a disk has gathered, of rows (..., MEANS_COLUMNS)."""
    entries, speed = rows[..., POWERS:], rows[..., MEAN_SPEED]
    brake = entries[..., L_BRAKE]
    return {
        "mean_speed": speed,
        "output_power": loads * speed + brake,
        "brake_power": brake,
        "axial_power": entries[..., W_AXIAL],
        "angular_power": entries[..., W_ANGULAR],
        "impact_loss": entries[..., L_AXIAL],
        "impact_friction_loss": entries[..., L_FRICTION],
        "sliding_loss": entries[..., L_SLIDING],
        "contact_share": rows[..., CONTACT_SHARE],
        "impact_rate": rows[..., IMPACT_RATE],
    }


def _ratios(rates: Mapping[str, Floats]) -> dict[str, tuple[Floats, Floats]]:
    """Means that are ratios of others: above and below the line."""
    given = rates["axial_power"] + rates["angular_power"]
    rubbed = rates["impact_friction_loss"] + rates["sliding_loss"]
    return {
        "efficiency": (rates["output_power"], given),
        "friction_work_per_turn": (math.tau * rubbed, rates["mean_speed"]),
    }


def _error(parts: Floats, mean: Floats, out: Floats) -> Floats:
    """Standard errors from parts (n, BATCHES); where the motion repeats, what roundings leave."""
    errors: Floats = out[:, CARRIED] * np.abs(mean)
    for i in np.flatnonzero(out[:, CYCLE] == 0.0):
        errors[i] = standard_error(parts[i])
    return errors


def _means(out: Floats, batches: Floats, disks: Sequence[Disk]) -> dict[str, NDArray[Any]]:
    loads = np.array([disk.load_torque for disk in disks])
    rates, parts = _rates(out, loads), _rates(batches, loads[:, None])
    ratios, of_parts = _ratios(rates), _ratios(parts)
    found = dict(rates)
    errors = {name: _error(parts[name], rates[name], out) for name in rates}
    errors["mean_speed"] = out[:, SPEED_ERROR]
    with np.errstate(divide="ignore", invalid="ignore"):
        for name, (over, under) in ratios.items():
            ratio = over / under
            left = of_parts[name][0] - ratio[:, None] * of_parts[name][1]
            errors[name] = _error(left / under[:, None], ratio, out)
            found[name] = np.abs(ratio)
        known = (ratios["efficiency"][0] > 0.0) & (ratios["efficiency"][1] > 0.0)
        turns = ratios["friction_work_per_turn"][1] != 0.0
    for name, where in (("efficiency", known), ("friction_work_per_turn", turns)):
        found[name] = np.where(where, found[name], math.nan)
        errors[name] = np.where(where, errors[name], math.nan)
    stops = np.array([_stop_time(disk, one) for disk, one in zip(disks, out, strict=True)])
    return {
        "kind": _kinds(out, np.array([runs_away(disk) for disk in disks], bool)),
        "period": np.nan_to_num(out[:, CYCLE_IMPACTS]).astype(np.int32),
        "cycles": np.nan_to_num(out[:, CYCLE]).astype(np.int32),
        "measured": out[:, PERIODS],
        "rise_time": out[:, RISE],
        "rise_time_95": out[:, RISE + 1],
        "stop_time": RISES[0] * stops,
        "stop_time_95": RISES[1] * stops,
        **{f"{name}_error": errors[name] for name in MEANS},
        **found,
    }


def _stop_time(disk: Disk, row: Floats) -> float:
    """Seconds in which friction, brake and load stop a rotor on a platform that rests."""
    speed = float(row[MEAN_SPEED])
    load = disk.load_torque if speed >= 0.0 else -disk.load_torque
    against = friction_limit(disk) + disk.brake_torque + load
    return disk.inertia * abs(speed) / against if against > 0.0 else math.nan


def _kinds(out: Floats, away: NDArray[np.bool_]) -> Ints:
    kind = np.full(len(out), UNKNOWN_KIND, np.int32)
    known = np.isfinite(out[:, MEAN_SPEED])
    repeats, bounces = out[:, CYCLE] > 0.0, out[:, IMPACT_RATE] > 0.0
    touches = (out[:, CONTACT_RATE] > 0.0) | (out[:, CONTACT_SHARE] > 0.0)
    kind[known & ~repeats] = NOT_PERIODIC
    kind[known & repeats & bounces & ~touches] = BOUNCES
    kind[known & repeats & bounces & touches] = CHATTERS
    kind[known & ~bounces] = CONTACT_ONLY
    kind[out[:, OUTCOME] == NOT_SETTLED] = UNSETTLED
    kind[away] = RUNS_AWAY
    return kind
