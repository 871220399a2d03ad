"""Enclosure of a run: every event of the rigid-impact law as balls, from the start to the end.

The state after an event, a ball in each number, is the start of the next stretch: nothing is
rounded to a float64 in between. The first zero of the gap (in contact of the load, the slip and
the margin of sticking) is proved to be the first (`proof.positivity`).
"""

from __future__ import annotations

import math
from contextlib import suppress
from enum import StrEnum
from typing import NamedTuple

from flint import arb, ctx

from bouncing_disk_ros.cases.definitions import Case
from bouncing_disk_ros.core.model import Motion, Phase
from bouncing_disk_ros.core.schedule import Fade, plan_fades
from bouncing_disk_ros.proof.event_functions import (
    Watched,
    gap_from,
    load_from,
    margin_from,
    slip_from,
)
from bouncing_disk_ros.proof.event_proof import chatter_tail
from bouncing_disk_ros.proof.exact_records import MotionRecord, OffsetPiece, State
from bouncing_disk_ros.proof.platforms import Platform, interval, platform_of
from bouncing_disk_ros.proof.positivity import Found, first_zero, opens
from bouncing_disk_ros.run.time_map import nanoseconds
from bouncing_disk_ros.units import NS

PRECISIONS = (512, 1024, 2048, 4096)
"""Bits, tried in turn: balls grow at each event, in a chatter a thousand times at each impact."""
_TAIL_SPEED = 1e-11
"""m/s: from here the rest of a chatter is bounded as a whole, to less than 1e-20 s."""
LISTED_PART = 1.0 / 128.0
"""Of the hardest impact since contact or an input: slower ones of a chatter are not listed."""


class EventKind(StrEnum):
    """What an event of a case is."""

    IMPACT = "impact"
    CONTACT = "contact"  # infinitely many impacts have ended, or ε = 0
    SEPARATION = "separation"
    STICK = "stick"
    SLIP = "slip"
    IMPULSE = "impulse"
    END = "end"


class Enclosed(NamedTuple):
    """One event, each number a ball: SI units; speeds are absolute."""

    kind: EventKind
    time: arb
    position: arb
    velocity_before: arb
    velocity_after: arb
    angle: arb
    angular_velocity_before: arb
    angular_velocity_after: arb
    condition: float
    """By what factor an error of the start (height over g/ω², velocity over g/ω) is greater in
    ωt (impacts; nan for others), ω = 2π/s; 0 after a separation, which forgets the start."""


class UndecidedError(Exception):
    """Balls overlap where the law needs a decision: more precision, or another case."""


class _Law(NamedTuple):
    """Constants of disk and contact, from the float64 parameters without rounding."""

    mass: arb
    inertia: arb
    restitution: arb
    g: arb  # g + P/m
    grip: arb  # μ a_e m/I, rad/m
    lag: arb  # T_L/I, rad/s²


def _law(case: Case) -> _Law:
    p = {name: arb(float(value)) for name, value in case.parameters.items()}
    inertia = p["mass"] * p["gyration_radius"] ** 2
    grip = p["friction"] * p["friction_radius"] / p["gyration_radius"] ** 2
    g = p["gravity"] + p["preload"] / p["mass"]
    return _Law(p["mass"], inertia, p["restitution"], g, grip, p["load_torque"] / inertia)


def _decided(is_so: bool, is_not: bool, what: str) -> bool:
    if not is_so and not is_not:
        raise UndecidedError(what)
    return is_so


def _is_zero(x: arb) -> bool:
    """Whether a number is exactly zero; a ball around zero is not (and x != 0 is not surely so)."""
    return bool(x == 0)


# ------------------------------------------------------------------------------------------------
# The platform: stretches of one law of motion between whole nanoseconds.


def _motions(case: Case) -> list[tuple[int, MotionRecord]]:
    """The begin of each stretch, ns, and its motion."""
    p = {name: float(value) for name, value in case.parameters.items()}
    start = Motion(p["axial_amplitude"], p["angular_amplitude"], p["frequency"], p["phase_lag"])
    points, latest = [], start
    for time, values in case.programme:
        latest = latest._replace(**values)
        points.append((nanoseconds(time), latest))
    pieces = _offset_pieces(case)
    found, motion = [(0, _steady(start, pieces))], start
    for fade in plan_fades(points, start, 0, 0):
        found.append((fade.begin_ns, _fading(motion, fade, pieces)))
        motion = fade.target
        found.append((fade.end_ns, _steady(motion, pieces)))
    return found


Pieces = tuple[OffsetPiece | None, OffsetPiece | None]


