"""Random runs over the whole range of the parameters, one for each seed.

Log-uniform over: A 1e-9 to 1 m, f 1e-3 to 1e6 Hz, heights 1e-8 to 100 m (a fifth at 0), preloads up
to 1000 m g and negative ones above −m g; ε in [0, 1], often at its ends; cross-fades between any
two such motions, of 1/1000 to 1000 periods of either. Runs with offset trajectories are on the
scale of a toss: heights up to some amplitudes, accelerations up to a few g.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from bouncing_disk_ros.core.model import Disk, InitialState, Motion
from bouncing_disk_ros.core.offset import Knot, OffsetState
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.run.session import Session
from bouncing_disk_ros.run.trajectory_validation import Splice
from bouncing_disk_ros.units import NS

GRAVITY = 9.81
FAR_NS = 10**15  # eleven days: a run is ended by its number of events


class RandomRun(NamedTuple):
    """A run with at most one cross-fade; its repr is enough to repeat it."""

    motion: Motion
    disk: Disk
    initial: InitialState
    target: Motion | None = None  # of the cross-fade
    begin_ns: int = 0
    duration_ns: int = 0

    def start(self) -> Simulation:
        """The run at t = 0, its cross-fade queued."""
        run = Simulation(self.motion, self.disk, self.initial)
        if self.target is not None:
            point = (self.begin_ns + self.duration_ns, self.target)
            run.command([point], crossfade_ns=self.duration_ns)
        return run


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """A number between low and high whose logarithm is uniform."""
    return float(math.exp(rng.uniform(math.log(low), math.log(high))))


def random_motion(rng: np.random.Generator) -> Motion:
    """A steady motion."""
    return Motion(
        log_uniform(rng, 1e-9, 1.0),
        log_uniform(rng, 1e-3, 1.0) if rng.random() < 0.7 else 0.0,
        log_uniform(rng, 1e-3, 1e6),
        float(rng.uniform(-math.pi, math.pi)),
    )


def random_disk(rng: np.random.Generator) -> Disk:
    """A disk with or without friction, preload and load torque."""
    mass = log_uniform(rng, 1e-3, 10.0)
    weight = mass * GRAVITY
    preload = (0.0, log_uniform(rng, 1e-3, 1e3), -float(rng.uniform(0.0, 0.99)))[rng.integers(3)]
    ends = (0.0, 1.0, float(rng.uniform()), 1.0 - log_uniform(rng, 1e-6, 1.0))
    friction = 0.0 if rng.random() < 0.1 else log_uniform(rng, 1e-3, 2.0)
    radius, load = log_uniform(rng, 0.01, 0.3), 0.0
    if rng.random() < 0.2:
        load = float(rng.uniform(-1.2, 1.2)) * friction * radius * weight * (1.0 + preload)
    return Disk(
        mass,
        ends[rng.integers(4)],
        friction,
        radius,
        log_uniform(rng, 0.01, 0.3),
        GRAVITY,
        preload * weight,
        load,
    )


def random_initial(rng: np.random.Generator) -> InitialState:
    """On the platform or above it; moving, or with the platform's velocity."""
    return InitialState(
        0.0 if rng.random() < 0.2 else log_uniform(rng, 1e-8, 100.0),
        None if rng.random() < 0.4 else float(rng.normal()) * log_uniform(rng, 1e-6, 10.0),
        float(rng.normal()) * 10.0,
        0.0,
        float(rng.uniform(0.0, math.tau)),
    )


def random_run(seed: int) -> RandomRun:
    """The run of a seed, the same with every version of Python."""
    rng = np.random.default_rng(seed)
    return RandomRun(random_motion(rng), random_disk(rng), random_initial(rng))


def random_fade(seed: int) -> RandomRun:
    """A run of a seed that begins with a cross-fade, at once or soon after."""
    rng = np.random.default_rng(seed)
    run = RandomRun(random_motion(rng), random_disk(rng), random_initial(rng))
    target = random_motion(rng)
    if rng.random() < 0.3:  # the same frequency or nearly
        target = target._replace(frequency=run.motion.frequency * log_uniform(rng, 0.5, 2.0))
    either = (run.motion.frequency, target.frequency)[rng.integers(2)]
    begin = 0.0 if rng.random() < 0.5 else log_uniform(rng, 1e-3, 10.0) / run.motion.frequency
    duration = log_uniform(rng, 1e-3, 1e3) / either
    return run._replace(
        target=target, begin_ns=round(begin * 1e9), duration_ns=max(round(duration * 1e9), 1)
    )


