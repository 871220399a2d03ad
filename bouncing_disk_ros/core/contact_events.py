"""Contact: when the disk leaves, sticks, slips and stops slipping (model: phases 3 and 4).

With a = g + s̈ (the normal force over the mass) and ρ = β̈ + drag (the torque that sticking needs
over the moment of inertia), friction can supply up to `grip`·a. The drag is what the load, and a
brake while α̇ keeps its sign, take from α̇, rad/s². The functions watched are each positive until
their event and searched with steps that cannot pass the first root.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from bouncing_disk_ros.core.arithmetic import TWO_PI, sincos, wrapped
from bouncing_disk_ros.core.brake import tie
from bouncing_disk_ros.core.compilation import kernel, rare_kernel
from bouncing_disk_ros.core.flight import (
    SEARCH_STEPS,
    Launch,
    gap_after,
    never_leaves,
    separation_phase,
)
from bouncing_disk_ros.core.layout import FADE, NOTHING, STEADY, WAYPOINT, NextEvent, Slide
from bouncing_disk_ros.core.platform import (
    Bounds,
    Jet,
    Record,
    angular_jet,
    axial_jet,
    blend_jet,
    bounds_from,
    frequency_at,
    phase_advance,
)
from bouncing_disk_ros.core.roots import ROUNDING, parabola_root

ONE_PERIOD = 1.0625  # and a bit: a steady motion that has no zero in it has none
# Of numpy's type: numba compiles a search again for each literal number of Python's.
LOAD, MARGIN, SLIPPING, DRIVE, UNLOAD, TURNING, SPINNING, SPIN_DRIVE, HOLD = np.arange(9)
Slip = tuple[float, float, float, float]  # sign·w_T, β̇, sin τ, cos τ where a slip begins
NO_SLIP = (0.0, 0.0, 0.0, 0.0)


@kernel
def load(motion: Record, g: float, s: Jet) -> tuple[float, bool]:
    """a = g + s̈, and whether a disk with gap = 0 and u = 0 is in contact, not in flight (rule 1).

    `s` is the platform's position with its derivatives.
    """
    a = g + s[2]
    if never_leaves(motion, g):
        return max(a, 0.0), True
    return a, not (a < 0.0 or (a == 0.0 and (s[3] < 0.0 or (s[3] == 0.0 and s[4] < 0.0))))


@kernel
def watched(
    which: int,
    sign: float,
    motion: Record,
    disk: Record,
    drag: float,
    elapsed: float,
    tau: float,
    slip: Slip,
    d: float,
) -> tuple[float, float]:
    """A watched function and its derivative d seconds after (elapsed, tau).

    LOAD a; UNLOAD −a; MARGIN grip·a − sign·ρ; SLIPPING sign·w_T of a disk that slides with this
    sign; DRIVE its derivative −grip·a − sign·ρ. `slip` describes the start of a slip. With a brake:
    TURNING sign·β̇; SPINNING sign·α̇ of a sliding disk, SPIN_DRIVE its derivative, HOLD what the
    brake has left: for these `slip` begins with the speed, or the most that the brake can hold, and
    the sign of friction. MARGIN and TURNING are raised by the first of `slip`.
    """
    sine, cosine = sincos(tau + phase_advance(motion, elapsed, d))
    _, _, s2, s3, _ = axial_jet(motion, sine, cosine, elapsed + d)
    a = disk.g + s2
    if which == LOAD:
        return a, s3
    if which == UNLOAD:
        return -a, -s3
    w, spin, s, c = slip
    if which == HOLD:
        return w - sign * (drag + spin * disk.grip * a), -sign * spin * disk.grip * s3
    if which == SPIN_DRIVE:
        return -spin * disk.grip * a - sign * drag, -spin * disk.grip * s3
    if which == SPINNING:
        pushed = -gap_after(motion, Launch(elapsed, s, c, disk.g, 0.0, 0.0), d)[1]
        slowed = spin * disk.grip * a + sign * drag
        return w - spin * disk.grip * pushed - sign * drag * d, -slowed
    _, b1, b2, b3, _ = angular_jet(motion, sine, cosine, elapsed + d)
    if which == TURNING:
        return sign * b1 + w, sign * b2
    rho = b2 + drag
    if which == MARGIN:
        return disk.grip * a - sign * rho + w, disk.grip * s3 - sign * b3
    if which == DRIVE:
        return -disk.grip * a - sign * rho, -disk.grip * s3 - sign * b3
    # ∫a dt as the slope of a gap: a strong grip must not magnify the rounding of ṡ
    pushed = -gap_after(motion, Launch(elapsed, s, c, disk.g, 0.0, 0.0), d)[1]
    return w - disk.grip * pushed - sign * (b1 - spin + drag * d), -disk.grip * a - sign * rho


@kernel
def _curvature(which: int, over: Bounds, disk: Record) -> float:
    """Bound of the second derivative of a watched function."""
    if which in (LOAD, UNLOAD):
        return over.s4
    if which == SLIPPING:
        return disk.grip * over.s3 + over.b3
    if which == TURNING:
        return over.b3
    if which == SPINNING:
        return disk.grip * over.s3
    if which in (SPIN_DRIVE, HOLD):
        return disk.grip * over.s4
    return disk.grip * over.s4 + over.b4


@kernel
def _since_event(motion: Record, elapsed: float) -> float:
    """A bound of the time from which the event at `elapsed` was found: 4096 steps before it, s.

    A step in a cross-fade is at most a period of the moment.
    """
    if motion.kind == STEADY:
        return 0.0
    return min(elapsed, SEARCH_STEPS / frequency_at(motion, elapsed))


@kernel
def _rounding(
    which: int, over: Bounds, motion: Record, disk: Record, drag: float, elapsed: float
) -> float:
    """Below minus this a drive pushes against the sign at which its search begins.

    Up to this it may be off, as drive, phase and instant are rounded. `over`: the bounds at that
    instant, not of a whole cross-fade.
    """
    if which not in (DRIVE, SPIN_DRIVE):
        return math.inf
    value = disk.grip * (disk.g + over.s2) + over.b2 + abs(drag)
    change = disk.grip * over.s3 + over.b3
    return 64.0 * ROUNDING * (8.0 * value + change * _since_event(motion, elapsed))


@rare_kernel
def turning_rounding(motion: Record, over: Bounds, elapsed: float) -> float:
    """What β̇ may be off by where it is 0, as β̇, phase and instant are rounded.

    Where an offset turns the platform too, it is as fast there as the sinusoid. An amplitude that
    fades is rounded on the scale of the larger one, as its bounds are.
    """
    blend, rate = 0.0, 0.0
    if motion.kind == FADE:
        x = (elapsed + motion.fade_lead) / motion.duration
        blend, rate, _, _, _ = blend_jet(x, motion.duration)
    spin = TWO_PI * (motion.f + motion.df * blend) + abs(motion.dlag) * rate
    speed = max(motion.p, motion.p + motion.dp) * spin + abs(motion.dp) * rate
    return 16.0 * ROUNDING * (speed + over.b2 * _since_event(motion, elapsed))


@kernel
def _raised(which: int, slip: Slip, motion: Record, over: Bounds, elapsed: float) -> Slip:
    """`slip` of `watched`; of TURNING, by which it is raised where these bounds hold."""
    if which != TURNING:
        return slip
    return turning_rounding(motion, over, elapsed), 0.0, 0.0, 0.0


class Search(NamedTuple):
    """What a search for a zero found: `zero` is inf if there is none up to `reached`."""

    zero: float
    reached: float  # the horizon, or less where the steps of one search were used up; s
    steps: int


@rare_kernel
def first_zero(
    which: int,
    sign: float,
    motion: Record,
    disk: Record,
    drag: float,
    elapsed: float,
    tau: float,
    slip: Slip,
    begin: float,
    horizon: float,
) -> Search:
    """Delay after `begin` at which a watched function falls through zero.

    A value that touches zero and rises again is no event. Where the function is negative at
    `begin`, that is rounding, and it counts as 0; but a drive that is clearly negative is an event.
    """
    d = begin
    over = bounds_from(motion, elapsed, d)
    curvature = _curvature(which, over, disk)
    slip = _raised(which, slip, motion, over, elapsed + d)
    touching = 1e-9  # rad
    for i in range(SEARCH_STEPS):
        if d > horizon:
            return Search(math.inf, horizon, i)
        if d >= over.until:
            over = bounds_from(motion, elapsed, d)
            curvature = _curvature(which, over, disk)
            slip = _raised(which, slip, motion, over, elapsed + d)
        f, f1 = watched(which, sign, motion, disk, drag, elapsed, tau, slip, d)
        if f <= 0.0:
            if f1 < 0.0 or f < -_rounding(which, over, motion, disk, drag, elapsed + d):
                return Search(d, d, i)
            f = 0.0
        if curvature == 0.0 and f1 >= 0.0:
            if over.until == math.inf:
                return Search(math.inf, horizon, i)
            d = over.until
            continue
        if f == 0.0 and f1 == 0.0:
            d += touching / motion.omega_max
            touching *= 2.0
            continue
        step = parabola_root(f, f1, curvature)
        if f1 < 0.0 and step <= 4.0 * ROUNDING * (d + step):
            return Search(d + step, d + step, i)
        d = min(max(d + step, d * (1.0 + 4.0 * ROUNDING)), over.until)
    return Search(math.inf, min(d, horizon), SEARCH_STEPS)


@kernel
def period_of(motion: Record) -> float:
    """Period of a steady motion, s."""
    return 1.0 / motion.f


@kernel
def separation(motion: Record, disk: Record, elapsed: float, tau: float, horizon: float) -> Search:
    """Delay of the next separation (a falls through 0)."""
    if motion.kind == STEADY:
        leave = separation_phase(motion, disk.g)
        if leave < 0.0:
            return Search(math.inf, horizon, 0)
        return Search(wrapped(leave - tau) / motion.omega, horizon, 0)
    if disk.g > motion.s2 or never_leaves(motion, disk.g):
        return Search(math.inf, horizon, 0)
    return first_zero(LOAD, 0.0, motion, disk, 0.0, elapsed, tau, NO_SLIP, 0.0, horizon)


@kernel
def load_returns(
    motion: Record, disk: Record, elapsed: float, tau: float, horizon: float
) -> Search:
    """After a launch with u = 0: delay until a rises through 0; before it the gap cannot close."""
    if motion.kind == STEADY:
        leave = separation_phase(motion, disk.g)
        if leave < 0.0:
            return Search(0.0, 0.0, 0)
        # launched at τ_sep, or later in the interval (τ_sep, π − τ_sep) where a < 0
        ahead = wrapped(math.pi - leave - tau)
        returns = min(ahead, max(math.pi - 2.0 * leave, 0.0)) / motion.omega
        return Search(returns, returns, 0)
    return first_zero(UNLOAD, 0.0, motion, disk, 0.0, elapsed, tau, NO_SLIP, 0.0, horizon)


@kernel
def stick_fails(
    motion: Record, disk: Record, drag: float, elapsed: float, tau: float, horizon: float
) -> tuple[Search, float]:
    """Delay at which |ρ| outgrows grip·a while sticking, and the sign of ρ there."""
    weakest = disk.g - motion.s2
    if motion.b2 + abs(drag) <= disk.grip * weakest + tie(disk):
        return Search(math.inf, horizon, 0), 0.0
    within = horizon
    if motion.kind == STEADY:
        within = min(horizon, ONE_PERIOD * period_of(motion))
    # with a brake an event must leave another row of `contact_table`: a tie is no end
    slack = (tie(disk) if disk.brake > 0.0 else 0.0, 0.0, 0.0, 0.0)
    up = first_zero(MARGIN, 1.0, motion, disk, drag, elapsed, tau, slack, 0.0, within)
    down = first_zero(MARGIN, -1.0, motion, disk, drag, elapsed, tau, slack, 0.0, up.reached)
    steps = up.steps + down.steps
    if down.zero < up.zero:
        return Search(down.zero, down.reached, steps), -1.0
    if up.zero <= down.reached:
        return Search(up.zero, up.reached, steps), 1.0
    reached = horizon if down.reached >= within else down.reached
    return Search(math.inf, reached, steps), 0.0


@kernel
def slip_ends(
    motion: Record,
    disk: Record,
    drag: float,
    elapsed: float,
    tau: float,
    sign: float,
    w: float,
    horizon: float,
) -> tuple[Search, int]:
    """Delay at which sliding with sign·w_T = w reaches w_T = 0, and whole periods to skip.

    A slip that begins at w = 0 is searched only from where its drive turns against it: until then
    it grows.
    """
    never = Search(math.inf, horizon, 0)
    if disk.grip == 0.0 and disk.brake == 0.0:  # where a brake acts, the sign of the slip counts
        return never, 0
    sine, cosine = sincos(tau)
    s1 = axial_jet(motion, sine, cosine, elapsed)[1]
    b1 = angular_jet(motion, sine, cosine, elapsed)[1]
    slip = (w, b1, sine, cosine)
    within = horizon
    if motion.kind == STEADY:
        skip = _periods_without_root(motion, disk, drag, sign, w + disk.grip * s1 + sign * b1)
        if skip > 0:
            return never, skip
    turns = Search(0.0, 0.0, 0)
    if w == 0.0:
        reach = min(horizon, ONE_PERIOD * period_of(motion)) if motion.kind == STEADY else horizon
        turns = first_zero(DRIVE, sign, motion, disk, drag, elapsed, tau, NO_SLIP, 0.0, reach)
        if turns.zero == math.inf:
            return (never if turns.reached >= reach else turns), 0
    if motion.kind == STEADY and disk.grip * disk.g + sign * drag <= 0.0:
        # higher after each period: now or never
        within = min(horizon, turns.zero + ONE_PERIOD * period_of(motion))
    end = first_zero(SLIPPING, sign, motion, disk, drag, elapsed, tau, slip, turns.zero, within)
    reached = horizon if end.zero == math.inf and end.reached >= within else end.reached
    return Search(end.zero, reached, turns.steps + end.steps), 0


@kernel
def _periods_without_root(
    motion: Record, disk: Record, drag: float, sign: float, start: float
) -> int:
    """Whole periods in which sign·w_T surely stays positive: slow sliding is not stepped.

    sign·w_T = start − p(τ) − r d with p a sinusoid of amplitude `swing`.
    """
    rate = (disk.grip * disk.g + sign * drag) * period_of(motion)
    if rate <= 0.0:
        return 0
    along = disk.grip * motion.a + sign * motion.p * motion.lag_cosine
    across = motion.p * motion.lag_sine
    swing = motion.omega * math.sqrt(along * along + across * across) * (1.0 + 1e-12)
    n = math.floor((start - swing) / rate) - 1.0
    if n < 4.0:
        return 0
    return int(min(n, 1e15))


@kernel
def slide(
    motion: Record, disk: Record, begin: Slide, omega: float, d: float
) -> tuple[float, float, float, float]:
    """Angle turned and α̇ after d seconds of sliding; ∫∫(g + s̈)dt dt and ∫(g + s̈)dt (phase 4).

    The integrals keep all their digits.
    """
    elapsed, _, sine, cosine, sign, drag = begin
    fall = gap_after(motion, Launch(elapsed, sine, cosine, disk.g, 0.0, 0.0), d)
    pushed, q = -fall[0], -fall[1]
    turned = (omega - 0.5 * drag * d) * d - sign * disk.grip * pushed
    return turned, omega - (sign * disk.grip * q + drag * d), pushed, q


@kernel
def stopped(reached: float, horizon: float, steps: int) -> NextEvent:
    """A waypoint where a search has stopped, or nothing if that is its horizon."""
    if reached >= horizon:
        return NextEvent(NOTHING, 0.0, 0.0, steps)
    return NextEvent(WAYPOINT, reached, 0.0, steps)
