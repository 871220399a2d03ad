"""Random inputs at the very instants of events, in round numbers and at limits: what always holds.

Decimal times and heights make impacts, separations and ends of cross-fades meet inputs to within
rounding; Γ = 1/π, ε = 0 and 1, friction 0 and loads at friction's limit are drawn often.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from bouncing_disk_ros.core.model import Disk, InitialState, Motion, Phase
from bouncing_disk_ros.core.offset import Knot, OffsetState
from bouncing_disk_ros.core.simulation import Simulation
from reference.cases import NS, examples

G = 10.0
END = NS // 2 + 12_345_678  # of no event
BUDGET = 60_000
"""Events of one run; those here have some hundred."""
Draw = Callable[..., Any]


def start(draw: Draw, random: np.random.Generator) -> Simulation:
    """A run in round numbers, or at a limit."""
    frequency = draw(1.0, 2.0, 3.0, 10.0, 0.37, 37.0)
    touching = G / (math.tau * frequency) ** 2
    amplitude = draw(0.0, touching, touching * random.uniform(0.3, 3.0))
    motion = Motion(amplitude, draw(0.0, 0.5), frequency, draw(0.0, math.pi / 2, 1.0))
    restitution, friction = draw(0.0, 1.0, 0.5, random.uniform(0.1, 0.9)), draw(0.0, 0.1, 0.5)
    disk = Disk(0.5, restitution, friction, 0.1, 0.1, G, 0.0, draw(0.0, 0.0, 0.05, -0.049))
    phase = draw(0.0, 1.5 * math.pi, math.pi / 2, 1.0)
    initial = InitialState(draw(0.0, 0.05, 0.2), draw(None, 0.0, 1.0), draw(0.0, 1.0), 0.0, phase)
    return Simulation(motion, disk, initial)


def change(sim: Simulation, draw: Draw) -> Simulation:
    """An input now or at a round later time; or another simulation, restored."""
    at, motion = sim.time_ns + draw(0, 0, NS // 20, NS // 10), sim.latest_target
    kind = draw("impulse", "motion", "line", "turn", "parameters", "reset", "restore")
    if kind == "impulse":
        sim.apply_impulse(at, draw(-0.01, 0.25, -0.5, 0.0), draw(0.0, 1e-3))
    elif kind == "motion":
        target = motion._replace(frequency=motion.frequency * draw(0.5, 1.0, 2.0), phase_lag=2.0)
        sim.command([(at + NS // 5, target)], draw(0, NS // 10, NS // 5))
    elif kind == "line":
        ways = ((NS // 10, 0.02), (NS // 5, 0.0))
        sim.trajectory(at, [Knot(at + after, OffsetState(place), 1) for after, place in ways])
    elif kind == "turn":
        ways = ((NS // 10, 0.3), (NS // 5, 0.0))
        turns = [Knot(at + after, OffsetState(place), 5) for after, place in ways]
        sim.trajectory(at, None, turns)
    elif kind == "parameters":
        sim.set_disk(sim.disk._replace(restitution=draw(0.0, 0.5), friction=draw(0.0, 0.5)))
    elif kind == "reset":
        sim.reset()
    else:
        return Simulation.restore(json.loads(json.dumps(sim.snapshot())))
    return sim


def test_inputs_at_the_instants_of_events() -> None:
    for seed in range(examples(150)):
        random = np.random.default_rng(seed)

        def draw(*values: Any, random: np.random.Generator = random) -> Any:
            return values[random.integers(len(values))]

        sim = start(draw, random)
        expected, _ = Simulation.restore(sim.snapshot()).advance(END, BUDGET)
        impacts = [round(float(time) * NS) for time in expected["time"][:40]]
        instants = [0, NS // 10, NS // 5, NS // 4, *impacts]
        for at in sorted(draw(*instants) for _ in range(draw(1, 2, 3, 4, 5))):
            behind = sim.advance(at, BUDGET)[1]
            assert not behind, (seed, sim.time_ns)
            sim = change(sim, draw)
        behind = sim.advance(END, BUDGET)[1]
        assert not behind, (seed, sim.time_ns)
        state, energy = sim.sample(), sim.energy()
        relative = state.axial_velocity - state.platform_velocity
        # in contact, but for the last bounce of a chatter that goes on, the disk does not sink in
        assert state.gap > 0.0 or relative > -1e-9, (seed, state)
        assert state.phase is Phase.FLIGHT or abs(relative) < 1e-12, (seed, state)
        assert energy.relative_residual < 1e-12 or abs(energy.residual) < 1e-15, (seed, energy)
