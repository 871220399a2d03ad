"""The flights of all lanes of `lane_basics`: launch, search, refine, land; and their scheduler.

Loops without branches, of a few dozen instructions: the processor works on several turns at once.
All that a loop reads is read before the first choice, and choices are selections (`chosen`, `&`,
`|`): of `if`, `and` and `or` the compiler makes loads and stores under masks, which processors
without AVX-512 have to do lane by lane.
"""

from __future__ import annotations

import math
from typing import Any

from bouncing_disk_ros.core import chatter, flight, roots
from bouncing_disk_ros.core.platform import ROOM
from bouncing_disk_ros.core.roots import ROUNDING
from bouncing_disk_ros.maps.axial_map import GRAVITY
from bouncing_disk_ros.maps.lanes.lane_basics import (
    BEGIN,
    CHATTER,
    COARSE,
    COSINE,
    CURVATURE,
    DELAY,
    END,
    FORCING,
    IMPACTS_LEFT,
    JERK,
    LANDED,
    LANES,
    MANY_SEARCHES,
    NEEDS_SCALAR,
    PULL,
    RESTITUTION,
    SEARCHES,
    SINE,
    SLOPE,
    SPEED,
    STEP,
    T0,
    T1,
    T2,
    T3,
    TAU,
    TRAJECTORY,
    Scratch,
    W,
    chosen,
    coarse_turn,
    fused,
    lane,
    lane_excesses,
    lane_phase_after,
    lane_turn,
    park_lane,
    rebound,
)

_LEAST_FALL = 0.1  # πg/ω; any speed above 0 is safe
_FLAT = 1e-100  # stands for accelerations a ≤ 0

turned_gap = lane(flight.turned_gap)
slope_after = lane(roots.slope_after)
may_end = lane(chatter.may_end)


@lane
def short_series(jet: tuple[float, float, float, float], r: float) -> float:
    """`inverse_series` without its last term; r = 1/h₁."""
    h, _, h2, h3 = jet
    v = h * r  # −ν
    b2, b3 = h2 * r, h3 * r
    third = fused(b2, 0.5 * b2, (-1.0 / 6.0) * b3)
    return fused(-(v * v), fused(v, third, 0.5 * b2), -v)


@lane
def _leave_platform(z: Scratch) -> None:
    """The platform at the last impact, and when the disk is above all that it can reach.

    BEGIN and END are `above_platform` on the safe side by more than rounding; END = −1: never.
    """
    for i in range(LANES):
        sine, cosine, _, _ = lane_turn(z[TAU + i])
        f = z[FORCING + i]
        z[SINE + i] = sine
        z[COSINE + i] = cosine
        z[PULL + i] = f * sine
        z[JERK + i] = f * cosine
    for i in range(LANES):
        v = z[JERK + i] + z[SPEED + i]
        q = fused(v, v, 2.0 * GRAVITY * fused(z[FORCING + i], -ROOM, z[PULL + i]))
        r = math.sqrt(max(q, 0.0))
        z[T0 + i] = r
        z[BEGIN + i] = fused(v - r, 1.0 / GRAVITY, (16.0 * ROUNDING / GRAVITY) * v)
        z[END + i] = chosen(q > 0.0, (v + r) * ((1.0 - 8.0 * ROUNDING) / GRAVITY), -1.0)


@lane
def _beyond_end(z: Scratch) -> None:
    """A safe step from END on, as numerator T0 and denominator T1.

    There the disk falls with T0 from the greatest height of the platform, which is where
    `coarse_turn` says to COARSE. With a gap of at least h that closes with at most s > 0, and h''
    ≥ −k, the root δ of h = sδ + kδ²/2 is safe, and so is less: from δ ≤ h/s follows h ≤ δ(s +
    kh/(2s)), and δ ≥ 2sh/(2s² + kh). That takes no root, and ends so near the impact that one look
    and `refine_roots` are enough.
    """
    for i in range(LANES):
        f = z[FORCING + i]
        sine, cosine = coarse_turn(z[TAU + i] + z[END + i])
        gap = max(f * ((ROOM - COARSE) - sine), 0.0)
        fall = max(fused(f, cosine + COARSE, z[T0 + i]), _LEAST_FALL)
        twice = fall + fall
        z[T0 + i] = twice * gap
        z[T1 + i] = fused(twice, fall, z[CURVATURE + i] * gap)


