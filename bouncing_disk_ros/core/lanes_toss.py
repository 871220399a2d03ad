"""Single tosses for many motions at once: `core.ride` in lanes.

The phase x = ωt takes the place of time and α̇/ω that of the speed. In contact, with γ = μ a_e/a_g²
and everything over ω², friction can supply γa = γ(g/ω² − A sin x) and sticking needs
ρ = −Φ sin(x + θ). A lane looks for the first zero of one function at a time (core.contact's, in
which every motion is a sinusoid and a line, so that one bound of the curvature, k = γA + Φ, serves
all), by the same certified steps; it goes from phase to phase without a branch, and has finished
where the platform falls away (eq. 3). What is rare (events within 1e-6 of
separation, slow searches, a load torque) is left to `ride.rides`.
"""

from __future__ import annotations

import math
from typing import Any

from numba import types

from bouncing_disk_ros.core import ride, roots
from bouncing_disk_ros.core.arithmetic import TWO_PI
from bouncing_disk_ros.core.lanes import LANES, lane, lane_entry
from bouncing_disk_ros.core.lanes_flight import lane_turn
from bouncing_disk_ros.core.roots import ROUNDING

_STICK, _DRIVE, _SLIP = 0.0, 1.0, 2.0  # looks for: the end of sticking; of growing slip; of slip
_X = 0 * LANES
_END = 1 * LANES  # phase of the separation
_LAG_SINE = 2 * LANES
_LAG_COSINE = 3 * LANES
_TURNING = 4 * LANES  # Φ
_RISE = 5 * LANES  # γA
_FALL = 6 * LANES  # γg/ω²
_MODE = 7 * LANES
_SIGN = 8 * LANES  # of w_T
_START = 9 * LANES  # sign·w_T = _START − γ(g/ω²)x − γA cos x − sign·β̇
_FROM = 10 * LANES  # what the work of this phase is counted from
_WORK = 11 * LANES  # ∫M β̇ dt, over Iω²
_LOOKS = 12 * LANES
_ASK = 13 * LANES  # 1: finished; 2: given up
_JOB = 14 * LANES
_ENTERED = 15  # the fields so far are those that a ride begins with
_SINE = 15 * LANES
_COSINE = 16 * LANES
_STEP = 17 * LANES
_PASSES = 18 * LANES  # 1: the step ends at the zero
FIELDS = 19

_MOST_LOOKS = 60.0
CLOSE = 1e-6
_DONE, _GIVEN_UP = 1.0, 2.0
_IDLE = (-1.0, 0.0, -math.inf, math.inf)  # job, asks, looks, end
_ARRAY, _TABLE = types.float64[::1], types.float64[:, ::1]
LEFT_TO_RIDE = -2  # code of a ride that `ride.rides` is to do

A, PHI, SINE, COSINE, TAU, SPEED, LEAVE = range(7)
"""Rows of the table that `ride_lanes` reads: A, Φ, sin θ, cos θ, τ and α̇/ω at the start, τ_sep."""

one_root_ahead = lane(roots.one_root_ahead)
parabola_quotient = lane(roots.parabola_quotient)
inverse_series = lane(roots.inverse_series)


@lane
def _drag(z: Any, i: int, x: float, s: float, c: float) -> float:
    """∫γa β̇ dx = Φ γ[g/ω² sin(x + θ) + A(cos(2x + θ)/4 + x sin θ/2)]."""
    st, ct = z[_LAG_SINE + i], z[_LAG_COSINE + i]
    sb, cb = s * ct + c * st, c * ct - s * st
    return z[_TURNING + i] * (
        z[_FALL + i] * sb + z[_RISE + i] * (0.25 * (c * cb - s * sb) + 0.5 * x * st)
    )


