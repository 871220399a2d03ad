"""What must hold for every run: determinism, order, energy, the impact law, continuity."""

from __future__ import annotations

import itertools
import json
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from bouncing_disk_ros.core.model import (
    IMPACT_DTYPE,
    Disk,
    ImpactKind,
    InitialState,
    Motion,
    Phase,
    Sample,
)
from bouncing_disk_ros.core.simulation import Simulation
from property.runs import Run, runs
from support.coverage import in_soak

FEW = settings(max_examples=60)
PERIODS = 6.0


class Gatherer:
    """Advances in ticks of a given pattern and keeps the rows."""

    def __init__(self, *ticks: float) -> None:
        self._ticks = itertools.cycle(ticks)  # in periods; inf: all at once
        self.rows: list[NDArray[Any]] = []

    def __call__(self, sim: Simulation, until_ns: int) -> None:
        while sim.time_ns < until_ns:
            tick = next(self._ticks)
            goal = until_ns
            if math.isfinite(tick):
                goal = min(until_ns, sim.time_ns + max(1, round(tick * self.period_ns)))
            while True:
                rows, behind = sim.advance(goal)
                self.rows.append(rows)
                if not behind:
                    break

    period_ns = 10**9

    @property
    def bytes(self) -> bytes:
        """All rows."""
        return b"".join(rows.tobytes() for rows in self.rows)

    @property
    def all(self) -> NDArray[Any]:
        """All rows as one array."""
        return np.frombuffer(self.bytes, IMPACT_DTYPE)


def played(run: Run, *ticks: float) -> tuple[Gatherer, Simulation]:
    gatherer = Gatherer(*ticks)
    gatherer.period_ns = run.period_ns
    return gatherer, run.play(gatherer, PERIODS)


@FEW
@given(run=runs(), ticks=st.lists(st.floats(1e-3, 2), min_size=1, max_size=5))
def test_bits_do_not_depend_on_the_pattern_of_ticks(run: Run, ticks: list[float]) -> None:
    whole, end = played(run, math.inf)
    for pattern in ([0.07], ticks):
        parts, other = played(run, *pattern)
        assert parts.bytes == whole.bytes
        assert other.sample() == end.sample()
        assert other.energy() == end.energy()


@FEW
@given(run=runs(), part=st.floats(0, 1))
def test_a_checkpoint_at_any_instant_continues_to_the_bit(run: Run, part: float) -> None:
    _, sim = played(run, math.inf)
    sim.command([(sim.time_ns + run.period_ns, run.motion._replace(phase_lag=0.1))])
    sim.advance(sim.time_ns + round(3 * part * run.period_ns))
    other = Simulation.restore(json.loads(json.dumps(sim.snapshot())))
    goal = sim.time_ns + 3 * run.period_ns
    assert other.advance(goal)[0].tobytes() == sim.advance(goal)[0].tobytes()
    assert other.sample() == sim.sample()
    assert other.energy() == sim.energy()


def check_rows(rows: NDArray[Any]) -> None:
    """Order and impact law, as far as rows alone show them."""
    assert np.array_equal(rows["index"], np.arange(len(rows)))
    assert (rows["axial_impact_velocity"] < 0).all()
    assert (rows["axial_impulse"] > 0).all()
    later = [(c, p) for c, p in zip(rows["cycles"], rows["forcing_phase"], strict=True)]
    assert later == sorted(later)
    assert (np.diff(rows["time"]) >= 0).all()


@FEW
@given(run=runs())
def test_rows_are_in_order(run: Run) -> None:
    check_rows(played(run, math.inf)[0].all)


@FEW
@given(run=runs())
def test_impact_law(run: Run) -> None:
    """Without inputs the parameters are known: each impact obeys them to rounding."""
    gatherer, _ = played(run._replace(inputs=(), report=0.0), math.inf)
    rows = gatherer.all[gatherer.all["kind"] == ImpactKind.IMPACT]
    disk, w = run.disk, -rows["axial_impact_velocity"]
    push = (1 + disk.restitution) * w
    np.testing.assert_allclose(rows["axial_impulse"], disk.mass * push, rtol=1e-15)
    slip = rows["angular_impact_velocity"]
    most = disk.friction * disk.friction_radius * disk.mass / disk.inertia * push
    twist = -np.sign(slip) * np.minimum(np.abs(slip), most)
    np.testing.assert_allclose(rows["angular_impulse"], disk.inertia * twist, rtol=3e-15)


