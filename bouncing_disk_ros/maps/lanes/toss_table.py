"""Single tosses in lanes: a slip in closed form, and the table of what a lane holds."""

from __future__ import annotations

import math
from typing import Any

from bouncing_disk_ros.core import roots
from bouncing_disk_ros.core.arithmetic import TWO_PI
from bouncing_disk_ros.maps.lanes.lane_table import LANES, lane, lane_turn

# ------------------------------------------------------------------------------------------------
# A slip in closed form, for lanes: its steepest points, its falling pieces, and where it ends.
#
# With x = ωt, speeds over ω and γ = μ a_e/a_g², a slip of sign σ obeys
#
#     σ w_T = K − γ(g/ω²) x − γA cos x − σ Φ cos(x + θ),
#
# so that its drive is one sinusoid, R sin(x + δ) − fall, fall = γg/ω². Counted from a steepest
# point c, where sin(x + δ) = −1,
#
#     σ w_T = F − fall y − R sin y,    y = x − c,    F = K − fall c,
#
# which is Kepler's equation. It falls over |y| < half, half = arccos(−fall/R), or π where R ≤ fall
# and it falls always, and by `depth` = fall half + √(R² − fall²) from c to the end of that piece.
# So a piece has a zero, and just one, if the slip is above zero where the piece begins and not
# above it where the piece ends: the sign there decides, and no zero can be stepped over.

inverse_series = lane(roots.inverse_series)

_TAN_8 = math.sqrt(2.0) - 1.0  # tan(π/8)
# (arctan t − t)/t³ as a polynomial in t² through Chebyshev's points of [0, tan²(π/8)]: with it
# arctan t has a relative error below 5e-18 there
_A3, _A5, _A7, _A9 = (
    -0.3333333333333333,
    0.1999999999999552,
    -0.14285714284666542,
    0.11111111015256361,
)
_A11, _A13, _A15, _A17 = (
    -0.09090904578123903,
    0.07692183190826087,
    -0.06664511447381948,
    0.0585814891280221,
)
_A19, _A21, _A23 = -0.0508544973794026, 0.03923165829558719, -0.01917688711906226

_SHORT = 5e-4  # a step so much shorter than what bends the slip is exact to rounding


@lane
def lane_angle(y: float, x: float) -> float:
    """arctan(y/x) in the quadrant of (x, y), within 4e-16; 0 for (0, 0)."""
    across, along = abs(y), abs(x)
    steep = across > along
    low, high = (along, across) if steep else (across, along)
    turned = low > _TAN_8 * high  # by π/4
    t = (low - high if turned else low) / max(low + high if turned else high, 1e-300)
    z = t * t
    p = _A15 + z * (_A17 + z * (_A19 + z * (_A21 + z * _A23)))
    p = _A3 + z * (_A5 + z * (_A7 + z * (_A9 + z * (_A11 + z * (_A13 + z * p)))))
    angle = t + t * z * p
    angle = 0.25 * math.pi + angle if turned else angle
    angle = 0.5 * math.pi - angle if steep else angle
    angle = math.pi - angle if x < 0.0 else angle
    return -angle if y < 0.0 else angle


@lane
def first_guess(above: float, half: float, depth: float) -> float:
    """About where fall y + R sin y = above ≥ 0, by a parabola with its top at (half, depth)."""
    return half - half * math.sqrt(max(1.0 - above / depth, 0.0))


@lane
def bent_step(
    above: float, fall: float, span: float, y: float, sine: float, cosine: float
) -> float:
    """A step to the zero of above − fall y − R sin y; s, c are sin y, cos y.

    By the parabola, which has its zero near a fold too, then by what the parabola leaves out.
    """
    h, h1 = above - fall * y - span * sine, -fall - span * cosine
    h2, h3 = span * sine, span * cosine
    q = math.sqrt(max(h1 * h1 - 2.0 * h * h2, 0.0))
    d = 2.0 * h / max(q - h1, 1e-300)
    slope = h1 + d * (h2 + d * (0.5 * h3 - d * h2 * (1.0 / 6.0)))
    left = d * d * d * (h3 * (1.0 / 6.0) - d * h2 * (1.0 / 24.0))
    return d - left / min(slope, 0.5 * h1)


