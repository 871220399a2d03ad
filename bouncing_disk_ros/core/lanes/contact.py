"""The phases of contact of single tosses in lanes: hold, aim, search, move (see `lanes.toss`).

A round is one stretch of sticking, for the lanes that stick, and one slip. Sticking ends where a
drive of either sign rises through zero, where a falling piece of its slip ends; a slip ends at the
zero of the first of its falling pieces that has one, or at the separation (eq. 3). No loop has a
branch; a lane that is done, or given up, keeps its numbers.
"""

from __future__ import annotations

import math
from typing import Any

from bouncing_disk_ros.core.arithmetic import ROUNDER, TWO_PI
from bouncing_disk_ros.core.lanes.arithmetic import lane_turn
from bouncing_disk_ros.core.lanes.lane import LANES, lane
from bouncing_disk_ros.core.lanes.slip import bent_step, first_guess, last_step, turned_by
from bouncing_disk_ros.core.lanes.toss import (
    ASK,
    CENTRE,
    CENTRE_COSINE,
    CENTRE_SINE,
    CLOSE,
    COSINE,
    DEPTH,
    DONE,
    END,
    END_COSINE,
    END_SINE,
    FOUND,
    GIVEN_UP,
    HALF,
    LAG_COSINE,
    LAG_SINE,
    LEVEL,
    MINUS,
    MORE,
    NARROW,
    REACHED,
    RISE,
    ROOT,
    SIGN,
    SINE,
    SPAN,
    START,
    STEEPEST,
    STICKS,
    STUCK,
    TURN_COSINE,
    TURN_SINE,
    TURNING,
    WORK,
    X,
    of_sign,
)

# A slip out of sticking begins, to rounding, where a falling piece ends. Taking so much (in turns)
# for the same place loses no zero: a slip falls there by its square, less than rounding, and one
# that is at zero there is left to `ride.rides`.
_BEYOND = 1e-12
_SURELY_LAST = 0.5e-8  # rad before separation: half of what events.after_sticking takes for none


@lane
def turns_until(x: float, at: float) -> float:
    """The turns to add to `at` for the first such place beyond x."""
    passed = (x - at) * (1.0 / TWO_PI)
    return ((passed + (0.5 + _BEYOND)) + ROUNDER) - ROUNDER


@lane
def friction_work(z: Any, i: int, fall: float, x: float, s: float, c: float) -> float:
    """∫γa β̇ dx = Φ γ[g/ω² sin(x + θ) + A(cos(2x + θ)/4 + x sin θ/2)]."""
    st, ct = z[LAG_SINE + i], z[LAG_COSINE + i]
    sb, cb = s * ct + c * st, c * ct - s * st
    return z[TURNING + i] * (fall * sb + z[RISE + i] * (0.25 * (c * cb - s * sb) + 0.5 * x * st))


@lane
def hold(z: Any, fall: float) -> None:
    """Carry the lanes that stick to where they slip out, or to the separation."""
    for i in range(LANES):
        x, end = z[X + i], z[END + i]
        one, other = z[CENTRE + i] + z[HALF + i], z[CENTRE + MINUS + i] + z[HALF + MINUS + i]
        one = one + TWO_PI * turns_until(x, one)
        other = other + TWO_PI * turns_until(x, other)
        one = one if z[ROOT + i] > 0.0 else math.inf
        other = other if z[ROOT + MINUS + i] > 0.0 else math.inf
        plus = one <= other
        out = 1.0 if plus else -1.0
        fails = min(one, other)
        over = 1.0 / of_sign(z, SPAN, i, plus)
        sine, cosine = of_sign(z, CENTRE_SINE, i, plus), of_sign(z, CENTRE_COSINE, i, plus)
        sh, ch = of_sign(z, ROOT, i, plus) * over, -fall * over
        st, ct = z[LAG_SINE + i], z[LAG_COSINE + i]
        s, c = z[SINE + i], z[COSINE + i]
        stays = fails > end - _SURELY_LAST
        doubt = fails > end - CLOSE and not stays
        s1 = z[END_SINE + i] if stays else sine * ch + cosine * sh
        c1 = z[END_COSINE + i] if stays else cosine * ch - sine * sh
        x1 = end if stays else fails
        turning = z[TURNING + i]
        before, after = turning * (c * ct - s * st), turning * (c1 * ct - s1 * st)
        work = z[WORK + i] + 0.5 * (after - before) * (after + before)
        ask, sign, start = z[ASK + i], z[SIGN + i], z[START + i]
        holds = z[STICKS + i] > 0.0 and ask == 0.0
        begun = out * after + fall * x1 + z[RISE + i] * c1
        z[X + i] = x1 if holds else x
        z[SINE + i] = s1 if holds else s
        z[COSINE + i] = c1 if holds else c
        z[SIGN + i] = out if holds else sign
        z[START + i] = begun if holds else start
        z[WORK + i] = work if holds else z[WORK + i]
        then = GIVEN_UP if doubt else (STUCK if stays else 0.0)
        z[ASK + i] = then if holds else ask


