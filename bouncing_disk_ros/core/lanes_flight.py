"""The flights of all lanes, without a branch: launch, look at the gap, land (see `lanes`)."""

from __future__ import annotations

import math

from bouncing_disk_ros.core import arithmetic, flight, impact, roots
from bouncing_disk_ros.core.arithmetic import (
    HALF_PI_1,
    HALF_PI_2,
    HALF_PI_3,
    ROUNDER,
    TWO_OVER_PI,
    TWO_PI,
)
from bouncing_disk_ros.core.axial_map import GRAVITY
from bouncing_disk_ros.core.lanes import (
    ASK,
    BEGIN,
    CHATTER,
    COSINE,
    DELAY,
    END,
    FORCING,
    LANDED,
    LANES,
    LEFT,
    LOOKS,
    MANY_LOOKS,
    RESTITUTION,
    SINE,
    SLOPE,
    SPEED,
    STEP,
    T0,
    T1,
    T2,
    T3,
    TAU,
    Scratch,
    W,
    lane,
)
from bouncing_disk_ros.core.platform import ROOM
from bouncing_disk_ros.core.roots import ROUNDING

excesses = lane(arithmetic.excesses)
turned_gap = lane(flight.turned_gap)
one_root_ahead = lane(roots.one_root_ahead)
parabola_quotient = lane(roots.parabola_quotient)
inverse_series = lane(roots.inverse_series)
slope_after = lane(roots.slope_after)
may_end = lane(impact.may_end)


@lane
def lane_turn(x: float) -> tuple[float, float, float, float]:
    """`sincos_excess` for 0 ≤ x < 1e6 without a branch, to the same bits."""
    k = (x * TWO_OVER_PI + ROUNDER) - ROUNDER
    small = k == 0.0
    r = ((x - k * HALF_PI_1) - k * HALF_PI_2) - k * HALF_PI_3
    se, ce = excesses(r)
    s = r + se
    c = 1.0 + ce
    # k modulo 4: the sum below is a quarter of k rounded down
    m = k - 4.0 * (((0.25 * k - 0.375) + ROUNDER) - ROUNDER)
    odd = abs(m - 2.0) == 1.0
    p = c if odd else s
    q = s if odd else c
    p = -p if m >= 2.0 else p
    q = -q if abs(m - 1.5) < 1.0 else q
    return p, q, (se if small else p - x), (ce if small else q - 1.0)


@lane
def lane_phase_after(tau: float, d: float) -> float:
    """`phase_after` for d < 1e6 without a branch; whole turns are taken off in three parts."""
    grown = tau + d
    turns = ((grown * (1.0 / TWO_PI) - 0.5) + ROUNDER) - ROUNDER
    four = 4.0 * turns
    grown = ((grown - four * HALF_PI_1) - four * HALF_PI_2) - four * HALF_PI_3
    grown = grown + TWO_PI if grown < 0.0 else grown
    return grown - TWO_PI if grown >= TWO_PI else grown


@lane
def lane_above(top: float, x: float, v: float) -> tuple[float, float]:
    """`above_platform` without a branch and a division, on the safe side by more than rounding."""
    q = v * v + 2.0 * GRAVITY * (x - top)
    r = math.sqrt(max(q, 0.0))
    begin = (v - r) * (1.0 / GRAVITY) + (16.0 * ROUNDING / GRAVITY) * v
    end = (v + r) * ((1.0 - 8.0 * ROUNDING) / GRAVITY)
    return begin, (end if q > 0.0 else -1.0)