@lane
def _look(z: Any) -> None:
    """One look at the function that each lane watches, and a safe step."""
    for i in range(LANES):
        s, c, _, _ = lane_turn(z[_X + i])
        z[_SINE + i] = s
        z[_COSINE + i] = c
    for i in range(LANES):
        x, s, c, mode, sign = z[_X + i], z[_SINE + i], z[_COSINE + i], z[_MODE + i], z[_SIGN + i]
        st, ct, turning = z[_LAG_SINE + i], z[_LAG_COSINE + i], z[_TURNING + i]
        rise, fall = z[_RISE + i], z[_FALL + i]
        sb, cb = turning * (s * ct + c * st), turning * (c * ct - s * st)
        a, a1 = fall - rise * s, -rise * c
        k = rise + turning
        # sticking: γa − |ρ|, and γa + |ρ|, which may fall faster
        need, need1 = abs(sb), (cb if sb >= 0.0 else -cb)
        stick, stick1 = a - need, a1 - need1
        other, other1 = a + need, a1 + need1
        # the other stays above zero where the one has its zero, if it has one soon
        soon = 2.0 * max(stick, 0.0)
        falls = max(-stick1, 0.0)
        alone = other * falls * falls + other1 * soon * falls > 0.5 * k * soon * soon
        low1 = min(stick1, other1)
        drive, drive1, drive2 = sign * sb - a, sign * cb - a1, -sign * sb - rise * s
        slip = z[_START + i] - fall * x - rise * c - sign * cb
        sticks, slips = mode == _STICK, mode == _SLIP
        f = slip if slips else (stick if sticks else drive)
        above = max(f, 0.0)
        f1 = drive if slips else (stick1 if sticks else drive1)
        f2 = drive1 if slips else (rise * s + need if sticks else drive2)
        f3 = drive2 if slips else (-stick1 if sticks else -drive1)
        ahead = one_root_ahead(above, f1, k) and (alone or not sticks)
        over, under = parabola_quotient(above, low1 if sticks else f1, k)
        r = (1.0 if ahead else over) / (f1 if ahead else under)
        step = inverse_series((f, f1, f2, f3, -f2), r)
        # the series leaves out less than rounding
        found = ahead and k * abs(step) < 5e-4 * min(abs(f1), k)
        safe = max(r, 4.0 * ROUNDING * x)
        z[_STEP + i] = step if ahead else safe
        z[_PASSES + i] = 1.0 if found else 0.0


@lane
def _go(z: Any) -> int:
    """Make the step, or pass into the next phase; how many lanes have finished."""
    wanted = 0
    for i in range(LANES):
        x, s, c, mode, sign = z[_X + i], z[_SINE + i], z[_COSINE + i], z[_MODE + i], z[_SIGN + i]
        start, work, begin, end = z[_START + i], z[_WORK + i], z[_FROM + i], z[_END + i]
        step, looks = z[_STEP + i], z[_LOOKS + i] + 1.0
        st, ct, turning = z[_LAG_SINE + i], z[_LAG_COSINE + i], z[_TURNING + i]
        rise, fall = z[_RISE + i], z[_FALL + i]
        ends = x + step >= end
        passes = z[_PASSES + i] > 0.0 and not ends
        # the sine and cosine after a step that is short where the lane passes
        x = x + step
        xx = step * step
        sx = step - step * xx * (1.0 / 6.0 - xx * (1.0 / 120.0))
        cx = xx * (0.5 - xx * (1.0 / 24.0))
        s, c = s + (c * sx - s * cx), c - (s * sx + c * cx)
        sb, cb = turning * (s * ct + c * st), turning * (c * ct - s * st)
        drag = _drag(z, i, x, s, c)
        sticks = mode == _STICK
        # DRIVE → SLIP; STICK → DRIVE; SLIP → STICK or DRIVE
        slips = mode == _DRIVE
        holds = mode == _SLIP and abs(sb) <= fall - rise * s
        out = 1.0 if sb > 0.0 else -1.0  # against ρ = −sb, contact.slip_out_sign
        next_mode = _SLIP if slips else (_STICK if holds else _DRIVE)
        done = 0.5 * (cb * cb - begin) if sticks else -sign * (drag - begin)
        turns = passes and not slips
        z[_MODE + i] = next_mode if passes else mode
        z[_SIGN + i] = out if turns else sign
        z[_START + i] = out * cb + fall * x + rise * c if turns else start
        z[_WORK + i] = work + done if turns else work
        z[_FROM + i] = (cb * cb if holds else drag) if turns else begin
        near = passes and end - x < CLOSE
        ask = _GIVEN_UP if (near or looks > _MOST_LOOKS) else (_DONE if ends else 0.0)
        z[_X + i] = x
        z[_LOOKS + i] = looks
        z[_ASK + i] = ask
        wanted += 1 if ask > 0.0 else 0
    return wanted


