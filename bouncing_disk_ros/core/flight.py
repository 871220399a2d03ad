"""Flight: the gap between disk and platform in closed form, and its first root.

gap(d) = gap + u d − g d²/2 − [s(t + d) − s(t) − ṡ(t) d]. The bracket is written with sin ψ − ψ and
cos ψ − 1 of the phase grown ψ, and with polynomials of d, so every term is of order d² with all
its digits: subtracting absolute positions would lose those of a tiny bounce.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from bouncing_disk_ros.core.arithmetic import TWO_PI, arcsine, sincos, sincos_excess
from bouncing_disk_ros.core.compilation import kernel, rare_kernel
from bouncing_disk_ros.core.layout import FADE, STEADY
from bouncing_disk_ros.core.platform import (
    Jet,
    Record,
    Six,
    axial_jet,
    blend_jet,
    bounds_between,
    bounds_from,
    offset_at,
    phase_advance,
    relative_blend,
    sinusoid_jet,
)
from bouncing_disk_ros.core.roots import (
    ROUNDING,
    one_root_ahead,
    polished,
    safe_step,
    slope_after,
)

SEARCH_STEPS = 4096
"""Steps of one search: the work of a call is bounded whatever the motion."""
MOST_GROWTH = 1024.0
"""Rounding may grow by so much, to 1e-13: over a flight of so many rad, or where the platform is so
much faster than the disk. `flown_far` computes what is beyond, `propagate` counts its scale."""
_REGULAR_STEPS = 8  # Newton's steps have converged by then, if rounding lets them
_BRACKET_STEPS = 128  # Newton's steps double their digits; halving takes 53 once the scale is right


class Launch(NamedTuple):
    """The state in which a flight begins."""

    elapsed: float  # s since the motion's origin
    sine: float  # of the forcing phase
    cosine: float
    g: float  # m/s²
    gap: float  # m
    u: float  # its velocity, m/s


@kernel
def turned_gap(
    amplitude: float,
    w: float,
    sine: float,
    cosine: float,
    g: float,
    gap: float,
    u: float,
    d: float,
    turn: tuple[float, float, float, float],
) -> Jet:
    """Gap and its first four derivatives after d seconds; s, c are sin τ, cos τ at the start.

    `turn`: the `sincos_excess` of the phase grown, ωd.
    """
    sx, cx, se, ce = turn
    rise = amplitude * (sine * ce + cosine * se)
    slope = amplitude * w * (cosine * ce - sine * sx)
    pull = amplitude * w * w * (sine * cx + cosine * sx)
    jerk = amplitude * w * w * w * (cosine * cx - sine * sx)
    return gap + (u - 0.5 * g * d) * d - rise, u - g * d - slope, pull - g, jerk, -w * w * pull


@rare_kernel
def fading_gap(motion: Record, launch: Launch, d: float) -> Jet:
    """`turned_gap` over a cross-fade."""
    elapsed, s, c, g, gap, u = launch
    t = motion.duration
    x = d / t
    c1, c2, c3, c4, c5 = relative_blend(motion, elapsed)
    b0, _, _, _, _ = blend_jet((elapsed + motion.fade_lead) / t, t)
    second = x * x * (c2 + x * (c3 + x * (c4 + x * c5)))  # Δb − c1 x
    grown = c1 * x + second
    slope_change = x * (2.0 * c2 + x * (3.0 * c3 + x * (4.0 * c4 + x * 5.0 * c5))) / t
    a0 = motion.a + motion.da * b0
    a1 = motion.da * c1 / t
    w0 = TWO_PI * (motion.f + motion.df * b0)
    dw = TWO_PI * motion.df
    bent = (
        dw
        * t
        * x
        * x
        * (c1 / 2.0 + x * (c2 / 3.0 + x * (c3 / 4.0 + x * (c4 / 5.0 + x * c5 / 6.0))))
    )
    sx, _, se, ce = sincos_excess(w0 * d + bent)
    sine_change = s * ce + c * sx
    cosine_change = c * ce - s * sx
    sine = s + sine_change
    cosine = c + cosine_change
    # ψ − w0 d = bent, so sin ψ − w0 d = (sin ψ − ψ) + bent
    rise = a0 * (s * ce + c * (se + bent)) + a1 * d * sine_change + motion.da * second * sine
    speed_change = motion.da * grown * (w0 + dw * grown) + a0 * dw * grown
    fall = (
        motion.da * slope_change * sine
        + a1 * sine_change
        + speed_change * cosine
        + a0 * w0 * cosine_change
    )
    jet = sinusoid_jet(motion, sine, cosine, elapsed + d)
    return gap + (u - 0.5 * g * d) * d - rise, u - g * d - fall, -g - jet[2], -jet[3], -jet[4]


@kernel
def gap_less(jet: Jet, p: Six, d: float) -> Jet:
    """A gap's jet d seconds on, less what the offset p(t + d) − p(t) − ṗ(t) d takes of it."""
    _, _, p2, p3, p4, p5 = p
    rise = d * d * (p2 / 2.0 + d * (p3 / 6.0 + d * (p4 / 24.0 + d * p5 / 120.0)))
    slope = d * (p2 + d * (p3 / 2.0 + d * (p4 / 6.0 + d * p5 / 24.0)))
    pull = p2 + d * (p3 + d * (p4 / 2.0 + d * p5 / 6.0))
    jerk = p3 + d * (p4 + d * p5 / 2.0)
    return jet[0] - rise, jet[1] - slope, jet[2] - pull, jet[3] - jerk, jet[4] - (p4 + d * p5)


