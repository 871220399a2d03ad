"""The next-collision map with rotation: what `axial_map` is, and the speed of the disk with it.

Angular velocity unit ωΦ, angle unit Φ: the platform turns as β = sin(τ + θ), and the largest change
of α̇ in one impact is (1 + ε)|w_A|/Γ_T. State: (τ, w, α̇) just before an impact; w = 0 stands for a
disk that lies on the platform. The axial part does not depend on the rotation, but a chatter is
completed in closed form only where friction is decided, which is later: τ and w then differ from
those of `axial_map` by rounding.
"""

from __future__ import annotations

import math

from numba import types

from bouncing_disk_ros.core.arithmetic import sincos
from bouncing_disk_ros.core.chatter import (
    BOUNCES,
    COMPLETES,
    chatter_rotation,
    chatter_sums,
    chatter_verdict,
)
from bouncing_disk_ros.core.compilation import entry, kernel
from bouncing_disk_ros.core.contact_events import load
from bouncing_disk_ros.core.flight import Launch, gap_after, separation_phase
from bouncing_disk_ros.core.forcing_clock import phase_after
from bouncing_disk_ros.core.next_event import Stretch, contact_run
from bouncing_disk_ros.core.platform import (
    Record,
    angular_jet,
    axial_jet,
    steady_motion,
)
from bouncing_disk_ros.core.restitution import axial_push, rebound, speed_after
from bouncing_disk_ros.maps.axial_map import (
    GRAVITY,
    MAP_CONTACT,
    MAP_IMPACT,
    MAP_REST,
    ORBIT_KIND,
    MapDisk,
    flight_tangent,
    landing,
    launched_impact,
)

ORBIT_SPEED, ORBIT_TURNED = ORBIT_KIND + 1, ORBIT_KIND + 2
"""Columns of what `collision_orbit` writes, after those of `axial_map`."""
MEAN_PER_TIME, MEAN_PER_IMPACT, LYAPUNOV, CONTACT_COUNT, MEASURED = range(5)
"""What `measure_attractor` writes into its results."""
AT_REST = (1.5 * math.pi, 0.0, 0.0, 1.0, 0.0)
"""The state of a disk that contact lasts for: at the lowest point, with any vector."""
_MOST_PHASES = 100_000  # of one contact: far more than any has
Collision = tuple[int, float, float, float, float, float]  # kind, τ, w, α̇, delay, angle turned


@kernel
def map_motion(forcing: float, phase_lag: float) -> Record:
    """The platform s = Γ sin τ, β = sin(τ + θ), ω = 1."""
    sine, cosine = sincos(phase_lag)
    return steady_motion(forcing, 1.0, 1.0 / (2.0 * math.pi), 1.0, phase_lag, sine, cosine)


@kernel
def map_disk(restitution: float, angular_forcing: float) -> MapDisk:
    """The disk; Γ_T = inf is one without friction."""
    return MapDisk(restitution, GRAVITY, 1.0 / angular_forcing, 0.0, 0.0)


@kernel
def _sum_nothing(_sums: float, _motion: Record, _disk: Record, _stretch: Stretch) -> None:
    """Nothing is summed up but what `contact_run` returns."""


_contact_until_flight = contact_run(_sum_nothing)


@kernel
def next_collision(motion: Record, disk: Record, tau: float, w: float, omega: float) -> Collision:
    """(kind, τ, w, α̇, delay, angle turned): the impact that follows the one with (τ, w, α̇).

    Motion and disk are those of `map_motion` and `map_disk`; the arguments are not checked. The
    angle is turned between the two impacts. MAP_REST has nan for all but the kind and the delay.
    """
    sine, cosine = sincos(tau)
    jet = axial_jet(motion, sine, cosine, 0.0)
    b = angular_jet(motion, sine, cosine, 0.0)
    if w < 0.0:
        omega = speed_after(omega, b[1], disk.grip * axial_push(w, disk.restitution))
    u = rebound(w, disk.restitution)
    waited = turned = 0.0
    kind = MAP_IMPACT
    if u > 0.0:
        end, waited, sign = chatter_verdict(
            motion, disk, disk.lag, 0.0, sine, cosine, jet, u, omega
        )
        if end == BOUNCES:
            launch = Launch(0.0, sine, cosine, disk.g, 0.0, u)
            d, w1 = landing(motion, launch, jet, 0.0, math.inf)
            return MAP_IMPACT, phase_after(tau, d)[1], w1, omega, d, omega * d
        tau = phase_after(tau, waited)[1]
        if end == COMPLETES:
            push = -gap_after(motion, Launch(0.0, sine, cosine, disk.g, 0.0, u), waited)[1]
            sums = chatter_sums(disk, jet, u)
            sine, cosine = sincos(tau)
            b_end = angular_jet(motion, sine, cosine, 0.0)
            turned, omega = chatter_rotation(
                disk, disk.lag, sign, omega, b, b_end, push, sums, waited
            )
            jet = axial_jet(motion, sine, cosine, 0.0)
    if load(motion, disk.g, jet)[1]:
        if separation_phase(motion, disk.g) < 0.0:
            return MAP_REST, math.nan, math.nan, math.nan, math.inf, math.nan
        kind = MAP_CONTACT
        d, omega, angle, _ = _contact_until_flight(motion, disk, tau, omega, _MOST_PHASES, 0.0)
        waited += d
        turned += angle
        tau = separation_phase(motion, disk.g)
        sine, cosine = sincos(tau)
        jet = axial_jet(motion, sine, cosine, 0.0)
    d, w1 = launched_impact(motion, disk, tau, sine, cosine, jet)
    return kind, phase_after(tau, d)[1], w1, omega, waited + d, turned + omega * d