@lane
def _finish(z: Any, i: int, out: Any, codes: Any) -> None:
    """What separation finds: sin x = g/(Aω²) there, and cos x > 0."""
    job = int(z[_JOB + i])
    if z[_ASK + i] == _GIVEN_UP:
        codes[job] = LEFT_TO_RIDE
        return
    x, sign = z[_END + i], z[_SIGN + i]
    s = z[_FALL + i] / z[_RISE + i]
    c = math.sqrt((1.0 - s) * (1.0 + s))
    b1 = z[_TURNING + i] * (c * z[_LAG_COSINE + i] - s * z[_LAG_SINE + i])
    sticks = z[_MODE + i] == _STICK
    codes[job] = ride.RIDE_STUCK if sticks else ride.RIDE_SLID
    slip = sign * (z[_START + i] - z[_FALL + i] * x - z[_RISE + i] * c - sign * b1)
    drag = -sign * (_drag(z, i, x, s, c) - z[_FROM + i])
    out[job, ride.AIRBORNE_SPEED] = b1 if sticks else b1 + slip
    out[job, ride.WORK_ANGULAR] = z[_WORK + i] + (
        0.5 * (b1 * b1 - z[_FROM + i]) if sticks else drag
    )


@lane
def _prepare(z: Any, first: int, grip: float, fall: float, table: Any) -> None:
    """The next rides, as they enter lanes; given up if the load at the start is next to none."""
    for i in range(min(LANES, table.shape[1] - first)):
        job = first + i
        z[_X + i], z[_TURNING + i], z[_RISE + i] = table[TAU, job], table[PHI, job], table[A, job]
        z[_LAG_SINE + i], z[_LAG_COSINE + i] = table[SINE, job], table[COSINE, job]
        z[_END + i], z[_STEP + i], z[_JOB + i] = table[LEAVE, job], table[SPEED, job], job
    for i in range(LANES):
        s, c, _, _ = lane_turn(z[_X + i])
        z[_SINE + i] = s
        z[_COSINE + i] = c
    for i in range(LANES):
        x, s, c, v, end = z[_X + i], z[_SINE + i], z[_COSINE + i], z[_STEP + i], z[_END + i]
        st, ct, turning = z[_LAG_SINE + i], z[_LAG_COSINE + i], z[_TURNING + i]
        rise, down = grip * z[_RISE + i], grip * fall
        z[_RISE + i] = rise
        z[_FALL + i] = down
        sb, cb = turning * (s * ct + c * st), turning * (c * ct - s * st)
        slip = v - cb
        load = down - rise * s
        held = slip == 0.0
        sticks = held and abs(sb) <= load
        up = sb > 0.0 if held else slip > 0.0
        sign = 1.0 if up else -1.0
        drag = _drag(z, i, x, s, c)
        z[_END + i] = end if end > x else end + TWO_PI
        z[_MODE + i] = _STICK if sticks else (_DRIVE if held else _SLIP)
        z[_SIGN + i] = sign
        z[_START + i] = sign * v + down * x + rise * c
        z[_FROM + i] = cb * cb if sticks else drag
        z[_WORK + i] = 0.0
        z[_LOOKS + i] = 0.0 if load > CLOSE * rise else _MOST_LOOKS
        z[_ASK + i] = 0.0


@lane
def _refill(z: Any, i: int, ready: Any, todo: int) -> None:
    for k in range(_ENTERED):
        z[k * LANES + i] = ready[k * LANES + todo % LANES]


@lane_entry(
    types.void(*[_ARRAY] * 2, *[types.float64] * 2, *[_TABLE] * 2, types.int8[::1]),
)
def ride_lanes(
    z: Any, ready: Any, grip: float, fall: float, table: Any, out: Any, codes: Any
) -> None:
    """Speed over ω and angular work over Iω² of rides that leave in the end."""
    n = table.shape[1]
    todo = done = 0
    for i in range(LANES):
        z[_JOB + i] = -1.0
        z[_ASK + i] = _DONE
    while done < n:
        if todo > 0:
            _look(z)
        if todo == 0 or _go(z) > 0:
            for i in range(LANES):
                if z[_ASK + i] == 0.0:
                    continue
                if z[_JOB + i] >= 0.0:
                    _finish(z, i, out, codes)
                    done += 1
                if todo == n:
                    z[_JOB + i], z[_ASK + i], z[_LOOKS + i], z[_END + i] = _IDLE
                    continue
                if todo % LANES == 0:
                    _prepare(ready, todo, grip, fall, table)
                _refill(z, i, ready, todo)
                todo += 1
