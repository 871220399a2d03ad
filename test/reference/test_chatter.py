"""Complete chattering: the core's completion against impact after impact in 60 digits.

A disk in contact is kicked with u = J/m; what follows is a chatter that ends in contact. Its sums
are compared: duration, number of impacts, ΣF̂ (with the momentum balance as a second witness), ΣĤ
and the final α̇. One impact of the core is right to ROUNDINGS ulp (see test_flight_reference), n of
them to n·ROUNDINGS ulp at worst; α̇ besides by the rounding of β̇, which friction hands on whole.
"""

from __future__ import annotations

import itertools
import math
from typing import NamedTuple

import numpy as np
import pytest
from mpmath import mp, mpf
from numpy.typing import NDArray

from bouncing_disk_ros.core.model import Disk, ImpactKind, InitialState, Motion, Phase, Sample
from bouncing_disk_ros.core.simulation import Simulation
from reference.cases import NS, axial_amplitude, examples
from reference.precise import Chatter, Constants, Landing, chatter, landing
from reference.precise_path import Path, Real

ROUNDINGS = 8.0
EPS = float(np.finfo(float).eps)
FREQUENCY = 2.0
OMEGA = math.tau * FREQUENCY
END = mpf(10) ** -18  # what is left of the exact sums, relative
#: as a multiple of the largest change of α̇ by all impacts, 2(1 + ε)/(1 − ε)·μ a_e u/a_g², about
SLIPS = {"all slip": 5.0, "slip, then stick": 0.3, "stick": 0.0, "backwards": -0.3}


class Chattered(NamedTuple):
    """What the core makes of a kick."""

    rows: NDArray[np.void]
    end: Sample


def disk(restitution: float, load: float = 0.0) -> Disk:
    return Disk(0.5, restitution, 0.3, 0.1, 0.08, 9.81, 2.0, load)


def kicked(motion: Motion, body: Disk, spin: float, phase: float, u: float) -> Simulation:
    """A disk in contact at t = 0, just kicked."""
    run = Simulation(motion, body, InitialState(angular_velocity=spin, forcing_phase=phase))
    run.apply_impulse(0, body.mass * u, 0.0)
    return run


def chattered(run: Simulation, duration: float) -> Chattered:
    """Rows of the chatter and the state a nanosecond or two after its end."""
    rows, behind = run.advance(math.floor(duration * NS) + 2)
    assert not behind
    return Chattered(rows, run.sample())


@pytest.mark.parametrize(
    ("slip", "restitution", "axial_forcing", "phase"),
    [
        *itertools.product(SLIPS, [0.0, 0.1, 0.5], [0.0], [1.0]),
        *itertools.product(SLIPS, [0.0, 0.1, 0.5], [0.25], [0.4, 4.0]),
        *itertools.product(SLIPS, [0.0, 0.1, 0.5], [0.8], [5.0]),
        ("slip, then stick", 0.9, 0.25, 4.0),
    ],
)
def test_sums_of_a_complete_chatter(
    slip: str, restitution: float, axial_forcing: float, phase: float
) -> None:
    body = disk(restitution)
    gravity = body.gravity + body.preload / body.mass
    motion = Motion(axial_amplitude(axial_forcing, FREQUENCY, body), 0.02, FREQUENCY, 0.7)
    u = 1e-3 * math.pi * gravity / OMEGA
    path = Path(motion, phase)
    grip = body.friction * body.friction_radius / body.gyration_radius**2
    largest = grip * u * (1 + restitution) / (1 - restitution)
    spin = float(path.at(mpf(0)).b1) + SLIPS[slip] * largest
    exact = chatter(path, body, mpf(0), mpf(u), mpf(spin), END)
    for report_speed in (0.0, 1e-3, 10.0):
        run = kicked(motion, body, spin, phase, u)
        run.set_chatter_report_speed(report_speed)
        assert_sums(chattered(run, float(exact.duration)), exact, motion, body, spin)


def assert_sums(found: Chattered, exact: Chatter, motion: Motion, body: Disk, spin: float) -> None:
    """The rows of the core sum up to the chatter in 60 digits, which ends in contact."""
    rows = found.rows
    few = ROUNDINGS * EPS * max(int(rows["count"].sum()), 4)
    clock = float(np.spacing(math.tau)) / OMEGA
    assert found.end.phase != Phase.FLIGHT
    assert found.end.gap == 0.0
    whole = ImpactKind.IMPACT if body.restitution == 0.0 else ImpactKind.CHATTER_TAIL
    assert rows["kind"][-1] == whole
    assert rows["time"][-1] == pytest.approx(
        float(exact.duration), rel=few, abs=(len(rows) + 1) * clock
    )
    assert math.fsum(rows["axial_impulse"]) == pytest.approx(float(exact.axial_impulse), rel=few)
    inertia = body.mass * body.gyration_radius**2
    fastest = abs(spin) + OMEGA * motion.angular_amplitude
    assert math.fsum(rows["angular_impulse"]) == pytest.approx(
        float(exact.angular_impulse), rel=few, abs=inertia * ROUNDINGS * EPS * fastest
    )
    # contact has lasted 2 ns at most since: friction changes α̇ by less than its limit
    gravity = body.gravity + body.preload / body.mass
    grip = body.friction * body.friction_radius / body.gyration_radius**2
    drift = 2e-9 * (grip * 4 * gravity + OMEGA**2 * motion.angular_amplitude)
    assert found.end.angular_velocity == pytest.approx(
        float(exact.angular_velocity), rel=few, abs=drift
    )


