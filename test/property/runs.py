"""Random runs: parameters over decades, and inputs of every kind at random instants."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

from hypothesis import strategies as st

from bouncing_disk_ros.core.model import Disk, InitialState, Motion
from bouncing_disk_ros.core.simulation import Simulation

GRAVITY = 9.81
FORCINGS = st.sampled_from([0.0, 0.2, 1 / math.pi, 0.34, 0.45, 0.6, 1.0, 3.0]) | st.floats(0.05, 5)
ANGULAR = st.sampled_from([0.0, 1.0]) | st.floats(1e-3, 5)
RESTITUTIONS = st.sampled_from([0.0, 0.1, 0.5, 0.9]) | st.floats(0, 0.97)
FRICTIONS = st.sampled_from([0.0, 0.6, 1e-6, 1e6]) | st.floats(0.01, 3)
LAGS = st.floats(-3.1, 3.1)


class Input(NamedTuple):
    """One input: when (in periods) and what it does."""

    after: float
    kind: str
    numbers: tuple[float, ...]


class Run(NamedTuple):
    """A run that can be repeated."""

    motion: Motion
    disk: Disk
    initial: InitialState
    report: float
    inputs: tuple[Input, ...]

    @property
    def period_ns(self) -> int:
        """Period of the first motion."""
        return round(1e9 / self.motion.frequency)

    def start(self) -> Simulation:
        """A new simulation in the initial state."""
        return Simulation(self.motion, self.disk, self.initial, chatter_report_speed=self.report)

    def play(self, advance: Callable[[Simulation, int], None], periods: float) -> Simulation:
        """Advance by a way of one's own from input to input, then for some periods."""
        sim, now = self.start(), 0
        for item in self.inputs:
            now += round(item.after * self.period_ns)
            advance(sim, now)
            self.apply(sim, item)
        advance(sim, now + round(periods * self.period_ns))
        return sim

    def apply(self, sim: Simulation, item: Input) -> None:
        """Give one input to a simulation at the instant it has reached."""
        n, now = item.numbers, sim.time_ns
        if item.kind == "motion":
            f = self.motion.frequency * (0.5 + n[0])
            amplitude = n[1] * math.pi * GRAVITY / (math.tau * f) ** 2
            target = Motion(amplitude, self.motion.angular_amplitude * 2 * n[2], f, 6 * n[3] - 3)
            sim.command([(now + round(3 * n[4] * self.period_ns), target)])
        elif item.kind == "kick":
            speed = GRAVITY / self.motion.frequency
            sim.apply_impulse(
                now + round(n[0] * self.period_ns),
                self.disk.mass * speed * (n[1] - 0.5),
                self.disk.inertia * (n[2] - 0.5),
            )
        elif item.kind == "disk":
            weight = self.disk.mass * GRAVITY
            sim.set_disk(
                self.disk._replace(
                    restitution=0.95 * n[0],
                    friction=n[1],
                    preload=(3 * n[3] - 0.5) * weight,
                    load_torque=(n[2] - 0.5) * weight * self.disk.friction_radius,
                    brake_torque=max(n[4] - 0.5, 0.0) * weight * self.disk.friction_radius,
                    load_inertia=max(n[0] - 0.5, 0.0) * self.disk.inertia,
                )
            )
        else:
            sim.reset()


UNIT = st.floats(0, 1)
INPUTS = st.builds(
    Input,
    st.floats(0, 3),
    st.sampled_from(["motion", "motion", "kick", "disk", "reset"]),
    st.tuples(UNIT, UNIT, UNIT, UNIT, UNIT),
)


@st.composite
def runs(draw: st.DrawFn) -> Run:
    """Runs over five decades of frequency; the disk starts on the platform or above it.

    A third has a brake, from next to none to more than friction can turn.
    """
    frequency = draw(st.sampled_from([3.0, 40e3]) | st.floats(0.5, 100))
    amplitude = draw(FORCINGS) * math.pi * GRAVITY / (math.tau * frequency) ** 2
    motion = Motion(amplitude, draw(ANGULAR), frequency, draw(LAGS))
    disk = Disk(0.3, draw(RESTITUTIONS), draw(FRICTIONS), 0.12, 0.106, GRAVITY)
    if draw(st.sampled_from([False, False, True])):
        strongest = min(disk.friction, 1.0) * disk.friction_radius * disk.mass * GRAVITY
        disk = disk._replace(
            brake_torque=draw(st.floats(0.01, 1.5)) * (strongest or 0.1),
            load_inertia=draw(st.sampled_from([0.0, 0.5, 2.0])) * disk.inertia,
        )
    height = draw(st.just(0.0) | st.floats(0, 2)) * GRAVITY / frequency**2
    initial = InitialState(height, None, draw(st.floats(-3, 3)), 0.0, draw(st.floats(0, 6.28)))
    report = draw(st.sampled_from([0.0, 0.05])) * GRAVITY / frequency
    return Run(motion, disk, initial, report, tuple(draw(st.lists(INPUTS, max_size=6))))
