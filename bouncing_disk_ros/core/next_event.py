"""The next event of a disk: in flight, in contact, and stored with its clock in the state."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from bouncing_disk_ros.core.arithmetic import sincos
from bouncing_disk_ros.core.brake import sign_of, tie
from bouncing_disk_ros.core.chatter import (
    BOUNCES,
    STILL,
    braked_chatter,
    chatter_verdict,
    shows_all,
)
from bouncing_disk_ros.core.compilation import Kernel, kernel, rare_kernel
from bouncing_disk_ros.core.contact_events import (
    HOLD,
    NO_SLIP,
    ONE_PERIOD,
    SPIN_DRIVE,
    SPINNING,
    TURNING,
    Search,
    first_zero,
    load,
    load_returns,
    period_of,
    separation,
    slide,
    slip_ends,
    stick_fails,
    stopped,
    turning_rounding,
)
from bouncing_disk_ros.core.contact_table import what_holds
from bouncing_disk_ros.core.event_instant import store_event
from bouncing_disk_ros.core.flight import Launch, search_impact, separation_phase
from bouncing_disk_ros.core.forcing_clock import elapsed, phase_after, seconds_between
from bouncing_disk_ros.core.layout import (
    CHATTER_ENDS,
    FAULT,
    FLIGHT,
    IMPACT,
    LETS_GO,
    LONGEST,
    NEVER,
    NOTHING,
    PAST_BOUNDARY,
    SEPARATION,
    SKIP,
    SLIDING,
    SLIP,
    SLIP_ENDS,
    STEADY,
    STICKING,
    STILLED,
    STOPS,
    TURNS,
    WAYPOINT,
    NextEvent,
    Slide,
)
from bouncing_disk_ros.core.platform import (
    Jet,
    Record,
    angular_jet,
    axial_jet,
    bounds_from,
    span_from,
    turns_next,
    turns_not,
    until_turning,
)
from bouncing_disk_ros.core.roots import ROUNDING


@kernel
def _chatter(
    state: Record, motion: Record, disk: Record, s: Jet, since: float, horizon: float
) -> NextEvent:
    """Complete chattering in closed form, where that is exact and friction's part decided."""
    u = state.u
    sine, cosine = state.sine, state.cosine
    if disk.brake > 0.0:
        end, t, sign = braked_chatter(motion, disk, since, sine, cosine, s, u, state.omega)
    else:
        end, t, sign = chatter_verdict(
            motion, disk, disk.lag, since, sine, cosine, s, u, state.omega
        )
    if end == STILL:
        return NextEvent(CHATTER_ENDS, 0.0, STILLED, 0)
    if end == BOUNCES or t + PAST_BOUNDARY > horizon or not shows_all(disk):
        return NextEvent(NOTHING, 0.0, 0.0, 0)
    return NextEvent(CHATTER_ENDS, t, sign, 0)


@kernel
def after_flight(
    state: Record, motion: Record, disk: Record, since: float, horizon: float
) -> NextEvent:
    """Next event of a disk in flight, up to `horizon` s ahead."""
    start, steps = 0.0, 0
    sine, cosine = state.sine, state.cosine
    jet = axial_jet(motion, sine, cosine, since)
    if state.gap == 0.0:
        if state.u == 0.0:  # launched: no root before the platform can come back (rule 2)
            returns = load_returns(motion, disk, since, state.tau, horizon)
            if returns.zero == math.inf:
                return stopped(returns.reached, horizon, returns.steps)
            start, steps = returns.zero, returns.steps
        elif state.u > 0.0:
            chatter = _chatter(state, motion, disk, jet, since, horizon)
            if chatter.kind != NOTHING:
                return chatter
    within = min(horizon, start + LONGEST)
    launch = Launch(since, sine, cosine, disk.g, state.gap, state.u)
    d, w, more = search_impact(motion, launch, jet, start, within)
    if w > 0.0:
        return stopped(d, horizon, steps + more)
    if d > within or d == math.inf:
        return stopped(within, horizon, steps + more)
    return NextEvent(IMPACT, d, w, steps + more)


# ------------------------------------------------------------------------------------------------
# The next event of a disk in contact: separation, or a change between sticking and slipping.


# A slip that begins less than this before separation (rad) changes α̇ by its square: rule 5, stick
# until then.
_LAST_SLIP = 1e-8
_BLEND_RATE = 6.0
"""rad over its duration: a cross-fade changes β̇ at most as fast as a sinusoid of this rate.

The root of the ratio of the blend's largest third derivative to its first."""
SLIDE_PERIODS = 8.0
"""Periods of one piece of a slide in a cross-fade."""
_SAFE = 1.0 + 1e-12  # bounds are rounded up
_QUADRATURE_STEPS = 500  # of a search take the time of the energy of one such piece