@lane
def launch_lanes(z: Scratch) -> int:
    """Where the platform and the disk are at the last impact, and a first safe delay.

    Returns how many lanes have NEEDS_SCALAR set, by others or here: a chatter may be complete.
    """
    _leave_platform(z)
    _beyond_end(z)
    count = 0
    for i in range(LANES):
        f, u, end = z[FORCING + i], z[SPEED + i], z[END + i]
        a = GRAVITY - z[PULL + i]
        # safe_step at h = 0: 2u/k with k sharpened by the acceleration at hand; times p/p
        p = max(a, _FLAT)
        over = (u + u) * p
        under = min(z[CURVATURE + i] * p, fused(p, p, (f * u) * (2.0 / 3.0 * ROOM)))
        leaps = (z[BEGIN + i] * under <= over) & (over < end * under)
        over = chosen(leaps, z[T0 + i], over)
        under = chosen(leaps, z[T1 + i], under)
        d = chosen(leaps, end, 0.0) + over / under
        before = z[DELAY + i]
        fresh = (z[LANDED + i] > 0.0) | (before != before)
        needs = (z[NEEDS_SCALAR + i] > 0.0) | may_end(a, z[JERK + i], f, u, z[CHATTER + i])
        z[DELAY + i] = chosen(fresh, d, before)
        z[NEEDS_SCALAR + i] = chosen(needs, 1.0, 0.0)
        count += needs
    return count


@lane
def search_step(z: Scratch) -> None:
    """One search step: to the root if one is proven ahead, else a step that is safe.

    LANDED: whether one is ahead, near enough for `refine_roots`; STEP: the way from DELAY to it,
    which is not yet added; T0 to T3: gap and derivatives at DELAY.
    """
    for i in range(LANES):
        sx, cx, se, ce = lane_turn(z[DELAY + i])
        z[T0 + i], z[T1 + i], z[T2 + i], z[T3 + i] = sx, cx, se, ce
    for i in range(LANES):
        u, d, curvature = z[SPEED + i], z[DELAY + i], z[CURVATURE + i]
        turn = (z[T0 + i], z[T1 + i], z[T2 + i], z[T3 + i])
        jet = turned_gap(1.0, 1.0, z[PULL + i], z[JERK + i], GRAVITY, 0.0, u, d, turn)
        h, h1, h2, h3, _ = jet
        above = max(h, 0.0)
        fall = max(-h1, 0.0)
        bent = (curvature + curvature) * above
        # `one_root_ahead`, and h < 0.6 |h1|: the root is within 0.6 · 1.18 < π/4
        ahead = bent + bent < fall * min(fall, 2.4 * curvature)
        r = 1.0 / chosen(ahead, h1, curvature)
        z[T0 + i], z[T1 + i], z[T2 + i], z[T3 + i] = h, h1, h2, h3
        z[STEP + i] = r
        z[SLOPE + i] = (
            h1 + math.sqrt(fused(h1, h1, bent))
        ) * r  # parabola_root where none is ahead
        z[LANDED + i] = chosen(ahead, 1.0, 0.0)
    for i in range(LANES):
        d, r, begin, end = z[DELAY + i], z[STEP + i], z[BEGIN + i], z[END + i]
        ahead = z[LANDED + i] > 0.0
        x = short_series((z[T0 + i], z[T1 + i], z[T2 + i], z[T3 + i]), r)
        safe = d + max(z[SLOPE + i], 4.0 * ROUNDING * d)
        safe = chosen((begin <= safe) & (safe < end), end, safe)
        z[STEP + i] = chosen(ahead, x, 0.0)
        z[DELAY + i] = chosen(ahead, d, safe)


