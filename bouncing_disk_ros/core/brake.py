"""A dry brake on the disk's shaft: −T_B sgn α̇, and at α̇ = 0 whatever within ±T_B keeps it at rest.

In contact α̈ is the one solution of α̈ + lag + grip·a·Sgn(w_T) + brake·Sgn(α̇) ∋ 0, where a sign
that is not decided (w_T or α̇ = 0) is that of the derivative, and anything in [−1, 1] where that is
0 too. Between its events the brake is a constant torque: `drag` stands for it and the load. Only
disks with a brake come here: without one nothing changes, to the bit.
"""

from __future__ import annotations

import math

from bouncing_disk_ros.core.arithmetic import kernel, rare_kernel, sincos, wrapped
from bouncing_disk_ros.core.contact import (
    HOLD,
    NO_SLIP,
    ONE_PERIOD,
    SPIN_DRIVE,
    SPINNING,
    TURNING,
    Search,
    first_zero,
    period_of,
    slip_out_sign,
)
from bouncing_disk_ros.core.energy_ledger import Ledger, add_entry, rubbing
from bouncing_disk_ros.core.impact_law import (
    ALL_STICK,
    BOUNCES,
    COMPLETES,
    MARGIN_OF_FRICTION,
    UNDECIDED,
    chatter_end,
    chatter_friction,
)
from bouncing_disk_ros.core.layout import (
    HELD,
    L_BRAKE,
    L_SLIDING,
    LETS_GO,
    NOTHING,
    SLIDING,
    STEADY,
    STICKING,
    STOPS,
    TURNS,
    W_ANGULAR,
    WAYPOINT,
    NextEvent,
)
from bouncing_disk_ros.core.platform import Jet, Record, angular_jet

STOPPED_TAIL = 3.0
"""Value of a CHATTER_ENDS whose flights each stop the disk, by its brake; times the slip's sign."""
_SAFE = 1.0 + 1e-12  # bounds are rounded up
_TURN = 1.0 + 1e-9  # more than half a period ahead is the zero that has just been


@kernel
def sign_of(value: float) -> float:
    """−1, 0 or 1."""
    return 1.0 if value > 0.0 else (-1.0 if value < 0.0 else 0.0)


@kernel
def left_over(load: float, brake: float) -> float:
    """What a brake leaves of a load on a disk at rest; 0 where it holds."""
    return load - sign_of(load) * min(abs(load), brake)


@kernel
def turns_not(motion: Record) -> bool:
    """Whether the platform does not turn, over all of its motion in force."""
    return motion.p == 0.0 and motion.dp == 0.0


# --- flight ---------------------------------------------------------------------------------------
@rare_kernel
def braked_spin(omega: float, disk: Record, d: float) -> tuple[float, float, float]:
    """Angle turned, α̇ and way (angle without its sign) after d seconds of flight."""
    turned = way = 0.0
    left = d
    if omega != 0.0:
        sign = sign_of(omega)
        drag = disk.lag + disk.brake * sign
        slows = drag * sign
        if slows * d < abs(omega):
            turned = (omega - 0.5 * drag * d) * d
            return turned, omega - drag * d, abs(turned)
        lasts = abs(omega) / slows
        turned = 0.5 * omega * lasts
        way = abs(turned)
        left = max(d - lasts, 0.0)
    rest = left_over(disk.lag, disk.brake)
    more = -0.5 * rest * left * left
    return turned + more, 0.0 - rest * left, way + abs(more)


# --- how contact begins ---------------------------------------------------------------------------
@kernel
def _stick(state: Record, disk: Record, spin: float) -> None:
    state.phase = STICKING
    state.spin_sign = spin
    state.drag = disk.lag + disk.brake * spin


@kernel
def _slide(state: Record, disk: Record, side: float, spin: float) -> None:
    state.phase = SLIDING
    state.slip_sign = side
    state.spin_sign = spin
    state.drag = disk.lag + disk.brake * spin


@kernel
def _hold(state: Record, disk: Record, side: float) -> None:
    state.phase = HELD
    state.slip_sign = side
    state.spin_sign = 0.0
    state.drag = disk.lag
    state.omega = 0.0


@kernel
def _from_rest(state: Record, disk: Record, side: float, grip: float) -> None:
    """A disk at rest over a platform that slides beneath: held, or set in motion."""
    torque = disk.lag + side * grip
    if abs(torque) <= disk.brake:
        _hold(state, disk, side)
    else:
        _slide(state, disk, side, -sign_of(torque))


