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

from bouncing_disk_ros.core import roots
from bouncing_disk_ros.core.lanes import LANES, lane
from bouncing_disk_ros.core.lanes_flight import lane_turn
from bouncing_disk_ros.core.roots import ROUNDING

STICK, DRIVE, SLIP = 0.0, 1.0, 2.0  # looks for: the end of sticking; of growing slip; of slip
X = 0 * LANES
END = 1 * LANES  # phase of the separation
LAG_SINE = 2 * LANES
LAG_COSINE = 3 * LANES
TURNING = 4 * LANES  # Φ
RISE = 5 * LANES  # γA
FALL = 6 * LANES  # γg/ω²
MODE = 7 * LANES
SIGN = 8 * LANES  # of w_T
START = 9 * LANES  # sign·w_T = START − γ(g/ω²)x − γA cos x − sign·β̇
FROM = 10 * LANES  # what the work of this phase is counted from
WORK = 11 * LANES  # ∫M β̇ dt, over Iω²
LOOKS = 12 * LANES
ASK = 13 * LANES  # 1: finished; 2: given up
JOB = 14 * LANES
BEGUN = 15 * LANES  # sine of the phase at the start
ENTERED = 16  # the fields so far are those that a ride begins with
SINE = 16 * LANES
COSINE = 17 * LANES
STEP = 18 * LANES
PASSES = 19 * LANES  # 1: the step ends at the zero
FIELDS = 20

MOST_LOOKS = 60.0
CLOSE = 1e-6
DONE, GIVEN_UP = 1.0, 2.0
IDLE = (-1.0, 0.0, -math.inf, math.inf)  # job, asks, looks, end

one_root_ahead = lane(roots.one_root_ahead)
parabola_quotient = lane(roots.parabola_quotient)
inverse_series = lane(roots.inverse_series)


@lane
def friction_work(z: Any, i: int, x: float, s: float, c: float) -> float:
    """∫γa β̇ dx = Φ γ[g/ω² sin(x + θ) + A(cos(2x + θ)/4 + x sin θ/2)]."""
    st, ct = z[LAG_SINE + i], z[LAG_COSINE + i]
    sb, cb = s * ct + c * st, c * ct - s * st
    return z[TURNING + i] * (
        z[FALL + i] * sb + z[RISE + i] * (0.25 * (c * cb - s * sb) + 0.5 * x * st)
    )


@lane
def look(z: Any) -> None:
    """One look at the function that each lane watches, and a safe step."""
    for i in range(LANES):
        s, c, _, _ = lane_turn(z[X + i])
        z[SINE + i] = s
        z[COSINE + i] = c
    for i in range(LANES):
        x, s, c, mode, sign = z[X + i], z[SINE + i], z[COSINE + i], z[MODE + i], z[SIGN + i]
        st, ct, turning = z[LAG_SINE + i], z[LAG_COSINE + i], z[TURNING + i]
        rise, fall = z[RISE + i], z[FALL + i]
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
        slip = z[START + i] - fall * x - rise * c - sign * cb
        sticks, slips = mode == STICK, mode == SLIP
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
        z[STEP + i] = step if ahead else safe
        z[PASSES + i] = 1.0 if found else 0.0


@lane
def go(z: Any) -> int:
    """Make the step, or pass into the next phase; how many lanes have finished."""
    wanted = 0
    for i in range(LANES):
        x, s, c, mode, sign = z[X + i], z[SINE + i], z[COSINE + i], z[MODE + i], z[SIGN + i]
        start, work, begin, end = z[START + i], z[WORK + i], z[FROM + i], z[END + i]
        step, looks = z[STEP + i], z[LOOKS + i] + 1.0
        st, ct, turning = z[LAG_SINE + i], z[LAG_COSINE + i], z[TURNING + i]
        rise, fall = z[RISE + i], z[FALL + i]
        ends = x + step >= end
        passes = z[PASSES + i] > 0.0 and not ends
        # the sine and cosine after a step that is short where the lane passes
        x = x + step
        xx = step * step
        sx = step - step * xx * (1.0 / 6.0 - xx * (1.0 / 120.0))
        cx = xx * (0.5 - xx * (1.0 / 24.0))
        s, c = s + (c * sx - s * cx), c - (s * sx + c * cx)
        sb, cb = turning * (s * ct + c * st), turning * (c * ct - s * st)
        drag = friction_work(z, i, x, s, c)
        sticks = mode == STICK
        # DRIVE → SLIP; STICK → DRIVE; SLIP → STICK or DRIVE
        slips = mode == DRIVE
        holds = mode == SLIP and abs(sb) <= fall - rise * s
        out = 1.0 if sb > 0.0 else -1.0  # against ρ = −sb, contact.slip_out_sign
        next_mode = SLIP if slips else (STICK if holds else DRIVE)
        done = 0.5 * (cb * cb - begin) if sticks else -sign * (drag - begin)
        turns = passes and not slips
        z[MODE + i] = next_mode if passes else mode
        z[SIGN + i] = out if turns else sign
        z[START + i] = out * cb + fall * x + rise * c if turns else start
        z[WORK + i] = work + done if turns else work
        z[FROM + i] = (cb * cb if holds else drag) if turns else begin
        near = passes and end - x < CLOSE
        ask = GIVEN_UP if (near or looks > MOST_LOOKS) else (DONE if ends else 0.0)
        z[X + i] = x
        z[LOOKS + i] = looks
        z[ASK + i] = ask
        wanted += 1 if ask > 0.0 else 0
    return wanted