@lane
def last_step(
    above: float, fall: float, span: float, y: float, sine: float, cosine: float
) -> tuple[float, bool]:
    """A step by the series of the inverse function, and whether it ends at the zero to rounding."""
    h, h1 = above - fall * y - span * sine, -fall - span * cosine
    h2, h3 = span * sine, span * cosine
    d = inverse_series((h, h1, h2, h3, -h2), 1.0 / h1)
    curvature = fall + span
    return d, curvature * abs(d) < _SHORT * min(-h1, curvature)


@lane
def turned_by(sine: float, cosine: float, d: float) -> tuple[float, float]:
    """Sine and cosine an angle |d| < 5e-4 on, to rounding."""
    dd = d * d
    sd = d - d * dd * (1.0 / 6.0 - dd * (1.0 / 120.0))
    cd = dd * (0.5 - dd * (1.0 / 24.0))
    return sine + (cosine * sd - sine * cd), cosine - (sine * sd + cosine * cd)


# ------------------------------------------------------------------------------------------------
# Field table of single tosses in lanes: what a lane holds, and how a toss begins.
#
# Units and formulas of a slip are those above; `lanes.toss_contact` advances the lanes from phase
# to phase of contact. Sixty-four tosses begin and end together: neighbours in a map have as many
# phases, and a toss that has left the platform earlier than others of its company is not touched
# any more, so that its bits do not depend on them. What is rare is left to `single_toss.toss_each`:
# an event within 1e-6 of separation, a decision that hangs on 1e-9 of what it compares, a root not
# found soon.


TOSS_X = 0 * LANES  # phase of the last event, the start being the first
TOSS_SPEED = 1 * LANES  # α̇ at the start
TOSS_RISE = 2 * LANES  # γA
TOSS_TURNING = 3 * LANES  # Φ
TOSS_LAG = 4 * LANES
TOSS_JOB = 5 * LANES  # row, −1: none
TOSS_SINE = 6 * LANES  # of X
TOSS_COSINE = 7 * LANES
TOSS_BEGUN = 8 * LANES  # sine of the phase at the start
TOSS_LAG_SINE = 9 * LANES
TOSS_LAG_COSINE = 10 * LANES
TOSS_END = 11 * LANES  # phase of the separation
TOSS_END_SINE = 12 * LANES
TOSS_END_COSINE = 13 * LANES
TOSS_AHEAD = 14 * LANES  # phase from the start to the separation
TOSS_STICKS = 15 * LANES  # 1: sticks; 0: slips
TOSS_SIGN = 16 * LANES  # σ of w_T
TOSS_START = 17 * LANES  # K
TOSS_WORK = 18 * LANES  # ∫M β̇ dt, over Iω²
TOSS_STATUS = 19 * LANES  # 0: has a phase of contact to come
TOSS_STEEPEST = 20 * LANES  # c of the falling piece that has the zero
TOSS_LEVEL = 21 * LANES  # F of that piece
TOSS_REACHED = 22 * LANES  # |y|, as far as it is known
TOSS_TURN_SINE = 23 * LANES  # of REACHED
TOSS_TURN_COSINE = 24 * LANES
TOSS_MORE = 25 * LANES  # from REACHED to the zero
TOSS_FOUND = 26 * LANES  # 0: not yet; 1: the zero; 2: there is none before the separation
# of the drives with σ = 1, and MINUS further on with σ = −1
TOSS_SPAN = 27 * LANES  # R
TOSS_CENTRE = 28 * LANES  # c
TOSS_CENTRE_SINE = 29 * LANES
TOSS_CENTRE_COSINE = 30 * LANES
TOSS_HALF = 31 * LANES
TOSS_DEPTH = 32 * LANES
TOSS_ROOT = 33 * LANES  # √(R² − fall²); 0: it falls always
TOSS_MINUS = 7 * LANES
TOSS_AMPLITUDE = 41 * LANES  # A
# what the separation finds, in SI units
TOSS_RESULT_SPEED = 42 * LANES
TOSS_RESULT_DELAY = 43 * LANES
TOSS_RESULT_WORK_AXIAL = 44 * LANES
TOSS_RESULT_WORK_ANGULAR = 45 * LANES
TOSS_FIELDS = 46

CLOSE = 1e-6  # rad before separation
NARROW = 1e-9  # of what a decision compares
TOSS_DONE, TOSS_STAYS_STUCK, TOSS_GIVEN_UP = 1.0, 2.0, 3.0