# --- with offset trajectories ---------------------------------------------------------------------
class Spliced(NamedTuple):
    """A message: when its trajectory begins, and the points of both joints.

    A point is (ns, position), or with velocity, or with velocity and acceleration.
    """

    begin_ns: int
    axial: tuple[tuple[float, ...], ...]
    angular: tuple[tuple[float, ...], ...]


class OffsetRun(NamedTuple):
    """A run with trajectories; its repr is enough to repeat it."""

    motion: Motion
    disk: Disk
    initial: InitialState
    trajectories: tuple[Spliced, ...]

    def start(self) -> Simulation:
        """The run at t = 0, its trajectories queued."""
        run = Simulation(self.motion, self.disk, self.initial)
        for one in self.trajectories:
            run.trajectory(one.begin_ns, knots(one.axial), knots(one.angular))
        return run


def knots(points: tuple[tuple[float, ...], ...]) -> list[Knot] | None:
    """Points as knots of the core; no points: the joint is left alone."""
    if not points:
        return None
    degrees = {2: 1, 3: 3, 4: 5}
    return [Knot(int(p[0]), OffsetState(*p[1:]), degrees[len(p)]) for p in points]


def points(
    rng: np.random.Generator, begin_ns: int, scale: float, rate: float
) -> tuple[tuple[float, ...], ...]:
    """One to four points about a part of 1/rate s apart."""
    kind = int(rng.integers(1, 4))
    now, found = begin_ns, []
    for _ in range(int(rng.integers(1, 5))):
        now += int(rng.uniform(0.1, 0.8) / rate * NS)
        stated = [float(rng.normal()) * scale * rate**order for order in range(kind)]
        found.append((now, *stated))
    return tuple(found)


def random_offset_run(seed: int) -> OffsetRun:
    """A run about a second long in the motion's own units, f = 1 … 30 Hz."""
    rng = np.random.default_rng(seed)
    f = float(rng.uniform(1.0, 30.0))
    w = math.tau * f
    unit = math.pi * GRAVITY / w**2
    amplitude = float(rng.choice([0.0, 1.0])) * float(rng.uniform(0.05, 1.0)) * unit
    motion = Motion(amplitude, float(rng.uniform(0.0, 1.5)), f, float(rng.uniform(-3, 3)))
    restitution = float(rng.choice([0.0, 1.0, rng.uniform(0.1, 0.95)], p=[0.1, 0.1, 0.8]))
    mu = float(rng.uniform(0.0, 1.0))
    disk = Disk(0.7, restitution, mu, 0.1, 0.09, GRAVITY)
    initial = InitialState(
        float(rng.choice([0.0, 1.0])) * float(rng.uniform(0.01, 2.0)) * unit,
        None if rng.random() < 0.5 else float(rng.normal()) * unit * w,
        float(rng.normal()) * w,
        0.0,
        float(rng.uniform(0.0, 6.28)),
    )
    begin, made = 0, []
    for _ in range(int(rng.integers(1, 4))):
        begin += int(rng.uniform(0.0, 1.0) / f * NS)
        axial = points(rng, begin, 0.3 * unit, f) if rng.random() < 0.9 else ()
        angular = points(rng, begin, 0.3, f) if rng.random() < 0.5 else ()
        made.append(Spliced(begin, axial, angular))
    return OffsetRun(motion, disk, initial, tuple(made))


# --- all features at once -------------------------------------------------------------------------
class Input(NamedTuple):
    """An input: when it arrives, and what it is.

    kind and values: "motion" (points (ns, Motion), cross-fade in ns or 0), "trajectory" (begin in
    ns, points (ns, position, ...) of the axial and the angular joint), "impulse" (ns, axial,
    angular), "disk" (the disk from here on), "reset" (initial state, motion), "snapshot" ().
    """

    arrives_ns: int
    kind: str
    values: tuple[Any, ...]


