"""Steady means of motors: speed, powers and losses of many disks with their platforms and loads."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.analysis.motor_curves import friction_limit, runs_away
from bouncing_disk_ros.analysis.period_one import period_one
from bouncing_disk_ros.analysis.scales import angular_forcing_of, velocity_scale
from bouncing_disk_ros.collision_map.motor_cell import (
    BEGIN_PRECISION,
    CONTACT_RATE,
    CONTACT_SHARE,
    CYCLE,
    CYCLE_IMPACTS,
    IMPACT_RATE,
    LOOK_AT,
    MEAN_SPEED,
    MEANS_COLUMNS,
    PERIODS,
    POWERS,
    PRECISION_PART,
    SPEED_ERROR,
    measure_motors,
    workspace,
)
from bouncing_disk_ros.core import platform
from bouncing_disk_ros.core.layout import (
    DISK_DTYPE,
    L_AXIAL,
    L_BRAKE,
    L_FRICTION,
    L_SLIDING,
    MOTION_DTYPE,
    W_ANGULAR,
    W_AXIAL,
    disk_record,
)
from bouncing_disk_ros.core.model import Disk, Motion
from bouncing_disk_ros.errors import InputError, closest

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

STARTS = ("period-1", "rest", "followed")
UNKNOWN_KIND, BOUNCES, CHATTERS, CONTACT_ONLY, NOT_PERIODIC, RUNS_AWAY = range(-1, 5)
KINDS: Mapping[int, str] = {
    UNKNOWN_KIND: "unresolved",
    BOUNCES: "periodic",
    CHATTERS: "chattering",
    CONTACT_ONLY: "contact_only",
    NOT_PERIODIC: "not_periodic",
    RUNS_AWAY: "runs_away",
}
"""periodic: impacts alone, that repeat; chattering: impacts and contact, that repeat."""
_BESIDE = 1e-3
"""A start so far (rad) from the period-1 orbit leaves it where it is not stable."""
_COUNTED = 0.01
"""Impacts slower than this part of πg/ω, the last ones of a chatter, count as one."""
_ROOM = 2.0
"""Times the periods that friction takes at least to give the rotor its speed."""


class MotorMeans(NamedTuple):
    """Steady means of n motors, arrays (n,), SI units; nan where the rotor runs away."""

    kind: Ints
    period: Ints  # impacts in one repetition, 0: none known
    cycles: Ints  # periods of the platform in one repetition, 0: none known
    mean_speed: Floats  # of α̇ in time
    mean_speed_error: Floats  # its standard error, 0 where the state repeats
    measured: Floats  # periods of the platform that the means are over
    output_power: Floats  # work on load and brake
    brake_power: Floats  # the brake's part of it
    axial_power: Floats  # work of the platform's axial motion
    angular_power: Floats  # and of its rotation
    efficiency: Floats  # nan where input or output is not > 0
    impact_loss: Floats  # by restitution
    impact_friction_loss: Floats  # by slip in impacts
    sliding_loss: Floats  # by slip in contact
    friction_work_per_turn: Floats  # of impacts and sliding
    contact_share: Floats  # part of the time
    impact_rate: Floats


class Run(NamedTuple):
    """How each motor is run."""

    start: str = "period-1"  # one of STARTS
    settling: int = 300  # periods left out, at least
    measured: int = 512  # periods of the first stretch
    longest: int = 20_000  # periods in all


def check_start(start: str) -> None:
    """Raise InputError for a word that is none of STARTS."""
    if start not in STARTS:
        raise InputError("start", start, ", ".join(STARTS), closest(start, STARTS))


def measure(motors: Sequence[tuple[Motion, Disk]], run: Run, row: int = 0) -> MotorMeans:
    """The means of each motor; with start `followed` in rows of `row`, each from the one before."""
    n = len(motors)
    motions, disks = np.zeros(n, MOTION_DTYPE), np.zeros(n, DISK_DTYPE)
    begins = np.zeros((n, BEGIN_PRECISION + 1))
    for i, (motion, disk) in enumerate(motors):
        motions[i] = _motion_record(motion)[0]
        disks[i] = disk_record(disk, _COUNTED * velocity_scale(motion, disk))[0]
        begins[i] = _begin(motion, disk, run)
    out = np.empty((n, MEANS_COLUMNS))
    states, ledgers, rows, open_row, work = workspace()
    followed = row if run.start == "followed" else 0
    measure_motors(
        states, motions, disks, ledgers, rows, open_row, work, begins, followed, run.measured,
        run.longest, out,
    )  # fmt: skip
    away = np.array([runs_away(disk) for _, disk in motors], bool)
    loads = np.array([disk.load_torque for _, disk in motors])
    return _means(out, away, loads)


@lru_cache(1024)
def _motion_record(motion: Motion) -> NDArray[np.void]:
    return platform.steady(motion, 0, 0, 0.0)


def _begin(motion: Motion, disk: Disk, run: Run) -> tuple[float, ...]:
    """The row of `measure_motors` that says where a motor starts and how long it settles."""
    omega = math.tau * motion.frequency
    limit = friction_limit(disk)
    scale = omega * motion.angular_amplitude or limit / (disk.inertia * omega)
    if runs_away(disk):
        return LOOK_AT, 0.0, 0.0, -1.0, PRECISION_PART * scale
    left = limit - max(abs(disk.load_torque) - disk.brake_torque, 0.0)
    slow = 0.0
    if left > 0.0 and motion.angular_amplitude > 0.0:
        slow = _ROOM * 0.5 * angular_forcing_of(motion, disk) * limit / left
    settling = min(run.settling + slow, max(run.longest - 2 * run.measured, 0))
    orbit = period_one(motion, disk) if run.start != "rest" else None
    begin = (LOOK_AT, 0.0, 0.0)
    if orbit is not None:
        bounce = -disk.restitution * orbit.axial_impact_velocity
        begin = (orbit.forcing_phase + _BESIDE, bounce, orbit.angular_velocity)
    return *begin, float(math.floor(settling)), PRECISION_PART * scale


def _means(out: Floats, away: NDArray[np.bool_], loads: Floats) -> MotorMeans:
    entries = out[:, POWERS:]
    speed = out[:, MEAN_SPEED]
    brake = entries[:, L_BRAKE]
    output = loads * speed + brake
    given = entries[:, W_AXIAL] + entries[:, W_ANGULAR]
    rubbed = entries[:, L_FRICTION] + entries[:, L_SLIDING]
    with np.errstate(divide="ignore", invalid="ignore"):
        efficiency = np.where((given > 0.0) & (output > 0.0), output / given, math.nan)
        per_turn = np.where(speed != 0.0, math.tau * rubbed / np.abs(speed), math.nan)
    cycles = np.nan_to_num(out[:, CYCLE]).astype(np.int32)
    return MotorMeans(
        _kinds(out, away),
        np.nan_to_num(out[:, CYCLE_IMPACTS]).astype(np.int32),
        cycles,
        speed,
        out[:, SPEED_ERROR],
        out[:, PERIODS],
        output,
        brake,
        entries[:, W_AXIAL],
        entries[:, W_ANGULAR],
        efficiency,
        entries[:, L_AXIAL],
        entries[:, L_FRICTION],
        entries[:, L_SLIDING],
        per_turn,
        out[:, CONTACT_SHARE],
        out[:, IMPACT_RATE],
    )


def _kinds(out: Floats, away: NDArray[np.bool_]) -> Ints:
    kind = np.full(len(out), UNKNOWN_KIND, np.int32)
    known = np.isfinite(out[:, MEAN_SPEED])
    repeats, bounces = out[:, CYCLE] > 0.0, out[:, IMPACT_RATE] > 0.0
    touches = (out[:, CONTACT_RATE] > 0.0) | (out[:, CONTACT_SHARE] > 0.0)
    kind[known & ~repeats] = NOT_PERIODIC
    kind[known & repeats & bounces & ~touches] = BOUNCES
    kind[known & repeats & bounces & touches] = CHATTERS
    kind[known & ~bounces] = CONTACT_ONLY
    kind[away] = RUNS_AWAY
    return kind
