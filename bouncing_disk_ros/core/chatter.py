"""Complete chattering in closed form, with its friction (model: phase 2, rules 7 and 8)."""

from __future__ import annotations

import math

from bouncing_disk_ros.core.arithmetic import sincos
from bouncing_disk_ros.core.brake import STOPPED_TAIL, braked_spin, chatter_drag, sign_of
from bouncing_disk_ros.core.compilation import kernel, rare_kernel
from bouncing_disk_ros.core.flight import Launch, gap_after
from bouncing_disk_ros.core.platform import (
    Jet,
    Record,
    angular_jet,
    axial_jet,
    phase_advance,
    turns_not,
)
from bouncing_disk_ros.core.roots import INSTANT, ROUNDING

UNDECIDED, ALL_SLIP, ALL_STICK = 0, 1, 2
BOUNCES, COMPLETES, STILL = 0, 1, 2
# A completion is taken only where what its series leaves out moves the forcing phase by less than
# this, rad.
_PHASE_ROUNDING = ROUNDING
# A bounce that lasts less than this (rad) ends at the instant at which it begins, to rounding: it
# is contact. With ε = 1 bounces that short would follow one another without end.
_NO_BOUNCE = 2.0 * math.pi * INSTANT
SLOW = 1e-2
"""A disk that leaves the platform with u > SLOW·a/ω bounces: T ω is far from small."""
# Longer than this (rad) β̈ is not constant enough: its change enters the friction sums by the cube.
_STRAIGHT = 4e-6
# Up to here (rad) the series of β̇ is exact to rounding with its first four derivatives.
_TAYLOR = 1e-3
# Over a completion a and ρ vary by less than this part: the friction case is decided outside it.
_MARGIN = 1e-3
_DECIDED = 1.0 + _MARGIN
SHOWN_BOUNCES = 10_000
"""Of a chatter in closed form, that one sample resolves."""
_ALL_BOUNCES = 29.0  # over 1 − ε: so many take u from SLOW·a/ω to where a bounce is STILL


@kernel
def chatter_duration(motion: Record, disk: Record, s: Jet, u: float) -> tuple[float, bool]:
    """Time from an impact (post-impact relative speed u > 0) to the end of its complete chatter, s.

    T = T₀ − s⃛T₀²/(3a) + …, T₀ = 2u/(a(1 − ε)). The second value says whether that is exact to
    rounding. For most that are not, T₀ alone is returned.
    """
    a = disk.g + s[2]
    if a <= 0.0 or disk.restitution >= 1.0:
        return 0.0, False
    t = 2.0 * u / (a * (1.0 - disk.restitution))
    turning = disk.grip > 0.0 and motion.b2 > 0.0 and t * motion.omega_max > _STRAIGHT
    if turning:
        return t, False
    x = abs(s[3]) * t / a
    y = motion.s4 * t * t / a
    exact = x < _MARGIN and y < _MARGIN and (x * x + y) * t * motion.omega_max <= _PHASE_ROUNDING
    return t - s[3] * t * t / (3.0 * a), exact


@kernel
def chatter_end(motion: Record, disk: Record, s: Jet, u: float) -> tuple[int, float]:
    """Whether a disk that leaves the platform with u > 0 chatters to its end, and how long, s.

    BOUNCES: the next impact is to be found by itself; COMPLETES: the rest of the chatter may be
    taken in closed form; STILL: the bounce is too short to have a duration.
    """
    a = disk.g + s[2]
    # cheap refusal, of all but the last bounces
    if a <= 0.0 or u * motion.omega_max > SLOW * a:
        return BOUNCES, 0.0
    if 2.0 * u * motion.omega_max <= _NO_BOUNCE * a:
        return STILL, 0.0
    t, exact = chatter_duration(motion, disk, s, u)
    return (COMPLETES if exact else BOUNCES), t


@kernel
def shows_all(disk: Record) -> bool:
    """Whether a sample within a chatter in closed form can resolve the bounces up to its instant.

    Else it would show contact where a disk with ε next to 1 still bounces.
    """
    shown: bool = (1.0 - disk.restitution) * SHOWN_BOUNCES >= _ALL_BOUNCES
    return shown