@kernel
def gap_after(motion: Record, launch: Launch, d: float) -> Jet:
    """Gap and its first four derivatives d seconds after the launch."""
    elapsed, sine, cosine, g, gap, u = launch
    if motion.kind != FADE:
        turn = sincos_excess(motion.omega * d)
        jet = turned_gap(motion.a, motion.omega, sine, cosine, g, gap, u, d, turn)
    else:
        jet = fading_gap(motion, launch, d)
    if motion.bending == 0:
        return jet
    time = elapsed + motion.axial_lead
    return gap_less(jet, offset_at(motion.axial, motion.axial_duration, time), d)


@kernel
def flies_far(motion: Record, launch: Launch, d: float) -> bool:
    """Whether `flown_far` computes a flight of d seconds.

    It does so over many periods, and over a cross-fade in which the platform is much faster than
    the disk at either end: `gap_after` would round on the scale of the phase, or of that speed.
    """
    if (
        motion.omega_max * d > MOST_GROWTH
        and phase_advance(motion, launch.elapsed, d) > MOST_GROWTH
    ):
        return True
    if motion.kind != FADE or 2.0 * d <= motion.duration:
        return False
    return motion.s2 * d > MOST_GROWTH * MOST_GROWTH * (
        abs(launch.u) + launch.g * d
    )  # rounded by 1e-10


@rare_kernel
def flown_far(
    motion: Record, launch: Launch, d: float, elapsed_end: float, tau_end: float
) -> tuple[float, float]:
    """Gap and its velocity after a flight of many periods, or across a steep cross-fade.

    The growth of the phase is rounded by 2⁻⁵³ of itself, and so would be the platform's speed. Here
    the platform is taken at the phases of both ends; the disk's own speed changes by g d alone.
    """
    elapsed, sine, cosine, g, gap, u = launch
    s = axial_jet(motion, sine, cosine, elapsed)
    sine_end, cosine_end = sincos(tau_end)
    s_end = axial_jet(motion, sine_end, cosine_end, elapsed_end)
    v = s[1] + u
    x = s[0] + gap + (v - 0.5 * g * d) * d
    return x - s_end[0], (v - g * d) - s_end[1]


@kernel
def above_platform(top: float, x: float, v: float, g: float) -> tuple[float, float]:
    """Interval in which a thrown disk is above `top`, the bound of |s|; (0, 0) if there is none.

    For a disk thrown down faster than it would fall v + r cancels: its conjugate is used there.
    """
    q = v * v + 2.0 * g * (x - top)
    if q <= 0.0:
        return 0.0, 0.0
    r = math.sqrt(q)
    end = (v + r) / g if v > -0.75 * r else 2.0 * (x - top) / (r - v)
    if end <= 0.0:
        return 0.0, 0.0
    begin = 0.0 if x >= top else 2.0 * (top - x) / (v + r)
    return begin, end * (1.0 - 4.0 * ROUNDING)


@kernel
def search_impact(
    motion: Record, launch: Launch, jet: Jet, start: float, horizon: float
) -> tuple[float, float, int]:
    """Delay and w_A < 0 of the first impact later than `start`; (inf, 0) if none before `horizon`.

    `jet` is the platform's position with its derivatives at the launch. Steps are safe ones, except
    two: the stretch above everything that the platform can reach is left out at once, and the last
    step begins where the slope proves one root ahead.
    At a graze the sign of the computed gap at its computed minimum decides: a gap below zero that
    already grows again is no impact. After SEARCH_STEPS steps (d, 1): no impact up to d, the search
    goes on from there. (d, nan): no convergence. The third value is the number of steps.
    """
    elapsed, g, gap, u = launch.elapsed, launch.g, launch.gap, launch.u
    begin, end = above_platform(motion.top, jet[0] + gap, jet[1] + u, g)
    d = start
    over = bounds_from(motion, elapsed, d)
    curvature = g + over.s2
    if (
        start == 0.0
        and gap == 0.0
        and u > 0.0
        and begin <= 2.0 * u / curvature < min(end, over.until)
    ):
        d = end  # a safe step already ends above the platform
    h, h1, h2, h3, h4 = gap, u, -(g + jet[2]), -jet[3], -jet[4]
    if d > 0.0:
        h, h1, h2, h3, h4 = gap_after(motion, launch, d)
    for i in range(SEARCH_STEPS):
        if d > horizon:
            return math.inf, 0.0, i
        if h <= 0.0 and h1 < 0.0:
            return d, h1, i
        h = max(h, 0.0)
        if d >= over.until:
            over = bounds_from(motion, elapsed, d)
            curvature = g + over.s2
        if _proven(motion, elapsed, g, d, h, h1, curvature, over.until):
            jet = (h, h1, h2, h3, h4)
            d, w = _impact_ahead(motion, launch, d, jet, horizon)
            return d, w, i
        step = safe_step(h, h1, -h2, curvature, over.s3)
        if step == 0.0 and h1 >= 0.0:  # next to no speed, or none
            step = 1e-9 / motion.omega_max
        if h1 < 0.0 and step <= 4.0 * ROUNDING * d:
            return d + step, h1, i
        d = min(max(d + step, d * (1.0 + 4.0 * ROUNDING)), over.until)
        d = end if begin <= d < end else d
        h, h1, h2, h3, h4 = gap_after(motion, launch, d)
    return d, 1.0, SEARCH_STEPS