_FLOAT = types.float64
_VECTOR = types.Array(_FLOAT, 1, "C")
_MATRIX = types.Array(_FLOAT, 2, "C")


@entry(types.int64(*[_FLOAT] * 7, types.int64, _MATRIX))
def collision_orbit(
    tau: float,
    w: float,
    omega: float,
    forcing: float,
    restitution: float,
    phase_lag: float,
    angular_forcing: float,
    impacts: int,
    out: Record,
) -> int:
    """Write the next impacts after (τ, w, α̇) into out (impacts, 6).

    Columns: τ, w, delay, kind (those of `axial_orbit`), SPEED α̇ just before the impact, which is
    that of the flight, and TURNED since the impact before. Returns their number; fewer than asked
    where contact lasts for good, with a last row of kind MAP_REST.
    """
    motion = map_motion(forcing, phase_lag)
    disk = map_disk(restitution, angular_forcing)
    for i in range(impacts):
        kind, tau, w, omega, delay, turned = next_collision(motion, disk, tau, w, omega)
        out[i] = (tau, w, delay, float(kind), omega, turned)
        if kind == MAP_REST:
            return i + 1
    return impacts


@entry(
    types.int64(_VECTOR, _FLOAT, _FLOAT, _FLOAT, _FLOAT, types.int64, types.int64, _MATRIX, _VECTOR)
)
def measure_attractor(
    state: Record,
    forcing: float,
    restitution: float,
    phase_lag: float,
    angular_forcing: float,
    settling: int,
    measured: int,
    out: Record,
    results: Record,
) -> int:
    """Let the orbit of `state` settle, then measure it; `state` becomes the last one.

    state (5,): τ, w, α̇ as in `next_collision`, and a vector (tangent) that the derivatives of the
    axial map act on. out (kept, 6): the last `kept` ≤ measured impacts, columns of
    `collision_orbit`. results (5,): mean α̇ in time and over the impacts, Lyapunov exponent of the
    axial part per impact (−inf where the orbit holds a contact), number of contacts, impacts
    measured. Returns the number of rows written, 0 where contact lasts for good: then the state is
    that of a disk at rest at the lowest point and the results are nan.
    """
    motion = map_motion(forcing, phase_lag)
    disk = map_disk(restitution, angular_forcing)
    tau, w, omega, x, y = state[0], state[1], state[2], state[3], state[4]
    time = angle = speeds = grown = 0.0
    contacts = 0
    kept = len(out)
    for i in range(settling + measured):
        kind, tau1, w1, omega, delay, turned = next_collision(motion, disk, tau, w, omega)
        if kind == MAP_REST:
            state[:] = AT_REST
            results[:] = math.nan
            return 0
        growth = 1.0
        if kind != MAP_CONTACT:
            t = flight_tangent(tau, w, delay, w1, forcing, restitution)
            x, y = t[0] * x + t[1] * y, t[2] * x + t[3] * y
            growth = math.sqrt(x * x + y * y)
            if growth > 0.0:
                x /= growth
                y /= growth
            else:  # ε = 0: a change of w before the impact leaves no trace
                x, y = 1.0, 0.0
        tau, w = tau1, w1
        if i < settling:
            continue
        contacts += kind == MAP_CONTACT
        grown += math.log(growth)
        time += delay
        angle += turned
        speeds += omega
        if i >= settling + measured - kept:
            out[i - settling - measured + kept] = (tau, w, delay, float(kind), omega, turned)
    state[:] = (tau, w, omega, x, y)
    results[MEAN_PER_TIME] = angle / time
    results[MEAN_PER_IMPACT] = speeds / measured
    results[LYAPUNOV] = grown / measured if contacts == 0 else -math.inf
    results[CONTACT_COUNT] = contacts
    results[MEASURED] = measured
    return kept