class Script(NamedTuple):
    """A run with inputs of every kind, and when its state is compared; its repr repeats it."""

    motion: Motion
    disk: Disk
    initial: InitialState
    inputs: tuple[Input, ...]
    samples_ns: tuple[int, ...]

    @property
    def parameters(self) -> dict[str, Value]:
        """The parameters of the simulator that it starts with."""
        return {**self.disk._asdict(), **_start(self.initial, self.motion)}


def _start(initial: InitialState, motion: Motion) -> dict[str, Value]:
    """Parameters that a reset begins with."""
    values = {f"initial_{name}": value for name, value in initial._asdict().items()}
    follows = values["initial_axial_velocity"] is None
    if follows:
        values["initial_axial_velocity"] = 0.0
    return {**motion._asdict(), **values, "initial_with_platform": follows}


def take(session: Session, one: Input) -> None:
    """An input that arrives at a paused session."""
    match one.kind, one.values:
        case "motion", (points, lasts):
            session.set_parameters({"crossfade_duration": lasts / NS})
            session.command(points)
        case "trajectory", (begin_ns, axial, angular):
            session.trajectory(Splice(begin_ns, _knots(axial), _knots(angular)))
        case "impulse", (at_ns, axial, angular):
            session.apply_impulse(at_ns, axial, angular)
        case "disk", (disk,):
            session.set_parameters(disk._asdict())
        case "reset", (initial, motion):
            session.set_parameters(_start(initial, motion))
            session.reset()
        case "snapshot", ():
            session.snapshot()


def _knots(points: tuple[tuple[float, ...], ...]) -> tuple[Knot, ...] | None:
    found = knots(points)
    return None if found is None else tuple(found)


_ENDS = (0.0, 1.0)


class _Scales(NamedTuple):
    """What a script is drawn in: g + P/m, ω, a friction μ a_e (m g + P), I, Φ; units follow."""

    gravity: float
    omega: float
    friction: float
    inertia: float
    swing: float

    @property
    def height(self) -> float:
        """πg/ω², m."""
        return math.pi * self.gravity / self.omega**2

    @property
    def speed(self) -> float:
        """πg/ω, m/s."""
        return math.pi * self.gravity / self.omega