@lane
def drive_field(z: Any, field: int, i: int, plus: bool) -> float:
    """A number of the drive of either sign; both are read, so that there is no branch."""
    above, below = z[field + i], z[field + TOSS_MINUS + i]
    return above if plus else below


@lane
def begin_tosses(z: Any, height: float, grip: float, omega: float) -> None:
    """Sines and cosines, the separation, both drives, and how contact begins; height is g/ω²."""
    fall = grip * height
    for i in range(LANES):
        sine, cosine, _, _ = lane_turn(z[TOSS_X + i])
        z[TOSS_SINE + i], z[TOSS_COSINE + i], z[TOSS_BEGUN + i] = sine, cosine, sine
    for i in range(LANES):
        lag = z[TOSS_LAG + i]
        sine, cosine, _, _ = lane_turn(abs(lag))
        z[TOSS_LAG_SINE + i] = sine if lag >= 0.0 else -sine
        z[TOSS_LAG_COSINE + i] = cosine
    for i in range(LANES):
        amplitude = z[TOSS_AMPLITUDE + i]
        sine = height / amplitude
        cosine = math.sqrt((1.0 - sine) * (1.0 + sine))
        end = lane_angle(sine, cosine)
        end = end if end > z[TOSS_X + i] else end + TWO_PI
        z[TOSS_RISE + i], z[TOSS_END + i], z[TOSS_AHEAD + i] = (
            grip * amplitude,
            end,
            end - z[TOSS_X + i],
        )
        z[TOSS_END_SINE + i], z[TOSS_END_COSINE + i] = sine, cosine
    _drive(z, 0, fall)
    _drive(z, TOSS_MINUS, fall)
    for i in range(LANES):
        sine, cosine, st, ct = (
            z[TOSS_SINE + i],
            z[TOSS_COSINE + i],
            z[TOSS_LAG_SINE + i],
            z[TOSS_LAG_COSINE + i],
        )
        v, rise, turning = z[TOSS_SPEED + i] / omega, z[TOSS_RISE + i], z[TOSS_TURNING + i]
        sb, cb = turning * (sine * ct + cosine * st), turning * (cosine * ct - sine * st)
        load = fall - rise * sine
        slip, need, least = v - cb, abs(sb), NARROW * (rise + turning)
        sticks = slip == 0.0 and need <= load
        up = sb > 0.0 if slip == 0.0 else slip > 0.0
        sign = 1.0 if up else -1.0
        loaded = load > CLOSE * rise
        doubt = not loaded or (abs(slip) < least and abs(need - load) < least)
        z[TOSS_STICKS + i] = 1.0 if sticks else 0.0
        z[TOSS_SIGN + i] = sign
        z[TOSS_START + i] = sign * v + fall * z[TOSS_X + i] + rise * cosine
        z[TOSS_WORK + i] = 0.0
        z[TOSS_STATUS + i] = (
            TOSS_DONE if z[TOSS_JOB + i] < 0.0 else (TOSS_GIVEN_UP if doubt else 0.0)
        )


@lane
def _drive(z: Any, shift: int, fall: float) -> None:
    """The drive of one sign."""
    sign = 1.0 if shift == 0 else -1.0
    for i in range(LANES):
        turned = sign * z[TOSS_TURNING + i]
        p, q = z[TOSS_RISE + i] + turned * z[TOSS_LAG_COSINE + i], turned * z[TOSS_LAG_SINE + i]
        square = p * p + q * q
        span = math.sqrt(square)
        over = 1.0 / max(span, 1e-300)
        root = math.sqrt(max(square - fall * fall, 0.0))
        half = lane_angle(root, -fall)
        z[TOSS_SPAN + shift + i] = span
        z[TOSS_CENTRE_SINE + shift + i], z[TOSS_CENTRE_COSINE + shift + i] = -p * over, -q * over
        z[TOSS_HALF + shift + i], z[TOSS_ROOT + shift + i] = half, root
        z[TOSS_DEPTH + shift + i] = fall * half + root
    for i in range(LANES):
        turned = sign * z[TOSS_TURNING + i]
        p, q = z[TOSS_RISE + i] + turned * z[TOSS_LAG_COSINE + i], turned * z[TOSS_LAG_SINE + i]
        z[TOSS_CENTRE + shift + i] = lane_angle(-p, -q)