@kernel
def _both_at_rest(state: Record, motion: Record, disk: Record, grip: float, b: Jet) -> None:
    """Disk and platform at rest at the same instant: what the platform does next decides."""
    ahead = 0.0
    if not turns_not(motion):
        for derivative in b[2:]:
            if ahead == 0.0:
                ahead = sign_of(derivative)
    lag, brake = disk.lag, disk.brake
    if ahead == 0.0:  # nothing moves: the brake holds first, friction what is left
        rest = left_over(lag, brake)
        if abs(rest) <= grip:
            _stick(state, disk, 0.0)
            state.drag = rest
        else:
            _slide(state, disk, -sign_of(rest), -sign_of(rest))
    elif abs(b[2] + lag + brake * ahead) <= grip:
        _stick(state, disk, ahead)
    elif abs(lag - grip * ahead) <= brake:
        _hold(state, disk, -ahead)
    elif grip + brake - lag < min(b[2], 0.0):
        _slide(state, disk, -1.0, -1.0)
    elif -(grip + brake) - lag > max(b[2], 0.0):
        _slide(state, disk, 1.0, 1.0)
    else:
        _slide(state, disk, -ahead, ahead)


@rare_kernel
def begin_braked_contact(state: Record, motion: Record, disk: Record, a: float, b: Jet) -> None:
    """Sticking, sliding or held, for a disk that is in contact with the load a = g + s̈ (≥ 0)."""
    slip = state.omega - b[1]
    spin = sign_of(state.omega)
    grip = disk.grip * a
    if slip != 0.0:
        if spin == 0.0:
            _from_rest(state, disk, sign_of(slip), grip)
        else:
            _slide(state, disk, sign_of(slip), spin)
    elif spin == 0.0:
        _both_at_rest(state, motion, disk, grip, b)
    else:
        rho = b[2] + disk.lag + disk.brake * spin
        if disk.grip > 0.0 and abs(rho) <= grip:
            _stick(state, disk, spin)
        else:
            _slide(state, disk, slip_out_sign(rho), spin)


# --- events ---------------------------------------------------------------------------------------
@rare_kernel
def _zero(
    which: int,
    sign: float,
    motion: Record,
    disk: Record,
    drag: float,
    elapsed: float,
    tau: float,
    about: tuple[float, float, float, float],
    begin: float,
    horizon: float,
) -> Search:
    return first_zero(which, sign, motion, disk, drag, elapsed, tau, about, begin, horizon)


@kernel
def _quarter(motion: Record, sign: float) -> float:
    """Forcing phase at which β̇ of a steady motion falls (sign 1) or rises through zero, rad."""
    return wrapped((0.5 if sign > 0.0 else 1.5) * math.pi - motion.lag)


@kernel
def _until_turn(motion: Record, tau: float, sign: float) -> float:
    """Seconds until β̇ of a steady motion, which has this sign, is zero."""
    ahead = wrapped(_quarter(motion, sign) - tau)
    return 0.0 if ahead > math.pi * _TURN else ahead / motion.omega


@rare_kernel
def _platform_turns(
    motion: Record, disk: Record, elapsed: float, tau: float, sign: float, horizon: float
) -> Search:
    """Delay at which β̇, which has this sign, is zero."""
    if sign == 0.0 or turns_not(motion):
        return Search(math.inf, horizon, 0)
    if motion.kind == STEADY:
        d = _until_turn(motion, tau, sign)
        return Search(d if d <= horizon else math.inf, min(d, horizon), 0)
    return _zero(TURNING, sign, motion, disk, 0.0, elapsed, tau, NO_SLIP, 0.0, horizon)


@rare_kernel
def _disk_stops(
    state: Record, motion: Record, disk: Record, elapsed: float, horizon: float
) -> Search:
    """Delay at which α̇ of a sliding disk is zero."""
    sign = state.spin_sign
    if turns_not(motion):  # α̇ is the slip: it ends where that does
        return Search(math.inf, horizon, 0)
    along = state.slip_sign * sign  # 1: friction slows the disk
    speed = max(sign * state.omega, 0.0)
    tau, drag = state.tau, state.drag
    sine, cosine = sincos(tau)
    about = (speed, along, sine, cosine)
    begin = 0.0
    within = reach = horizon
    if motion.kind == STEADY:
        reach = min(horizon, ONE_PERIOD * period_of(motion))
    if speed == 0.0:  # searched from where its drive turns against it, as a slip from 0
        starts = _zero(SPIN_DRIVE, sign, motion, disk, drag, elapsed, tau, about, 0.0, reach)
        if starts.zero == math.inf:
            return Search(math.inf, horizon, starts.steps) if starts.reached >= reach else starts
        begin = starts.zero
    if motion.kind == STEADY:
        rate = along * disk.grip * disk.g + sign * drag
        sure = speed - 2.0 * disk.grip * motion.a * motion.omega * _SAFE
        if sure > 0.0:
            begin = min(sure / (rate * _SAFE), horizon) if rate > 0.0 else horizon
        if begin >= horizon:
            return Search(math.inf, horizon, 0)
        if rate <= 0.0:  # faster after each period: now or never
            within = min(horizon, begin + ONE_PERIOD * period_of(motion))
    end = _zero(SPINNING, sign, motion, disk, drag, elapsed, tau, about, begin, within)
    reached = horizon if end.zero == math.inf and end.reached >= within else end.reached
    return Search(end.zero, reached, end.steps)


