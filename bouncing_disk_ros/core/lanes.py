"""Many flights at once: the next-collision map in lanes, which the compiler turns into SIMD.

Units of core/axial_map.py. The physics is that of the stepper: the gap, the proof that one root
lies ahead, the steps and the polynomials are its functions, inlined. What SIMD forces to be written
a second time is control flow alone: the range reduction and the search take both sides of each
branch and choose. Anything rare (a chatter that may be complete, contact, a search that is long)
is left to `axial_map.next_impact`.

A lane is a trajectory between two impacts. Its numbers are in one array of float64, field after
field (one array with constant offsets: the compiler must see that the fields do not overlap).
A round is `launch` for the lanes that have just had an impact, two looks at the gap for all, and
`land` for those that have found their root; the others keep their delay and look again in the next
round, so no lane waits for another. There is no fastmath: a lane has the same bits in any place,
in any company and on any processor.
"""

from __future__ import annotations

import math
from typing import Any

from bouncing_disk_ros.core.arithmetic import (
    HALF_PI_1,
    HALF_PI_2,
    HALF_PI_3,
    ROUNDER,
    TWO_OVER_PI,
    TWO_PI,
    excesses,
    kernel,
)
from bouncing_disk_ros.core.axial_map import GRAVITY
from bouncing_disk_ros.core.flight import above_platform, turned_gap
from bouncing_disk_ros.core.impact import chatter_speed
from bouncing_disk_ros.core.platform import ROOM
from bouncing_disk_ros.core.roots import ROUNDING, one_root_ahead, parabola_root, polished

Scratch = Any  # float64 (FIELDS * LANES,)

LANES = 64
FIELDS = 18
TAU = 0 * LANES  # phase of the last impact
W = 1 * LANES  # w_A of the last impact
SINE = 2 * LANES  # of TAU
COSINE = 3 * LANES
SPEED = 4 * LANES  # u after it
FORCING = 5 * LANES
RESTITUTION = 6 * LANES
DELAY = 7 * LANES  # so far: no root before it
BEGIN = 8 * LANES  # between BEGIN and END the disk is above all the platform can reach
END = 9 * LANES
SLOPE = 10 * LANES  # of the gap where the last step ends
SHORT = 11 * LANES  # 1: DELAY is a root
LANDED = 12 * LANES  # 1: has had an impact in this round
LOOKS = 13 * LANES  # looks since the launch
CALM = 14 * LANES  # a slower launch may be the end of a chatter
LEFT = 15 * LANES  # impacts to come
JOB = 16 * LANES  # index of the trajectory, −1: none
FLIGHT = 17 * LANES  # duration of the flight that ended in this round

MANY_LOOKS = 40.0


@kernel
def lane_turn(x: float) -> tuple[float, float, float, float]:
    """`sincos_excess` for 0 ≤ x < 1e6 without a branch, to the same bits."""
    small = abs(x) <= 0.78
    k = (x * TWO_OVER_PI + ROUNDER) - ROUNDER
    k = 0.0 if small else k
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


@kernel
def lane_phase_after(tau: float, d: float) -> float:
    """`phase_after` for d < 1e6 without a branch; whole turns are taken off in three parts."""
    grown = tau + d
    turns = ((grown * (1.0 / TWO_PI) - 0.5) + ROUNDER) - ROUNDER
    four = 4.0 * turns
    grown = ((grown - four * HALF_PI_1) - four * HALF_PI_2) - four * HALF_PI_3
    grown = grown + TWO_PI if grown < 0.0 else grown
    return grown - TWO_PI if grown >= TWO_PI else grown


@kernel
def launch(z: Scratch) -> None:
    """Where the platform and the disk are at the last impact, and a first safe delay."""
    for i in range(LANES):
        f = z[FORCING + i]
        u = z[SPEED + i]
        s, c, _, _ = lane_turn(z[TAU + i])
        top = f * ROOM
        begin, end = above_platform(top, f * s, f * c + u, GRAVITY)
        a = GRAVITY - f * s
        # safe_step at h = 0: 2u/k with k sharpened by the acceleration at hand
        k = GRAVITY + top
        sharp = a * a + top * u * (2.0 / 3.0)
        sharper = a > 0.0 and sharp < k * a
        d = (2.0 * u * a if sharper else 2.0 * u) / (sharp if sharper else k)
        d = end if begin <= d < end else d
        fresh = z[LANDED + i] > 0.0
        z[SINE + i] = s
        z[COSINE + i] = c
        z[BEGIN + i] = begin
        z[END + i] = end
        z[DELAY + i] = d if fresh else z[DELAY + i]
        z[LOOKS + i] = 0.0 if fresh else z[LOOKS + i]


