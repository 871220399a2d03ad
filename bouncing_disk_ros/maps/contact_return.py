"""The orbit that leaves contact, followed up to its next contact. Units as in `axial_map`."""

from __future__ import annotations

import math

from numba import types

from bouncing_disk_ros.core.arithmetic import TWO_PI, entry, sincos, wrapped
from bouncing_disk_ros.core.flight import separation_phase
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
