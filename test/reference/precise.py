"""The model in arbitrary precision, event by event: an independent solution, for tests alone.

Written from the model's equations only. First roots are certified by exclusion: on an interval of
half width r about c, |f(t) − f(c) − f'(c)(t − c)| ≤ M r²/2 with a bound M of |f''|; an interval
is passed only if that proves f > 0, and a root is taken only where f is proved monotone. No step
is ever taken in hope.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import mpmath
from mpmath import mp, mpf

from bouncing_disk_ros.core.model import Disk, Motion
from reference.cases import NS, Fade, Kick

mp.dps = 60
Real = Any  # mpf: mpmath has no types
TINY = mpf(10) ** -45

# Extremes of the blend b(σ) = 10σ³ − 15σ⁴ + 6σ⁵ on [0, 1]: b' at 1/2, b'' at (3 − √3)/6.
BLEND_1, BLEND_2 = mpf(15) / 8, 10 / mpmath.sqrt(3)


class GrazeError(Exception):
    """A double root, to the working precision: no sign decides."""


def first_zero(
    f: Callable[[Real], Real], f1: Callable[[Real], Real], bound: Real, start: Real, end: Real
) -> Real | None:
    """First t in (start, end] with f(t) = 0, where f(start) > 0 and |f''| ≤ bound; None if there
    is none."""
    pieces = [(mpf(start), mpf(end))]
    while pieces:
        a, b = pieces.pop()
        c, r = (a + b) / 2, (b - a) / 2
        value, slope = f(c), f1(c)
        if value - abs(slope) * r - bound * r * r / 2 > 0:
            continue
        if abs(slope) > bound * r:
            if f(b) > 0:  # monotone and positive at both ends
                continue
            return _newton(f, f1, a, b)
        if r < TINY * max(abs(c), 1):
            raise GrazeError(f"a double root near {mpmath.nstr(c, 20)}")
        pieces += [(c, b), (a, c)]
    return None


def _newton(f: Callable[[Real], Real], f1: Callable[[Real], Real], a: Real, b: Real) -> Real:
    """The zero of a falling f in [a, b], f(a) > 0 ≥ f(b): Newton steps kept inside a shrinking
    bracket."""
    t = (a + b) / 2
    while True:
        value = f(t)
        a, b = (t, b) if value > 0 else (a, t)
        new = t - value / f1(t)
        if not a < new < b:
            new = (a + b) / 2
        if abs(new - t) <= mpf(10) ** (5 - mp.dps) * abs(t):
            return new
        t = new


class At(NamedTuple):
    """The platform at one instant: s, ṡ, s̈, s⃛ and β, β̇, β̈, β⃛ (third derivatives in steady
    motion alone)."""

    s: Real
    s1: Real
    s2: Real
    s3: Real
    b: Real
    b1: Real
    b2: Real
    b3: Real


class Path:
    """The platform's motion from t = 0, with cross-fades."""

    def __init__(self, motion: Motion, phase: Real, fades: Sequence[Fade] = ()) -> None:
        self._pieces: list[tuple[Real, Real, Real, Motion, Motion]] = []
        now, tau = mpf(0), mpf(phase)
        for fade in fades:
            begin, end = mpf(fade.begin_ns) / NS, mpf(fade.end_ns) / NS
            self._pieces.append((now, mpf(0), tau, motion, motion))
            tau += _omega(motion) * (begin - now)
            self._pieces.append((begin, end - begin, tau, motion, fade.target))
            tau += (_omega(motion) + _omega(fade.target)) / 2 * (end - begin)
            now, motion = end, fade.target
        self._pieces.append((now, mpf(0), tau, motion, motion))
        motions = [piece[3] for piece in self._pieces] + [motion]
        self.omega = max(_omega(m) for m in motions)
        self.reach = max(mpf(m.axial_amplitude) for m in motions)
        self.swing = max(mpf(m.angular_amplitude) for m in motions)
        self.ends = [piece[0] for piece in self._pieces[1:]]

    @property
    def acceleration_bound(self) -> Real:
        """A bound of |s̈| over all time."""
        bound = self.reach * self.omega**2
        for _, duration, _, a, b in self._pieces:
            if duration:
                change = abs(mpf(b.axial_amplitude) - mpf(a.axial_amplitude))
                rate = abs(_omega(b) - _omega(a)) * BLEND_1 / duration
                fading = change * (BLEND_2 / duration**2 + 2 * BLEND_1 / duration * self.omega)
                bound = max(bound, self.reach * (self.omega**2 + rate) + fading)
        return bound

    def forcing(self, t: Real) -> tuple[Real, Real, Real, Real, Real, Real, Real, Motion, Motion]:
        """Return τ, ω, ω̇, b, ḃ, b̈ and the rest of the piece in force at t."""
        begin, duration, tau, a, b = next(p for p in reversed(self._pieces) if p[0] <= t)
        elapsed, w, dw = t - begin, _omega(a), _omega(b) - _omega(a)
        if not duration:
            return tau + w * elapsed, w, mpf(0), mpf(0), mpf(0), mpf(0), begin, a, b
        x = elapsed / duration
        blend = x**3 * (10 - 15 * x + 6 * x * x)
        blend1 = 30 * x * x * (1 - x) ** 2 / duration
        blend2 = 60 * x * (1 - x) * (1 - 2 * x) / duration**2
        tau += w * elapsed + dw * duration * x**4 * (mpf(5) / 2 - 3 * x + x * x)
        return tau, w + dw * blend, dw * blend1, blend, blend1, blend2, begin, a, b

    def at(self, t: Real) -> At:
        """The platform at t."""
        tau, w, w1, x, x1, x2, _, a, b = self.forcing(t)
        lag, short = mpf(a.phase_lag), mpf(b.phase_lag) - mpf(a.phase_lag)
        short -= 2 * mp.pi * mpmath.nint(short / (2 * mp.pi))
        axial = _sine(a.axial_amplitude, b.axial_amplitude, x, x1, x2, tau, w, w1)
        turn, rate, rate1 = tau + lag + short * x, w + short * x1, w1 + short * x2
        angular = _sine(a.angular_amplitude, b.angular_amplitude, x, x1, x2, turn, rate, rate1)
        return At(*axial, *angular)


def _omega(motion: Motion) -> Real:
    return 2 * mp.pi * mpf(motion.frequency)


def _sine(
    start: float, end: float, x: Real, x1: Real, x2: Real, tau: Real, w: Real, w1: Real
) -> tuple[Real, Real, Real, Real]:
    """A(t) sin τ(t) and its derivatives."""
    change = mpf(end) - mpf(start)
    a, a1, a2 = mpf(start) + change * x, change * x1, change * x2
    sine, cosine = mpmath.sin(tau), mpmath.cos(tau)
    return (
        a * sine,
        a1 * sine + a * w * cosine,
        a2 * sine + 2 * a1 * w * cosine + a * (w1 * cosine - w * w * sine),
        -a * w**3 * cosine,
    )


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
        return gap + u * d - gravity * d * d / 2 - (path.at(t + d).s - now.s - now.s1 * d)

    def speed_after(d: Real) -> Real:
        return u - gravity * d - (path.at(t + d).s1 - now.s1)

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


def kicked(kick: Kick, disk: Disk) -> tuple[Real, Real]:
    """Changes of ẋ and α̇ by a kick."""
    k = Constants(disk)
    return mpf(kick.axial) / k.mass, mpf(kick.angular) / k.inertia