@pytest.mark.parametrize("load", [-0.4, 0.4])
@pytest.mark.parametrize("restitution", [0.1, 0.7])
def test_chatter_against_a_load_torque(restitution: float, load: float) -> None:
    """A load torque acts in the flights of a chatter too."""
    body = disk(restitution)
    gravity = body.gravity + body.preload / body.mass
    body = body._replace(
        load_torque=load * body.friction * body.friction_radius * body.mass * gravity
    )
    motion = Motion(axial_amplitude(0.25, FREQUENCY, body), 0.02, FREQUENCY, 0.7)
    u = 1e-3 * math.pi * gravity / OMEGA
    exact = chatter(Path(motion, 4.0), body, mpf(0), mpf(u), mpf(0.05), END)
    found = chattered(kicked(motion, body, 0.05, 4.0, u), float(exact.duration))
    few = ROUNDINGS * EPS * max(exact.impacts, 4)
    inertia = body.mass * body.gyration_radius**2
    assert math.fsum(found.rows["angular_impulse"]) == pytest.approx(
        float(exact.angular_impulse), rel=few, abs=inertia * ROUNDINGS * EPS * OMEGA * 0.02
    )


def test_rows_count_what_the_reporting_speed_hides() -> None:
    """Speed of reporting moves impacts between rows and changes nothing else: not a bit."""
    body = disk(0.9)
    motion = Motion(axial_amplitude(0.25, FREQUENCY, body), 0.02, FREQUENCY, 0.7)
    ends, counts = [], []
    for speed in (0.0, 1e-6, 1e-3, 10.0):
        run = kicked(motion, body, 0.3, 4.0, 0.02)
        run.set_chatter_report_speed(speed)
        rows, _ = run.advance(200_000_000)
        sample = run.sample()
        assert sample.phase != Phase.FLIGHT
        ends.append((rows["time"][-1], sample, run.energy()))
        counts.append(int(rows["count"].sum()))
        assert np.all(rows["count"][rows["kind"] == ImpactKind.IMPACT] == 1)
        if speed == 10.0:
            assert len(rows) == 1
    assert all(end == ends[0] for end in ends)
    assert len(set(counts)) == 1


@pytest.mark.parametrize("seed", range(examples(6)))
def test_chatter_that_meets_separation(seed: int) -> None:
    """Rule 7: where a falls to 0 before the tail ends, it is bounce by bounce, and then a flight.

    Every row until the first long flight against 60 digits. The nearer separation, the more the
    rounding of a phase counts: the tolerance is what one of 2π ulp at the start makes of the row.
    """
    random = np.random.default_rng(seed)
    body = disk(random.choice([0.1, 0.5, 0.8]))
    gravity = body.gravity + body.preload / body.mass
    axial_forcing, early = random.uniform(0.33, 1.5), 10 ** random.uniform(-3, -0.3)
    motion = Motion(axial_amplitude(axial_forcing, FREQUENCY, body), 0.0, FREQUENCY, 0.0)
    phase = math.asin(1 / (math.pi * axial_forcing)) - early
    load = gravity - motion.axial_amplitude * OMEGA**2 * math.sin(phase)
    u = random.uniform(0.8, 1.5) * early / OMEGA * load * (1 - body.restitution) / 2
    rows, _ = kicked(motion, body, 0.0, phase, u).advance(NS)
    single = rows[: int(np.argmax(np.append(rows["kind"], ImpactKind.CHATTER_TAIL) > 0))]
    shifted = mpf(phase) + mpf(float(np.spacing(math.tau)))
    exact = bounces(Path(motion, phase), body, mpf(u), len(single))
    near = bounces(Path(motion, shifted), body, mpf(u), len(single))
    assert len(exact) > 1
    for n, (row, end, other) in enumerate(zip(single, exact, near, strict=False), start=1):
        rounding = abs(float(other.impact_velocity / end.impact_velocity - 1)) + n * EPS
        assert row["axial_impact_velocity"] == pytest.approx(
            float(end.impact_velocity), rel=ROUNDINGS * rounding
        )


def bounces(path: Path, body: Disk, u: Real, most: int) -> list[Landing]:
    """Impacts after a launch with u, up to the first that ends a flight of a quarter period."""
    k, t, found = Constants(body), mpf(0), list[Landing]()
    while len(found) < most:
        end = landing(path, k.gravity, t, mpf(0), u)
        assert end is not None
        found.append(end)
        if end.duration * path.omega > mp.pi / 2:
            break
        t, u = t + end.duration, -k.restitution * end.impact_velocity
    return found
