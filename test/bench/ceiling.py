"""How much faster than real time `Simulation.advance` runs, against the drive frequency."""

from __future__ import annotations

import math
import time
from typing import NamedTuple

from bench.axial import RESTITUTION, period_one
from bench.table import Aim, Row, row
from bouncing_disk_ros.core.model import Disk, InitialState, Motion
from bouncing_disk_ros.core.simulation import Simulation

PART = "ceiling"
FREQUENCIES = (1.0, 10.0, 100.0, 1e3, 1e4, 4e4, 1e5, 2e5)
MOTORS = (4e4, 2e5)  # Hz, of ultrasonic motors: in real time
GRAVITY = 9.81
TICK_NS = 10_000_000  # the node's at its default state_rate
REPEATS = 7
SECONDS = 0.03  # of one repeat


class Regime(NamedTuple):
    """A forcing Γ, and whether it starts on the period-1 orbit, else at rest at the bottom."""

    name: str
    axial_forcing: float
    on_orbit: bool


# Γ just above 1/π: separation, a short flight, complete chattering and contact in every period
REGIMES = (
    Regime("period-1, Γ = 0.45", 0.45, True),
    Regime("chattering, Γ = 0.3245", 0.3245, False),
)


def simulation_of(regime: Regime, frequency: float) -> Simulation:
    """The same dimensionless problem at any frequency, with rotation."""
    omega = math.tau * frequency
    unit = math.pi * GRAVITY / omega  # of speed
    disk = Disk(0.5, RESTITUTION, 0.5, 0.1, 0.1, GRAVITY)
    amplitude = regime.axial_forcing * unit / omega
    motion = Motion(amplitude, amplitude / disk.friction_radius, frequency, -0.7)
    initial = InitialState()
    if regime.on_orbit:
        phase, speed = period_one(regime.axial_forcing)
        climb = regime.axial_forcing * math.cos(phase)
        initial = InitialState(axial_velocity=(climb + speed) * unit, forcing_phase=phase)
    return Simulation(motion, disk, initial)


def factor(simulation: Simulation, tick_ns: int) -> float:
    """Simulated over elapsed time, over at least SECONDS."""
    from_ns, begin = simulation.time_ns, time.perf_counter_ns()
    elapsed = 0
    while elapsed < SECONDS * 1e9:
        until = simulation.time_ns + tick_ns
        while simulation.advance(until)[1]:
            pass
        elapsed = time.perf_counter_ns() - begin
    return (simulation.time_ns - from_ns) / elapsed


def measure() -> list[Row]:
    """Rows for calls of 10 ms as in the node, and of a thousand periods, which show the kernels."""
    rows = []
    for regime in REGIMES:
        for frequency in FREQUENCIES:
            for what, tick_ns, aim in (
                ("10 ms a call", TICK_NS, Aim(at_least=1.0) if frequency in MOTORS else None),
                ("1000 periods a call", round(1e12 / frequency), None),
            ):
                simulation = simulation_of(regime, frequency)
                factor(simulation, tick_ns)  # the start is not the steady regime
                values = [factor(simulation, tick_ns) for _ in range(REPEATS)]
                name = f"{frequency:g} Hz, {regime.name}, {what}"
                rows.append(row(PART, name, "× real time", values, aim))
    return rows
