"""Flights of the axial map beside the map itself: clearance, return to contact, the map backwards.

Units as in `axial_map`.
"""

from __future__ import annotations

import math

from numba import types

from bouncing_disk_ros.core.arithmetic import TWO_PI, entry, kernel, sincos, wrapped
from bouncing_disk_ros.core.flight import Launch, gap_after, separation_phase
from bouncing_disk_ros.core.platform import Record, axial_jet
from bouncing_disk_ros.core.restitution import rebound
from bouncing_disk_ros.maps.axial_map import (
    GRAVITY,
    MAP_CONTACT,
    MAP_REST,
    MapDisk,
    after_impact,
    axial_motion,
    landing,
    launched_impact,
    next_impact,
)

# ------------------------------------------------------------------------------------------------
# How near a flight comes to the platform before it lands: the least minimum of the gap on the way.
#
# h'' = Γ sin(τ + d) − 1/π, so h' grows only while τ + d is between τ_sep and π − τ_sep (modulo 2π):
# in each of these windows the gap has one minimum, or none.


@kernel
def flight_clearance(motion: Record, tau: float, u: float, d: float) -> float:
    """Least minimum of the gap inside a flight of d rad from gap = 0; inf where it has none."""
    leave = separation_phase(motion, GRAVITY)
    least = math.inf
    if leave < 0.0:
        return least
    sine, cosine = sincos(tau)
    launch = Launch(0.0, sine, cosine, GRAVITY, 0.0, u)
    begin = leave - tau
    while begin < d:
        end = min(begin + math.pi - 2.0 * leave, d)
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
            least = min(least, gap_after(motion, launch, middle)[0])
        begin += TWO_PI
    return least


@entry(types.float64(*[types.float64] * 5))
def clearance_of(tau: float, w: float, delay: float, forcing: float, restitution: float) -> float:
    """`flight_clearance` of the flight of `delay` rad after an impact with (τ, w), in πg/ω²."""
    return flight_clearance(axial_motion(forcing), tau, rebound(w, restitution), delay)


@entry(types.int64(types.Array(types.float64, 1, "C"), types.float64, types.float64, types.int64))
def impacts_before_contact(state: Record, forcing: float, restitution: float, impacts: int) -> int:
    """Impacts that follow the one with state (τ, w) up to the first complete chatter; −1: none.

    `state` (2,) becomes that of the last impact before it.
    """
    for i in range(impacts):
        kind, tau, w, _ = next_impact(state[0], state[1], forcing, restitution)
        if kind in (MAP_CONTACT, MAP_REST):
            return i
        state[0] = tau
        state[1] = w
    return -1


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


# ------------------------------------------------------------------------------------------------
# The next-collision map backwards, and many states forwards or backwards at once.
#
# A flight run backwards is a flight too: with τ' = π − τ the platform moves as before, the speed of
# arrival is that of launch. So the impact before one with (τ, w) is the landing of a flight
# launched at π − τ with −w, and w there is the speed of that landing over ε. Every state has one,
# for a disk that has always flown; where the flight backwards grazes the platform it jumps. Units
# as in `axial_map`.


@kernel
def previous_impact(
    tau: float, w: float, forcing: float, restitution: float
) -> tuple[float, float, float]:
    """(τ, w, delay) of the impact before the one with (τ, w < 0); ε > 0."""
    motion = axial_motion(forcing)
    back = (math.pi - tau) % TWO_PI
    sine, cosine = sincos(back)
    jet = axial_jet(motion, sine, cosine, 0.0)
    d, w1 = landing(motion, Launch(0.0, sine, cosine, GRAVITY, 0.0, -w), jet, 0.0, math.inf)
    return (tau - d) % TWO_PI, w1 / restitution, d


_FLOAT = types.float64
_STATES = types.Array(_FLOAT, 2, "C")
_COUNTS = types.Array(types.int64, 1, "C")


@entry(types.void(_STATES, _COUNTS, _FLOAT, _FLOAT, _FLOAT))
def iterate_backwards(
    states: Record, counts: Record, forcing: float, restitution: float, fastest: float
) -> None:
    """Take each state (τ, w) so many impacts back, in place; (nan, nan) once |w| > fastest."""
    for i in range(len(states)):
        tau, w = states[i, 0], states[i, 1]
        for _ in range(counts[i]):
            if not -w <= fastest:
                tau, w = math.nan, math.nan
                break
            tau, w, _d = previous_impact(tau, w, forcing, restitution)
        states[i, 0], states[i, 1] = tau, w


@entry(types.void(_STATES, _COUNTS, _FLOAT, _FLOAT))
def iterate_forwards(states: Record, counts: Record, forcing: float, restitution: float) -> None:
    """Take each state (τ, w) so many impacts on, in place; (nan, nan) where contact lasts."""
    for i in range(len(states)):
        tau, w = states[i, 0], states[i, 1]
        for _ in range(counts[i]):
            kind, tau, w, _d = next_impact(tau, w, forcing, restitution)
            if kind == MAP_REST:
                break
        states[i, 0], states[i, 1] = tau, w


@entry(types.void(_STATES, _FLOAT, _STATES))
def land_from_height(flights: Record, forcing: float, out: Record) -> None:
    """The next impacts of disks in flight: of (τ, gap ≥ 0, relative speed) the (τ, w) and delay.

    A gap of 0 and a speed below 0 is an impact at once; so is a gap of 0 at speed 0 on a platform
    that rises, whose impact has w = 0.
    """
    motion = axial_motion(forcing)
    for i in range(len(flights)):
        tau, gap, speed = flights[i, 0], flights[i, 1], flights[i, 2]
        if gap <= 0.0 and speed <= 0.0:
            out[i, 0], out[i, 1], out[i, 2] = tau % TWO_PI, speed, 0.0
            continue
        sine, cosine = sincos(tau % TWO_PI)
        jet = axial_jet(motion, sine, cosine, 0.0)
        launch = Launch(0.0, sine, cosine, GRAVITY, gap, speed)
        d, w = landing(motion, launch, jet, 0.0, math.inf)
        out[i, 0], out[i, 1], out[i, 2] = (tau + d) % TWO_PI, w, d
