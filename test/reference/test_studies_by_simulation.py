"""Studies at random options beside single runs of the simulator, which know nothing of them.

A diagram follows the map step by step: its steps have the stepper's bits (test_map_kernels.py),
and its results are pinned. Tosses are in test_toss.py. Of the resilience studies, fatal changes are
beside the simulator in test_fatal_changes.py, manifolds beside basins in test_manifolds.py, and
curves beside Newton's method in test_curve_reference.py.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
import xarray as xr

from bouncing_disk_ros.core.model import Disk, Energy, ImpactKind, InitialState, Motion, Phase
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.errors import InputError
from reference.cases import examples, in_soak
from support import studied
from support.studied import Options, computed

EVENTS = 20_000
"""Events of one run."""
PARTS, RUNS = 16, 6
AXES = ("load_torque", "brake_torque", "preload", "axial_amplitude", "frequency", "phase_lag",
        "restitution", "friction")  # fmt: skip
LOWEST = 1.5 * math.pi
PERIODIC, CHATTERS, CONTACT_ONLY, NOT_PERIODIC, RUNS_AWAY = range(5)


class Motor(NamedTuple):
    """A motor of SI units, and the scales of its motion."""

    motion: Motion
    disk: Disk
    pull: float  # g + P/m
    forcing: float  # Γ
    omega: float


class Block(NamedTuple):
    """What is seen between two instants a whole number of periods apart."""

    numbers: dict[str, float]  # as the study names them
    seconds: float
    rows: int
    tails: int
    phase: Phase


def any_motor(rng: np.random.Generator) -> Motor:
    """Γ from 0.03 to 30, Γ_T from 10⁻³ to 10³, loads up to what friction holds, any size."""

    def power(low: float, high: float) -> float:
        return float(10.0 ** rng.uniform(low, high))

    near = rng.random() < 0.5
    forcing = float(rng.uniform(0.2, 0.8)) if near else power(-1.5, 1.5)
    restitution = float(rng.choice([0.0, 0.5, rng.uniform(0.0, 0.97)]))
    mass, gravity, friction, radius = power(-6, 3), power(-3, 2), power(-3, 2), power(-4, 2)
    preload = float(rng.choice([0.0, power(-1, 3), -0.5])) * mass * gravity
    frequency, gyration = power(-1, 5), radius * power(-1, 1)
    pull, omega = gravity + preload / mass, math.tau * frequency
    inertia = mass * gyration**2 * float(rng.choice([0.0, power(-2, 2)]))
    limit = friction * radius * mass * pull
    whole = mass * gyration**2 + inertia
    angular = power(-1, 1) if near else power(-3, 3)
    motion = Motion(
        forcing * math.pi * pull / omega**2,
        float(rng.choice([1.0, 1.0, 0.0])) * angular * math.pi * limit / (whole * omega**2),
        frequency, float(rng.uniform(-4.0, 4.0)),
    )  # fmt: skip
    disk = Disk(
        mass, restitution, friction, radius, gyration, gravity, preload,
        limit * float(rng.choice([0.0, rng.uniform(-1.0, 1.0), 1.5])),
        limit * float(rng.choice([0.0, power(-3, 0)])), inertia,
    )  # fmt: skip
    return Motor(motion, disk, pull, forcing, omega)


def begun(motor: Motor, start: str, speed: float) -> Simulation:
    """A rotor at rest at the lowest point, or beside the period-1 orbit where there is one."""
    motion, disk, pull, forcing, omega = motor
    loss = (1.0 - disk.restitution) / (1.0 + disk.restitution)
    unit = math.pi * pull / omega
    initial = InitialState(0.0, None, speed, 0.0, LOWEST)
    if start == "period-1" and forcing > loss:
        tau = math.acos(loss / forcing) + 1e-3
        platform = motion.axial_amplitude * omega * math.cos(tau)
        falls = platform - 2.0 * unit / (1.0 + disk.restitution)
        initial = InitialState(0.0, falls, speed, 0.0, tau)
    return Simulation(motion, disk, initial, chatter_report_speed=0.01 * unit)


def instant(motor: Motor, start: Simulation, k: int) -> int:
    """ns at which the platform is at its lowest point for the k-th time."""
    tau = start.motion_in_force.forcing_phase if start.time_ns == 0 else 0.0
    return round(((LOWEST - tau) % math.tau + math.tau * k) / motor.omega * 1e9)


def block(one: Simulation, motor: Motor, until: int) -> Block | None:
    """Means up to an instant; None: the events run out."""
    begin, first, angle = one.time_ns, one.energy(), one.sample().unwrapped_angle
    resting = one.sample().phase is not Phase.FLIGHT
    rows, behind = one.advance(until, EVENTS)
    if behind:
        return None
    last, t = one.energy(), (until - begin) * 1e-9
    spent = Energy(*(b - a for a, b in zip(first, last, strict=True)))
    disk = motor.disk
    speed = (one.sample().unwrapped_angle - angle) / t
    out = disk.load_torque * speed + spent.loss_brake / t
    given = (spent.work_axial + spent.work_angular) / t
    rubbed = spent.loss_impact_friction + spent.loss_sliding
    numbers = {
        "mean_speed": speed, "output_power": out, "brake_power": spent.loss_brake / t,
        "axial_power": spent.work_axial / t, "angular_power": spent.work_angular / t,
        "efficiency": out / given if out > 0.0 and given > 0.0 else math.nan,
        "impact_loss": spent.loss_impact_axial / t,
        "impact_friction_loss": spent.loss_impact_friction / t,
        "sliding_loss": spent.loss_sliding / t,
        "friction_work_per_turn":
            math.tau * rubbed / t / abs(speed) if speed != 0.0 else math.nan,
        "contact_share": _in_contact(rows, motor, begin, until, resting=resting) / t,
        "impact_rate": len(rows) / t,
    }  # fmt: skip
    tails = int(np.count_nonzero(rows["kind"] == ImpactKind.CHATTER_TAIL))
    return Block(numbers, t, len(rows), tails, one.sample().phase)


def _in_contact(rows: np.ndarray, motor: Motor, begin: int, end: int, *, resting: bool) -> float:
    """Seconds in contact: from the end of a chatter to separation, sin τ = 1/(πΓ)."""
    if math.pi * motor.forcing <= 1.0:
        return (end - begin) * 1e-9 if resting and not len(rows) else math.nan
    leave = math.asin(1.0 / (math.pi * motor.forcing))
    tau = rows["forcing_phase"]
    lands = rows["kind"] == ImpactKind.CHATTER_TAIL
    if motor.disk.restitution == 0.0:
        lands |= np.sin(tau) * math.pi * motor.forcing < 1.0
    seconds = float(np.sum(np.remainder(leave - tau[lands], math.tau)) / motor.omega)
    # contact that the block begins or ends with: its ends are at the lowest point
    wait = (leave - LOWEST) % math.tau / motor.omega
    if resting:
        seconds += wait
    if (
        len(rows)
        and lands[-1]
        and rows["time"][-1] + 1e-9 > end * 1e-9 - (math.tau / motor.omega - wait)
    ):
        seconds -= wait
    elif resting and not len(rows):
        return math.nan
    return seconds


def attack_motor(rng: np.random.Generator, path: Path) -> list[str]:
    """Kind and all means at one point."""
    motor = any_motor(rng)
    start = str(rng.choice(["rest", "period-1"]))
    values = {**motor.motion._asdict(), **motor.disk._asdict()}
    across, up = rng.permutation(AXES)[:2]
    options: Options = {"start": start, "x_axis": str(across), "y_axis": str(up), "longest": 4000,
                        **{name: value for name, value in values.items()
                           if name not in (across, up)}}  # fmt: skip
    for key, name in (("x", across), ("y", up)):
        options |= {f"{key}_begin": values[name], f"{key}_end": values[name], f"{key}_count": 1}
    try:
        result = computed("motor", path, **options).isel({str(across): 0, str(up): 0})
    except InputError:  # nothing moves, or all runs away
        return []
    return [f"motor({options}): {one}" for one in _beside(motor, start, result)]


def _beside(motor: Motor, start: str, result: xr.Dataset) -> list[str]:
    kind, cycles = int(result["kind"].values), int(result["cycles"].values)
    disk = motor.disk
    limit = disk.friction * disk.friction_radius * disk.mass * motor.pull
    away = abs(disk.load_torque) > (limit + disk.brake_torque) * (1.0 + 1e-9)
    if (kind == RUNS_AWAY) != away and abs(disk.load_torque) != limit + disk.brake_torque:
        return [f"kind {kind} with load {disk.load_torque}, friction and brake {limit}"]
    if not PERIODIC <= kind <= NOT_PERIODIC:
        return []
    mean = float(result["mean_speed"].values)
    scale = motor.omega * motor.motion.angular_amplitude
    scale = scale or limit / (disk.inertia * motor.omega) or 1.0
    far = 2.0 * scale + 8.0 * math.tau * abs(disk.load_torque) / (disk.inertia * motor.omega)
    upper, lower = (blocks_of(motor, start, mean + side * far, cycles) for side in (1.0, -1.0))
    if upper is None or lower is None:
        return []
    if cycles:
        return _repeats(motor, result, upper[0], lower[0], scale, kind)
    return _wanders(motor, start, result, upper, lower, scale, kind)


def blocks_of(motor: Motor, start: str, speed: float, cycles: int = 0) -> list[Block] | None:
    """What is seen of a run, in parts; in one of whole repetitions, where there are any."""
    one = begun(motor, start, speed)
    first = instant(motor, one, 600)
    _, behind = one.advance(first, 10 * EVENTS)
    whole = cycles * max(1, 300 // cycles) if cycles else 100
    found = []
    for j in range(1, 2 if cycles else PARTS + 1):
        seen = block(one, motor, first + round(j * whole * math.tau / motor.omega * 1e9))
        if behind or seen is None:
            return None
        found.append(seen)
    return found


def _repeats(
    motor: Motor, result: xr.Dataset, high: Block, low: Block, scale: float, kind: int
) -> list[str]:
    mean = float(result["mean_speed"].values)
    top, bottom = (b.numbers["mean_speed"] for b in (high, low))
    cycles, seconds = int(result["cycles"].values), high.seconds
    # of what a whole number of nanoseconds leaves out, too
    tiny = 1e-6 * scale + 2e-9 / seconds * (scale + abs(mean))
    tiny += 10.0 * float(result["mean_speed_error"].values)
    if not bottom - tiny <= mean <= top + tiny:
        return [f"mean speed {mean}, {bottom} to {top} seen"]
    said = []
    touches = high.numbers["contact_share"] > 0.0 or high.tails > 0
    seen = CONTACT_ONLY if not high.rows else CHATTERS if touches else PERIODIC
    if seen != kind:
        said.append(f"kind {kind}, {seen} seen")
    repetitions = round(seconds * motor.omega / math.tau / cycles)
    period = int(result["period"].values)
    if abs(high.rows - period * repetitions) > 1:  # the row that is open at an end
        said.append(f"period {period}, {high.rows} in {repetitions} repetitions seen")
    if top - bottom > tiny:  # not met: as far as they have come
        return said
    power = sum(abs(high.numbers[n]) for n in high.numbers if n.endswith(("power", "loss")))
    for name, value in high.numbers.items():
        found = float(result[name].values)
        size = power if name.endswith(("power", "loss")) else abs(value)
        if name == "mean_speed" or math.isnan(value) or math.isnan(found):
            continue
        if name == "friction_work_per_turn":
            size += 1e-6 * math.tau * power / abs(mean)
        if name == "efficiency" and value < 1e-3:
            continue
        if abs(found - value) > (1e-4 + 1.0 / (1 + high.rows) * (name == "impact_rate")) * size:
            said.append(f"{name} {found}, {value} seen")
    return said + _stop(motor, result, mean)


def _stop(motor: Motor, result: xr.Dataset, mean: float) -> list[str]:
    disk = motor.disk
    limit = disk.friction * disk.friction_radius * disk.mass * motor.pull
    against = limit + disk.brake_torque + math.copysign(1.0, mean) * disk.load_torque
    stop = float(result["stop_time_95"].values)
    if against > 0.0 and not math.isclose(stop, 0.95 * disk.inertia * abs(mean) / against,
                                          rel_tol=1e-9, abs_tol=1e-300):  # fmt: skip
        return [f"stop time {stop}"]
    return []


def _wanders(
    motor: Motor, start: str, result: xr.Dataset, upper: list[Block], lower: list[Block],
    scale: float, kind: int,
) -> list[str]:  # fmt: skip
    """Means of chaos within their errors, where both runs have met."""
    if kind != NOT_PERIODIC:
        return [f"kind {kind} without a cycle"] if upper[-1].rows else []
    if any(abs(a.numbers["mean_speed"] - b.numbers["mean_speed"]) > 1e-6 * scale
           for a, b in zip(upper[:2], lower[:2], strict=True)):  # fmt: skip
        return []
    said, runs = [], [upper]
    for j in range(1, RUNS):  # roundings may decide what follows a contact
        motion = motor.motion._replace(
            axial_amplitude=motor.motion.axial_amplitude * (1.0 + j * 2.0**-51)
        )
        run_ = blocks_of(motor._replace(motion=motion), start, float(result["mean_speed"].values))
        if run_ is None:
            return []
        runs.append(run_)
    for name in upper[0].numbers:
        parts = np.array([np.mean([b.numbers[name] for b in run_]) for run_ in runs])
        found, error = (float(result[n].values) for n in (name, f"{name}_error"))
        if not np.isfinite(parts).all() or math.isnan(found) or name in (
            "efficiency", "friction_work_per_turn"
        ):  # fmt: skip
            continue
        own = float(parts.std(ddof=1)) / math.sqrt(RUNS)
        if abs(found - parts.mean()) > 8.0 * math.hypot(own, error) + 1e-9 * abs(found):
            said.append(f"{name} {found} ± {error}, {parts.mean()} ± {own} seen")
    return said


ATTACKS: dict[str, Callable[[np.random.Generator, Path], list[str]]] = {
    "basins": studied.attack_basins,
    "basin_shares": studied.attack_basin_shares,
    "parameter_map": studied.attack_parameter_map,
    "motor": attack_motor,
}
"""Study -> what differs at one draw of its options, nothing if all agrees."""
DRAWS = {"motor": 6}
"""So many (else 1) of each, for they take up to a second of CPU."""
STUDIES = [
    (name, seed)
    for name in ATTACKS
    for seed in (*range(examples(DRAWS.get(name, 1))), *in_soak(*range(10_000, 10_050)))
]


@pytest.mark.parametrize(("name", "seed"), STUDIES)
def test_a_study_agrees_with_the_simulator(name: str, seed: int, tmp_path: Path) -> None:
    said = ATTACKS[name](np.random.default_rng(seed), tmp_path)
    assert not said, "\n".join(said)
