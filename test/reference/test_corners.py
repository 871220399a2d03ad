"""Corners that scripts do not reach (test_inclusion.py): reports of a chatter, runs of few or of a
million events, bounces too small for the clock, checkpoints within a chatter."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from bouncing_disk_ros.core.model import Disk, ImpactKind, InitialState, Motion, Phase, join_rows
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.units import NS
from reference.cases import in_soak
from reference.corner_scripts import DISK, GRIP, START, STILL, G, forced

CONTACT = (Phase.STICKING, Phase.SLIDING)


# --- chatter --------------------------------------------------------------------------------------
@pytest.mark.parametrize("restitution", [0.1, 0.5, 0.9, 0.99])
@pytest.mark.parametrize(("spin", "load"), [(1e4, 0.0), (0.0, 0.001)], ids=["slips", "sticks"])
def test_a_disk_dropped_on_a_still_platform_stops_in_closed_form(
    restitution: float, spin: float, load: float
) -> None:
    """T = t₀(1 + ε)/(1 − ε) with the fall time t₀; ΣF̂ by momentum; the row tells the end.

    ΣĤ is −μ a_e ΣF̂ where all impacts slip; where they stick, it takes what the load brings.
    """
    disk = DISK._replace(restitution=restitution, load_torque=load)
    start = InitialState(height=0.2, angular_velocity=spin)
    run = Simulation(STILL, disk, start, chatter_report_speed=100.0)
    end = math.sqrt(2 * 0.2 / G) * (1 + restitution) / (1 - restitution)
    rows, _ = run.advance(round((end + 1) * NS))
    assert rows["kind"].tolist() == [ImpactKind.CHATTER_TAIL]
    assert rows["time"][0] == pytest.approx(end, rel=1e-13)
    # the momentum that gravity gave over the whole time
    pressed = disk.mass * G * end
    assert rows["axial_impulse"][0] == pytest.approx(pressed, rel=1e-12)
    turned = -disk.friction * disk.friction_radius * pressed if spin else load * end
    assert rows["angular_impulse"][0] == pytest.approx(turned, rel=1e-12)
    assert run.sample().phase in CONTACT


def test_what_is_reported_changes_nothing() -> None:
    ends = []
    for speed in (0.0, 0.01, 100.0):
        run = Simulation(forced(0.6, 0.5), DISK, START, chatter_report_speed=speed)
        run.advance(20 * NS)
        ends.append((run.sample(), run.energy()))
    assert ends[0] == ends[1] == ends[2]


def test_an_input_in_a_chatter_closes_its_row_as_cut() -> None:
    run = Simulation(STILL, DISK, InitialState(height=0.2), chatter_report_speed=100.0)
    cut = round(2.9 * math.sqrt(2 * 0.2 / G) * NS)  # the end would be at 3 times the fall
    run.advance(cut)
    run.apply_impulse(cut, 0.3, 0.0)
    rows, _ = run.advance(20 * NS)
    assert rows["kind"].tolist() == [ImpactKind.CHATTER_CUT, ImpactKind.CHATTER_TAIL]
    # flights take 1, then 1, 1/2, 1/4, ... of the fall time: 1 + Σ < 2.9
    assert rows["count"][0] == 1 + sum(1 + 2 - 2 * 0.5**n < 2.9 for n in range(1, 50))
    assert run.rows_total == 2


def test_a_checkpoint_in_a_chatter_and_before_a_row_that_waits() -> None:
    """Open rows, queued impulses and rows for the next advance are part of a checkpoint."""
    disk = DISK._replace(restitution=0.9)
    run = Simulation(STILL, disk, InitialState(0.2), chatter_report_speed=100.0)
    run.apply_impulse(5 * NS, 0.1, 0.01)
    for instant in (NS // 2, NS, 2 * NS):
        run.advance(instant)
        twin = Simulation.restore(json.loads(json.dumps(run.snapshot())))
        assert twin.sample() == run.sample()
        rows, _ = twin.advance(8 * NS)
        original = Simulation.restore(run.snapshot())
        assert rows.tobytes() == original.advance(8 * NS)[0].tobytes()
    run.apply_impulse(run.time_ns, -0.5, 0.0)
    twin = Simulation.restore(run.snapshot())
    assert twin.advance(run.time_ns)[0].tobytes() == run.advance(run.time_ns)[0].tobytes()


# --- many events, and few -------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("forcing", "restitution", "events"),
    [(0.55, 0.5, 10**6), *in_soak((0.45, 0.5, 10**5), (1.2, 0.8, 10**5))],
)
def test_a_million_events(forcing: float, restitution: float, events: int) -> None:
    """Rows in order, the energy ledger, and no fall through the platform."""
    disk = DISK._replace(restitution=restitution, load_torque=0.01)
    run = Simulation(forced(forcing, 1.4, -0.7), disk, InitialState(height=0.1))
    found = []
    while run.rows_total < events:
        found.append(run.advance(run.time_ns + 10**13, 100_000)[0])
    rows = join_rows(found)
    assert np.array_equal(rows["index"], np.arange(len(rows)))
    assert (rows["axial_impact_velocity"] < 0).all()
    assert (rows["axial_impulse"] > 0).all()
    later = list(zip(rows["cycles"], rows["forcing_phase"], strict=True))
    assert later == sorted(later)
    assert (np.diff(rows["time"]) >= 0).all()
    energy = run.energy()
    assert abs(energy.residual) < 1e-10 * energy.throughput
    assert run.sample().gap >= 0


@pytest.mark.parametrize(
    ("motion", "disk", "speed", "seconds", "gained", "phase"),
    [
        # ten million periods of sliding, far from where it would stick
        (Motion(1e-12, 1e-3, 1e5, 0.3), DISK._replace(friction=1e-12), 1e4, 100,
         -1e-12 * DISK.friction_radius * G / DISK.gyration_radius**2 * 100, Phase.SLIDING),
        # without friction zeros of the slip are no events
        (forced(0.2, 1.0), DISK._replace(friction=0.0), 0.0, 100_000, 0.0, Phase.SLIDING),
        # a load beyond friction turns the disk for ever
        (STILL, DISK._replace(load_torque=2 * DISK.inertia * GRIP), 0.0, 10_000, -GRIP * 1e4,
         Phase.SLIDING),
        # sticking at 100 kHz for three hours
        (Motion(1e-12, 1e-10, 1e5, 0.3), DISK, 0.0, 10_000, None, Phase.STICKING),
    ],
    ids=["slow", "no friction", "load", "sticks"],
)  # fmt: skip
def test_long_contact_takes_few_events(
    motion: Motion, disk: Disk, speed: float, seconds: int, gained: float | None, phase: Phase
) -> None:
    """And the phase is still that of the clock."""
    run = Simulation(motion, disk, InitialState(angular_velocity=speed))
    rows, behind = run.advance(seconds * NS, max_events=50)
    assert (len(rows), behind) == (0, False)
    sample = run.sample()
    assert sample.phase == phase
    if gained is not None:  # to the rounding of α̇
        assert sample.angular_velocity - speed == pytest.approx(gained, rel=1e-13, abs=1e-11)
    assert sample.forcing_phase == pytest.approx(1.5 * math.pi, abs=3e-15)
    assert sample.cycles == round(seconds * motion.frequency)


def test_nearly_elastic_bouncing_exhausts_the_budget_not_the_patience() -> None:
    run = Simulation(forced(0.2), DISK._replace(restitution=1 - 1e-6), InitialState(height=1e-3))
    rows, behind = run.advance(10**6 * NS, max_events=5000)
    assert (len(rows), behind) == (5000, True)
    assert run.time_ns < 10**6 * NS


# --- bounces too small for the clock --------------------------------------------------------------
@pytest.mark.parametrize("restitution", [5e-324, 1e-310, 1e-160, 1 - 1e-9, 1.0 - 2**-53, 1.0])
@pytest.mark.parametrize("impulse", [5e-324, 1e-300, 1e-160, 1e-20, 1e-14])
def test_bounces_too_small_for_the_clock_neither_hang_nor_lose_the_disk(
    restitution: float, impulse: float
) -> None:
    """A flight that does not move the forcing phase is no flight: contact, and no endless loop."""
    disk = DISK._replace(restitution=restitution)
    run = Simulation(forced(0.3), disk, InitialState(forcing_phase=1.0))
    run.apply_impulse(NS, impulse, 0.0)
    _, behind = run.advance(2 * NS, max_events=100_000)
    sample = run.sample()
    assert sample.gap < 1e-12
    assert not behind or run.time_ns >= NS
    if impulse <= 1e-20:
        assert sample.phase in CONTACT
    run = Simulation(forced(0.3), disk, InitialState(height=0.1, forcing_phase=1.0))
    rows, _ = run.advance(NS, max_events=1000)
    assert len(rows) == 1 or restitution > 1e-100


def test_a_bounce_of_the_smallest_speed_leaves_a_platform_that_falls_away() -> None:
    """u = ε w is 1.5e-323 m/s: a step that it allows is rounded to 0."""
    disk = Disk(0.3, 5e-324, 0.0, 0.12, 0.106, 9.81, preload=-0.125 * 0.3 * 9.81)
    motion = Motion(0.08673944398508296, 0.0, 3.0, 0.0)
    disks = disk, disk._replace(restitution=0.0)
    runs = [Simulation(motion, one, START) for one in disks]
    times = [run.advance(2 * NS)[0]["time"] for run in runs]
    assert len(times[0]) > 0
    np.testing.assert_allclose(times[0], times[1], rtol=0, atol=1e-12)