@kernel
def after_sticking(
    state: Record, motion: Record, disk: Record, since: float, horizon: float
) -> NextEvent:
    """Next event of a disk that sticks."""
    leave = separation(motion, disk, since, state.tau, horizon)
    until = min(leave.reached, leave.zero)
    fail, sign = stick_fails(motion, disk, state.drag, since, state.tau, min(horizon, until))
    steps = leave.steps + fail.steps
    rate = motion.omega_max
    if motion.kind != STEADY:
        rate = max(rate, _BLEND_RATE / motion.duration)
    near = fail.zero <= until and (until - fail.zero) * rate <= _LAST_SLIP
    if near and leave.zero == math.inf and until < horizon and fail.zero > 0.0:
        # whether separation follows at once is not known yet
        return NextEvent(WAYPOINT, fail.zero, 0.0, steps)
    if fail.zero < until and not (near and leave.zero != math.inf):
        return NextEvent(SLIP, fail.zero, -sign, steps)
    if fail.zero == math.inf and fail.reached < until:
        return NextEvent(WAYPOINT, fail.reached, 0.0, steps)
    if leave.zero == math.inf:
        return stopped(until, horizon, steps)
    return NextEvent(SEPARATION, leave.zero, 0.0, steps)


@kernel
def after_sliding(
    state: Record, motion: Record, disk: Record, since: float, horizon: float
) -> NextEvent:
    """Next event of a disk that slides.

    In a cross-fade a slide is propagated in pieces: its energy takes quadrature, whose work is to
    be bounded.
    """
    within = horizon
    if motion.kind != STEADY:
        within = min(horizon, span_from(motion, since, motion.duration, SLIDE_PERIODS))
    leave = separation(motion, disk, since, state.tau, within)
    until = min(leave.reached, leave.zero)
    b = angular_jet(motion, state.sine, state.cosine, since)
    sign = float(state.slip_sign)
    w = max(sign * (state.omega - b[1]), 0.0)
    stop, skip = slip_ends(motion, disk, state.drag, since, state.tau, sign, w, until)
    steps = leave.steps + stop.steps + (0 if motion.kind == STEADY else _QUADRATURE_STEPS)
    if stop.zero < until or (stop.zero == until < math.inf and leave.zero == math.inf):
        return NextEvent(SLIP_ENDS, stop.zero, 0.0, steps)
    if stop.zero == math.inf and stop.reached < until:
        return NextEvent(WAYPOINT, stop.reached, 0.0, steps)
    if leave.zero != math.inf:
        return NextEvent(SEPARATION, leave.zero, 0.0, steps)
    if skip > 0:
        periods = math.floor(min(float(skip), LONGEST / period_of(motion)))
        return NextEvent(SKIP, periods * period_of(motion), float(periods), steps)
    return stopped(until, horizon, steps)


@kernel
def after_held(
    state: Record, motion: Record, disk: Record, since: float, horizon: float
) -> NextEvent:
    """Next event of a disk that its brake holds, without the events of the brake itself."""
    within = horizon
    if motion.kind != STEADY:  # its energy takes quadrature, as in a slide
        within = min(horizon, span_from(motion, since, motion.duration, SLIDE_PERIODS))
    leave = separation(motion, disk, since, state.tau, within)
    steps = leave.steps + (0 if motion.kind == STEADY else _QUADRATURE_STEPS)
    if leave.zero == math.inf:
        return stopped(leave.reached, horizon, steps)
    return NextEvent(SEPARATION, leave.zero, 0.0, steps)


@rare_kernel
def _platform_turns(
    motion: Record,
    disk: Record,
    elapsed: float,
    tau: float,
    sine: float,
    cosine: float,
    sign: float,
    horizon: float,
) -> tuple[Search, float]:
    """Delay at which β̇, which has this sign, is zero, and its sign after that.

    At once, and 0, where the platform stands. In a cross-fade or with an offset that changes β̇
    turns where it is beyond its rounding: what only touches zero does not turn.
    """
    if motion.kind == STEADY and not turns_not(motion):
        d = until_turning(motion, tau, sign)
        return Search(d if d <= horizon else math.inf, min(d, horizon), 0), -sign
    b = angular_jet(motion, sine, cosine, elapsed)
    ahead = turns_next(motion, b)
    if b[1] == 0.0 and sign * ahead <= 0.0:
        return Search(0.0, 0.0, 0), float(ahead)
    if sign * b[1] < -turning_rounding(motion, bounds_from(motion, elapsed, 0.0), elapsed):
        return Search(0.0, 0.0, 0), -sign
    return first_zero(TURNING, sign, motion, disk, 0.0, elapsed, tau, NO_SLIP, 0.0, horizon), -sign


