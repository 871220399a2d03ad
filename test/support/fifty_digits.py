"""The reference cases once more, in 50 digits and without intervals: a second way to their bounds.

Nothing of the package's physics is used. Zeros are bracketed on a dense grid and bisected; a
chatter is bounced through impact by impact until nothing of it is left.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from mpmath import mp, mpf

from bouncing_disk_ros.cases.definitions import Case
from bouncing_disk_ros.core.model import Motion

DIGITS = 50
GRID = 200  # steps a second in which a zero is looked for; the shortest dip of a case lasts 17 ms
GONE = mpf(10) ** -21  # m/s: slower bounces are over; their heights must keep digits of the fifty


class Row(NamedTuple):
    kind: str
    time: Any
    position: Any
    velocity_before: Any
    velocity_after: Any
    angle: Any
    angular_velocity_before: Any
    angular_velocity_after: Any


Function = Callable[[Any], Any]


Three = tuple[Any, Any, Any]
"""A position with its first two derivatives."""


class Fade(NamedTuple):
    """A cross-fade to `target` between two instants, s."""

    begin: Any
    end: Any
    target: Motion


class Path:
    """s(t) and β(t) of a platform with cross-fades, from the phase τ at t = 0 on."""

    def __init__(self, motion: Motion, phase: Any, fades: Sequence[Fade] = ()) -> None:
        self._pieces: list[tuple[Any, Any, Any, Motion, Motion]] = []
        now, tau = mpf(0), mpf(phase)
        for fade in fades:
            length = fade.end - fade.begin
            self._pieces.append((now, mpf(0), tau, motion, motion))
            tau += _omega(motion) * (fade.begin - now)
            self._pieces.append((fade.begin, length, tau, motion, fade.target))
            tau += (_omega(motion) + _omega(fade.target)) / 2 * length
            now, motion = fade.end, fade.target
        self._pieces.append((now, mpf(0), tau, motion, motion))

    def axial(self, t: Any) -> Three:
        """s and its derivatives."""
        tau, x, a, b = self._at(t)
        return _sine(a.axial_amplitude, b.axial_amplitude, x, tau)

    def angular(self, t: Any) -> Three:
        """β and its derivatives; θ goes the short way."""
        tau, x, a, b = self._at(t)
        short = mpf(b.phase_lag) - mpf(a.phase_lag)
        short -= 2 * mp.pi * mp.nint(short / (2 * mp.pi))
        lag = mpf(a.phase_lag) + short * x[0], short * x[1], short * x[2]
        turn = tau[0] + lag[0], tau[1] + lag[1], tau[2] + lag[2]
        return _sine(a.angular_amplitude, b.angular_amplitude, x, turn)

    def _at(self, t: Any) -> tuple[Three, Three, Motion, Motion]:
        """τ and the blend with their derivatives, and the motions before and after it."""
        begin, length, tau, a, b = next(p for p in reversed(self._pieces) if p[0] <= t)
        d, w, change = t - begin, _omega(a), _omega(b) - _omega(a)
        if not length:
            return (tau + w * d, w, mpf(0)), (mpf(0),) * 3, a, b
        y = d / length
        blend = (y**3 * (10 - 15 * y + 6 * y * y), 30 * y * y * (1 - y) ** 2 / length,
                 60 * y * (1 - y) * (1 - 2 * y) / length**2)  # fmt: skip
        tau += w * d + change * length * y**4 * (mpf(5) / 2 - 3 * y + y * y)
        return (tau, w + change * blend[0], change * blend[1]), blend, a, b


def _omega(motion: Motion) -> Any:
    return 2 * mp.pi * mpf(motion.frequency)


def _sine(begin: float, end: float, blend: Three, tau: Three) -> Three:
    """A blended amplitude times the sine of a phase, with its derivatives."""
    change = mpf(end) - mpf(begin)
    a, a1, a2 = mpf(begin) + change * blend[0], change * blend[1], change * blend[2]
    cosine, sine = mp.cos_sin(tau[0])
    s1, s2 = cosine * tau[1], cosine * tau[2] - sine * tau[1] ** 2
    return a * sine, a1 * sine + a * s1, a2 * sine + 2 * a1 * s1 + a * s2


class Platform:
    """s(t) and β(t) with their first two derivatives, of the one law that a case has."""

    def __init__(self, case: Case) -> None:
        motion = Motion(*(float(case.parameters[name]) for name in Motion._fields))
        fades, self.path = list[Fade](), None
        for end, to in case.programme:
            begin = mpf(end) - 1 / min(mpf(motion.frequency), mpf(to["frequency"]))
            fades.append(Fade(begin, mpf(end), motion._replace(**to)))
        for end, values in case.trajectory:
            self.path = mpf(end), values["platform_axial"]
        self._sinusoid = Path(motion, 0, fades)
        self.fade, self.angular = fades[0] if fades else None, self._sinusoid.angular

    def axial(self, t: Any) -> Three:
        s, v, acc = self._sinusoid.axial(t)
        if self.path:
            end, given = self.path
            if isinstance(given, tuple):  # c t²/2 to x = c T²/2, v = c T
                c = mpf(given[1]) / end
                assert 2 * mpf(given[0]) == c * end * end
                return s + c * t * t / 2, v + c * t, acc + c
            return s + mpf(given) * t / end, v + mpf(given) / end, acc
        return s, v, acc


def first_zero(f: Function, begin: Any, end: Any) -> Any:
    """Where f, positive after `begin`, first falls through zero; None: nowhere up to `end`."""
    low = begin
    while low < end:
        high = min(low + mpf(1) / GRID, end)
        if f(high) < 0:
            low = low if f(low) > 0 else (low + high) / 2
            while f(low) < 0:  # from a zero at `begin`
                high, low = low, (begin + low) / 2
            for _ in range(4 * DIGITS):
                middle = (low + high) / 2
                low, high = (middle, high) if f(middle) > 0 else (low, middle)
            return high
        low = high
    return None


class Run:
    """One run of a case."""

    def __init__(self, case: Case) -> None:
        p = {name: mpf(value) for name, value in case.parameters.items()}
        self.case, self.platform, self.rows = case, Platform(case), list[Row]()
        self.m, self.e = p["mass"], p["restitution"]
        self.inertia = self.m * p["gyration_radius"] ** 2
        self.g = p["gravity"] + p["preload"] / self.m
        self.grip = p["friction"] * p["friction_radius"] / p["gyration_radius"] ** 2
        self.lag = p["load_torque"] / self.inertia
        self.t, self.x = mpf(0), p["initial_height"] + self.platform.axial(mpf(0))[0]
        self.angle, self.omega = p["initial_angle"], p["initial_angular_velocity"]
        self.phase, self.sign = "flight", 0
        self.v = p["initial_axial_velocity"]
        if case.parameters["initial_with_platform"]:
            self.v = self.platform.axial(mpf(0))[1]
            self.enter_contact()

    def go(self) -> list[Row]:
        pushes = [(mpf(t), mpf(j)) for t, j, twist in self.case.impulses]
        marks = [*pushes, (mpf(self.case.duration), None)]
        if self.platform.fade:
            marks += [(edge, mpf(0)) for edge in self.platform.fade[:2]]
        for end, push in sorted(marks, key=lambda mark: mark[0]):
            while self.step(end):
                pass
            if push:
                self.push(push)
        self.keep("end", self.v, self.omega)
        return self.rows

    def keep(self, kind: str, before: Any, omega: Any) -> None:
        row = Row(kind, self.t, self.x, before, self.v, self.angle, omega, self.omega)
        self.rows.append(row)

    def turning(self, t: Any) -> tuple[Any, Any]:
        """Angle and speed of the disk at t, in the phase it is in."""
        d = t - self.t
        if self.phase == "sticks":
            beta = self.platform.angular(t)
            return self.angle + beta[0] - self.platform.angular(self.t)[0], beta[1]
        pull = self.grip * self.sign if self.phase == "slides" else 0
        s0, s = self.platform.axial(self.t), self.platform.axial(t)
        swing = pull * (s[0] - s0[0] - s0[1] * d)
        still = pull * self.g + self.lag
        angle = self.angle + self.omega * d - still * d * d / 2 - swing
        return angle, self.omega - still * d - pull * (s[1] - s0[1])

    def step(self, end: Any) -> bool:
        t0, x0, v0, g, axial = self.t, self.x, self.v, self.g, self.platform.axial
        watched: dict[str, Function] = {}
        if self.phase == "flight":
            watched["impact"] = lambda t: x0 + (v0 - g * (t - t0) / 2) * (t - t0) - axial(t)[0]
        else:
            watched["separation"] = lambda t: g + axial(t)[2]
            angular, grip, lag = self.platform.angular, self.grip, self.lag
            if self.phase == "sticks":
                watched["slip"] = lambda t: grip * (g + axial(t)[2]) - abs(angular(t)[2] + lag)
            elif self.sign:
                sign = self.sign
                watched["stick"] = lambda t: sign * (self.turning(t)[1] - angular(t)[1])
        zeros = {kind: first_zero(f, t0, end) for kind, f in watched.items()}
        found = {kind: t for kind, t in zeros.items() if t is not None}
        kind = min(found, key=lambda name: found[name], default="")
        t = found[kind] if kind else end
        self.angle, self.omega = self.turning(t)
        if self.phase == "flight":
            self.x, self.v = x0 + v0 * (t - t0) - g * (t - t0) ** 2 / 2, v0 - g * (t - t0)
        else:
            self.x, self.v = axial(t)[:2]
        self.t = t
        if kind == "impact":
            self.impact()
        elif kind == "separation":
            self.phase, self.sign = "flight", 0
            self.keep(kind, self.v, self.omega)
        elif kind:
            self.omega = self.platform.angular(t)[1]
            self.enter_contact(slips=kind == "slip")
            self.keep(kind, self.v, self.omega)
        return bool(kind)

    def impact(self) -> None:
        (s, speed, _), turning = self.platform.axial(self.t), self.platform.angular(self.t)[1]
        w, slip, before, omega = self.v - speed, self.omega - turning, self.v, self.omega
        self.x, self.v = s, speed - self.e * w
        most = self.grip * (1 + self.e) * abs(w)
        self.omega = turning if abs(slip) <= most else omega - most * mp.sign(slip)
        self.keep("impact", before, omega)
        if self.e * abs(w) < GONE:
            self.v = speed
            self.enter_contact()
            self.keep("contact", self.v, self.omega)

    def push(self, push: Any) -> None:
        before, was_contact = self.v, self.phase != "flight"
        self.v, self.phase = self.v + push / self.m, "flight"
        self.keep("impulse", before, self.omega)
        if was_contact and push < 0:
            self.impact()

    def enter_contact(self, *, slips: bool = False) -> None:
        beta = self.platform.angular(self.t)
        load, needed = self.g + self.platform.axial(self.t)[2], beta[2] + self.lag
        slip = self.omega - beta[1]
        if self.grip and not slips and abs(slip) < GONE and abs(needed) < self.grip * load:
            self.phase, self.sign = "sticks", 0
        else:
            self.phase = "slides"
            against = mp.sign(slip) if abs(slip) >= GONE else -mp.sign(needed)
            self.sign = int(against) if self.grip else 0


def run(case: Case) -> list[Row]:
    """All events of a case, the impacts that its file does not list among them."""
    with mp.workdps(DIGITS):
        return Run(case).go()
