"""Single tosses in 60 digits: contact phases by certified roots, the work by quadrature.

The phases of contact come from `precise_contact`, up to the instant of separation that eq. 3 gives;
E_in is the integral of the forces' power, by quadrature over each phase. Nothing is shared with the
core.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import mpmath
import numpy as np
import pytest
from mpmath import mp, mpf

from bouncing_disk_ros.core.model import Disk, Motion
from bouncing_disk_ros.maps.tosses import PAPER, PAPER_DISK, extreme, motion_of, toss
from reference.precise_contact import Constants, Contact, Turning
from reference.precise_path import Path, Real

EPS = float(np.finfo(float).eps)
LOWEST = 3 * mp.pi / 2


class Exact(NamedTuple):
    """α̇_f and E_in."""

    speed: Real
    work: Real


def exact_toss(
    motion: Motion, disk: Disk, *, spin: Real = 0, phase: Real = LOWEST, work: bool = True
) -> Exact:
    """From the start on the platform to separation, where sin τ = g/(A ω²)."""
    path, k = Path(motion, phase), Constants(disk)
    leave = mpmath.asin(k.gravity / (path.reach * path.omega**2))
    end = (leave + 2 * mp.pi - phase) / path.omega
    phases = Contact(path, disk).sequence(mpf(0), mpf(spin), end)
    total = sum((_work(path, k, a, b) for a, b in pairwise(phases)), mpf(0)) if work else mpf(0)
    return Exact(phases[-1].spin, total)


def _work(path: Path, k: Constants, begin: Turning, end: Turning) -> Real:
    """∫(N ṡ + M β̇)dt over one phase."""

    def power(t: Real) -> Real:
        now = path.at(t)
        normal = k.mass * (k.gravity + now.s2)
        moment = k.inertia * (now.b2 + k.brake)
        if begin.slip:
            moment = -begin.slip * k.inertia * k.grip * (k.gravity + now.s2)
        return normal * now.s1 + moment * now.b1

    return mpmath.quad(power, [begin.t, end.t], method="gauss-legendre")


def efficiency(motion: Motion, spin: Real = 0) -> Real:
    found = exact_toss(motion, PAPER_DISK, spin=spin)
    return Constants(PAPER_DISK).inertia * found.speed**2 / 2 / found.work


RNG = np.random.default_rng(5)
PIXELS = [(0.0, 0.2456 * math.pi), (0.0, 0.248 * math.pi), (math.pi / 2, math.pi / 4)]
PIXELS += [(float(a), float(b)) for a, b in RNG.uniform([-3.1, 0.05], [3.1, 1.4], (3, 2))]


@pytest.mark.parametrize(("lag", "angle"), PIXELS)
@pytest.mark.parametrize("loaded", [False, True])
def test_speed_and_work(lag: float, angle: float, loaded: bool) -> None:
    """To a few roundings: an instant errs by ε/ω, and α̇ by friction's acceleration times that."""
    disk, spin, phase = PAPER_DISK, 0.0, 1.5 * math.pi
    if loaded:
        disk, spin, phase = disk._replace(preload=1.0, load_torque=0.02), 4.0, 5.0
    setting = PAPER._replace(disk=disk)
    with mp.workdps(30):
        exact = exact_toss(motion_of(lag, angle, setting), disk, spin=spin, phase=mpf(phase))
    found = toss(lag, angle, setting, angular_velocity=spin, forcing_phase=phase)
    speeds = abs(spin) + math.tau * 3.0 * 0.25 / 0.12 + 20.0
    assert found.airborne_speed == pytest.approx(float(exact.speed), rel=0, abs=32 * EPS * speeds)
    assert found.input_energy == pytest.approx(float(exact.work), rel=64 * EPS)


def hill(function: str, angle: float, step: Real) -> tuple[Real, Real]:
    """Vertex of the parabola through three points near φ_L along θ = 0, in 60 digits."""
    a_e, c = mpf(PAPER_DISK.friction_radius), mpf(PAPER.arc_amplitude)

    def value(phi: Real) -> Real:
        motion = Motion(c * mpmath.cos(phi), c * mpmath.sin(phi) / a_e, mpf(3), mpf(0))
        # cos(3π/2) is 1e-60 in 60 digits: that too is rest
        rest = Path(motion, LOWEST).at(mpf(0)).b1
        if function == "efficiency":
            return efficiency(motion, rest)
        return exact_toss(motion, PAPER_DISK, spin=rest, work=False).speed

    low, middle, high = (value(angle + k * step) for k in (-1, 0, 1))
    slope, bend = (high - low) / 2, high - 2 * middle + low
    assert bend < 0
    return angle - step * slope / bend, middle - slope**2 / bend / 2


@pytest.mark.parametrize("measure", ["airborne_speed", "efficiency"])
def test_extremes(measure: str) -> None:
    """27.18 rad/s at 0.245642π; 0.344 at 0.246088π: where the slope in 60 digits vanishes.

    They lie on a crease: to both sides of θ = 0 the exact values fall at once, with other slopes.
    """
    best = extreme(measure)
    place, value = hill(measure, mpf(best.amplitude_angle), mpf(10) ** -12)
    # a hill is flat: golden sections know its place to √(rounding) of its value
    assert best.amplitude_angle == pytest.approx(float(place), abs=1e-8)
    # what is lost beside the crease: some 1e-12 rad of θ by a slope of 13 rad/s for each rad
    assert getattr(best, measure) == pytest.approx(float(value), rel=1e-12)
    slopes = []
    for side in (-1e-6, 1e-6):
        motion = motion_of(side, best.amplitude_angle)
        there = (
            exact_toss(motion, PAPER_DISK).speed
            if measure == "airborne_speed"
            else efficiency(motion)
        )
        slopes.append((float(there) - getattr(best, measure)) / side)
    assert slopes[0] > 0.1 * getattr(best, measure)
    assert slopes[1] < -0.01 * getattr(best, measure)