@kernel
def chatter_verdict(
    motion: Record,
    disk: Record,
    drag: float,
    elapsed: float,
    sine: float,
    cosine: float,
    s: Jet,
    u: float,
    omega: float,
) -> tuple[int, float, float]:
    """`chatter_end` with friction, which must be decided too; and the sign of w_T (0: sticks).

    `drag` is what load and brake take from α̇ in flight, rad/s².
    """
    end, t = chatter_end(motion, disk, s, u)
    if end != COMPLETES:
        return end, t, 0.0
    b = angular_jet(motion, sine, cosine, elapsed)
    rho = b[2] + drag
    total = tail_push(u, disk.restitution)
    friction, sign = chatter_friction(disk, disk.g + s[2], rho, omega - b[1], total, t)
    if friction == UNDECIDED:
        return BOUNCES, t, 0.0
    return COMPLETES, t, 0.0 if friction == ALL_STICK else sign


@kernel
def tail_push(u: float, restitution: float) -> float:
    """Sum of the axial impulses over m of a whole chatter tail after an impact with u."""
    return u * (1.0 + restitution) / (1.0 - restitution)


@kernel
def chatter_sums(disk: Record, s: Jet, u: float) -> tuple[float, float]:
    """Σ F̂ₙ(tₙ − t₀) over m and Σ dₙ² of a whole chatter tail with flights dₙ = εⁿ 2u/a."""
    e = disk.restitution
    d0 = 2.0 * u / (disk.g + s[2])
    return u * d0 / ((1.0 - e) * (1.0 - e)), d0 * d0 / (1.0 - e * e)


@rare_kernel
def first_of_chatter(
    motion: Record,
    disk: Record,
    elapsed: float,
    tau: float,
    sine: float,
    cosine: float,
    u: float,
    omega: float,
) -> tuple[float, float]:
    """w_A and w_T of the first impact of a complete chatter, whose flight begins with u."""
    s = axial_jet(motion, sine, cosine, elapsed)
    d, w = 2.0 * u / (disk.g + s[2]), -u
    launch = Launch(elapsed, sine, cosine, disk.g, 0.0, u)
    for _ in range(3):  # the first guess is good to 1e-3, each step doubles its digits
        jet = gap_after(motion, launch, d)
        w = jet[1]
        d -= jet[0] / w
    b = angular_jet(motion, sine, cosine, elapsed)
    slip = omega - b[1]
    if disk.brake > 0.0:
        slip += braked_spin(omega, disk, d)[1] - omega
    else:
        slip -= disk.lag * d
    if d * motion.omega_max > _TAYLOR:
        then = sincos(tau + phase_advance(motion, elapsed, d))
        return w, slip - (angular_jet(motion, then[0], then[1], elapsed + d)[1] - b[1])
    return w, slip - d * (b[2] + d * (b[3] / 2.0 + d * b[4] / 6.0))


@kernel
def chatter_rotation(
    disk: Record,
    drag: float,
    sign: float,
    omega: float,
    b: Jet,
    b_end: Jet,
    push: float,
    sums: tuple[float, float],
    t: float,
) -> tuple[float, float]:
    """Angle turned in a whole chatter tail that lasts t, and α̇ at its end.

    `sign` as `chatter_verdict` gives it, b and b_end the platform's rotation at both ends, `push`
    Σ F̂ over m, `sums` those of `chatter_sums`.
    """
    moment, squares = sums
    if sign == 0.0:
        return b_end[0] - b[0] - 0.5 * (b[2] + drag) * squares, b_end[1]
    turned = (omega - 0.5 * drag * t) * t - sign * disk.grip * moment * disk.restitution
    return turned, omega - sign * disk.grip * push - drag * t


@kernel
def chatter_scale(restitution: float) -> float:
    """What `may_end` takes: `chatter_duration` is exact only for u³(s⃛² + s⁗a) ≤ scale·a⁵, ω = 1.

    From t = 2u/(a(1 − ε)) and t³(s⃛² + s⁗a)/a² ≤ rounding; rounded up.
    """
    part = 0.5 * (1.0 - restitution)
    return _PHASE_ROUNDING * part * part * part * (1.0 + 1e-9)


