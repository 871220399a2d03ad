"""One flight at a time: the core's first contact against a certified first root in 60 digits.

Tolerances follow from the data. With x = ωd the terms of the gap are u d, g d²/2 and A·min(x²/2,
2 + x); each carries a few roundings (ROUNDINGS ulp in all), and the phase τ₀ + x carries its own,
so the gap at d is known to e = ROUNDINGS·ε·[|u|d + g d²/2 + A min(x²/2, 2 + x)(1 + τ₀ + x)] and d
to e/|w_A|. The row's time has besides the resolution of a forcing phase, one ulp of 2π, over ω;
the velocities have not: w_A is what shows that a tiny bounce keeps its digits.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import mpmath
import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from mpmath import mpf

from bouncing_disk_ros.core.model import Disk, InitialState, Motion
from bouncing_disk_ros.core.simulation import Simulation
from reference import precise
from reference.cases import NS, SLOW, Case, Fade, axial_amplitude, effective_gravity, examples
from reference.precise import Landing, landing
from reference.precise_path import Path

ROUNDINGS = 8.0
EPS = float(np.finfo(float).eps)
DISK = Disk(0.5, 1.0, 0.3, 0.1, 0.1, 9.81)  # ε = 1: every impact has a row of its own


class Tolerance(NamedTuple):
    """Of the duration of a flight (s), of w_A (m/s) and of the instant of a row (s)."""

    duration: float
    impact_velocity: float
    instant: float


def tolerance(
    motion: Motion, disk: Disk, start: tuple[float, float, float], speed: float, end: Landing
) -> Tolerance:
    """What rounding makes of a flight from (phase, gap, u); `speed` is that of the numbers u was
    computed from."""
    phase, gap, u = start
    d, w, g = float(end.duration), abs(float(end.impact_velocity)), effective_gravity(disk)
    omega, reach = math.tau * motion.frequency, motion.axial_amplitude
    x = omega * d
    turn = 1.0 + phase + x
    position = gap + (abs(u) + speed) * d + g * d * d / 2 + reach * min(x * x / 2, 2 + x) * turn
    velocity = abs(u) + speed + g * d + reach * omega * min(x, 2) * turn
    duration = ROUNDINGS * EPS * position / w
    speed_change = (g + reach * omega**2) * duration
    instant = duration + float(np.spacing(math.tau)) / omega
    return Tolerance(duration, ROUNDINGS * EPS * velocity + speed_change, instant)


def first_impact(run: Simulation, before: float) -> np.void:
    """The first row, which is due before `before`, s."""
    # an elastic disk may bounce a million times within a nanosecond
    rows, _ = run.advance(math.ceil(before * NS) + 2, max_events=10)
    assert len(rows), "no impact where there is one"
    return rows[0]


def assert_lands(row: np.void, end: Landing, allowed: Tolerance) -> None:
    """The row is the landing, to rounding."""
    assert row["time"] == pytest.approx(float(end.duration), rel=0, abs=allowed.instant)
    assert row["axial_impact_velocity"] == pytest.approx(
        float(end.impact_velocity), rel=0, abs=allowed.impact_velocity
    )


@given(
    axial_forcing=st.floats(0.05, 1.5),
    frequency=st.sampled_from([1.0, 37.5, 40e3]),
    phase=st.floats(0.0, 6.28),
    exponent=st.floats(-10.0, 0.0),
)
@example(axial_forcing=0.45, frequency=3.0, phase=4.0, exponent=-10.0)
@example(axial_forcing=0.0, frequency=3.0, phase=4.0, exponent=-10.0)
@example(axial_forcing=0.2268354159065425, frequency=40e3, phase=5.748938808033809, exponent=-10.0)
@settings(SLOW, max_examples=examples(40))
def test_bounce_from_contact(
    axial_forcing: float, frequency: float, phase: float, exponent: float
) -> None:
    """A kick of a disk in contact launches it with u = J/m: its digits survive however small it
    is."""
    motion = Motion(axial_amplitude(axial_forcing, frequency, DISK), 0.0, frequency, 0.0)
    omega, g = math.tau * frequency, DISK.gravity
    assume(g - motion.axial_amplitude * omega**2 * math.sin(phase) > 0.01 * g)  # in contact
    u = 10.0**exponent * math.pi * g / omega
    end = landing(Path(motion, phase), mpf(g), mpf(0), mpf(0), mpf(u))
    assert end is not None
    allowed = tolerance(motion, DISK, (phase, 0.0, u), 0.0, end)
    assume(allowed.duration * omega < 1e-9)  # not a graze
    run = Simulation(motion, DISK, InitialState(forcing_phase=phase))
    run.apply_impulse(0, DISK.mass * u, 0.0)
    row = first_impact(run, float(end.duration))
    assert_lands(row, end, allowed)
    pressed = 1 - math.pi * axial_forcing * math.sin(phase)
    if exponent < -4 and pressed > 0.3:  # neither test above is a loose one
        assert allowed.duration < 1e-12 * float(end.duration)
        assert allowed.impact_velocity < 1e-12 * u


@given(
    axial_forcing=st.floats(0.0, 4.0),
    frequency=st.sampled_from([1.0, 37.5, 40e3]),
    phase=st.floats(0.0, 6.28),
    height=st.one_of(st.just(0.0), st.floats(1e-6, 3.0)),
    speed=st.floats(-1.0, 3.0),
    preload=st.sampled_from([0.0, -2.0, 30.0]),
)
@settings(SLOW, max_examples=examples(40))
def test_flight_from_anywhere(
    axial_forcing: float,
    frequency: float,
    phase: float,
    height: float,
    speed: float,
    preload: float,
) -> None:
    disk = DISK._replace(preload=preload)
    motion = Motion(axial_amplitude(axial_forcing, frequency, disk), 0.0, frequency, 0.0)
    omega, g = math.tau * frequency, effective_gravity(disk)
    gap, velocity = height * g / omega**2, speed * math.pi * g / omega
    path = Path(motion, phase)
    u = mpf(velocity) - path.at(mpf(0)).s1
    assume(gap > 0 or u > 1e-6 * g / omega)
    end = landing(path, precise.Constants(disk).gravity, mpf(0), mpf(gap), u)
    assert end is not None
    platform_speed = motion.axial_amplitude * omega
    allowed = tolerance(motion, disk, (phase, gap, float(u)), abs(velocity) + platform_speed, end)
    assume(allowed.duration * omega < 1e-9)
    run = Simulation(motion, disk, InitialState(gap, velocity, forcing_phase=phase))
    assert_lands(first_impact(run, float(end.duration)), end, allowed)


def random_flight(random: np.random.Generator) -> tuple[Motion, Disk, InitialState]:
    """A flight under any g + P/m; lengths, speeds and accelerations have scales of their own."""

    def between(low: float, high: float) -> float:
        return float(10.0 ** random.uniform(low, high))

    g, height = between(-9.0, 9.0), between(-4.0, 1.0)
    if random.random() < 0.5:
        speed = random.choice([-1.0, 1.0]) * between(-4.0, 1.5)
        reach, pull = between(-10.0, -1.0), between(-2.0, 2.0) * g
    else:  # fast on to a small, quick platform
        g, speed = between(-9.0, -3.0), -math.sqrt(height * between(0.0, 3.0))
        reach, pull = between(-12.0, -8.0), between(0.0, 1.0) * speed**2 / height
    gravity = random.choice([g, 1e-3 * g, 2.0 * g])
    disk = DISK._replace(gravity=float(gravity), preload=float((g - gravity) * DISK.mass))
    initial = InitialState(height, float(speed), forcing_phase=random.uniform(0.0, 6.28))
    return Motion(reach, 0.0, math.sqrt(pull / reach) / math.tau, 0.0), disk, initial


def test_flights_under_any_gravity() -> None:
    """g + P/m from 1e-9 to 1e9 m/s², thrown at speeds far above and far below those of the fall."""
    random, checked = np.random.default_rng(26), 0
    while checked < examples(20):
        motion, disk, initial = random_flight(random)
        phase, gap, velocity = initial.forcing_phase, initial.height, initial.axial_velocity
        assert velocity is not None
        path, g = Path(motion, phase), precise.Constants(disk).gravity
        fall = (velocity + mpmath.sqrt(velocity**2 + 2 * g * gap)) / g
        if fall * motion.frequency > 1e4:  # the exact flight would take long
            continue
        u = mpf(velocity) - path.at(mpf(0)).s1
        end = landing(path, g, mpf(0), mpf(gap), u)
        assert end is not None
        scale = abs(velocity) + motion.axial_amplitude * float(path.omega)
        allowed = tolerance(motion, disk, (phase, gap, float(u)), scale, end)
        if allowed.duration * float(path.omega) > 1e-9:  # a graze
            continue
        run = Simulation(motion, disk, initial)
        assert_lands(first_impact(run, float(end.duration)), end, allowed)
        checked += 1


@given(
    axial_forcing=st.floats(0.0, 1.5),
    phase=st.floats(0.0, 6.28),
    height=st.floats(1e-3, 3.0),
    speed=st.floats(-1.0, 2.0),
    factors=st.tuples(st.floats(0.0, 2.0), st.floats(0.3, 3.0)),
    fade=st.tuples(st.floats(0.0, 0.4), st.floats(0.05, 1.0)),
)
@settings(SLOW, max_examples=examples(30))
def test_flight_through_a_crossfade(
    axial_forcing: float,
    phase: float,
    height: float,
    speed: float,
    factors: tuple[float, float],
    fade: tuple[float, float],
) -> None:
    """The first root is found, and to rounding, where frequency and amplitude change on the way."""
    frequency, g = 2.0, DISK.gravity
    omega = math.tau * frequency
    motion = Motion(axial_amplitude(axial_forcing, frequency, DISK), 0.0, frequency, 0.0)
    target = Motion(motion.axial_amplitude * factors[0], 0.0, frequency * factors[1], 0.0)
    begin, end_ns = round(fade[0] / frequency * NS), round((fade[0] + fade[1]) / frequency * NS)
    case = Case(
        motion,
        DISK,
        InitialState(height * g / omega**2, speed * math.pi * g / omega, forcing_phase=phase),
        (Fade(begin, end_ns, target),),
    )
    path = Path(motion, phase, case.fades)
    assert case.initial.axial_velocity is not None
    u = mpf(case.initial.axial_velocity) - path.at(mpf(0)).s1
    end = landing(path, mpf(g), mpf(0), mpf(case.initial.height), u)
    assert end is not None
    fastest = motion._replace(
        axial_amplitude=float(path.acceleration_bound)
        / (math.tau * frequency * max(1.0, factors[1])) ** 2,
        frequency=frequency * max(1.0, factors[1]),
    )
    speed_scale = abs(case.initial.axial_velocity) + motion.axial_amplitude * omega
    allowed = tolerance(fastest, DISK, (phase, case.initial.height, float(u)), speed_scale, end)
    assume(allowed.duration * omega < 1e-9)
    assert_lands(first_impact(case.start(), float(end.duration)), end, allowed)


@pytest.mark.parametrize("duration_ns", [60_000, 100_000, 200_000])
@pytest.mark.parametrize("later_ns", [0, 5_000_000])
def test_a_change_of_frequency_much_shorter_than_a_period(duration_ns: int, later_ns: int) -> None:
    """The platform's derivatives are huge in so short a cross-fade: no series reaches beyond it."""
    motion, height = Motion(2.2037571776981084e-05, 0.0, 18.84251275117375, 0.0), 0.01
    phase, end_ns = 4.553408462758767, 44_589_848 - later_ns
    target = motion._replace(frequency=16.24564054372087)
    initial = InitialState(height, forcing_phase=phase)
    case = Case(motion, DISK, initial, (Fade(end_ns - duration_ns, end_ns, target),))
    path = Path(motion, phase, case.fades)
    end = landing(path, mpf(DISK.gravity), mpf(0), mpf(height), mpf(0))
    assert end is not None
    allowed = tolerance(motion, DISK, (phase, height, 0.0), 1.0, end)
    assert_lands(first_impact(case.start(), float(end.duration)), end, allowed)


