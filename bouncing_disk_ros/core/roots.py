"""Certified root finding: steps that cannot pass the first root.

For h ≥ 0 with slope h1 and curvature bounded from below, h'' ≥ −k, the parabola h + h1 δ − k δ²/2
lies below h, so its positive root is a step that no root precedes. k is sharpened by the curvature
at hand: with h'' = −a here and |h'''| ≤ bound, h'' ≥ −(a + bound·δ) and the parabola with k = a +
bound·δ/3 still lies below on [0, δ]. Near a root that makes the step a third-order one.
"""

from __future__ import annotations

import math

from bouncing_disk_ros.core.compilation import kernel

Jet = tuple[float, float, float, float, float]
ROUNDING = 1.1102230246251565e-16  # 2⁻⁵³
INSTANT = 16.0 * ROUNDING
"""Of a period, or of a speed: within it two of them are the same to rounding."""
_LEAST_SQUARED, _MOST_SQUARED = 1e-150, 1e150
"""Between them the square of a number is a normal number."""


@kernel
def parabola_quotient(h: float, h1: float, curvature: float) -> tuple[float, float]:
    """Numerator and denominator of `parabola_root`."""
    q = math.sqrt(h1 * h1 + 2.0 * curvature * h)
    return (2.0 * h, q - h1) if h1 < 0.0 else (h1 + q, curvature)


@kernel
def parabola_root(h: float, h1: float, curvature: float) -> float:
    """Positive root of h + h1 δ − k δ²/2; needs h ≥ 0 and k > 0, or k = 0 and h1 < 0."""
    if h == 0.0 and _LEAST_SQUARED < h1 < _MOST_SQUARED:  # at a launch: √h1² is h1 to the last bit
        return (h1 + h1) / curvature
    over, under = parabola_quotient(h, h1, curvature)
    return over / under


@kernel
def safe_step(h: float, h1: float, a: float, curvature: float, bound: float) -> float:
    """Largest proven step: h'' = −a now, h'' ≥ −k and |h'''| ≤ bound everywhere ahead."""
    near = curvature
    if a > 0.0:
        reach = parabola_root(h, h1, a)
        near = min(curvature, a + bound * reach / 3.0)
    elif h1 < 0.0:
        near = min(curvature, max(a - bound * h / h1 / 3.0, 0.0))
    step = parabola_root(h, h1, near)
    if h1 > 0.0 and near == curvature and bound > 0.0:
        # after a launch with next to no acceleration: half of h1 δ outweighs each of a δ²/2, bound
        # δ³/6
        rise = math.sqrt(3.0 * h1 / bound)
        step = max(step, min(rise, h1 / a) if a > 0.0 else rise)
    return step


@kernel
def one_root_ahead(h: float, h1: float, curvature: float) -> bool:
    """Whether h ≥ 0 falls through zero just once within 2h/|h1|: |h''| ≤ k keeps h' < h1/2."""
    return h1 < 0.0 and 4.0 * curvature * h <= h1 * h1


@kernel
def polished(jet: Jet) -> tuple[float, float]:
    """Step to the root of the fourth-degree Taylor polynomial of a falling h, and the slope there.

    The series of the inverse function: δ = ν − a₂ν² + (2a₂² − a₃)ν³ + (5a₂a₃ − 5a₂³ − a₄)ν⁴ with ν
    = −h/h₁ and aₙ = hₙ/(n! h₁), one division; where `one_root_ahead` holds |a₂ν| ≤ 1/8.
    """
    x = inverse_series(jet, 1.0 / jet[1])
    return x, slope_after(jet, x)


@kernel
def inverse_series(jet: Jet, r: float) -> float:
    """The step of `polished`; r = 1/h₁."""
    h, _, h2, h3, h4 = jet
    v = -h * r
    a2, a3, a4 = 0.5 * h2 * r, (1.0 / 6.0) * h3 * r, (1.0 / 24.0) * h4 * r
    return v - v * v * (a2 - v * ((2.0 * a2 * a2 - a3) + v * (5.0 * a2 * (a3 - a2 * a2) - a4)))


@kernel
def slope_after(jet: Jet, x: float) -> float:
    """The slope a step of x on, by the Taylor polynomial."""
    _, h1, h2, h3, h4 = jet
    return h1 + x * (h2 + x * (0.5 * h3 + x * h4 * (1.0 / 6.0)))
