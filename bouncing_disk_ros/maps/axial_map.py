"""The axial part of the next-collision map, compiled: from one impact to the next.

Dimensionless: time unit 1/ω, length unit πg/ω², axial velocity unit πg/ω. Gravity is then 1/π, the
platform is s = Γ sin τ, and the map depends on the forcing Γ and the restitution ε alone. Its state
is (τ, w): forcing phase in [0, 2π) and w_A < 0 just before an impact. The functions are those of
the stepper, given a named tuple in place of its records: numba leaves out what a steady motion does
not need.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from numba import types

from bouncing_disk_ros.core.arithmetic import sincos, sincos_excess, wrapped
from bouncing_disk_ros.core.chatter import BOUNCES, chatter_end
from bouncing_disk_ros.core.compilation import entry, kernel
from bouncing_disk_ros.core.contact_events import load, load_returns
from bouncing_disk_ros.core.flight import Launch, never_leaves, search_impact, separation_phase
from bouncing_disk_ros.core.forcing_clock import phase_after
from bouncing_disk_ros.core.platform import Jet, Record, axial_jet, steady_motion
from bouncing_disk_ros.core.restitution import rebound

MAP_IMPACT, MAP_CONTACT, MAP_REST = 0, 1, 2
"""How the next impact came about: after a flight; after a complete chatter and contact
to separation and a flight; not at all, for contact lasts for good (Γ ≤ 1/π)."""

MAP_FLIES = 3
"""Of `after_impact`: the disk bounces."""

GRAVITY = 1.0 / math.pi
"""g in the map's units."""
_SEARCHES = 64  # of `search_impact` for one flight: far more than any needs
ORBIT_TAU, ORBIT_W, ORBIT_DELAY, ORBIT_KIND = range(4)
"""Columns of what `axial_orbit` writes."""


class MapDisk(NamedTuple):
    """The disk in the map's units, with the fields of layout.DISK_DTYPE that kernels read."""

    restitution: float
    g: float
    grip: float  # 1/Γ_T; 0: no friction
    lag: float  # of a load torque: none
    brake: float  # none


@kernel
def axial_motion(forcing: float) -> Record:
    """A platform that moves up and down only: s = Γ sin τ, ω = 1."""
    return steady_motion(forcing, 0.0, 1.0 / (2.0 * math.pi), 1.0, 0.0, 0.0, 1.0)


@kernel
def landing(
    motion: Record, launch: Launch, jet: Jet, start: float, horizon: float
) -> tuple[float, float]:
    """Delay and w_A of the impact that ends a flight (`search_impact`); nan if it is not found."""
    d, w = start, 1.0
    for _ in range(_SEARCHES):
        d, w, _ = search_impact(motion, launch, jet, d, horizon)
        if not w > 0.0:
            return d, w
    return math.nan, math.nan


@kernel
def launched_impact(
    motion: Record, disk: Record, tau: float, sine: float, cosine: float, jet: Jet
) -> tuple[float, float]:
    """Delay and w_A of the first impact after a launch with gap = 0 and u = 0 at τ (rule 2)."""
    start = load_returns(motion, disk, 0.0, tau, math.inf).zero
    launch = Launch(0.0, sine, cosine, disk.g, 0.0, 0.0)
    return landing(motion, launch, jet, start, math.inf)


@kernel
def after_impact(
    motion: Record, disk: Record, tau: float, jet: Jet, u: float
) -> tuple[int, float, float]:
    """What an impact at τ leads to, with u ≥ 0 after it; the phase of it, and the time until then.

    MAP_FLIES: to a flight, at once. MAP_IMPACT: to a launch with u = 0. MAP_CONTACT: to contact
    that ends in separation. MAP_REST: to contact for good.
    """
    waited = 0.0
    if u > 0.0:
        end, waited = chatter_end(motion, disk, jet, u)
        if end == BOUNCES:
            return MAP_FLIES, tau, 0.0
        tau = phase_after(tau, waited)[1]
        sine, cosine = sincos(tau)
        jet = axial_jet(motion, sine, cosine, 0.0)
    if not load(motion, GRAVITY, jet)[1]:
        return MAP_IMPACT, tau, waited
    return (MAP_REST if never_leaves(motion, GRAVITY) else MAP_CONTACT), tau, waited