@FEW
@given(run=runs())
def test_gap_force_and_friction_stay_within_bounds(run: Run) -> None:
    parameters: list[Disk] = []

    def advance(sim: Simulation, until_ns: int) -> None:
        parameters.append(sim.disk)
        while sim.time_ns < until_ns:
            sim.advance(min(until_ns, sim.time_ns + run.period_ns // 7 + 1))
            check(sim.sample(), sim.disk)

    def check(sample: Sample, disk: Disk) -> None:
        assert sample.gap >= 0
        if sample.phase == Phase.FLIGHT:
            assert sample.axial_force == 0 == sample.friction_torque
            return
        assert sample.gap == 0
        weight = disk.mass * disk.gravity + disk.preload
        assert sample.axial_force >= -1e-14 * weight
        most = disk.friction * disk.friction_radius * sample.axial_force
        # sticking up to the very limit: both sides have a few roundings of their largest term
        torques = abs(disk.load_torque) + disk.brake_torque
        scale = disk.friction * disk.friction_radius * weight + torques
        assert abs(sample.friction_torque) <= most + 1e-13 * scale

    run.play(advance, PERIODS)


@FEW
@given(run=runs())
def test_energy_balance(run: Run) -> None:
    """Every book is computed by itself, so the residual is rounding: 1e-10 of the throughput.

    Where sticking begins, α̇ becomes β̇ to the rounding of ωΦ: a few ulp of that are the floor.
    """
    fastest = 2 * run.motion.angular_amplitude * math.tau * 1.5 * run.motion.frequency
    floor = 1e-14 * 1.5 * run.disk.inertia * fastest**2  # an input may add half to the inertia

    def advance(sim: Simulation, until_ns: int) -> None:
        braked = sim.energy().loss_brake
        while sim.time_ns < until_ns:
            sim.advance(min(until_ns, sim.time_ns + run.period_ns))
            energy = sim.energy()
            scale = energy.throughput + abs(energy.initial) + energy.kinetic
            assert abs(energy.residual) <= 1e-10 * scale + floor
            assert energy.loss_impact_axial >= 0
            assert energy.loss_impact_friction >= -1e-15 * scale - floor
            assert energy.loss_sliding >= -1e-15 * scale - floor
            assert energy.loss_brake >= braked
            braked = energy.loss_brake

    run.play(advance, PERIODS)


@pytest.mark.parametrize(
    ("forcing", "restitution", "events"),
    [(0.55, 0.5, 10**6), *in_soak((0.45, 0.5, 10**5), (1.2, 0.8, 10**5))],
)
def test_a_million_events(forcing: float, restitution: float, events: int) -> None:
    amplitude = forcing * math.pi * 10.0 / (math.tau * 3.0) ** 2
    disk = Disk(0.3, restitution, 0.6, 0.12, 0.106, 10.0, 0.0, 0.01)
    sim = Simulation(Motion(amplitude, 1.4, 3.0, -0.7), disk, InitialState(height=0.1))
    rows: list[NDArray[Any]] = []
    while sim.rows_total < events:
        rows.append(sim.advance(sim.time_ns + 10**13, 100_000)[0])
    check_rows(np.frombuffer(b"".join(r.tobytes() for r in rows), IMPACT_DTYPE))
    energy = sim.energy()
    assert abs(energy.residual) < 1e-10 * energy.throughput
    assert sim.sample().gap >= 0


@FEW
@given(run=runs(), part=st.floats(0, 3))
def test_commands_never_make_the_platform_jump(run: Run, part: float) -> None:
    """Neither s, ṡ, β, β̇ at any nanosecond, nor s̈, β̈ as differences of ṡ, β̇ over it."""
    sim = run.start()
    for item in run.inputs:
        if item.kind == "motion":
            sim.advance(sim.time_ns + round(item.after * run.period_ns))
            run.apply(sim, item)
    sim.advance(sim.time_ns + round(part * run.period_ns))
    ends = [f.begin_ns for f in sim.pending] + [f.end_ns for f in sim.pending]
    for instant in sorted({*ends, sim.motion_in_force.end_ns + 0}):
        if instant - 1 <= sim.time_ns:
            continue
        sim.advance(instant - 1)
        before, dt = sim.sample(), 2e-9
        sim.advance(instant + 1)
        after = sim.sample()
        rate = math.tau * 2 * run.motion.frequency + 10 * run.motion.frequency
        reach = 20 * GRAVITY_REACH / run.motion.frequency**2 + 1e-12
        turn = 2 * run.motion.angular_amplitude + 1e-12
        for size, pairs in (
            (reach, ((before.platform_position, after.platform_position),)),
            (turn, ((before.platform_angle, after.platform_angle),)),
        ):
            for a, b in pairs:
                assert abs(b - a) <= size * rate * dt + 1e-15 * size
        assert abs(after.platform_velocity - before.platform_velocity) <= reach * rate**2 * dt * 2
        assert (
            abs(after.platform_angular_velocity - before.platform_angular_velocity)
            <= turn * rate**2 * dt * 2
        )


GRAVITY_REACH = 9.81 * math.pi / math.tau**2