@rare_kernel
def _lets_go(
    state: Record, motion: Record, disk: Record, elapsed: float, horizon: float
) -> tuple[Search, float]:
    """Delay at which the brake no longer holds the disk, and the sign with which it then turns."""
    if abs(disk.lag) + disk.grip * (disk.g + motion.s2) <= disk.brake:
        return Search(math.inf, horizon, 0), 0.0
    about = (disk.brake, state.slip_sign, 0.0, 0.0)
    lag, tau = disk.lag, state.tau
    up = _zero(HOLD, 1.0, motion, disk, lag, elapsed, tau, about, 0.0, horizon)
    down = _zero(HOLD, -1.0, motion, disk, lag, elapsed, tau, about, 0.0, up.reached)
    steps = up.steps + down.steps
    if down.zero < up.zero:
        return Search(down.zero, down.reached, steps), 1.0
    if up.zero <= down.reached:
        return Search(up.zero, up.reached, steps), -1.0
    return Search(math.inf, down.reached, steps), 0.0


@rare_kernel
def brake_event(
    state: Record, motion: Record, disk: Record, elapsed: float, horizon: float
) -> NextEvent:
    """The brake's next event before `horizon` s: the disk stops, the platform turns, slip begins.

    NOTHING, or a WAYPOINT where the search stopped before.
    """
    kind, value = TURNS, 0.0
    if state.phase == STICKING:
        found = _platform_turns(motion, disk, elapsed, state.tau, state.spin_sign, horizon)
    elif state.phase == SLIDING:
        kind = STOPS
        found = _disk_stops(state, motion, disk, elapsed, horizon)
    else:
        found, value = _lets_go(state, motion, disk, elapsed, horizon)
        # held for good, turns of the platform need no event: see add_held_work
        if value != 0.0 or motion.kind != STEADY or found.reached < horizon:
            until, steps = min(found.zero, found.reached), found.steps
            turn = _platform_turns(motion, disk, elapsed, state.tau, -state.slip_sign, until)
            kind = TURNS if turn.zero < until else LETS_GO
            if turn.zero < until or turn.reached < until:
                found = Search(turn.zero, turn.reached, steps + turn.steps)
    if found.zero < horizon:
        return NextEvent(kind, found.zero, value, found.steps)
    if found.reached < horizon:
        return NextEvent(WAYPOINT, found.reached, 0.0, found.steps)
    return NextEvent(NOTHING, 0.0, 0.0, found.steps)


@rare_kernel
def end_braked_phase(
    state: Record, motion: Record, disk: Record, kind: int, value: float, a: float, b: Jet
) -> None:
    """Go through STOPS, TURNS or LETS_GO at their instant."""
    grip = disk.grip * a
    state.omega = 0.0
    if kind == LETS_GO:
        _slide(state, disk, state.slip_sign, value)
    elif kind == STOPS:
        _from_rest(state, disk, state.slip_sign, grip)
    else:
        _both_at_rest(state, motion, disk, grip, b)
        if state.phase == STICKING:
            state.omega = b[1]


@rare_kernel
def stick_or_reverse_braked(state: Record, motion: Record, disk: Record, a: float, b: Jet) -> None:
    """Where a slip has reached w_T = 0 (contact.stick_or_reverse)."""
    grip = disk.grip * a
    spin = sign_of(b[1])
    if spin == 0.0:
        state.omega = 0.0
        _both_at_rest(state, motion, disk, grip, b)
        return
    rho = b[2] + disk.lag + disk.brake * spin
    if abs(rho) <= grip:
        state.omega = b[1]
        _stick(state, disk, spin)
    else:
        _slide(state, disk, slip_out_sign(rho), spin)


