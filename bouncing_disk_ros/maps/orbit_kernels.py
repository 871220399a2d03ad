"""What curves of orbits ask of one flight and one orbit: clearance, and the return to contact.

Units as in `axial_map`.
"""

from __future__ import annotations

import math

from numba import types

from bouncing_disk_ros.core.arithmetic import TWO_PI, sincos, wrapped
from bouncing_disk_ros.core.compilation import entry
from bouncing_disk_ros.core.flight import Launch, gap_after, separation_phase
from bouncing_disk_ros.core.platform import axial_jet
from bouncing_disk_ros.core.restitution import rebound
from bouncing_disk_ros.maps.axial_map import (
    GRAVITY,
    MAP_CONTACT,
    MapDisk,
    after_impact,
    axial_motion,
    launched_impact,
    next_impact,
)

# ------------------------------------------------------------------------------------------------
# How near a flight comes to the platform before it lands: the least minimum of the gap on the way.
#
# h'' = Γ sin(τ + d) − 1/π, so h' grows only while τ + d is between τ_sep and π − τ_sep (modulo 2π):
# in each of these windows the gap has one minimum, or none.


@entry(types.UniTuple(types.float64, 2)(*[types.float64] * 5))
def clearance_of(
    tau: float, w: float, delay: float, forcing: float, restitution: float
) -> tuple[float, float]:
    """Least minimum of the gap, πg/ω², in the flight of `delay` rad after an impact with (τ, w).

    And how long after the impact it is, rad; (inf, nan) where the gap has none.
    """
    motion = axial_motion(forcing)
    leave = separation_phase(motion, GRAVITY)
    least, place = math.inf, math.nan
    if leave < 0.0:
        return least, place
    sine, cosine = sincos(tau)
    launch = Launch(0.0, sine, cosine, GRAVITY, 0.0, rebound(w, restitution))
    begin = leave - tau
    while begin < delay:
        end = min(begin + math.pi - 2.0 * leave, delay)
        low = max(begin, 0.0)
        if (
            low < end
            and gap_after(motion, launch, low)[1] < 0.0
            and gap_after(motion, launch, end)[1] > 0.0
        ):
            high = end
            middle = 0.5 * (low + high)
            while low < middle < high:
                if gap_after(motion, launch, middle)[1] < 0.0:
                    low = middle
                else:
                    high = middle
                middle = 0.5 * (low + high)
            gap = gap_after(motion, launch, middle)[0]
            if gap < least:
                least, place = gap, middle
        begin += TWO_PI
    return least, place


# ------------------------------------------------------------------------------------------------
# The orbit that leaves contact, followed up to its next contact.


@entry(
    types.Tuple((types.float64, types.float64, types.int64))(
        types.float64, types.float64, types.int64
    )
)
def contact_return(forcing: float, restitution: float, most: int) -> tuple[float, float, int]:
    """Periods from separation to the next one, time in contact before it (rad), impacts before.

    (−1, −1, most) where the first `most` impacts bring no contact, and (0, inf, 0) where contact
    never ends, Γ ≤ 1/π.
    """
    motion = axial_motion(forcing)
    disk = MapDisk(restitution, GRAVITY, 0.0, 0.0, 0.0)
    leave = separation_phase(motion, GRAVITY)
    if leave < 0.0:
        return 0.0, math.inf, 0
    sine, cosine = sincos(leave)
    total, w = launched_impact(
        motion, disk, leave, sine, cosine, axial_jet(motion, sine, cosine, 0.0)
    )
    tau = wrapped(leave + total)
    for i in range(most):
        sine, cosine = sincos(tau)
        jet = axial_jet(motion, sine, cosine, 0.0)
        kind, at, waited = after_impact(motion, disk, tau, jet, rebound(w, restitution))
        if kind == MAP_CONTACT:
            contact = wrapped(leave - at)
            return (total + waited + contact) / TWO_PI, contact, i
        _, tau, w, delay = next_impact(tau, w, forcing, restitution)
        total += delay
    return -1.0, -1.0, most