@lane
def refine_roots(z: Scratch) -> None:
    """Take the last step to the roots that `search_step` has found, if it is short enough.

    The gap is that of a flight that begins where `search_step` looked, so that a turn below π/4 is
    left, which takes neither a reduction nor a proof.
    """
    for i in range(LANES):
        x, pull, jerk = z[STEP + i], z[T2 + i] + GRAVITY, z[T3 + i]
        se, ce = lane_excesses(x)
        turn = (x + se, 1.0 + ce, se, ce)
        jet = turned_gap(1.0, 1.0, pull, jerk, GRAVITY, z[T0 + i], z[T1 + i], x, turn)
        z[T0 + i], z[T1 + i], z[T2 + i], z[T3 + i], _ = jet
    for i in range(LANES):
        d, x, h1, h2, h3 = z[DELAY + i], z[STEP + i], z[T1 + i], z[T2 + i], z[T3 + i]
        ahead = z[LANDED + i] > 0.0
        y = short_series((z[T0 + i], h1, h2, h3), 1.0 / h1)
        # the terms left out, of y⁴, are below 1e-16; this implies the conditions of
        # flight._impact_ahead: Γ/k⁴ < 3.4 and Γ/k² < 0.8
        short = ahead & (z[CURVATURE + i] * abs(y) < 1e-4 * min(abs(h1), 1.0))
        z[SLOPE + i] = slope_after((0.0, h1, h2, h3, -(h2 + GRAVITY)), y)
        z[LANDED + i] = chosen(short, 1.0, 0.0)
        z[DELAY + i] = chosen(ahead, d + (x + y), d)


@lane
def land_lanes(z: Scratch) -> None:
    """The impact of the lanes whose delay is a root."""
    for i in range(LANES):
        hit = z[LANDED + i]
        landed = hit > 0.0
        tau, w, u = z[TAU + i], z[W + i], z[SPEED + i]
        slope = z[SLOPE + i]
        left = z[IMPACTS_LEFT + i] - hit
        searches = chosen(landed, 0.0, z[SEARCHES + i] + 1.0)
        z[TAU + i] = chosen(landed, lane_phase_after(tau, z[DELAY + i]), tau)
        z[W + i] = chosen(landed, slope, w)
        z[SPEED + i] = chosen(landed, rebound(slope, z[RESTITUTION + i]), u)
        z[IMPACTS_LEFT + i] = left
        z[SEARCHES + i] = searches
        z[NEEDS_SCALAR + i] = chosen((left <= 0.0) | (searches > MANY_SEARCHES), 1.0, 0.0)


# ------------------------------------------------------------------------------------------------
# The scheduler of the lanes: those that need the scalar map get it, all others fly on.


@lane
def run_lanes(z: Scratch, n: int, service: Any, assign: Any, on_landing: Any, data: Any) -> None:
    """Run n trajectories in the lanes; when one is done its lane gets the next.

    Compiled for the three functions that it is given: service(z, i, data) does by the scalar map
    what a lane needs and returns whether its trajectory is done; assign(z, i, job, data) gives it
    the next one; on_landing(z, data) is the impact of the lanes that have landed, and what is
    summed up there.
    """
    todo = done = 0
    for i in range(LANES):
        park_lane(z, i)
        z[NEEDS_SCALAR + i] = 1.0
    while done < n:
        if todo == 0 or launch_lanes(z) > 0:
            for i in range(LANES):
                if z[NEEDS_SCALAR + i] <= 0.0:
                    continue
                if z[TRAJECTORY + i] >= 0.0:
                    if not service(z, i, data):
                        continue
                    done += 1
                if todo == n:
                    park_lane(z, i)
                    continue
                assign(z, i, todo, data)
                todo += 1
        search_step(z)
        refine_roots(z)
        on_landing(z, data)
