"""Certified root finding: steps that cannot pass the first root.

For h ≥ 0 with slope h1 and curvature bounded from below, h'' ≥ −k, the parabola h + h1 δ − k δ²/2 lies below
h, so its positive root is a step that no root precedes. k is sharpened by the curvature at hand: with
h'' = −a here and |h'''| ≤ bound, h'' ≥ −(a + bound·δ) and the parabola with k = a + bound·δ/3 still lies below
on [0, δ]. Near a root that makes the step a third-order one.
"""

from __future__ import annotations

import math

from bouncing_disk_ros.core.arithmetic import kernel

ROUNDING = 1.1102230246251565e-16  # 2⁻⁵³


@kernel
def parabola_root(h: float, h1: float, k: float) -> float:
    """Positive root of h + h1 δ − k δ²/2; needs h ≥ 0 and k > 0, or k = 0 and h1 < 0."""
    q = math.sqrt(h1 * h1 + 2.0 * k * h)
    if h1 < 0.0:
        return 2.0 * h / (q - h1)
    return (h1 + q) / k


@kernel
def safe_step(h: float, h1: float, a: float, k: float, bound: float) -> float:
    """Largest proven step: h'' = −a now, h'' ≥ −k and |h'''| ≤ bound everywhere ahead."""
    if a > 0.0:
        reach = parabola_root(h, h1, a)
        k = min(k, a + bound * reach / 3.0)
    elif h1 < 0.0:
        k = min(k, max(a - bound * h / h1 / 3.0, 0.0))
    return parabola_root(h, h1, k)


@kernel
def step_is_final(step: float, d: float, h1: float, bound: float) -> bool:
    """Whether what `safe_step` neglected moves the root by less than the rounding of d."""
    return bound * step * step * step < 3.0 * ROUNDING * d * abs(h1) or step <= 4.0 * ROUNDING * d