def _offset_pieces(case: Case) -> Pieces:
    """The one piece of each joint's offset, from rest at t = 0 on."""
    assert len(case.trajectory) <= 1
    found: dict[str, OffsetPiece] = {}
    for time, values in case.trajectory:
        for joint, given in values.items():
            end = tuple(given) if isinstance(given, tuple) else (given,)
            padded = (*end, *(0.0,) * (3 - len(end)))
            piece = OffsetPiece(0, nanoseconds(time), (0.0,) * 3, padded, 2 * len(end) - 1)
            found[joint] = piece
    return found.get("platform_axial"), found.get("platform_rotation")


def _steady(motion: Motion, pieces: Pieces) -> MotionRecord:
    a, p, f, lag = motion
    return MotionRecord(False, 0, 0, 0, 0.0, a, 0.0, p, 0.0, f, 0.0, lag, 0.0, *pieces)


def _fading(start: Motion, fade: Fade, pieces: Pieces) -> MotionRecord:
    (a, p, f, lag), (a1, p1, f1, lag1) = start, fade.target
    changes = (a, a1 - a, p, p1 - p, f, f1 - f, lag, lag1 - lag)
    return MotionRecord(True, fade.begin_ns, fade.end_ns, 0, 0.0, *changes, *pieces)


# ------------------------------------------------------------------------------------------------
# The run.