@rare_kernel
def _disk_stops(
    state: Record, motion: Record, disk: Record, elapsed: float, horizon: float
) -> Search:
    """Delay at which α̇ of a sliding disk is zero."""
    sign = float(state.spin_sign)
    along = state.slip_sign * sign  # 1: friction slows the disk
    speed = max(sign * state.omega, 0.0)
    tau, drag = state.tau, state.drag
    about = (speed, along, state.sine, state.cosine)
    begin = 0.0
    within = reach = horizon
    if motion.kind == STEADY:
        reach = min(horizon, ONE_PERIOD * period_of(motion))
    if speed == 0.0:  # searched from where its drive turns against it, as a slip from 0
        starts = first_zero(SPIN_DRIVE, sign, motion, disk, drag, elapsed, tau, about, 0.0, reach)
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
    end = first_zero(SPINNING, sign, motion, disk, drag, elapsed, tau, about, begin, within)
    reached = horizon if end.zero == math.inf and end.reached >= within else end.reached
    return Search(end.zero, reached, end.steps)


@rare_kernel
def _held_ends(
    state: Record, motion: Record, disk: Record, elapsed: float, horizon: float
) -> tuple[int, Search, float]:
    """What ends that the brake holds a disk: LETS_GO with the sign of α̇ after it, or TURNS."""
    slip, tau = float(state.slip_sign), state.tau
    most = disk.brake + tie(disk)
    for_good = abs(disk.lag) + disk.grip * (disk.g + motion.s2) <= most
    if for_good and motion.kind == STEADY and not turns_not(motion):
        return TURNS, Search(math.inf, horizon, 0), 0.0  # no turn matters: see add_held_work
    found, value = _platform_turns(
        motion, disk, elapsed, tau, state.sine, state.cosine, -slip, horizon
    )
    if for_good:
        return TURNS, found, value
    about = (most, slip, 0.0, 0.0)
    kind, steps = TURNS, found.steps
    for sign in (1.0, -1.0):
        until = min(found.zero, found.reached)
        more = first_zero(HOLD, sign, motion, disk, disk.lag, elapsed, tau, about, 0.0, until)
        steps += more.steps
        if more.zero < until or more.reached < until:
            kind, found, value = LETS_GO, more, -sign
    return kind, Search(found.zero, found.reached, steps), value


@rare_kernel
def brake_event(
    state: Record, motion: Record, disk: Record, elapsed: float, horizon: float
) -> NextEvent:
    """The next end of a row of `contact_table` at which α̇ or β̇ is 0 or the brake lets go.

    Before `horizon` s: NOTHING, or a WAYPOINT where the search stopped before.
    """
    kind, value = TURNS, 0.0
    found = Search(math.inf, horizon, 0)
    if state.slip_sign == 0:
        if state.spin_sign != 0:
            sign, sine, cosine = float(state.spin_sign), state.sine, state.cosine
            found, value = _platform_turns(
                motion, disk, elapsed, state.tau, sine, cosine, sign, horizon
            )
    elif state.spin_sign != 0:
        kind = STOPS
        found = _disk_stops(state, motion, disk, elapsed, horizon)
    else:
        kind, found, value = _held_ends(state, motion, disk, elapsed, horizon)
    if found.zero < horizon:
        return NextEvent(kind, found.zero, value, found.steps)
    if found.reached < horizon:
        return NextEvent(WAYPOINT, found.reached, 0.0, found.steps)
    return NextEvent(NOTHING, 0.0, 0.0, found.steps)


@rare_kernel
def after_contact(
    state: Record, motion: Record, disk: Record, since: float, horizon: float
) -> NextEvent:
    """Next event of a disk in contact, up to `horizon` s ahead."""
    if state.phase == STICKING:
        found = after_sticking(state, motion, disk, since, horizon)
    elif state.phase == SLIDING:
        found = after_sliding(state, motion, disk, since, horizon)
    else:
        found = after_held(state, motion, disk, since, horizon)
    if disk.brake > 0.0:
        until = horizon if found.kind == NOTHING else found.delay
        sooner = brake_event(state, motion, disk, since, until)
        steps = found.steps + sooner.steps
        if sooner.kind != NOTHING:
            return NextEvent(sooner.kind, sooner.delay, sooner.value, steps)
    return found


# ------------------------------------------------------------------------------------------------
# Find the next event: computed once, with a horizon fixed by state and inputs, and stored.


_STEPS_PER_EVENT = 16  # so many steps of a search cost as much as one event


