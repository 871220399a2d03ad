"""The words of the model: motions, disks, states and the records of the core (SI units, z up).

Symbols are those of Liu, Friend, Yeo, "The behavior of bouncing disks and pizza tossing" (EPL
2009).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.impact_layout import IMPACT_LAYOUT


class SimulationError(RuntimeError):
    """The state of a run is not finite, or a root could not be found: the run cannot go on."""


class Phase(IntEnum):
    """Phase of motion of the disk."""

    FLIGHT = 0
    STICKING = 1
    SLIDING = 2
    HELD = 3  # at α̇ = 0 by the brake, while the platform slides beneath


class ImpactKind(IntEnum):
    """What one row of the impact log stands for: the one numbered table."""

    IMPACT = 0  # one impact
    CHATTER_TAIL = 1  # the last impacts of a complete chattering, summed; the row ends in contact
    CHATTER_CUT = 2  # impacts below the reporting speed, summed, that did not end in contact


class Motion(NamedTuple):
    """Platform motion s = A sin(ωt), β = Φ sin(ωt + θ) (paper, eq. 1)."""

    axial_amplitude: float  # A, m
    angular_amplitude: float  # Φ, rad
    frequency: float  # f = ω/2π, Hz
    phase_lag: float  # θ, rad

    @classmethod
    def of(cls, values: Mapping[str, Any]) -> Motion:
        """The motion of a set of parameters, by their names."""
        return cls(*(float(values[name]) for name in cls._fields))


class Disk(NamedTuple):
    """Disk, contact and constant loads."""

    mass: float  # m, kg
    restitution: float  # ε, 1
    friction: float  # μ, 1
    friction_radius: float  # a_e, m
    gyration_radius: float  # a_g, m
    gravity: float  # g, m/s²
    preload: float = 0.0  # P, N, presses the disk on the platform
    load_torque: float = 0.0  # T_L, N·m, positive when it brakes positive rotation
    brake_torque: float = 0.0  # T_B, N·m, a dry brake: −T_B sgn α̇
    load_inertia: float = 0.0  # J, kg·m², turns with the disk

    @classmethod
    def of(cls, values: Mapping[str, Any]) -> Disk:
        """The disk of a set of parameters, by their names."""
        return cls(*(float(values[name]) for name in cls._fields))

    @property
    def inertia(self) -> float:
        """Moment of inertia of all that turns, I = m a_g² + J, kg·m²."""
        return self.mass * self.gyration_radius**2 + self.load_inertia


class InitialState(NamedTuple):
    """Where a run starts."""

    height: float = 0.0  # of the disk above the platform, m
    axial_velocity: float | None = None  # absolute, m/s; None: the platform's
    angular_velocity: float = 0.0  # absolute, rad/s
    angle: float = 0.0  # rad
    forcing_phase: float = 1.5 * math.pi  # τ, rad; the default is the lowest point


class Sample(NamedTuple):
    """State of platform and disk at one instant of simulated time."""

    time_ns: int
    phase: Phase
    cycles: int
    forcing_phase: float  # rad, in [0, 2π)
    platform_position: float  # s, m
    platform_velocity: float  # m/s
    platform_angle: float  # β, rad
    platform_angular_velocity: float  # rad/s
    gap: float  # x − s, m
    axial_position: float  # x, m
    axial_velocity: float  # m/s
    turns: int  # whole turns of the disk
    angle: float  # rad, the remainder, |angle| ≤ π
    angular_velocity: float  # rad/s
    axial_force: float  # of the platform on the disk, N
    friction_torque: float  # of the platform on the disk, N·m

    @property
    def unwrapped_angle(self) -> float:
        """Angle of the disk with its whole turns, rad."""
        return math.tau * self.turns + self.angle

    def mean_speeds(self, later: Sample) -> tuple[float, float]:
        """Mean axial (m/s) and angular (rad/s) speed of the disk until a later sample."""
        seconds = (later.time_ns - self.time_ns) / 1e9
        turned = math.tau * (later.turns - self.turns) + (later.angle - self.angle)
        return (later.axial_position - self.axial_position) / seconds, turned / seconds


_INTEGERS = {"time_ns": "<i8", "phase": "u1", "cycles": "<i8", "turns": "<i8"}
SAMPLE_DTYPE = np.dtype([(name, _INTEGERS.get(name, "<f8")) for name in Sample._fields])
"""One sample as a row."""


class Energy(NamedTuple):
    """Energy ledger since the start or the last reset, J; each is computed by itself."""

    kinetic: float
    potential: float  # (m g + P) x + T_L α
    initial: float  # kinetic + potential at the start
    work_axial: float  # of the platform on the disk
    work_angular: float
    work_impulses: float
    work_parameters: float  # jumps of the energy where parameters change
    loss_impact_axial: float
    loss_impact_friction: float
    loss_sliding: float
    loss_brake: float  # what a brake takes: with a motor, work done on the load
    residual: float  # kinetic + potential − initial − works + losses: 0 but for rounding
    # the scale of the residual: magnitudes of all entries, of what flights exchanged
    # between kinetic and potential energy, and of the energies themselves
    throughput: float

    @property
    def relative_residual(self) -> float:
        """|residual| over the throughput, 1; of nothing: the residual in J."""
        return abs(self.residual) / (self.throughput if self.throughput > 0.0 else 1.0)


RESIDUAL_LIMIT = 1e-9
"""Largest `Energy.relative_residual` that rounding explains (docs/model.md): more is an error."""


class MotionInForce(NamedTuple):
    """The cross-fade in progress, or the steady motion (then start = target, begin_ns = end_ns)."""

    begin_ns: int
    end_ns: int
    start: Motion
    target: Motion
    cycles: int  # at begin_ns
    forcing_phase: float  # at begin_ns, rad


IMPACT_DTYPE: np.dtype[np.void] = np.dtype(dict(IMPACT_LAYOUT))  # type: ignore[call-overload, unused-ignore]
"""One row of the impact log: x, y, z (float32) are τ/2π, w_A/(πg/ω), α̇/(ωΦ); the rest is SI.

`axial_impact_velocity` and `angular_impact_velocity` are those just before the impact, w_A < 0;
position, velocity and angular velocity those just after. Impulses are of the platform on the disk.
A row with `count` > 1 holds summed impulses, the velocities of its first impact and the time at
which it ended. Where x, y or z would pass LARGEST_FLOAT32, they stand at it: a row is finite.
"""

LARGEST_FLOAT32 = float(np.finfo(np.float32).max)
"""The largest finite float32; what is stored as one is held within ± this."""


def join_rows(parts: Iterable[NDArray[np.void]]) -> NDArray[np.void]:
    """One array of all rows; np.concatenate would drop the padding that the layout has."""
    parts = list(parts)
    if len(parts) == 1:
        return parts[0]
    raw = np.dtype((np.void, IMPACT_DTYPE.itemsize))
    rows = [np.ascontiguousarray(part).view(raw) for part in parts]
    return np.concatenate([np.zeros(0, raw), *rows]).view(IMPACT_DTYPE)