class Enclosure:
    """The run of a case, event by event."""

    def __init__(self, case: Case) -> None:
        """At the precision in force."""
        self.law, self._events = _law(case), list[Enclosed]()
        p = {name: float(value) for name, value in case.parameters.items()}
        assert p["initial_forcing_phase"] == 0.0
        self._time, self._is_listed, self._hardest = arb(0), True, 0.0
        self._motions = _motions(case)
        self._platform = self._from(0, arb(0))
        s, b = self._axial(), self._angular()
        self._gap, self._angle = arb(p["initial_height"]), arb(p["initial_angle"])
        self._omega = arb(p["initial_angular_velocity"])
        self._u = arb(0) if p["initial_with_platform"] else arb(p["initial_axial_velocity"]) - s[1]
        self._known: tuple[arb, ...] = (self._gap, self._u)
        self._sign, self._phase, self._slips_from_stick = arb(0), Phase.FLIGHT, False
        self._sensitivity = [[1.0, 0.0], [0.0, 1.0]]  # ∂(gap, u)/∂(height, velocity)
        impulses = [(nanoseconds(t), axial, angular) for t, axial, angular in case.impulses]
        self._impulses = impulses
        instants = {ns for ns, *_ in impulses} | {ns for ns, _ in self._motions[1:]}
        self._boundaries = sorted({*instants, nanoseconds(case.duration)})
        if _is_zero(self._gap) and _is_zero(self._u):
            self._touch(arb(self._omega - b[1]))

    def run(self) -> list[Enclosed]:
        """All events up to the end of the case."""
        for boundary in self._boundaries:
            while self._step(boundary):
                pass
            self._at_boundary(boundary)
        self._keep(EventKind.END, self._velocity(), self._omega, math.nan)
        return self._events

    # the platform at the instant of the state

    def _from(self, ns: int, tau: arb) -> Platform:
        motion = next(motion for begin, motion in reversed(self._motions) if begin <= ns)
        state = State(ns, 0.0, 0, 0.0, Phase.FLIGHT, 0.0, 0.0, 0.0, 0.0)
        return platform_of(motion, state, tau)

    def _axial(self, t: arb | None = None) -> list[arb]:
        return self._platform.mix(arb(1), arb(0)).jet(arb(0) if t is None else t)

    def _angular(self, t: arb | None = None) -> list[arb]:
        return self._platform.mix(arb(0), arb(1)).jet(arb(0) if t is None else t)

    def _velocity(self) -> arb:
        return self._axial()[1] + self._u

    # one stretch

    def _step(self, boundary: int) -> bool:
        """Go to the next event or to the boundary; whether an event came."""
        left = arb(boundary) / NS - self._time
        if not left > 0:
            return False
        candidates = list(self._watched())
        nearest: tuple[arb, EventKind] | None = None
        for watched, kind in candidates:
            at = self._first(watched, float(left.upper()))
            if at is None or not _decided(at < left, at > left, "an event at a boundary"):
                continue
            if nearest is None or _decided(at < nearest[0], at > nearest[0], "two events"):
                nearest = at, kind
        if nearest is None:
            self._go(left, arb(boundary) / NS)
            return False
        self._go(nearest[0], self._time + nearest[0])
        self._resolve(nearest[1])
        return True

    def _first(self, watched: Watched, end: float) -> arb | None:
        begin = opens(watched, end, float(self._platform.rate(interval(0.0, end)).upper()))
        if begin is None:
            raise UndecidedError("a function that does not rise from its zero")
        zero = first_zero(watched, begin, end, watched.floor_zeros())
        if zero.found is Found.UNKNOWN:
            raise UndecidedError("a graze")
        return zero.at if zero.found is Found.ZERO else None

    def _watched(self) -> list[tuple[Watched, EventKind]]:
        """What may fall through zero next, in the phase of the disk."""
        law, platform = self.law, self._platform
        if self._phase is Phase.FLIGHT:
            gap = gap_from(platform, self._gap, self._u, law.g, known=self._known)
            return [(gap, EventKind.IMPACT)]
        found = [(load_from(platform, law.g), EventKind.SEPARATION)]
        if self._phase is Phase.STICKING:
            for sign in (1, -1):
                margin = margin_from(platform, law.grip, law.g, law.lag, sign)
                found.append((margin, EventKind.SLIP))
        elif law.grip > 0:
            known = (arb(0),) if self._slips_from_stick else ()
            numbers = self._omega, self._sign, law.grip, law.g, law.lag
            found.append((slip_from(platform, *numbers, known=known), EventKind.STICK))
        return found

    def _go(self, d: arb, time: arb) -> None:
        """Move the state on by d seconds of the phase it is in."""
        law, s, s_then, b = self.law, self._axial(), self._axial(d), self._angular()
        if self._phase is Phase.FLIGHT:
            fall = s_then[0] - s[0] - s[1] * d
            self._gap += self._u * d - law.g * d * d / 2 - fall
            self._u += s[1] - s_then[1] - law.g * d
            for k in (0, 1):
                self._sensitivity[0][k] += float(d) * self._sensitivity[1][k]
        if self._phase is Phase.STICKING:
            b_then = self._angular(d)
            self._angle += b_then[0] - b[0]
            self._omega = b_then[1]
        else:
            drive = self._sign * law.grip if self._phase is Phase.SLIDING else arb(0)
            swing = drive * (s_then[0] - s[0] - s[1] * d)
            self._angle += self._omega * d - (drive * law.g + law.lag) * d * d / 2 - swing
            self._omega -= (drive * law.g + law.lag) * d + drive * (s_then[1] - s[1])
        self._known, self._slips_from_stick = (self._gap, self._u), False
        self._platform, self._time = self._platform.moved(d), time

    def _resolve(self, kind: EventKind) -> None:
        if kind is EventKind.IMPACT:
            self._gap = arb(0)
            self._impact()
        elif kind is EventKind.SEPARATION:
            self._sharpen()
            self._phase, self._sign, self._known = Phase.FLIGHT, arb(0), (arb(0),) * 3
            self._sensitivity = [[0.0, 0.0], [0.0, 0.0]]
            self._is_listed, self._hardest = True, 0.0
            self._keep(kind, self._velocity(), self._omega, math.nan)
        else:
            self._omega = self._angular()[1]
            is_slip = kind is EventKind.SLIP
            self._touch(arb(0), slips=is_slip)
            self._keep(kind, self._velocity(), self._omega, math.nan)

    def _sharpen(self) -> None:
        """Put the exact phase of separation, sin τ = g/(Aω²), in place of the ball around it.

        Without this the width of a chatter's end would stay in all that follows.
        """
        if len(self._motions) > 1 or self._motions[0][1].axial is not None:
            return
        amplitude, rate = arb(self._motions[0][1].a), self._platform.rate(arb(0))
        ball, turn = self._platform.phase(arb(0)), 2 * arb.pi()
        phase = (self.law.g / (amplitude * rate * rate)).asin()
        phase += turn * round(float((ball - phase) / turn))
        assert ball.overlaps(phase)
        self._time, self._platform = phase / rate, self._from(0, phase)

    # the law of impacts

    def _impact(self) -> None:
        law, w, omega = self.law, self._u, self._omega
        s, b = self._axial(), self._angular()
        before, slip = s[1] + w, omega - b[1]
        condition = self._through_impact(float(w), float(law.g + s[2]))
        self._u = -law.restitution * w
        most = law.grip * (1 + law.restitution) * abs(w)
        if law.grip > 0 and not _is_zero(slip):
            sticks = _decided(bool(abs(slip) <= most), bool(abs(slip) > most), "slip or stick")
            self._omega = b[1] if sticks else omega - most * _sign_of(slip)
            slip = arb(0) if sticks else self._omega - b[1]
        self._hardest = max(self._hardest, -float(w))
        self._is_listed &= not -float(w) < LISTED_PART * self._hardest
        if self._is_listed:
            self._keep(EventKind.IMPACT, before, omega, condition)
        self._known = (arb(0), self._u)
        if _is_zero(self._u):
            self._touch(slip)
            self._keep(EventKind.CONTACT, self._velocity(), self._omega, math.nan)
        elif self._u < _TAIL_SPEED and (lasts := self._tail()) is not None:
            if not (_is_zero(slip) and _is_zero(law.lag)):
                raise UndecidedError("friction over the tail of a chatter")
            self._phase, self._sign = Phase.SLIDING, arb(0)  # moves the angle at a steady rate
            self._go(lasts, self._time + lasts)
            self._gap, self._u = arb(0), arb(0)
            self._touch(arb(0))
            self._keep(EventKind.CONTACT, self._velocity(), self._omega, math.nan)

    def _through_impact(self, w: float, load: float) -> float:
        """Take the sensitivity through an impact; the condition number of its time."""
        epsilon = float(self.law.restitution)
        (g0, g1), (v0, v1) = self._sensitivity
        times = [-g0 / w, -g1 / w]
        speeds = [v0 - load * times[0], v1 - load * times[1]]
        u = -epsilon * w
        self._sensitivity = [
            [-u * t for t in times],
            [-epsilon * v + load * t for v, t in zip(speeds, times, strict=True)],
        ]
        unit = 2.0 * math.pi  # ω, rad/s
        g = float(self.law.g)
        return math.hypot(times[0] * unit * g / unit**2, times[1] * unit * g / unit)

    def _tail(self) -> arb | None:
        """How long the rest of a chatter lasts; None: not surely complete."""
        law, u = self.law, self._u
        load = law.g + self._axial()[2]
        about = float((2 * u / (load * (1 - law.restitution))).upper())
        tail = chatter_tail(self._platform, law.restitution, law.g, law.lag, u, about)
        return None if tail is None else tail.closed_form * (1 + arb(0, tail.remainder))

    # contact

    def _touch(self, slip: arb, *, slips: bool = False) -> None:
        """Contact, or flight without gap and speed, from here on (rules 1 and 4).

        `slips`: sticking has just become impossible.
        """
        law, s, b = self.law, self._axial(), self._angular()
        load, needed = law.g + s[2], b[2] + law.lag
        if not _decided(bool(load > 0), bool(load < 0), "contact or flight"):
            self._phase, self._known = Phase.FLIGHT, (arb(0), arb(0))
            self._sensitivity = [[0.0, 0.0], [0.0, 0.0]]
            return
        most = law.grip * load
        if not law.grip > 0:
            self._phase, self._sign = Phase.SLIDING, arb(0)
        elif not _is_zero(slip):
            self._phase, self._sign = Phase.SLIDING, _sign_of(slip)
        elif not slips and _decided(
            bool(abs(needed) < most), bool(abs(needed) > most), "stick or slip"
        ):
            self._phase, self._sign = Phase.STICKING, arb(0)
        else:
            self._phase, self._sign = Phase.SLIDING, -_sign_of(needed)
            self._slips_from_stick = True
        if self._phase is Phase.SLIDING and not _is_zero(self._sign) and _is_zero(slip):
            self._slips_from_stick = True

    def _at_boundary(self, ns: int) -> None:
        """Take the inputs of an instant."""
        self._time = arb(ns) / NS
        self._platform = self._from(ns, self._platform.phase(arb(0)))
        for at, axial, angular in self._impulses:
            if at == ns:
                self._push(arb(axial), arb(angular))

    def _push(self, axial: arb, angular: arb) -> None:
        law, before, omega = self.law, self._velocity(), self._omega
        self._u += axial / law.mass
        self._omega += angular / law.inertia
        self._known, self._is_listed, self._hardest = (self._gap, self._u), True, 0.0
        self._keep(EventKind.IMPULSE, before, omega, math.nan)
        if self._phase is not Phase.FLIGHT:
            self._phase, self._sign = Phase.FLIGHT, arb(0)
            self._sensitivity = [[0.0, 0.0], [0.0, 0.0]]
            if self._u < 0:
                self._impact()

    def _keep(self, kind: EventKind, before: arb, omega: arb, condition: float) -> None:
        position = self._axial()[0] + self._gap
        after = self._velocity()
        row = Enclosed(
            kind, self._time, position, before, after, self._angle, omega, self._omega, condition
        )
        self._events.append(row)


def _sign_of(x: arb) -> arb:
    return arb(1 if _decided(bool(x > 0), bool(x < 0), "the sign of a slip") else -1)


def enclose(case: Case) -> list[Enclosed]:
    """The events of a case, each number enclosed in a ball; UndecidedError where balls overlap."""
    for precision in PRECISIONS:
        with ctx.workprec(precision), suppress(UndecidedError):
            return Enclosure(case).run()
    with ctx.workprec(2 * PRECISIONS[-1]):
        return Enclosure(case).run()