# --- energy ---------------------------------------------------------------------------------------
@rare_kernel
def add_held_work(
    ledger: Ledger, state: Record, motion: Record, disk: Record, elapsed: float, d: float
) -> None:
    """Work of the platform that slides beneath a held disk, all of it lost; the sign of the slip.

    A steady motion may turn back many times on the way.
    """
    rubbed, tau, left, sign = 0.0, state.tau, d, state.slip_sign
    if motion.kind == STEADY:
        half = math.pi / motion.omega
        for _ in range(4):
            span = _until_turn(motion, tau, -sign)
            if span >= left:
                break
            rubbed -= sign * rubbing(motion, disk, elapsed, tau, span)
            left -= span
            tau = _quarter(motion, -sign)
            sign = -sign
            periods = math.floor(left / (2.0 * half))
            if periods >= 1.0:
                other = _quarter(motion, -sign)
                rubbed -= sign * periods * rubbing(motion, disk, elapsed, tau, half)
                rubbed += sign * periods * rubbing(motion, disk, elapsed, other, half)
                left = max(left - periods * 2.0 * half, 0.0)
    rubbed -= sign * rubbing(motion, disk, elapsed, tau, left)
    state.slip_sign = sign
    add_entry(ledger, W_ANGULAR, rubbed)
    add_entry(ledger, L_SLIDING, rubbed)


@kernel
def add_brake_loss(ledger: Ledger, disk: Record, way: float) -> None:
    """What the brake takes while the disk turns by `way` rad, without its sign."""
    if disk.brake > 0.0:
        add_entry(ledger, L_BRAKE, disk.brake_torque * abs(way))


# --- chatter --------------------------------------------------------------------------------------
@kernel
def chatter_drag(disk: Record, omega: float) -> float:
    """What load and brake take from α̇ in the flights of a chatter that keeps its direction."""
    if disk.brake == 0.0:
        return disk.lag
    if omega != 0.0:
        return disk.lag + disk.brake * sign_of(omega)
    return left_over(disk.lag, disk.brake)


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
    """impact_law.chatter_verdict with a brake: completed only where the brake's part is decided.

    The disk keeps its direction; or it stops in this flight and in each that follows (the sign is
    STOPPED_TAIL times that of the slip); or neither it nor the platform turns.
    """
    end, t = chatter_end(motion, disk, s, u)
    if end != COMPLETES:
        return end, t, 0.0
    b = angular_jet(motion, sine, cosine, elapsed)
    a, e = disk.g + s[2], disk.restitution
    total = u * (1.0 + e) / (1.0 - e)
    drag = chatter_drag(disk, omega)
    spin, side = sign_of(omega), -sign_of(b[1])
    most = disk.grip * (1.0 + e) * u  # change of α̇ in the first impact to come
    first = (disk.brake + disk.lag * spin) * 2.0 * u / a  # what the flight before it can take
    stops = (
        side != 0.0
        and abs(disk.lag) <= disk.brake
        and abs(omega) * MARGIN_OF_FRICTION <= first
        and most * a * MARGIN_OF_FRICTION <= (disk.brake - disk.lag * side) * 2.0 * e * u
        and abs(b[1]) > (abs(b[2]) * t + most + abs(omega)) * MARGIN_OF_FRICTION
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
        lasts = abs(omega) > (abs(b[2]) + abs(drag)) * t * MARGIN_OF_FRICTION
        return (COMPLETES if lasts else BOUNCES), t, 0.0
    if sign == spin:  # friction slows the disk
        lasts = abs(omega) > (disk.grip * total + slows * t) * MARGIN_OF_FRICTION
    else:  # each impact gives more than the next flight takes, or all flights together too little
        grows = disk.grip * (1.0 + e) * a > slows * 2.0 * e * MARGIN_OF_FRICTION
        lasts = abs(omega) > slows * t * MARGIN_OF_FRICTION or (
            grows and abs(omega) > max(first, 0.0) * MARGIN_OF_FRICTION
        )
    return (COMPLETES if lasts else BOUNCES), t, sign


@rare_kernel
def stopped_tail(disk: Record, side: float, u: float, omega: float) -> tuple[float, float, float]:
    """Angle turned, and way, in a chatter whose flights each stop the disk; Σ(Δα̇)² of its impacts.

    Each impact gives Δα̇ = −side·grip·(1+ε)w from rest, and the flight turns by
    (Δα̇)²/(2(brake + lag sgn Δα̇)), as the first one does with its α̇.
    """
    e = disk.restitution
    most = disk.grip * (1.0 + e) * u
    squares = most * most / (1.0 - e * e)
    later = 0.5 * squares / (disk.brake - disk.lag * side)
    spin = sign_of(omega)
    first = 0.0
    if spin != 0.0:
        first = 0.5 * omega * omega / (disk.brake + disk.lag * spin)
    return spin * first - side * later, first + later, squares
