"""Phases of contact of single tosses in lanes: sticking, then slip up to its end.

A round is one stretch of sticking, for the lanes that stick, and one slip. Sticking ends where a
drive of either sign rises through zero, where a falling piece of its slip ends; a slip ends at the
zero of the first of its falling pieces that has one, or at the separation (eq. 3). No loop has a
branch; a lane that is done, or given up, keeps its numbers.
"""

from __future__ import annotations

import math
from typing import Any

from bouncing_disk_ros.core.arithmetic import ROUNDER, TWO_PI
from bouncing_disk_ros.maps.lanes.lane_table import LANES, lane, lane_turn
from bouncing_disk_ros.maps.lanes.toss_table import (
    CLOSE,
    NARROW,
    TOSS_CENTRE,
    TOSS_CENTRE_COSINE,
    TOSS_CENTRE_SINE,
    TOSS_COSINE,
    TOSS_DEPTH,
    TOSS_DONE,
    TOSS_END,
    TOSS_END_COSINE,
    TOSS_END_SINE,
    TOSS_FOUND,
    TOSS_GIVEN_UP,
    TOSS_HALF,
    TOSS_LAG_COSINE,
    TOSS_LAG_SINE,
    TOSS_LEVEL,
    TOSS_MINUS,
    TOSS_MORE,
    TOSS_REACHED,
    TOSS_RISE,
    TOSS_ROOT,
    TOSS_SIGN,
    TOSS_SINE,
    TOSS_SPAN,
    TOSS_START,
    TOSS_STATUS,
    TOSS_STAYS_STUCK,
    TOSS_STEEPEST,
    TOSS_STICKS,
    TOSS_TURN_COSINE,
    TOSS_TURN_SINE,
    TOSS_TURNING,
    TOSS_WORK,
    TOSS_X,
    bent_step,
    drive_field,
    first_guess,
    last_step,
    turned_by,
)

# A slip out of sticking begins, to rounding, where a falling piece ends. Taking so much (in turns)
# for the same place loses no zero: a slip falls there by its square, less than rounding, and one
# that is at zero there is left to `single_toss.toss_each`.
_BEYOND = 1e-12
_SURELY_LAST = 0.5e-8  # rad before separation: half of what events.after_sticking takes for none


@lane
def turns_until(x: float, at: float) -> float:
    """The turns to add to `at` for the first such place beyond x."""
    passed = (x - at) * (1.0 / TWO_PI)
    return ((passed + (0.5 + _BEYOND)) + ROUNDER) - ROUNDER


@lane
def friction_work(z: Any, i: int, fall: float, x: float, sine: float, cosine: float) -> float:
    """∫γa β̇ dx = Φ γ[g/ω² sin(x + θ) + A(cos(2x + θ)/4 + x sin θ/2)]."""
    st, ct = z[TOSS_LAG_SINE + i], z[TOSS_LAG_COSINE + i]
    sb, cb = sine * ct + cosine * st, cosine * ct - sine * st
    return z[TOSS_TURNING + i] * (
        fall * sb + z[TOSS_RISE + i] * (0.25 * (cosine * cb - sine * sb) + 0.5 * x * st)
    )