@pytest.mark.parametrize("frequency", [1.0, 40e3])
@pytest.mark.parametrize("axial_forcing", [0.3184, 0.32, 0.34, 0.45, 0.6, 1.0, 3.0])
def test_separation_and_the_flight_from_it(axial_forcing: float, frequency: float) -> None:
    """Eq. 3: contact ends at sin τ = 1/(πΓ): relative position, velocity, acceleration all 0."""
    motion = Motion(axial_amplitude(axial_forcing, frequency, DISK), 0.0, frequency, 0.0)
    path = Path(motion, 0.0)
    omega = path.omega
    sine = mpf(DISK.gravity) / (path.reach * omega**2)
    separation = mpmath.asin(sine) / omega
    end = landing(path, mpf(DISK.gravity), separation, mpf(0), mpf(0))
    assert end is not None
    run = Simulation(motion, DISK, InitialState(forcing_phase=0.0))
    row = first_impact(run, float(separation + end.duration))
    # τ_sep = asin q has the condition q/√(1 − q²); the landing moves with it, and as one of
    # `tolerance` for u = 0
    allowed = tolerance(motion, DISK, (float(omega * separation), 0.0, 0.0), 0.0, end)
    shift = ROUNDINGS * EPS * float(sine / mpmath.sqrt(1 - sine**2) / omega)
    steep = (DISK.gravity + motion.axial_amplitude * float(omega) ** 2) / abs(
        float(end.impact_velocity)
    )
    duration = allowed.duration + shift * (1 + steep * float(end.duration))
    moved = Landing(separation + end.duration, end.impact_velocity)
    late = abs(float(end.impact_velocity)) * steep * duration
    assert_lands(
        row, moved, Tolerance(duration, allowed.impact_velocity + late, duration + allowed.instant)
    )