@lane
def aim(z: Any, fall: float) -> int:
    """Which falling piece of the slip has the zero, if one has, and about where; how many have."""
    wanted = 0
    for i in range(LANES):
        x, end, start, sign = z[X + i], z[END + i], z[START + i], z[SIGN + i]
        plus = sign > 0.0
        centre, half = of_sign(z, CENTRE, i, plus), of_sign(z, HALF, i, plus)
        depth, span = of_sign(z, DEPTH, i, plus), of_sign(z, SPAN, i, plus)
        centre = centre + TWO_PI * turns_until(x, centre + half)  # the first that ends beyond x
        level = start - fall * centre
        c, s = z[END_COSINE + i], z[END_SINE + i]
        spin = z[TURNING + i] * (c * z[LAG_COSINE + i] - s * z[LAG_SINE + i])
        last = start - fall * end - z[RISE + i] * c - sign * spin
        whole = centre + half <= end
        first = level <= depth if whole else last <= 0.0
        centre = centre if first else centre + TWO_PI
        least = NARROW * (fall + span)
        doubt = (whole and abs(level - depth) < least) or abs(last) < least
        level = start - fall * centre
        z[STEEPEST + i], z[LEVEL + i] = centre, level
        z[REACHED + i] = first_guess(abs(level), half, depth)
        ask = z[ASK + i]
        z[ASK + i] = GIVEN_UP if (doubt and ask == 0.0) else ask
        stops = (first or last <= 0.0) and ask == 0.0 and not doubt
        z[FOUND + i] = 0.0 if stops else 2.0
        wanted += 1 if stops else 0
    return wanted


@lane
def search(z: Any, fall: float) -> int:
    """Two looks at the zeros of slips; how many lanes have not found theirs."""
    for i in range(LANES):
        z[TURN_SINE + i], z[TURN_COSINE + i], _, _ = lane_turn(z[REACHED + i])
    for i in range(LANES):
        plus, y, s, c = z[SIGN + i] > 0.0, z[REACHED + i], z[TURN_SINE + i], z[TURN_COSINE + i]
        span, half = of_sign(z, SPAN, i, plus), of_sign(z, HALF, i, plus)
        step = bent_step(abs(z[LEVEL + i]), fall, span, y, s, c)
        z[REACHED + i] = min(max(y + step, 0.0), half) if z[FOUND + i] == 0.0 else y
    for i in range(LANES):
        z[TURN_SINE + i], z[TURN_COSINE + i], _, _ = lane_turn(z[REACHED + i])
    wanted = 0
    for i in range(LANES):
        plus, y, s, c = z[SIGN + i] > 0.0, z[REACHED + i], z[TURN_SINE + i], z[TURN_COSINE + i]
        step, exact = last_step(abs(z[LEVEL + i]), fall, of_sign(z, SPAN, i, plus), y, s, c)
        found, more = z[FOUND + i], z[MORE + i]
        looks = found == 0.0
        z[MORE + i] = step if looks else more
        z[FOUND + i] = 1.0 if (looks and exact) else found
        wanted += 1 if (looks and not exact) else 0
    return wanted


@lane
def move(z: Any, fall: float) -> int:
    """Carry the lanes that slip to the end of it; how many have a phase of contact to come."""
    wanted = 0
    for i in range(LANES):
        x, s, c, sign = z[X + i], z[SINE + i], z[COSINE + i], z[SIGN + i]
        end, level, found, ask = z[END + i], z[LEVEL + i], z[FOUND + i], z[ASK + i]
        turning, rise, st, ct = z[TURNING + i], z[RISE + i], z[LAG_SINE + i], z[LAG_COSINE + i]
        plus, stops = sign > 0.0, found < 2.0
        sine, cosine = of_sign(z, CENTRE_SINE, i, plus), of_sign(z, CENTRE_COSINE, i, plus)
        sy, cy = turned_by(z[TURN_SINE + i], z[TURN_COSINE + i], z[MORE + i])
        y = z[REACHED + i] + z[MORE + i]
        sy, y = (-sy, -y) if level < 0.0 else (sy, y)
        s1 = sine * cy + cosine * sy if stops else z[END_SINE + i]
        c1 = cosine * cy - sine * sy if stops else z[END_COSINE + i]
        x1 = z[STEEPEST + i] + y if stops else end
        sb, cb = turning * (s1 * ct + c1 * st), turning * (c1 * ct - s1 * st)
        load, need = fall - rise * s1, abs(sb)
        out = 1.0 if sb > 0.0 else -1.0  # against ρ = −sb, contact.slip_out_sign
        before, after = friction_work(z, i, fall, x, s, c), friction_work(z, i, fall, x1, s1, c1)
        close = x1 > end - CLOSE or abs(need - load) < NARROW * (rise + turning)
        doubt = stops and (close or found == 0.0)
        goes = ask == 0.0
        on = goes and stops
        z[WORK + i] = z[WORK + i] - (sign * (after - before) if goes else 0.0)
        z[X + i] = x1 if goes else x
        z[SINE + i] = s1 if goes else s
        z[COSINE + i] = c1 if goes else c
        z[STICKS + i] = 1.0 if need <= load else 0.0
        z[SIGN + i] = out if on else sign
        z[START + i] = out * cb + fall * x1 + rise * c1 if on else z[START + i]
        ask = (GIVEN_UP if doubt else (0.0 if stops else DONE)) if goes else ask
        z[ASK + i] = ask
        wanted += 1 if ask == 0.0 else 0
    return wanted


@lane
def separation_speed(z: Any, i: int, fall: float) -> float:
    """α̇/ω at the separation."""
    spin = z[TURNING + i] * (
        z[END_COSINE + i] * z[LAG_COSINE + i] - z[END_SINE + i] * z[LAG_SINE + i]
    )
    slid = z[SIGN + i] * (z[START + i] - fall * z[END + i] - z[RISE + i] * z[END_COSINE + i])
    return spin if z[ASK + i] == STUCK else slid
