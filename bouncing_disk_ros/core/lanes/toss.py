"""Single tosses for many motions at once: what a lane of `core.ride` holds, and how it begins.

Units and formulas of a slip are those of `lanes.slip`; `lanes.contact` carries the lanes from phase
to phase of contact. Sixty-four rides begin and end together: neighbours in a map have as many
phases, and a ride that has left the platform earlier than others of its company is not touched any
more, so that its bits do not depend on them. What is rare is left to `ride.rides`: an event within
1e-6 of separation, a decision that hangs on 1e-9 of what it compares, a root not found soon.
"""

from __future__ import annotations

import math
from typing import Any

from bouncing_disk_ros.core.arithmetic import TWO_PI
from bouncing_disk_ros.core.lanes.arithmetic import lane_turn
from bouncing_disk_ros.core.lanes.lane import LANES, lane
from bouncing_disk_ros.core.lanes.slip import lane_angle

X = 0 * LANES  # phase of the last event; at first of the start
SPEED = 1 * LANES  # α̇ at the start
RISE = 2 * LANES  # γA; at first A
TURNING = 3 * LANES  # Φ
LAG = 4 * LANES
JOB = 5 * LANES  # row, −1: none
SINE = 6 * LANES  # of X
COSINE = 7 * LANES
BEGUN = 8 * LANES  # sine of the phase at the start
LAG_SINE = 9 * LANES
LAG_COSINE = 10 * LANES
END = 11 * LANES  # phase of the separation
END_SINE = 12 * LANES
END_COSINE = 13 * LANES
AHEAD = 14 * LANES  # phase from the start to the separation
STICKS = 15 * LANES  # 1: sticks; 0: slips
SIGN = 16 * LANES  # σ of w_T
START = 17 * LANES  # K
WORK = 18 * LANES  # ∫M β̇ dt, over Iω²
ASK = 19 * LANES  # 0: has a phase of contact to come
STEEPEST = 20 * LANES  # c of the falling piece that has the zero
LEVEL = 21 * LANES  # F of that piece
REACHED = 22 * LANES  # |y|, as far as it is known
TURN_SINE = 23 * LANES  # of REACHED
TURN_COSINE = 24 * LANES
MORE = 25 * LANES  # from REACHED to the zero
FOUND = 26 * LANES  # 0: not yet; 1: the zero; 2: there is none before the separation
# of the drives with σ = 1, and MINUS further on with σ = −1
SPAN = 27 * LANES  # R
CENTRE = 28 * LANES  # c
CENTRE_SINE = 29 * LANES
CENTRE_COSINE = 30 * LANES
HALF = 31 * LANES
DEPTH = 32 * LANES
ROOT = 33 * LANES  # √(R² − fall²); 0: it falls always
MINUS = 7 * LANES
FIELDS = 41

CLOSE = 1e-6  # rad before separation
NARROW = 1e-9  # of what a decision compares
DONE, STUCK, GIVEN_UP = 1.0, 2.0, 3.0


@lane
def of_sign(z: Any, field: int, i: int, plus: bool) -> float:
    """A number of the drive of either sign; both are read, so that there is no branch."""
    above, below = z[field + i], z[field + MINUS + i]
    return above if plus else below


@lane
def begin(z: Any, height: float, grip: float, omega: float) -> None:
    """Sines and cosines, the separation, both drives, and how contact begins; height is g/ω²."""
    fall = grip * height
    for i in range(LANES):
        s, c, _, _ = lane_turn(z[X + i])
        z[SINE + i], z[COSINE + i], z[BEGUN + i] = s, c, s
    for i in range(LANES):
        lag = z[LAG + i]
        s, c, _, _ = lane_turn(abs(lag))
        z[LAG_SINE + i] = s if lag >= 0.0 else -s
        z[LAG_COSINE + i] = c
    for i in range(LANES):
        amplitude = z[RISE + i]
        s = height / amplitude
        c = math.sqrt((1.0 - s) * (1.0 + s))
        end = lane_angle(s, c)
        end = end if end > z[X + i] else end + TWO_PI
        z[RISE + i], z[END + i], z[AHEAD + i] = grip * amplitude, end, end - z[X + i]
        z[END_SINE + i], z[END_COSINE + i] = s, c
    _drive(z, 0, fall)
    _drive(z, MINUS, fall)
    for i in range(LANES):
        s, c, st, ct = z[SINE + i], z[COSINE + i], z[LAG_SINE + i], z[LAG_COSINE + i]
        v, rise, turning = z[SPEED + i] / omega, z[RISE + i], z[TURNING + i]
        sb, cb = turning * (s * ct + c * st), turning * (c * ct - s * st)
        load = fall - rise * s
        slip, need, least = v - cb, abs(sb), NARROW * (rise + turning)
        sticks = slip == 0.0 and need <= load
        up = sb > 0.0 if slip == 0.0 else slip > 0.0
        sign = 1.0 if up else -1.0
        loaded = load > CLOSE * rise
        doubt = not loaded or (abs(slip) < least and abs(need - load) < least)
        z[STICKS + i] = 1.0 if sticks else 0.0
        z[SIGN + i] = sign
        z[START + i] = sign * v + fall * z[X + i] + rise * c
        z[WORK + i] = 0.0
        z[ASK + i] = DONE if z[JOB + i] < 0.0 else (GIVEN_UP if doubt else 0.0)


@lane
def _drive(z: Any, shift: int, fall: float) -> None:
    """The drive of one sign."""
    sign = 1.0 if shift == 0 else -1.0
    for i in range(LANES):
        turned = sign * z[TURNING + i]
        p, q = z[RISE + i] + turned * z[LAG_COSINE + i], turned * z[LAG_SINE + i]
        square = p * p + q * q
        span = math.sqrt(square)
        over = 1.0 / max(span, 1e-300)
        root = math.sqrt(max(square - fall * fall, 0.0))
        half = lane_angle(root, -fall)
        z[SPAN + shift + i] = span
        z[CENTRE_SINE + shift + i], z[CENTRE_COSINE + shift + i] = -p * over, -q * over
        z[HALF + shift + i], z[ROOT + shift + i] = half, root
        z[DEPTH + shift + i] = fall * half + root
    for i in range(LANES):
        turned = sign * z[TURNING + i]
        p, q = z[RISE + i] + turned * z[LAG_COSINE + i], turned * z[LAG_SINE + i]
        z[CENTRE + shift + i] = lane_angle(-p, -q)
