"""Sticking and sliding in 60 digits: phase after phase by closed forms and certified roots.

Written from the model's equations only; it shares nothing with the core.
"""

from __future__ import annotations

from typing import NamedTuple

import mpmath
from mpmath import mpf

from bouncing_disk_ros.core.model import Disk
from reference.precise_path import Path, Real, first_zero


class Constants:
    """A disk's constants as the equations use them."""

    def __init__(self, disk: Disk) -> None:
        self.mass = mpf(disk.mass)
        self.gravity = mpf(disk.gravity) + mpf(disk.preload) / self.mass
        self.inertia = self.mass * mpf(disk.gyration_radius) ** 2
        #: μ a_e m / (m a_g²): the largest |Δα̇| per unit of N/m or of F̂/m
        self.grip = self.mass * mpf(disk.friction) * mpf(disk.friction_radius) / self.inertia
        self.brake = mpf(disk.load_torque) / self.inertia


class Turning(NamedTuple):
    """The disk on the platform, in contact: instant, slip (−1, 1, or 0 sticking), angle and
    angular velocity."""

    t: Real
    slip: int
    angle: Real
    spin: Real


class Contact:
    """Sticking and sliding of a disk that stays in contact (g + s̈ > 0 always), steady motion."""

    def __init__(self, path: Path, disk: Disk) -> None:
        self.path, self.k = path, Constants(disk)
        w, reach, swing = path.omega, path.reach, path.swing
        self.slip_bound = (self.k.grip * reach + swing) * w**3
        self.hold_bound = (self.k.grip * reach + swing) * w**4

    def sequence(self, angle: Real, spin: Real, end: Real) -> list[Turning]:
        """Phases from t = 0 until `end`, which is the last entry."""
        phases = [self._choose(mpf(0), mpf(angle), mpf(spin))]
        while True:
            last = phases[-1]
            change = self._slip_ends(last, end) if last.slip else self._stick_ends(last, end)
            at = self.carried(last, end if change is None else change)
            if change is None:
                return [*phases, at]
            phases.append(self._choose(change, at.angle, self.path.at(change).b1))

    def carried(self, phase: Turning, t: Real) -> Turning:
        """The phase at a later instant, by its closed form."""
        then, now, d = self.path.at(phase.t), self.path.at(t), t - phase.t
        if not phase.slip:
            return Turning(t, 0, phase.angle + now.b - then.b, now.b1)
        g, grip, brake = self.k.gravity, phase.slip * self.k.grip, self.k.brake
        spin = phase.spin - grip * (g * d + now.s1 - then.s1) - brake * d
        turned = (
            phase.spin * d
            - grip * (g * d * d / 2 + now.s - then.s - then.s1 * d)
            - brake * d * d / 2
        )
        return Turning(t, phase.slip, phase.angle + turned, spin)

    def _choose(self, t: Real, angle: Real, spin: Real) -> Turning:
        """Rule 4: stick if the friction it takes is at hand, otherwise slip to the side it gives
        way."""
        now = self.path.at(t)
        slip = spin - now.b1
        if abs(slip) > 0:
            return Turning(t, int(mpmath.sign(slip)), angle, spin)
        needed, limit = now.b2 + self.k.brake, self.k.grip * (self.k.gravity + now.s2)
        if abs(needed) < limit * (1 - mpf(10) ** -30):
            return Turning(t, 0, angle, spin)
        return Turning(t, -int(mpmath.sign(needed)), angle, spin)

    def _slip_ends(self, phase: Turning, end: Real) -> Real | None:
        side = phase.slip

        def slip(t: Real) -> Real:
            return side * (self.carried(phase, t).spin - self.path.at(t).b1)

        def slip1(t: Real) -> Real:
            now = self.path.at(t)
            grip = self.k.grip * (self.k.gravity + now.s2)
            return -grip - side * (self.k.brake + now.b2)

        start = phase.t
        if (
            slip(start) < mpf(10) ** -40 * self.path.omega
        ):  # slip has just begun: f = f'd + f''d²/2 + …, first nonzero > 0
            start += self._first_part(slip1(start), phase)
            assert slip(start) > 0
        return first_zero(slip, slip1, self.slip_bound, start, end) if start < end else None

    def _first_part(self, slope: Real, phase: Turning) -> Real:
        if slope > mpf(10) ** -25 * self.slip_bound / self.path.omega:
            return slope / self.slip_bound
        now = self.path.at(phase.t)
        curvature = -self.k.grip * now.s3 - phase.slip * now.b3
        return curvature / self.hold_bound

    def _stick_ends(self, phase: Turning, end: Real) -> Real | None:
        found = []
        for side in (-1, 1):

            def reserve(t: Real, side: int = side) -> Real:
                now = self.path.at(t)
                return self.k.grip * (self.k.gravity + now.s2) - side * (now.b2 + self.k.brake)

            def reserve1(t: Real, side: int = side) -> Real:
                now = self.path.at(t)
                return self.k.grip * now.s3 - side * now.b3

            found.append(first_zero(reserve, reserve1, self.hold_bound, phase.t, end))
        return min((t for t in found if t is not None), default=None)