@kernel
def next_impact(
    tau: float, w: float, forcing: float, restitution: float
) -> tuple[int, float, float, float]:
    """(kind, τ, w, delay): the impact that follows the one with (τ, w); delay in rad.

    τ in [0, 2π), w < 0, Γ ≥ 0, 0 ≤ ε ≤ 1, not checked. MAP_REST has nan for τ, w and inf for the
    delay.
    """
    motion = axial_motion(forcing)
    disk = MapDisk(restitution, GRAVITY, 0.0, 0.0, 0.0)
    sine, cosine = sincos(tau)
    jet = axial_jet(motion, sine, cosine, 0.0)
    u = rebound(w, restitution)
    kind, at, waited = after_impact(motion, disk, tau, jet, u)
    if kind == MAP_FLIES:
        launch = Launch(0.0, sine, cosine, GRAVITY, 0.0, u)
        d, w1 = landing(motion, launch, jet, 0.0, math.inf)
        return MAP_IMPACT, phase_after(tau, d)[1], w1, d
    if kind == MAP_REST:
        return MAP_REST, math.nan, math.nan, math.inf
    if kind == MAP_CONTACT:
        leave = separation_phase(motion, GRAVITY)
        waited += wrapped(leave - at)
        at = leave
    sine, cosine = sincos(at)
    jet = axial_jet(motion, sine, cosine, 0.0)
    d, w1 = launched_impact(motion, disk, at, sine, cosine, jet)
    return kind, phase_after(at, d)[1], w1, waited + d


@entry(
    types.int64(
        types.float64,
        types.float64,
        types.float64,
        types.float64,
        types.int64,
        types.Array(types.float64, 2, "C"),
    )
)
def axial_orbit(
    tau: float, w: float, forcing: float, restitution: float, impacts: int, out: Record
) -> int:
    """Write the next impacts after (τ, w) into out (impacts, 4): columns TAU, W, DELAY, KIND.

    Returns their number; fewer than asked where contact lasts for good, with a last row of kind
    MAP_REST.
    """
    for i in range(impacts):
        kind, tau, w, delay = next_impact(tau, w, forcing, restitution)
        out[i, ORBIT_TAU] = tau
        out[i, ORBIT_W] = w
        out[i, ORBIT_DELAY] = delay
        out[i, ORBIT_KIND] = kind
        if kind == MAP_REST:
            return i + 1
    return impacts


# --- derivatives of one flight in closed form -----------------------------------------------------
# The gap of a flight with u = −ε w is h(d) = u d − d²/(2π) − Γ[sin(τ + d) − sin τ − d cos τ]. By
# h(d) = 0 the delay is a function of τ, w, Γ, ε, whose derivatives follow from the implicit
# function theorem; those of τ₁ = τ + d and w₁ = h'(d) by the chain rule.
Tangent = tuple[float, float, float, float, float, float, float, float]


@kernel
def flight_tangent(
    tau: float, w: float, d: float, w1: float, forcing: float, restitution: float
) -> Tangent:
    """∂τ₁/∂τ, ∂τ₁/∂w, ∂w₁/∂τ, ∂w₁/∂w, ∂τ₁/∂Γ, ∂w₁/∂Γ, ∂τ₁/∂ε, ∂w₁/∂ε of a flight of d rad."""
    sine, cosine = sincos(tau)
    return turned_tangent(sine, cosine, sincos_excess(d), w, d, w1, forcing, restitution)


@kernel
def turned_tangent(
    sine: float,
    cosine: float,
    turn: tuple[float, float, float, float],
    w: float,
    d: float,
    w1: float,
    forcing: float,
    restitution: float,
) -> Tangent:
    """`flight_tangent` where sin τ, cos τ and `sincos_excess` of d are known."""
    sx, cx, se, ce = turn
    bend = forcing * (sine * cx + cosine * sx) - GRAVITY  # h''(d)
    d_tau = forcing * (cosine * ce - sine * se) / w1
    d_u = -d / w1
    d_forcing = (sine * ce + cosine * se) / w1
    return (
        1.0 + d_tau,
        -restitution * d_u,
        forcing * (sine * ce + cosine * sx) + bend * d_tau,
        -restitution * (1.0 + bend * d_u),
        d_forcing,
        sine * sx - cosine * ce + bend * d_forcing,
        -w * d_u,
        -w * (1.0 + bend * d_u),
    )