@kernel
def _proven(
    motion: Record,
    elapsed: float,
    g: float,
    d: float,
    h: float,
    h1: float,
    curvature: float,
    until: float,
) -> bool:
    """Whether `one_root_ahead` holds, with bounds over all of the stretch that it speaks of."""
    if not one_root_ahead(h, h1, curvature):
        return False
    end = d - 2.0 * h / h1
    if end <= until:
        return True
    return one_root_ahead(h, h1, g + bounds_between(motion, elapsed, d, end).s2)


@kernel
def _step_within(jet: Jet, d: float, low: float, high: float) -> tuple[float, float]:
    """A step towards the root between low and high, and the slope after it; nan if not known."""
    step, slope = polished(jet)
    newton = -jet[0] / jet[1]
    if not abs(step - newton) <= 0.25 * abs(newton):  # so is nan
        step, slope = newton, slope_after(jet, newton)
    slack = 8.0 * ROUNDING * high
    if not low - slack <= d + step <= high + slack:
        return 0.5 * (low + high) - d, math.nan
    return step, slope


@kernel
def _impact_ahead(
    motion: Record, launch: Launch, d: float, jet: Jet, horizon: float
) -> tuple[float, float]:
    """The root that is proven to lie ahead, by steps of fifth order, and the slope there.

    (inf, 0) past the horizon, where the gap is not even evaluated: a cross-fade ends there. The
    root lies within 2h/|h₁| (`one_root_ahead`), and that bracket shrinks with each sign seen. The
    series of the inverse function holds only over a part of a period (or of a short cross-fade):
    a step that differs from Newton's by more than a quarter is not taken, Newton's is, which
    converges here; what leaves the bracket is replaced by its middle. (d, nan): no convergence.
    """
    rate = motion.omega_max
    if motion.kind != STEADY:  # of the blend's fifth derivative to the bound of its fourth
        rate = max(rate, 2.0 / motion.duration)
    bound = motion.s4 * rate
    low, high = d, d - 2.0 * jet[0] / jet[1]
    for i in range(_BRACKET_STEPS):
        step, slope = _step_within(jet, d, low, high)
        d += step
        if d > horizon:
            jet = gap_after(motion, launch, horizon)
            if jet[0] > 0.0:
                return math.inf, 0.0
            d = high = horizon
            continue
        x = step * step
        fall = abs(jet[1])
        # what the Taylor polynomial and the series of its inverse leave out is below rounding
        short = abs(jet[2] * step) < 1e-4 * fall and abs(jet[3]) * x < 2e-8 * fall
        if short and bound * x * x < 16.0 * ROUNDING * abs(slope):
            return d, slope
        jet = gap_after(motion, launch, d)
        if jet[0] > 0.0:
            low = max(low, d)
        else:
            high = min(high, d)
        least = 2.0 * ROUNDING * d
        if i >= _REGULAR_STEPS:  # of a flight of days the gap itself is rounded by more than that
            fallen = (abs(launch.u) + launch.g * d) * d
            least += 4.0 * ROUNDING * (launch.gap + fallen) / abs(jet[1])
        if high - low <= 2.0 * least or abs(step) <= least:
            return d, jet[1]
    return d, math.nan


@kernel
def never_leaves(motion: Record, g: float) -> bool:
    """Whether the platform moves as a steady sinusoid with Γ ≤ 1/π, to rounding: a may touch 0."""
    steady = motion.da == 0.0 and motion.df == 0.0 and motion.bending == 0
    return steady and motion.a * motion.omega * motion.omega <= g * (1.0 + 8.0 * ROUNDING)


@kernel
def separation_phase(motion: Record, g: float) -> float:
    """τ_sep, sin τ_sep = g/(A ω²) = 1/(πΓ) (paper, eq. 3); −1 where the disk never leaves."""
    if motion.separation_g == g:
        return motion.separation_phase
    if never_leaves(motion, g):
        return -1.0
    return arcsine(g / (motion.a * motion.omega * motion.omega))
