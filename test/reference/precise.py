"""Flights, impacts and chatters in 60 digits, one by one: an independent solution, for tests alone.

Written from the model's equations only; it shares nothing with the core.
"""

from __future__ import annotations

from typing import NamedTuple

import mpmath
from mpmath import mp, mpf

from bouncing_disk_ros.core.model import Disk
from reference.precise_path import Path, Real, first_zero


class Constants:
    """A disk's constants as the equations use them."""

    def __init__(self, disk: Disk) -> None:
        self.mass, self.restitution = mpf(disk.mass), mpf(disk.restitution)
        self.gravity = mpf(disk.gravity) + mpf(disk.preload) / self.mass
        self.inertia = self.mass * mpf(disk.gyration_radius) ** 2
        #: μ a_e m / (m a_g²): the largest |Δα̇| per unit of N/m or of F̂/m
        self.grip = self.mass * mpf(disk.friction) * mpf(disk.friction_radius) / self.inertia
        self.brake = mpf(disk.load_torque) / self.inertia


class Landing(NamedTuple):
    """The end of a flight: duration and w_A there, with what an error of the data makes of it."""

    duration: Real
    impact_velocity: Real


def landing(path: Path, gravity: Real, t: Real, gap: Real, u: Real) -> Landing | None:
    """The first contact after t of a disk in flight with gap ≥ 0 and relative velocity u; u > 0
    if gap = 0."""
    now = path.at(t)
    bound = gravity + path.acceleration_bound

    def gap_after(d: Real) -> Real:
        return gap + u * d - gravity * d * d / 2 - (path.axial(t + d)[0] - now.s - now.s1 * d)

    def speed_after(d: Real) -> Real:
        return u - gravity * d - (path.axial(t + d)[1] - now.s1)

    hop = _hop_bound(path, gravity + now.s2, u) if gap == 0 else None
    if hop is not None:  # concave: Newton's steps from beyond the only root come down to it
        d = hop
        while True:
            step = gap_after(d) / speed_after(d)
            d -= step
            if step <= mpf(10) ** (5 - mp.dps) * d:
                return Landing(d, speed_after(d))
    # |s| ≤ reach: no flight outlasts the fall through all of it. Before `start` the gap is positive
    # by the bound alone.
    v, fall = now.s1 + u, now.s + gap + path.reach
    end = (v + mpmath.sqrt(v * v + 2 * gravity * fall)) / gravity * (1 + mpf(10) ** -20)
    if gap > 0:
        start = mpf(0)
    elif u > 0:
        start = u / bound
    else:
        start = _after_launch(path, gravity, t, bound)
    found = first_zero(gap_after, speed_after, bound, start, end)
    return None if found is None else Landing(found, speed_after(found))


def _hop_bound(path: Path, acceleration: Real, u: Real) -> Real | None:
    """An end of a hop so short that g + s̈ stays above half of what it is now; None: it is not."""
    if u <= 0 or acceleration <= 0 or path.ends:
        return None
    hop = 4 * u / acceleration
    return hop if path.reach * path.omega**3 * hop < acceleration / 2 else None


def _after_launch(path: Path, gravity: Real, t: Real, bound: Real) -> Real:
    """Where gap > 0 is sure after a launch with u = 0 in steady motion: by the first nonzero
    derivative."""
    now, w = path.at(t), path.omega
    acceleration, jerk, snap = -gravity - now.s2, -now.s3, path.reach * w**4
    if acceleration > mpf(10) ** -30 * bound:  # gap ≥ a d²/2 − Aω³ d³/6
        return acceleration / (path.reach * w**3)
    return jerk / snap  # gap ≥ s⃛ d³/6 − Aω⁴ d⁴/24


class Chatter(NamedTuple):
    """A complete chatter: its duration, number of impacts, summed impulses and the disk's α̇ at
    its end."""

    duration: Real
    impacts: int
    axial_impulse: Real
    angular_impulse: Real
    angular_velocity: Real


def chatter(path: Path, disk: Disk, t: Real, u: Real, spin: Real, until: Real) -> Chatter:
    """Impact after impact from a launch with u > 0 until the rest lasts less than `until`·(what
    has passed).

    The rest of a geometric sequence is bounded by twice its first term/(1 − ε); the impulses
    still to come are as small a part of the sums.
    """
    k = Constants(disk)
    begin, axial, angular, n = t, mpf(0), mpf(0), 0
    while True:
        end = landing(path, k.gravity, t, mpf(0), u)
        assert end is not None
        t, n = t + end.duration, n + 1
        w = -end.impact_velocity
        axial += k.mass * (1 + k.restitution) * w
        slip, largest = (
            spin - k.brake * end.duration - path.at(t).b1,
            k.grip * (1 + k.restitution) * w,
        )
        change = -mpmath.sign(slip) * min(abs(slip), largest)
        spin += change - k.brake * end.duration
        angular += k.inertia * change
        u = k.restitution * w
        acceleration = k.gravity + path.at(t).s2
        if 2 * 2 * u / (acceleration * (1 - k.restitution)) <= until * (t - begin):
            return Chatter(t - begin, n, axial, angular, spin)
