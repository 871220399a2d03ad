"""Random runs of the whole model for the tests: parameters, start, cross-fades, kicks.

Everything is drawn in the model's own units (time 1/ω, axial velocity πg/ω, angular velocity ωΦ),
so that each draw has impacts, contact and slip in comparable amounts whatever the SI values are.
"""

from __future__ import annotations

import math
import os
from typing import NamedTuple

from hypothesis import Phase as HypothesisPhase
from hypothesis import settings
from hypothesis import strategies as st

from bouncing_disk_ros.core.model import Disk, InitialState, Motion
from bouncing_disk_ros.core.simulation import Simulation

NS = 1_000_000_000

#: the same examples on every run
FIXED = settings(derandomize=True, deadline=None, database=None, print_blob=True)
#: the same where one example takes long: the first failure is reported as it is found
SLOW = settings(FIXED, phases=[HypothesisPhase.explicit, HypothesisPhase.generate])


#: seed of the first random draw: 0, and another one for each `make soak`
FIRST = int(os.environ.get("SEED", "0")) if "EXAMPLES" in os.environ else 0


def examples(number: int, soak: int | None = None) -> int:
    """So many examples of a slow test, EXAMPLES times as many in `make soak`.

    `soak`: so many there instead, in proportion to EXAMPLES, of which 20 are usual.
    """
    times = int(os.environ.get("EXAMPLES", "0"))
    return number * max(times, 1) if soak is None or not times else soak * times // 20


class Fade(NamedTuple):
    """A cross-fade to `target` between two instants, ns."""

    begin_ns: int
    end_ns: int
    target: Motion


class Kick(NamedTuple):
    """Impulses (N s, N m s) at an instant, ns."""

    at_ns: int
    axial: float
    angular: float


class Case(NamedTuple):
    """A run: where it starts and all that drives it."""

    motion: Motion
    disk: Disk
    initial: InitialState
    fades: tuple[Fade, ...] = ()
    impulses: tuple[Kick, ...] = ()

    def start(self, report_speed: float = 0.0) -> Simulation:
        """The run at t = 0, with its inputs queued."""
        run = Simulation(self.motion, self.disk, self.initial, chatter_report_speed=report_speed)
        if self.fades:
            duration = self.fades[0].end_ns - self.fades[0].begin_ns
            run.command([(fade.end_ns, fade.target) for fade in self.fades], crossfade_ns=duration)
        for impulse in self.impulses:
            run.apply_impulse(*impulse)
        return run


def effective_gravity(disk: Disk) -> float:
    """g + P/m, m/s²."""
    return disk.gravity + disk.preload / disk.mass


def axial_amplitude(axial_forcing: float, frequency: float, disk: Disk) -> float:
    """A of a given Γ = A ω²/(π g), m."""
    return axial_forcing * math.pi * effective_gravity(disk) / (math.tau * frequency) ** 2


@st.composite
def disks(draw: st.DrawFn) -> Disk:
    """A disk with or without friction, preload and load torque."""
    mass, gravity = draw(st.floats(0.5, 2.0)), 9.81
    preload = draw(st.sampled_from([0.0, 0.0, -0.3, 1.0])) * mass * gravity
    friction = draw(st.floats(0.02, 1.0))
    radius = draw(st.floats(0.05, 0.2))
    load = draw(st.sampled_from([0.0, 0.0, -0.2, 0.2]))
    return Disk(
        mass,
        draw(st.just(0.0) | st.floats(0.01, 0.9)),
        friction,
        radius,
        draw(st.floats(0.05, 0.2)),
        gravity,
        preload,
        load * friction * radius * (mass * gravity + preload),
    )


@st.composite
def loaded(draw: st.DrawFn, disk: Disk) -> Disk:
    """The disk with a brake, from next to none to more than friction can turn, and an inertia."""
    most = disk.friction * disk.friction_radius * disk.mass * effective_gravity(disk)
    own = disk.mass * disk.gyration_radius**2
    return disk._replace(
        brake_torque=draw(st.floats(0.01, 1.5)) * most,
        load_inertia=draw(st.sampled_from([0.0, 0.5, 2.0])) * own,
    )


@st.composite
def motions(draw: st.DrawFn, disk: Disk, frequency: float) -> Motion:
    """A steady motion, Γ from rest to well above the first bifurcation."""
    return Motion(
        axial_amplitude(draw(st.floats(0.1, 1.0)), frequency, disk),
        draw(st.floats(0.0, 2.0)),
        frequency,
        draw(st.floats(-4.0, 4.0)),
    )


@st.composite
def initial_states(draw: st.DrawFn, disk: Disk, motion: Motion) -> InitialState:
    """On the platform or above it, moving or at rest with it."""
    omega = math.tau * motion.frequency
    weight = math.pi * effective_gravity(disk)
    height = draw(st.one_of(st.just(0.0), st.floats(0.01, 2.0))) * weight / omega**2
    velocity = draw(st.one_of(st.none(), st.floats(-1.0, 1.0)))
    return InitialState(
        height,
        None if velocity is None else velocity * weight / omega,
        draw(st.floats(-1.0, 1.0)) * omega * motion.angular_amplitude,
        draw(st.floats(-3.0, 3.0)),
        draw(st.floats(0.0, 6.28)),
    )


@st.composite
def runs(draw: st.DrawFn, brake: bool = False) -> Case:
    """A run of the whole model at 1 Hz; the inputs fall within 3 s."""
    disk = draw(disks())
    if brake:
        disk = draw(loaded(disk))
    motion = draw(motions(disk, 1.0))
    initial = draw(initial_states(disk, motion))
    fades: tuple[Fade, ...] = ()
    impulses: tuple[Kick, ...] = ()
    if draw(st.booleans()):
        begin, duration = draw(st.floats(0.05, 0.6)), draw(st.floats(0.1, 0.6))
        times = [round(3.0 * NS * t) for t in (begin, begin + duration)]
        fades = (Fade(times[0], times[1], draw(motions(disk, draw(st.floats(0.7, 1.4))))),)
    if draw(st.booleans()):
        omega = math.tau * motion.frequency
        axial = draw(st.floats(-0.5, 0.5)) * math.pi * effective_gravity(disk) / omega
        angular = draw(st.floats(-1.0, 1.0)) * omega * motion.angular_amplitude
        at = round(3.0 * NS * draw(st.floats(0.0, 0.8)))
        impulses = (Kick(at, disk.mass * axial, disk.inertia * angular),)
    return Case(motion, disk, initial, fades, impulses)