def random_script(seed: int) -> Script:
    """The script of a seed: all features at once over the whole allowed ranges.

    g + P/m from 1e-9 to 1e9 m/s², periods from 1 µs to 10³ s, Γ from 0 to 3; friction, load and
    brake at 0, at ties of one another and between. Some are made of decimal numbers, whose
    impacts are at whole milliseconds, with inputs at these.
    """
    rng = np.random.default_rng(seed)
    decimal = rng.random() < 0.25
    scales, disk = _scripted_disk(rng, decimal)
    motion = _scripted_motion(rng, scales, decimal)
    initial = _scripted_initial(rng, scales, decimal)
    period = round(1e9 * math.tau / scales.omega)
    lasts = int(period * rng.uniform(1.0, 4.0))
    if initial.height > 0.0:
        lasts += round(1e9 * min(math.sqrt(2.0 * initial.height / scales.gravity), 1e6))
    if decimal:
        lasts = 2 * NS
    inputs = _scripted_inputs(rng, scales, motion, disk, lasts, decimal)
    times = sorted({*(int(t) for t in lasts * rng.uniform(0.05, 1.0, 6)), lasts})
    if decimal:
        times = [t // 10**7 * 10**7 + 10**6 * int(rng.integers(2)) for t in times]
        times = sorted({max(t, 10**6) for t in times})
    return Script(motion, disk, initial, tuple(inputs), tuple(times))


def _pick(rng: np.random.Generator, *values: float) -> float:
    return float(values[int(rng.integers(len(values)))])


def _scripted_disk(rng: np.random.Generator, decimal: bool) -> tuple[_Scales, Disk]:
    """A disk with its loads, and the scales of its motion."""
    gravity = 10.0 if decimal else log_uniform(rng, 1e-9, 1e9)
    period = 1.0
    while not decimal:
        period = log_uniform(rng, 1e-6, 1e3)
        if gravity * period**2 < 1e6 and gravity * period < 1e5:
            break
    mass = 0.5 if decimal else log_uniform(rng, 1e-3, 10.0)
    part = _pick(rng, 0.0, 0.0, float(rng.uniform(-2.0, 0.9)))  # of g + P/m that is the preload's
    part = part if gravity * mass * abs(part) < 1e11 and gravity * (1.0 - part) <= 1e9 else 0.0
    radius, gyration = (0.125, 0.25) if decimal else (log_uniform(rng, 0.01, 0.3) for _ in "ab")
    inertia = mass * gyration**2
    added = _pick(rng, 0.0, 0.0, 0.5, 2.0) * inertia
    omega = math.tau / period
    friction = _pick(rng, 0.1, 0.25, 0.5) if decimal else log_uniform(rng, 1e-3, 10.0)
    force = friction * radius * mass * gravity
    strength = 1.0 if decimal else log_uniform(rng, 0.03, 30.0)  # Γ_T
    swing = min(math.pi * force / (strength * omega * omega * (inertia + added)), 1e5)
    friction = _pick(rng, 0.0, *[friction] * 5)
    scales = _Scales(gravity, omega, force, inertia + added, swing)
    load, brake = _torques(rng, scales.friction)
    kinds = (*_ENDS, 0.5, float(rng.uniform(0.0, 0.9)), float(rng.uniform(0.1, 0.9)))
    disk = Disk(
        mass, _pick(rng, *kinds), friction, radius, gyration, gravity * (1.0 - part),
        part * gravity * mass, load, brake, added,
    )  # fmt: skip
    return scales, disk


def _torques(rng: np.random.Generator, force: float) -> tuple[float, float]:
    """Load and brake: none, some, and ties with one another and with friction."""
    load = _pick(rng, 0.0, 0.0, float(rng.uniform(-1.3, 1.3)), _pick(rng, -1.0, 1.0)) * force
    some = log_uniform(rng, 0.01, 3.0) * force
    tie = _pick(rng, force, abs(load), force + abs(load), abs(force - abs(load)))
    return load, _pick(rng, 0.0, some, some, tie)


def _scripted_motion(rng: np.random.Generator, scales: _Scales, decimal: bool) -> Motion:
    forcing = _pick(rng, 0.0, float(rng.uniform(0.05, 0.4)), float(rng.uniform(0.3, 3.0)))
    if decimal:
        forcing *= _pick(rng, 0.0, 0.0, 1.0)
    lag = _pick(rng, 0.0, 0.5 * math.pi, float(rng.uniform(-3.1, 3.1)))
    swing = scales.swing * _pick(rng, 0.0, 1.0, 1.0, float(rng.uniform()))
    return Motion(forcing * scales.height, swing, scales.omega / math.tau, lag)


def _scripted_initial(rng: np.random.Generator, scales: _Scales, decimal: bool) -> InitialState:
    if decimal:
        height, velocity = _pick(rng, 0.0, 0.05, 0.2), _pick(rng, math.nan, 0.0, 1.0, -1.0)
        spin = _pick(rng, 0.0, 1.0, -2.0)
    else:
        height = _pick(rng, 0.0, 0.0, log_uniform(rng, 1e-3, 3.0), log_uniform(rng, 1.0, 1e3))
        height = min(height * scales.height, 1e6)
        velocity = float(rng.normal()) * _pick(rng, 1.0, log_uniform(rng, 1.0, 1e4)) * scales.speed
        velocity = _pick(rng, math.nan, max(min(velocity, 1e6), -1e6))
        spin = _pick(rng, 0.0, float(rng.normal())) * scales.omega * scales.swing
        spin = max(min(spin, 1e9), -1e9)
    phase = _pick(rng, 0.0, 1.5 * math.pi, float(rng.uniform(0.0, 6.28)))
    follows = math.isnan(velocity)
    return InitialState(height, None if follows else velocity, spin, 0.0, phase)


def _scripted_inputs(
    rng: np.random.Generator, scales: _Scales, motion: Motion, disk: Disk, lasts: int, decimal: bool
) -> list[Input]:
    """Inputs of every kind, queued at the start or arriving at their instant."""

    def instant() -> int:
        at = int(lasts * rng.uniform(0.0, 0.9))
        return at // 10**8 * 10**8 if decimal else at

    def arrives(at_ns: int) -> int:
        return 0 if rng.random() < 0.5 else at_ns

    inputs = []
    if rng.random() < 0.35:
        at = instant()
        inputs.append(
            Input(arrives(at), "motion", _scripted_fade(rng, scales, motion, at, decimal))
        )
    if rng.random() < 0.4 and scales.omega < 1e5:
        for at in [instant() for _ in range(int(rng.integers(1, 3)))]:
            first = arrives(at)
            inputs += [Input(first, "trajectory", _scripted_offset(rng, scales, at, decimal))]
    for _ in range(int(rng.integers(0, 3)) if rng.random() < 0.6 else 0):
        at = instant()
        impulse = _scripted_impulse(rng, scales, disk, decimal)
        inputs.append(Input(arrives(at), "impulse", (at, *impulse)))
    for _ in range(int(rng.integers(0, 3)) if rng.random() < 0.4 else 0):
        changed = _scripted_change(rng, scales, disk)
        inputs.append(Input(instant(), "disk", (changed,)))
    if rng.random() < 0.2:
        again = _scripted_initial(rng, scales, decimal)
        inputs.append(Input(instant(), "reset", (again, _scripted_motion(rng, scales, decimal))))
    inputs.append(Input(instant(), "snapshot", ()))
    return sorted(inputs, key=lambda one: one.arrives_ns)


def _scripted_impulse(
    rng: np.random.Generator, scales: _Scales, disk: Disk, decimal: bool
) -> tuple[float, float]:
    axial = disk.mass * scales.speed * _pick(rng, 0.0, float(rng.normal()) * 0.3)
    angular = scales.inertia * scales.omega * scales.swing
    angular *= _pick(rng, 0.0, 0.0, float(rng.normal()))
    if decimal:
        axial = disk.mass * _pick(rng, 0.0, 0.5, 1.0, -0.5)
    return axial, angular


def _scripted_change(rng: np.random.Generator, scales: _Scales, disk: Disk) -> Disk:
    """Other loads and restitution, and sometimes another friction."""
    load, brake = _torques(rng, scales.friction)
    restitution = _pick(rng, *_ENDS, 0.5, disk.restitution)
    changed = disk._replace(load_torque=load, brake_torque=brake, restitution=restitution)
    if rng.random() < 0.3:
        changed = changed._replace(friction=_pick(rng, 0.0, 0.5, 2.0) * disk.friction)
    return changed


def _scripted_fade(
    rng: np.random.Generator, scales: _Scales, motion: Motion, at: int, decimal: bool
) -> tuple[Any, ...]:
    """The points of a programme, and the duration of its cross-fades."""
    period = round(1e9 * math.tau / scales.omega)
    points, lasts = [], int(period * _pick(rng, 0.0, log_uniform(rng, 1e-2, 30.0)))
    for _ in range(int(rng.integers(1, 3))):
        target = _scripted_motion(rng, scales, decimal)
        target = target._replace(
            frequency=motion.frequency * _pick(rng, 1.0, rng.uniform(0.5, 2.0))
        )
        points.append((at, target))
        at += int(period * rng.uniform(0.1, 2.0)) + 1
    return tuple(points), lasts


def _scripted_offset(
    rng: np.random.Generator, scales: _Scales, at: int, decimal: bool
) -> tuple[Any, ...]:
    """Where a trajectory begins, and the points of its joints."""
    rate = scales.omega / math.tau
    axial = points(rng, at, 0.3 * scales.height, rate) if rng.random() < 0.7 else ()
    if decimal and axial:
        axial = tuple(
            (at + 10**8 * (i + 1), *(round(x, 1) for x in p[1:])) for i, p in enumerate(axial)
        )
    swing = 0.3 * scales.swing
    angular = points(rng, at, swing, rate) if rng.random() < 0.7 or not axial else ()
    return at, axial, angular