@lane
def advance_sticking(z: Any, fall: float) -> None:
    """Advance the lanes that stick to where they slip out, or to the separation."""
    for i in range(LANES):
        x, end = z[TOSS_X + i], z[TOSS_END + i]
        one, other = (
            z[TOSS_CENTRE + i] + z[TOSS_HALF + i],
            z[TOSS_CENTRE + TOSS_MINUS + i] + z[TOSS_HALF + TOSS_MINUS + i],
        )
        one = one + TWO_PI * turns_until(x, one)
        other = other + TWO_PI * turns_until(x, other)
        one = one if z[TOSS_ROOT + i] > 0.0 else math.inf
        other = other if z[TOSS_ROOT + TOSS_MINUS + i] > 0.0 else math.inf
        plus = one <= other
        out = 1.0 if plus else -1.0
        fails = min(one, other)
        over = 1.0 / drive_field(z, TOSS_SPAN, i, plus)
        sine, cosine = (
            drive_field(z, TOSS_CENTRE_SINE, i, plus),
            drive_field(z, TOSS_CENTRE_COSINE, i, plus),
        )
        sh, ch = drive_field(z, TOSS_ROOT, i, plus) * over, -fall * over
        st, ct = z[TOSS_LAG_SINE + i], z[TOSS_LAG_COSINE + i]
        s, c = z[TOSS_SINE + i], z[TOSS_COSINE + i]
        stays = fails > end - _SURELY_LAST
        doubt = fails > end - CLOSE and not stays
        s1 = z[TOSS_END_SINE + i] if stays else sine * ch + cosine * sh
        c1 = z[TOSS_END_COSINE + i] if stays else cosine * ch - sine * sh
        x1 = end if stays else fails
        turning = z[TOSS_TURNING + i]
        before, after = turning * (c * ct - s * st), turning * (c1 * ct - s1 * st)
        work = z[TOSS_WORK + i] + 0.5 * (after - before) * (after + before)
        ask, sign, start = z[TOSS_STATUS + i], z[TOSS_SIGN + i], z[TOSS_START + i]
        holds = z[TOSS_STICKS + i] > 0.0 and ask == 0.0
        begun = out * after + fall * x1 + z[TOSS_RISE + i] * c1
        z[TOSS_X + i] = x1 if holds else x
        z[TOSS_SINE + i] = s1 if holds else s
        z[TOSS_COSINE + i] = c1 if holds else c
        z[TOSS_SIGN + i] = out if holds else sign
        z[TOSS_START + i] = begun if holds else start
        z[TOSS_WORK + i] = work if holds else z[TOSS_WORK + i]
        then = TOSS_GIVEN_UP if doubt else (TOSS_STAYS_STUCK if stays else 0.0)
        z[TOSS_STATUS + i] = then if holds else ask


@lane
def find_falling_piece(z: Any, fall: float) -> int:
    """Which falling piece of the slip has the zero, if one has, and about where; how many have."""
    wanted = 0
    for i in range(LANES):
        x, end, start, sign = z[TOSS_X + i], z[TOSS_END + i], z[TOSS_START + i], z[TOSS_SIGN + i]
        plus = sign > 0.0
        centre, half = drive_field(z, TOSS_CENTRE, i, plus), drive_field(z, TOSS_HALF, i, plus)
        depth, span = drive_field(z, TOSS_DEPTH, i, plus), drive_field(z, TOSS_SPAN, i, plus)
        centre = centre + TWO_PI * turns_until(x, centre + half)  # the first that ends beyond x
        level = start - fall * centre
        cosine, sine = z[TOSS_END_COSINE + i], z[TOSS_END_SINE + i]
        spin = z[TOSS_TURNING + i] * (cosine * z[TOSS_LAG_COSINE + i] - sine * z[TOSS_LAG_SINE + i])
        last = start - fall * end - z[TOSS_RISE + i] * cosine - sign * spin
        whole = centre + half <= end
        first = level <= depth if whole else last <= 0.0
        centre = centre if first else centre + TWO_PI
        least = NARROW * (fall + span)
        doubt = (whole and abs(level - depth) < least) or abs(last) < least
        level = start - fall * centre
        z[TOSS_STEEPEST + i], z[TOSS_LEVEL + i] = centre, level
        z[TOSS_REACHED + i] = first_guess(abs(level), half, depth)
        ask = z[TOSS_STATUS + i]
        z[TOSS_STATUS + i] = TOSS_GIVEN_UP if (doubt and ask == 0.0) else ask
        stops = (first or last <= 0.0) and ask == 0.0 and not doubt
        z[TOSS_FOUND + i] = 0.0 if stops else 2.0
        wanted += 1 if stops else 0
    return wanted


@lane
def search_zero(z: Any, fall: float) -> int:
    """Two search steps for the zeros of slips; how many lanes have not found theirs."""
    for i in range(LANES):
        z[TOSS_TURN_SINE + i], z[TOSS_TURN_COSINE + i], _, _ = lane_turn(z[TOSS_REACHED + i])
    for i in range(LANES):
        plus, y, sine, cosine = (
            z[TOSS_SIGN + i] > 0.0,
            z[TOSS_REACHED + i],
            z[TOSS_TURN_SINE + i],
            z[TOSS_TURN_COSINE + i],
        )
        span, half = drive_field(z, TOSS_SPAN, i, plus), drive_field(z, TOSS_HALF, i, plus)
        step = bent_step(abs(z[TOSS_LEVEL + i]), fall, span, y, sine, cosine)
        z[TOSS_REACHED + i] = min(max(y + step, 0.0), half) if z[TOSS_FOUND + i] == 0.0 else y
    for i in range(LANES):
        z[TOSS_TURN_SINE + i], z[TOSS_TURN_COSINE + i], _, _ = lane_turn(z[TOSS_REACHED + i])
    wanted = 0
    for i in range(LANES):
        plus, y, sine, cosine = (
            z[TOSS_SIGN + i] > 0.0,
            z[TOSS_REACHED + i],
            z[TOSS_TURN_SINE + i],
            z[TOSS_TURN_COSINE + i],
        )
        step, exact = last_step(
            abs(z[TOSS_LEVEL + i]), fall, drive_field(z, TOSS_SPAN, i, plus), y, sine, cosine
        )
        found, more = z[TOSS_FOUND + i], z[TOSS_MORE + i]
        looks = found == 0.0
        z[TOSS_MORE + i] = step if looks else more
        z[TOSS_FOUND + i] = 1.0 if (looks and exact) else found
        wanted += 1 if (looks and not exact) else 0
    return wanted