@kernel
def may_end(a: float, jerk: float, s4: float, u: float, scale: float) -> bool:
    """Whether `chatter_end` may answer other than BOUNCES, without a division or branch; ω = 1.

    What is exact is far below the u ≤ a/100 that `chatter_end` asks for; where it is not, for next
    to no forcing, this answers yes too often.
    """
    p = max(a, 0.0)
    v = u - _NO_BOUNCE * p
    pp = p * p
    return v * v * v * (jerk * jerk + s4 * p) <= scale * (pp * pp * p)


@kernel
def chatter_friction(
    disk: Record, a: float, rho: float, slip: float, total: float, t: float
) -> tuple[int, float]:
    """How friction acts in a whole chatter tail, and the sign of w_T where all its impacts slip.

    `total` is the sum of the axial impulses over m. ALL_STICK: slip is 0 and each impact takes
    away what one flight brings. ALL_SLIP: the sign lasts. UNDECIDED: the sign changes or the first
    stick is still to come.
    """
    if disk.grip == 0.0:
        return ALL_SLIP, 1.0 if slip >= 0.0 else -1.0
    limit = disk.grip * a * 0.5 * (1.0 + disk.restitution)
    if slip == 0.0:
        if abs(rho) <= limit * (1.0 - _MARGIN):
            return ALL_STICK, 0.0
        if abs(rho) >= limit * (1.0 + _MARGIN):
            return ALL_SLIP, -1.0 if rho > 0.0 else 1.0
        return UNDECIDED, 0.0
    sign = 1.0 if slip > 0.0 else -1.0
    if abs(slip) > (disk.grip * total + abs(rho) * t) * (1.0 + _MARGIN):
        return ALL_SLIP, sign
    return UNDECIDED, sign


@rare_kernel
def braked_chatter(
    motion: Record,
    disk: Record,
    elapsed: float,
    sine: float,
    cosine: float,
    s: Jet,
    u: float,
    omega: float,
) -> tuple[int, float, float]:
    """`chatter_verdict` with a brake: completed only where the brake's part is decided.

    The disk keeps its direction; or it stops in this flight and in each that follows (the sign is
    STOPPED_TAIL times that of the slip); or neither it nor the platform turns.
    """
    end, t = chatter_end(motion, disk, s, u)
    if end != COMPLETES:
        return end, t, 0.0
    b = angular_jet(motion, sine, cosine, elapsed)
    a, e = disk.g + s[2], disk.restitution
    total = tail_push(u, e)
    drag = chatter_drag(disk, omega)
    spin, side = sign_of(omega), -sign_of(b[1])
    most = disk.grip * (1.0 + e) * u  # change of α̇ in the first impact to come
    first = (disk.brake + disk.lag * spin) * 2.0 * u / a  # what the flight before it can take
    stops = (
        side != 0.0
        and abs(disk.lag) <= disk.brake
        and abs(omega) * _DECIDED <= first
        and most * a * _DECIDED <= (disk.brake - disk.lag * side) * 2.0 * e * u
        and abs(b[1]) > (abs(b[2]) * t + most + abs(omega)) * _DECIDED
    )
    if stops:
        return COMPLETES, t, STOPPED_TAIL * side
    if omega == 0.0 and not turns_not(motion):
        return BOUNCES, t, 0.0
    friction, sign = chatter_friction(disk, a, b[2] + drag, omega - b[1], total, t)
    if friction == UNDECIDED:
        return BOUNCES, t, 0.0
    if omega == 0.0:
        return COMPLETES, t, 0.0 if friction == ALL_STICK else sign
    slows = max(drag * spin, 0.0)
    if friction == ALL_STICK:
        lasts = abs(omega) > (abs(b[2]) + abs(drag)) * t * _DECIDED
        return (COMPLETES if lasts else BOUNCES), t, 0.0
    if sign == spin:  # friction slows the disk
        lasts = abs(omega) > (disk.grip * total + slows * t) * _DECIDED
    else:  # each impact gives more than the next flight takes, or all flights together too little
        grows = disk.grip * (1.0 + e) * a > slows * 2.0 * e * _DECIDED
        lasts = abs(omega) > slows * t * _DECIDED or (
            grows and abs(omega) > max(first, 0.0) * _DECIDED
        )
    return (COMPLETES if lasts else BOUNCES), t, sign