@lane
def launch(z: Scratch) -> int:
    """Where the platform and the disk are at the last impact, and a first safe delay.

    Returns how many lanes have ASK set, be it by others or here: where a chatter may be complete.
    """
    for i in range(LANES):
        s, c, _, _ = lane_turn(z[TAU + i])
        z[SINE + i] = s
        z[COSINE + i] = c
    for i in range(LANES):
        f = z[FORCING + i]
        begin, end = lane_above(f * ROOM, f * z[SINE + i], f * z[COSINE + i] + z[SPEED + i])
        z[BEGIN + i] = begin
        z[END + i] = end
    wanted = 0
    for i in range(LANES):
        f, u, end = z[FORCING + i], z[SPEED + i], z[END + i]
        top = f * ROOM
        a = GRAVITY - f * z[SINE + i]
        # safe_step at h = 0: 2u/k with k sharpened by the acceleration at hand
        k = GRAVITY + top
        sharp = a * a + top * u * (2.0 / 3.0)
        sharper = a > 0.0 and sharp < k * a
        d = (2.0 * u * a if sharper else 2.0 * u) / (sharp if sharper else k)
        d = end if z[BEGIN + i] <= d < end else d
        before, looks, ask = z[DELAY + i], z[LOOKS + i], z[ASK + i]
        fresh = z[LANDED + i] > 0.0 or before != before
        asks = ask > 0.0 or may_end(a, f * z[COSINE + i], top, u, z[CHATTER + i])
        z[DELAY + i] = d if fresh else before
        z[LOOKS + i] = 0.0 if fresh else looks
        z[ASK + i] = 1.0 if asks else 0.0
        wanted += 1 if asks else 0
    return wanted


@lane
def look(z: Scratch, last: bool) -> None:
    """One look at the gap: a step to the root if one is proven ahead, else a step that is safe.

    Loops of a few dozen instructions: the processor works on several turns of such a loop at once.
    """
    for i in range(LANES):
        sx, cx, se, ce = lane_turn(z[DELAY + i])
        z[T0 + i], z[T1 + i], z[T2 + i], z[T3 + i] = sx, cx, se, ce
    for i in range(LANES):
        f, u, d = z[FORCING + i], z[SPEED + i], z[DELAY + i]
        turn = (z[T0 + i], z[T1 + i], z[T2 + i], z[T3 + i])
        jet = turned_gap(f, 1.0, z[SINE + i], z[COSINE + i], GRAVITY, 0.0, u, d, turn)
        h, h1, h2, h3, _ = jet
        k = GRAVITY + f * ROOM
        above = max(h, 0.0)
        ahead = one_root_ahead(above, h1, k)
        over, under = parabola_quotient(above, h1, k)
        z[T0 + i], z[T1 + i], z[T2 + i], z[T3 + i] = h, h1, h2, h3
        z[STEP + i] = (1.0 if ahead else over) / (h1 if ahead else under)
        z[LANDED + i] = 1.0 if ahead else 0.0
    for i in range(LANES):
        d, r, end = z[DELAY + i], z[STEP + i], z[END + i]
        ahead = z[LANDED + i] > 0.0
        h1, h2 = z[T1 + i], z[T2 + i]
        jet = (z[T0 + i], h1, h2, z[T3 + i], -(h2 + GRAVITY))  # ω = 1
        x = inverse_series(jet, r)
        safe = d + max(r, 4.0 * ROUNDING * d)
        safe = end if z[BEGIN + i] <= safe < end else safe
        z[DELAY + i] = d + x if ahead else safe
        if last:
            # implies the conditions of flight._impact_ahead: Γ/k⁴ < 3.4 and Γ/k² < 0.8
            k = GRAVITY + z[FORCING + i]
            short = ahead and k * abs(x) < 1e-4 * min(abs(h1), 1.0)
            z[SLOPE + i] = slope_after(jet, x)
            z[LANDED + i] = 1.0 if short else 0.0


@lane
def land(z: Scratch) -> None:
    """The impact of the lanes whose delay is a root."""
    for i in range(LANES):
        hit = z[LANDED + i]
        landed = hit > 0.0
        tau, w, u = z[TAU + i], z[W + i], z[SPEED + i]
        after = lane_phase_after(tau, z[DELAY + i])
        slope = z[SLOPE + i]
        u = -z[RESTITUTION + i] * slope if landed else u
        left = z[LEFT + i] - hit
        looks = z[LOOKS + i] + 1.0
        z[TAU + i] = after if landed else tau
        z[W + i] = slope if landed else w
        z[SPEED + i] = u
        z[LEFT + i] = left
        z[LOOKS + i] = looks
        z[ASK + i] = 1.0 if (left <= 0.0 or looks > MANY_LOOKS) else 0.0