@lane
def advance_slip(z: Any, fall: float) -> int:
    """Advance the lanes that slip to the end of it; how many have a phase of contact to come."""
    wanted = 0
    for i in range(LANES):
        x, s, c, sign = z[TOSS_X + i], z[TOSS_SINE + i], z[TOSS_COSINE + i], z[TOSS_SIGN + i]
        end, level, found, ask = (
            z[TOSS_END + i],
            z[TOSS_LEVEL + i],
            z[TOSS_FOUND + i],
            z[TOSS_STATUS + i],
        )
        turning, rise, st, ct = (
            z[TOSS_TURNING + i],
            z[TOSS_RISE + i],
            z[TOSS_LAG_SINE + i],
            z[TOSS_LAG_COSINE + i],
        )
        plus, stops = sign > 0.0, found < 2.0
        sine, cosine = (
            drive_field(z, TOSS_CENTRE_SINE, i, plus),
            drive_field(z, TOSS_CENTRE_COSINE, i, plus),
        )
        sy, cy = turned_by(z[TOSS_TURN_SINE + i], z[TOSS_TURN_COSINE + i], z[TOSS_MORE + i])
        y = z[TOSS_REACHED + i] + z[TOSS_MORE + i]
        sy, y = (-sy, -y) if level < 0.0 else (sy, y)
        s1 = sine * cy + cosine * sy if stops else z[TOSS_END_SINE + i]
        c1 = cosine * cy - sine * sy if stops else z[TOSS_END_COSINE + i]
        x1 = z[TOSS_STEEPEST + i] + y if stops else end
        sb, cb = turning * (s1 * ct + c1 * st), turning * (c1 * ct - s1 * st)
        load, need = fall - rise * s1, abs(sb)
        out = 1.0 if sb > 0.0 else -1.0  # against ρ = −sb, contact.slip_out_sign
        before, after = friction_work(z, i, fall, x, s, c), friction_work(z, i, fall, x1, s1, c1)
        close = x1 > end - CLOSE or abs(need - load) < NARROW * (rise + turning)
        doubt = stops and (close or found == 0.0)
        goes = ask == 0.0
        on = goes and stops
        z[TOSS_WORK + i] = z[TOSS_WORK + i] - (sign * (after - before) if goes else 0.0)
        z[TOSS_X + i] = x1 if goes else x
        z[TOSS_SINE + i] = s1 if goes else s
        z[TOSS_COSINE + i] = c1 if goes else c
        z[TOSS_STICKS + i] = 1.0 if need <= load else 0.0
        z[TOSS_SIGN + i] = out if on else sign
        z[TOSS_START + i] = out * cb + fall * x1 + rise * c1 if on else z[TOSS_START + i]
        ask = (TOSS_GIVEN_UP if doubt else (0.0 if stops else TOSS_DONE)) if goes else ask
        z[TOSS_STATUS + i] = ask
        wanted += 1 if ask == 0.0 else 0
    return wanted


@lane
def separation_speed(z: Any, i: int, fall: float) -> float:
    """α̇/ω at the separation."""
    spin = z[TOSS_TURNING + i] * (
        z[TOSS_END_COSINE + i] * z[TOSS_LAG_COSINE + i]
        - z[TOSS_END_SINE + i] * z[TOSS_LAG_SINE + i]
    )
    slid = z[TOSS_SIGN + i] * (
        z[TOSS_START + i] - fall * z[TOSS_END + i] - z[TOSS_RISE + i] * z[TOSS_END_COSINE + i]
    )
    return spin if z[TOSS_STATUS + i] == TOSS_STAYS_STUCK else slid
