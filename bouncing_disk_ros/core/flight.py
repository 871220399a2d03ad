"""Flight: the gap between disk and platform in closed form, and its first root.

gap(d) = gap + u d − g d²/2 − [s(t + d) − s(t) − ṡ(t) d]. The bracket is written with sin ψ − ψ and cos ψ − 1 of
the phase grown ψ, and with polynomials of d, so every term is of order d² with all its digits: subtracting
absolute positions would lose those of a tiny bounce.
"""

from __future__ import annotations

import math

from bouncing_disk_ros.core.arithmetic import TWO_PI, arcsine, kernel, sincos, sincos_excess
from bouncing_disk_ros.core.layout import STEADY
from bouncing_disk_ros.core.platform import Record, blend_jet, relative_blend
from bouncing_disk_ros.core.roots import ROUNDING, safe_step, step_is_final

@kernel
def steady_gap(
    amplitude: float, w: float, s: float, c: float, g: float, gap: float, u: float, d: float
) -> tuple[float, float, float, float]:
    """gap and its first three derivatives after d seconds over a steady motion; s, c = sin τ, cos τ at the start."""
    x = w * d
    sx, cx, se, ce = sincos_excess(x)
    rise = amplitude * (s * ce + c * se)
    slope = amplitude * w * (c * ce - s * sx)
    pull = amplitude * w * w * (s * cx + c * sx)
    jerk = amplitude * w * w * w * (c * cx - s * sx)
    return gap + (u - 0.5 * g * d) * d - rise, u - g * d - slope, pull - g, jerk


@kernel
def fading_gap(
    motion: Record, elapsed: float, s: float, c: float, g: float, gap: float, u: float, d: float
) -> tuple[float, float, float, float]:
    """The same over a cross-fade that began `elapsed` seconds before the start."""
    t = motion.duration
    x = d / t
    c1, c2, c3, c4, c5 = relative_blend(motion, elapsed)
    b0, _, _, _, _ = blend_jet(elapsed / t, t)
    second = x * x * (c2 + x * (c3 + x * (c4 + x * c5)))  # Δb − c1 x
    grown = c1 * x + second
    slope = (c1 + x * (2.0 * c2 + x * (3.0 * c3 + x * (4.0 * c4 + x * 5.0 * c5)))) / t
    slope_change = x * (2.0 * c2 + x * (3.0 * c3 + x * (4.0 * c4 + x * 5.0 * c5))) / t
    curve = (2.0 * c2 + x * (6.0 * c3 + x * (12.0 * c4 + x * 20.0 * c5))) / (t * t)
    a0 = motion.a + motion.da * b0
    a1 = motion.da * c1 / t
    w0 = TWO_PI * (motion.f + motion.df * b0)
    dw = TWO_PI * motion.df
    bent = dw * t * x * x * (c1 / 2.0 + x * (c2 / 3.0 + x * (c3 / 4.0 + x * (c4 / 5.0 + x * c5 / 6.0))))
    sx, cx, se, ce = sincos_excess(w0 * d + bent)
    sine_change = s * ce + c * sx
    cosine_change = c * ce - s * sx
    sine = s + sine_change
    cosine = c + cosine_change
    amplitude = a0 + motion.da * grown
    w = w0 + dw * grown
    # ψ − w0 d = bent, so sin ψ − w0 d = (sin ψ − ψ) + bent
    rise = a0 * (s * ce + c * (se + bent)) + a1 * d * sine_change + motion.da * second * sine
    speed_change = motion.da * grown * w + a0 * dw * grown
    fall = motion.da * slope_change * sine + a1 * sine_change + speed_change * cosine + a0 * w0 * cosine_change
    q2 = dw * slope
    z1 = motion.da * slope
    pull = motion.da * curve * sine + 2.0 * z1 * w * cosine + amplitude * (q2 * cosine - w * w * sine)
    return gap + (u - 0.5 * g * d) * d - rise, u - g * d - fall, -g - pull, 0.0


@kernel
def gap_after(
    motion: Record, elapsed: float, s: float, c: float, g: float, gap: float, u: float, d: float
) -> tuple[float, float, float, float]:
    """gap, gap velocity, gap acceleration and (steady motion only, else 0) jerk after d seconds of flight."""
    if motion.kind == STEADY:
        return steady_gap(motion.a, motion.omega, s, c, g, gap, u, d)
    return fading_gap(motion, elapsed, s, c, g, gap, u, d)


@kernel
def above_platform(top: float, x: float, v: float, g: float) -> tuple[float, float]:
    """Interval of time in which a thrown disk is above `top`, the bound of |s|: no impact there. Empty: (0, 0)."""
    q = v * v + 2.0 * g * (x - top)
    if q <= 0.0:
        return 0.0, 0.0
    r = math.sqrt(q)
    end = (v + r) / g
    if end <= 0.0:
        return 0.0, 0.0
    begin = 0.0 if x >= top else 2.0 * (top - x) / (v + r)
    return begin, end * (1.0 - 4.0 * ROUNDING)


@kernel
def first_impact(
    motion: Record, elapsed: float, tau: float, g: float, gap: float, u: float, start: float, horizon: float
) -> tuple[float, float]:
    """Delay and w_A < 0 of the first impact later than `start`; (inf, 0) where none comes before `horizon`.

    Safe steps only, but for the stretch above everything the platform can reach, which is left out at once.
    At a graze the sign of the computed gap at its computed minimum decides: a gap below zero that already
    grows again is no impact.
    """
    s, c = sincos(tau)
    if motion.kind == STEADY:
        level, climb = motion.a * s, motion.a * motion.omega * c
    else:
        level, climb = _fading_start(motion, elapsed, s, c)
    begin, end = above_platform(motion.top, level + gap, climb + u, g)
    k = g + motion.s2
    d = start
    while d <= horizon:
        if begin <= d < end:
            d = end
            continue
        h, h1, h2, h3 = gap_after(motion, elapsed, s, c, g, gap, u, d)
        if h <= 0.0:
            if h1 < 0.0:
                return d, h1
            h = 0.0
            if h1 == 0.0:
                d += 1e-9 / motion.omega_max
                continue
        step = safe_step(h, h1, -h2, k, motion.s3)
        if h1 < 0.0 and step_is_final(step, d + step, h1 + h2 * step, motion.s3):
            if motion.kind == STEADY:
                return d + step, h1 + step * (h2 + 0.5 * h3 * step)
            d += step
            return d, gap_after(motion, elapsed, s, c, g, gap, u, d)[1]
        d = max(d + step, d * (1.0 + 4.0 * ROUNDING))
    return math.inf, 0.0


@kernel
def _fading_start(motion: Record, elapsed: float, s: float, c: float) -> tuple[float, float]:
    b0, b1, _, _, _ = blend_jet(elapsed / motion.duration, motion.duration)
    a0 = motion.a + motion.da * b0
    return a0 * s, motion.da * b1 * s + a0 * TWO_PI * (motion.f + motion.df * b0) * c


@kernel
def separation_phase(motion: Record, g: float) -> float:
    """τ_sep with sin τ_sep = g/(A ω²) = 1/(πΓ) (paper, eq. 3); −1 where the disk never leaves (Γ ≤ 1/π)."""
    reach = motion.a * motion.omega * motion.omega
    if reach <= g:
        return -1.0
    return arcsine(g / reach)