@kernel
def look(z: Scratch) -> None:
    """One look at the gap: a step to the root if one is proven ahead, else a step that is safe."""
    for i in range(LANES):
        f = z[FORCING + i]
        d = z[DELAY + i]
        s, c = z[SINE + i], z[COSINE + i]
        jet = turned_gap(f, 1.0, s, c, GRAVITY, 0.0, z[SPEED + i], d, lane_turn(d))
        h, h1, h2, h3, _ = jet
        top = f * ROOM
        k = GRAVITY + top
        above = max(h, 0.0)
        x, slope = polished(jet)
        ahead = one_root_ahead(above, h1, k)
        y = max(parabola_root(above, h1, k), 4.0 * ROUNDING * d)
        end = z[END + i]
        safe = d + y
        safe = end if z[BEGIN + i] <= safe < end else safe
        # the conditions of flight._impact_ahead
        fall = abs(h1)
        xx = x * x
        short = (
            ahead
            and abs(h2 * x) < 1e-4 * fall
            and abs(h3) * xx < 2e-8 * fall
            and top * xx * xx < 16.0 * ROUNDING * abs(slope)
        )
        z[DELAY + i] = d + x if ahead else safe
        z[SLOPE + i] = slope
        z[SHORT + i] = 1.0 if short else 0.0


@kernel
def land(z: Scratch) -> int:
    """The impact of the lanes whose delay is a root; how many lanes need attention."""
    wanted = 0
    for i in range(LANES):
        landed = z[SHORT + i] > 0.0
        w, d = z[SLOPE + i], z[DELAY + i]
        tau = lane_phase_after(z[TAU + i], d)
        u = -z[RESTITUTION + i] * w
        u = u if landed else z[SPEED + i]
        left = z[LEFT + i] - z[SHORT + i]
        looks = z[LOOKS + i] + 1.0
        z[TAU + i] = tau if landed else z[TAU + i]
        z[W + i] = w if landed else z[W + i]
        z[FLIGHT + i] = d
        z[SPEED + i] = u
        z[LANDED + i] = z[SHORT + i]
        z[LEFT + i] = left
        z[LOOKS + i] = looks
        wanted += 1 if (u <= z[CALM + i] or left <= 0.0 or looks > MANY_LOOKS) else 0
    return wanted


@kernel
def wants_attention(z: Scratch, i: int) -> bool:
    """Whether `land` counted this lane."""
    return bool(z[SPEED + i] <= z[CALM + i] or z[LEFT + i] <= 0.0 or z[LOOKS + i] > MANY_LOOKS)


@kernel
def enter(z: Scratch, i: int, job: int, left: float, state: Any) -> None:
    """Give a lane a trajectory: state = (τ, w, Γ, ε) at an impact."""
    tau, w, forcing, restitution = state
    z[JOB + i] = job
    z[LEFT + i] = left
    z[FORCING + i] = forcing
    z[RESTITUTION + i] = restitution
    z[CALM + i] = chatter_speed(forcing, restitution, GRAVITY)
    place(z, i, tau, w)


@kernel
def place(z: Scratch, i: int, tau: float, w: float) -> None:
    """Put a lane at an impact."""
    z[TAU + i] = tau
    z[W + i] = w
    z[SPEED + i] = -z[RESTITUTION + i] * w
    z[LANDED + i] = 1.0
    z[SHORT + i] = 1.0
    z[LOOKS + i] = 0.0


@kernel
def idle(z: Scratch, i: int) -> None:
    """Give a lane nothing to do: it bounces for ever on a platform that does not move."""
    enter(z, i, -1, math.inf, (0.0, -1.0, 0.0, 1.0))
    z[CALM + i] = -1.0


@kernel
def busy(z: Scratch) -> bool:
    """Whether any lane has a trajectory."""
    most = -1.0
    for i in range(LANES):
        most = max(most, z[JOB + i])
    return most >= 0.0