@kernel
def find_next(state: Record, motion: Record, disk: Record, boundary_ns: int) -> int:
    """Store the next event up to boundary_ns (an input or an end of a cross-fade) in the state.

    A search that needs many steps ends at a waypoint. Returns what it cost, in events.
    """
    horizon = math.inf
    if boundary_ns != NEVER:
        horizon = seconds_between(state.ns, state.sub, boundary_ns, 0.0) + PAST_BOUNDARY
    since = elapsed(motion, state.ns, state.sub)
    if motion.kind != STEADY:
        until = motion.fade_end
        left = max(until - since, 0.0)
        if state.phase == FLIGHT:  # an impact may be due at the very end
            left += 8.0 * ROUNDING * until
        horizon = min(horizon, left)
    if state.phase == FLIGHT:
        found = after_flight(state, motion, disk, since, horizon)
    else:
        found = after_contact(state, motion, disk, since, horizon)
    known = state.gap + state.u + state.omega + state.angle + state.tau
    known += found.delay + found.value
    if not math.isfinite(known):
        state.event = FAULT
        return 1
    store_event(state, motion, disk, found.kind, found.delay, found.value, boundary_ns)
    late = state.event_ns > boundary_ns or (state.event_ns == boundary_ns and state.event_sub > 0.0)
    if state.event == NOTHING or late:
        state.event = NOTHING
        state.event_ns = NEVER
    return 1 + found.steps // _STEPS_PER_EVENT


# ------------------------------------------------------------------------------------------------
# Contact with a steady motion up to separation (eq. 3), for single tosses and for the map: the
# events above, given named tuples in place of the stepper's records.


class ContactState(NamedTuple):
    """The disk on the platform, with the fields of layout.STATE_DTYPE that kernels read."""

    tau: float
    sine: float
    cosine: float
    slip_sign: float
    drag: float
    omega: float


class Stretch(NamedTuple):
    """A phase of contact: how it begins, how long it lasts, the platform at both ends."""

    begin: Slide  # of the sign 0: the disk sticks
    slip: float  # w_T at its begin
    duration: float
    pushed: float  # the integrals of `slide`; 0 in sticking
    q: float
    axial: tuple[Jet, Jet]
    angular: tuple[Jet, Jet]


def contact_run(add: Kernel) -> Kernel:
    """Compile the loop, with what is summed up over its phases: add(sums, motion, disk, stretch).

    A function of its own for each `add`: one that is given as an argument could not be cached.
    """

    @rare_kernel
    def contact_until_flight(
        motion: Record, disk: Record, tau: float, omega: float, most: int, sums: Any
    ) -> tuple[float, float, float, float]:
        """Seconds from τ until separation, which comes; α̇ there, angle turned, sign of the slip.

        Of the last phase, 0: the disk sticks. nan after `most` phases without it. No brake.
        """
        lasted = turned = 0.0
        sine, cosine = sincos(tau)
        s, b = axial_jet(motion, sine, cosine, 0.0), angular_jet(motion, sine, cosine, 0.0)
        a, _ = load(motion, disk.g, s)
        sign = float(what_holds(sign_of(omega - b[1]), 0, 0, disk, a, b)[0])
        for _ in range(most):
            state = ContactState(tau, sine, cosine, sign, disk.lag, omega)
            begin, slip = Slide(0.0, tau, sine, cosine, sign, disk.lag), omega - b[1]
            if sign == 0.0:
                kind, d, value, _ = after_sticking(state, motion, disk, 0.0, math.inf)
            else:
                kind, d, value, _ = after_sliding(state, motion, disk, 0.0, math.inf)
            tau = phase_after(tau, motion.omega * d)[1]
            if kind == SEPARATION:
                tau = separation_phase(motion, disk.g)
            sine, cosine = sincos(tau)
            s1, b1 = axial_jet(motion, sine, cosine, 0.0), angular_jet(motion, sine, cosine, 0.0)
            angle, pushed, q = b1[0] - b[0], 0.0, 0.0
            if sign == 0.0:
                omega = b1[1]
            else:
                angle, omega, pushed, q = slide(motion, disk, begin, omega, d)
            add(sums, motion, disk, Stretch(begin, slip, d, pushed, q, (s, s1), (b, b1)))
            lasted += d
            turned += angle
            s, b = s1, b1
            if kind == SEPARATION:
                return lasted, omega, turned, sign
            if kind == SLIP:
                sign = value
            elif kind == SLIP_ENDS:
                sign = float(what_holds(0, 0, 0, disk, disk.g + s[2], b)[0])
                omega = b[1] if sign == 0.0 else omega
        return math.nan, math.nan, math.nan, sign

    return contact_until_flight
