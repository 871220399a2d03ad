"""Proof of single tosses: sticking and sliding on a steady platform until it falls away.

The referee follows the contact by itself: each stretch of contact ends at the first zero, enclosed
in a ball, of what can end it, and the next begins there. Speed, delay and both works of the toss
are compared with those that are reported.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from flint import arb, ctx

from bouncing_disk_ros.core.model import Phase
from bouncing_disk_ros.proof.event_functions import (
    HALF_ULP,
    ROUNDINGS,
    Watched,
    load_of,
    margin_of,
    slip_from,
)
from bouncing_disk_ros.proof.exact_records import (
    DiskRecord,
    MotionRecord,
    Outcome,
    State,
    Verdict,
    compared,
)
from bouncing_disk_ros.proof.platforms import SteadyPlatform
from bouncing_disk_ros.proof.positivity import Found, Zero, first_zero, opens

SLID, STUCK, NONE, STAYS = 0, 1, 2, 3
"""How a toss ended: separation while sliding, while sticking, at once; not at all."""

_LAST_SLIP = 1e-8
_PRECISION = 192
_MOST_STRETCHES = 1000


class Toss(NamedTuple):
    """A start in contact with a steady motion, and what is said to come of it."""

    motion: MotionRecord
    disk: DiskRecord
    forcing_phase: float  # rad, at the start
    start_speed: float  # α̇, rad/s
    code: int
    speed: float  # α̇ at separation, rad/s
    delay: float  # s
    work_axial: float  # ∫N ṡ dt over m, m²/s²
    work_angular: float  # ∫M β̇ dt over m a_g², rad²/s²


class UndecidedError(Exception):
    """Rounding decides how the toss goes on."""


def prove_toss(toss: Toss) -> Verdict:
    """Prove or refute one toss."""
    with ctx.workprec(_PRECISION):
        try:
            return _TossProof(toss).verdict()
        except UndecidedError as reason:
            return Verdict(Outcome.UNDECIDED, str(reason))


class _TossProof:
    """The disk on the platform, from the start of a toss to its separation."""

    def __init__(self, toss: Toss) -> None:
        state = State(0, 0.0, 0, toss.forcing_phase, Phase.SLIDING, 0.0, 0.0, 0.0, toss.start_speed)
        self.toss, self.disk = toss, toss.disk
        self.start = self.platform = SteadyPlatform(toss.motion, state)
        self.rate = self.platform.rate(arb(0))
        self.omega = arb(toss.start_speed)
        self.passed = arb(0)  # since the start, s
        self.work = arb(0)  # ∫M β̇ dt over m a_g²
        self.rounding = abs(toss.start_speed)  # what α̇ is made of, rad/s
        self.pieces = 0

    def verdict(self) -> Verdict:
        """Follow the contact to the separation, and compare."""
        leave = self._separation()
        load = load_of(self.platform, self.disk)
        at_start = load.jet(arb(0))[0]
        if leave is None:
            return self._expect(STAYS)
        if abs(at_start) <= load.tolerance(0.0):
            raise UndecidedError("the load at the start is zero within its rounding")
        if at_start < 0:
            return self._compare(NONE, arb(0))
        sign = self._start_sign()
        for _ in range(_MOST_STRETCHES):
            left = leave - self.passed
            ended = self._stick(left) if sign == 0.0 else self._slide(sign, left)
            if ended is None:
                return self._compare(STUCK if sign == 0.0 else SLID, leave)
            sign = ended
        raise UndecidedError(f"more than {_MOST_STRETCHES} stretches of contact")

    def _separation(self) -> arb | None:
        """Time from the start to the separation, sin τ = g/(Aω²); None: there is none."""
        part = arb(self.disk.g) / (arb(self.toss.motion.a) * self.rate * self.rate)
        if abs(part - 1) < 64 * HALF_ULP:
            raise UndecidedError("the load touches zero within its rounding")
        if part > 1:
            return None
        turn = arb.pi() * 2
        ahead = (part.asin() - arb(self.toss.forcing_phase)) / turn
        return (ahead - ahead.floor().mid()) * turn / self.rate

    def _start_sign(self) -> float:
        """Sign of the slip at the start; 0: the disk sticks."""
        slip = slip_from(self.platform, self.omega, 1.0, self.disk, self.rounding)
        value = slip.start()[0]
        if abs(value) <= slip.tolerance(0.0):
            return self._rule_4()
        return 1.0 if value > 0 else -1.0

    def _rule_4(self) -> float:
        """Whether a disk without slip sticks (0), or the sign with which it slides."""
        if self.disk.grip > 0.0:
            margins = [margin_of(self.platform, self.disk, sign) for sign in (1.0, -1.0)]
            values = [margin.jet(arb(0))[0] for margin in margins]
            if any(
                abs(value) <= margin.tolerance(0.0)
                for margin, value in zip(margins, values, strict=True)
            ):
                raise UndecidedError("sticking is as strong as friction can be, within rounding")
            if all(value > 0 for value in values):
                return 0.0
        torque = self.platform.mix(arb(0), arb(1)).jet(arb(0))[2] + self.disk.lag
        if not (torque > 0 or torque < 0):
            raise UndecidedError("no torque decides the sign of the slip")
        return -1.0 if torque > 0 else 1.0

    def _stick(self, left: arb) -> float | None:
        """Stick until a slip begins; its sign, or None: until the separation."""
        last = float(left) - _LAST_SLIP / float(self.rate)
        zeros = {}
        for sign in (1.0, -1.0):
            zero = self._zero(margin_of(self.platform, self.disk, sign), last)
            if zero is not None:
                zeros[float(zero)] = (-sign, zero)
        spin = self.platform.mix(arb(0), arb(1))
        before = spin.jet(arb(0))
        ended: float | None = None
        d = left
        if zeros:
            ended, d = zeros[min(zeros)]
        after = spin.jet(d)
        change = (after[1] + before[1]) * (after[1] - before[1]) / 2
        self.work += change + self.disk.lag * (after[0] - before[0])
        self.omega = after[1]
        self._move(d)
        self.rounding = self.toss.motion.p * float(self.rate) * (8.0 + self._turn())
        return ended

    def _slide(self, sign: float, left: arb) -> float | None:
        """Slide until w_T = 0; how it goes on there, or None: until the separation."""
        slip = slip_from(self.platform, self.omega, sign, self.disk, self.rounding)
        stop = self._zero(slip, float(left)) if self.disk.grip > 0.0 else None
        d = left if stop is None else stop
        axial, spin = self.platform.mix(arb(1), arb(0)), self.platform.mix(arb(0), arb(1))
        pushed = self.disk.g * d + axial.jet(d)[1] - axial.jet(arb(0))[1]
        self.work -= sign * self.disk.grip * self._load_on_spin(d)
        self.rounding += float(abs(pushed).upper()) * self.disk.grip
        self.rounding += self.disk.grip * self.disk.g * float(d)
        self.omega -= sign * self.disk.grip * pushed + self.disk.lag * d
        if stop is not None:
            self.omega = spin.jet(d)[1]
        self._move(d)
        return None if stop is None else self._rule_4()

    def _load_on_spin(self, d: arb) -> arb:
        """∫(g + s̈)β̇ dt over the next d seconds, from sin φ cos(φ + θ) = (sin(2φ + θ) − sin θ)/2."""
        m, spin = self.toss.motion, self.platform.mix(arb(0), arb(1))
        begin, end = self.platform.phase(arb(0)), self.platform.phase(d)
        lag = arb(m.lag)
        mean = ((2 * begin + lag).cos() - (2 * end + lag).cos()) / 4 - (end - begin) * lag.sin() / 2
        swing = arb(m.a) * self.rate * self.rate * arb(m.p)
        return self.disk.g * (spin.jet(d)[0] - spin.jet(arb(0))[0]) - swing * mean

    def _zero(self, watched: Watched, last: float) -> arb | None:
        """The first zero before `last`; None: there is none."""
        first = opens(watched, last, float(self.rate)) if last > 0.0 else None
        if first is None:
            if last * float(self.rate) < 1e-7:
                raise UndecidedError("a stretch of contact within rounding of the separation")
            raise UndecidedError("what is watched begins at zero within rounding")
        zero: Zero = first_zero(watched, first, last, watched.floor_zeros())
        self.pieces += zero.pieces
        if zero.found is Found.UNKNOWN:
            raise UndecidedError(f"a graze at {float(self.passed + zero.at)!r} s within rounding")
        return zero.at if zero.found is Found.ZERO else None

    def _turn(self) -> float:
        return float(self.rate * self.passed)

    def _move(self, d: arb) -> None:
        self.platform = self.platform.moved(d)
        self.passed += d

    def _expect(self, code: int) -> Verdict:
        if code == self.toss.code:
            return Verdict(Outcome.PROVED, "", 0.0, self.pieces)
        reason = f"the toss ends with code {self.toss.code}, proved is {code}"
        return Verdict(Outcome.REFUTED, reason, 0.0, self.pieces)

    def _compare(self, code: int, leave: arb) -> Verdict:
        """Compare the reported numbers with those found here."""
        expected = self._expect(code)
        if expected.outcome is not Outcome.PROVED:
            return expected
        m, toss, w = self.toss.motion, self.toss, float(self.rate)
        unit = ROUNDINGS * HALF_ULP
        turn = 2.0 * math.pi + w * float(leave)
        axial = self.start.mix(arb(1), arb(0))
        end, begin = axial.jet(leave), axial.jet(arb(0))
        lifted = self.disk.g * (end[0] - begin[0]) + (end[1] * end[1] - begin[1] * begin[1]) / 2
        steep = abs(end[0] / end[1]) * self.rate if end[1] != 0 else arb(0)
        speed = unit * (self.rounding + m.p * w * (2.0 + turn) + self.disk.grip * m.a * w * turn)
        spin = m.p * w * (2.0 + turn)
        strength = self.disk.grip * (self.disk.g + m.a * w * w) * float(leave) + self.rounding
        for name, reported, proved, allowed in (
            ("delay", toss.delay, leave, unit * (turn + float(steep.upper())) / w),
            ("speed", toss.speed, self.omega, speed),
            (
                "axial work",
                toss.work_axial,
                lifted,
                unit * (2.0 * self.disk.g * m.a + m.a * w * m.a * w * turn),
            ),
            ("angular work", toss.work_angular, self.work, unit * spin * (strength + spin)),
        ):
            found = compared(proved - arb(reported), allowed, f"the {name} {reported!r}")
            if found.outcome is not Outcome.PROVED:
                return found._replace(pieces=self.pieces)
        return Verdict(Outcome.PROVED, "", speed, self.pieces)
