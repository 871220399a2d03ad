"""Arithmetic with the same bits on every processor: own sine, cosine, exact sums and products.

No function of the C library is called but the square root, the floor and the fused multiply-add,
which IEEE 754 defines to the last bit.
"""

from __future__ import annotations

import math
from typing import Any

from numba import types
from numba.extending import intrinsic

from bouncing_disk_ros.core.compilation import entry, kernel, rare_kernel

TWO_PI = 2.0 * math.pi
GIGA = 1e9
"""Nanoseconds of a second, for kernels."""
TWO_OVER_PI = 2.0 / math.pi
# π/2 in parts: the first two have 33 bits, so that their product with |k| < 2²⁰ is exact.
HALF_PI_1 = float.fromhex("0x1.921fb54400000p+0")
HALF_PI_2 = float.fromhex("0x1.0b4611a600000p-34")
HALF_PI_3 = float.fromhex("0x1.3198a2e037073p-69")
_HALF_PI_HIGH = math.pi / 2
_QUARTER_PI = math.pi / 4
_HALF_PI_LOW = float.fromhex("0x1.1a62633145c07p-54")
_FEW_TURNS = 1.0e6  # below it k < 2²⁰
ROUNDER = 1.5 * 2.0**52  # adding and subtracting it rounds to the nearest whole number

# Taylor coefficients: on |r| ≤ π/4 the first neglected term is below 5e-17 (sine) and 2e-18
# (cosine).
S3, S5, S7 = -1.0 / 6.0, 1.0 / 120.0, -1.0 / 5040.0
S9, S11, S13, S15 = (
    1.0 / 362880.0,
    -1.0 / 39916800.0,
    1.0 / 6227020800.0,
    -1.0 / 1307674368000.0,
)
C4, C6, C8, C10 = 1.0 / 24.0, -1.0 / 720.0, 1.0 / 40320.0, -1.0 / 3628800.0
C12, C14, C16 = 1.0 / 479001600.0, -1.0 / 87178291200.0, 1.0 / 20922789888000.0


@kernel
def two_sum(a: float, b: float) -> tuple[float, float]:
    """a + b as the rounded sum and its exact error (Knuth)."""
    total = a + b
    t = total - a
    return total, (a - (total - t)) + (b - t)


@kernel
def fast_two_sum(a: float, b: float) -> tuple[float, float]:
    """`two_sum` where |a| ≥ |b| or a is 0 (Dekker), by half the operations.

    With the same bits but where b is −0.
    """
    total = a + b
    return total, b - (total - a)


@intrinsic
def _fused(_typing: Any, _a: Any, _b: Any, _c: Any) -> Any:
    """a b + c, rounded once: by the processor, or by the C library where it cannot.

    Only for results that are exact, which have the same bits in every way to compute them.
    """

    def generate(_context: Any, builder: Any, _signature: Any, given: Any) -> Any:
        return builder.fma(*given)

    return types.float64(types.float64, types.float64, types.float64), generate


@intrinsic
def floor(_typing: Any, _x: Any) -> Any:
    """The largest whole number up to x, as a float64: `math.floor` in numba goes by an integer."""

    def generate(_context: Any, builder: Any, _signature: Any, given: Any) -> Any:
        double = given[0].type
        return builder.call(builder.module.declare_intrinsic("llvm.floor", [double]), given)

    return types.float64(types.float64), generate


@kernel
def two_product(a: float, b: float) -> tuple[float, float]:
    """a b as the rounded product and its exact error; |a b| below 1e308, and 0 or above 1e-290."""
    p = a * b
    return p, _fused(a, b, -p)


@kernel
def pair_sum(ah: float, al: float, bh: float, bl: float) -> tuple[float, float]:
    """Sum of two double-double numbers."""
    total, e = two_sum(ah, bh)
    return two_sum(total, e + (al + bl))


@kernel
def pair_product(ah: float, al: float, bh: float, bl: float) -> tuple[float, float]:
    """Product of two double-double numbers."""
    p, e = two_product(ah, bh)
    return fast_two_sum(p, e + (ah * bl + al * bh))


@kernel
def pair_quotient(ah: float, al: float, b: float) -> tuple[float, float]:
    """Quotient of a double-double number and a float64."""
    q = ah / b
    p, e = two_product(q, b)
    return fast_two_sum(q, ((ah - p) - e + al) / b)


@kernel
def _reduced(x: float) -> tuple[float, int]:
    """Remainder of x after the nearest multiple k of π/2, |r| ≤ π/4, and k modulo 4."""
    quadrant = (x * TWO_OVER_PI + ROUNDER) - ROUNDER
    if abs(x) < _FEW_TURNS:
        r = ((x - quadrant * HALF_PI_1) - quadrant * HALF_PI_2) - quadrant * HALF_PI_3
    else:
        r, quadrant = _far_remainder(x, quadrant)
    return r, int(quadrant) & 3


@rare_kernel
def _far_remainder(x: float, quadrant: float) -> tuple[float, float]:
    """x − kπ/2 and k for a large x: x·2/π is rounded, so k may be one off at the first look."""
    r = _remainder(x, quadrant)
    quadrant += 1.0 if r > _QUARTER_PI else (-1.0 if r < -_QUARTER_PI else 0.0)
    return _remainder(x, quadrant), quadrant


@kernel
def _remainder(x: float, quadrant: float) -> float:
    """x − kπ/2, rounded once."""
    p, e = two_product(quadrant, _HALF_PI_HIGH)
    high, low = two_sum(x - p, -e)
    return high + (low - quadrant * _HALF_PI_LOW)


@kernel
def excesses(r: float) -> tuple[float, float]:
    """sin r − r and cos r − 1 for |r| ≤ π/4, to a few ulp of themselves (Estrin's order)."""
    z = r * r
    z2 = z * z
    z4 = z2 * z2
    p = ((S3 + S5 * z) + z2 * (S7 + S9 * z)) + z4 * ((S11 + S13 * z) + z2 * S15)
    q = ((C4 + C6 * z) + z2 * (C8 + C10 * z)) + z4 * ((C12 + C14 * z) + z2 * C16)
    return (r * z) * p, z2 * q - 0.5 * z


@kernel
def sincos(x: float) -> tuple[float, float]:
    """sin x and cos x, absolute error below 2e-16 for |x| < 1e15."""
    r, quadrant = _reduced(x)
    se, ce = excesses(r)
    s = r + se
    c = 1.0 + ce
    swap = quadrant & 1
    p = c if swap else s
    q = s if swap else c
    return (-p if quadrant & 2 else p), (-q if (quadrant + 1) & 2 else q)


@entry(types.UniTuple(types.float64, 2)(types.float64))
def sine_and_cosine(x: float) -> tuple[float, float]:
    """`sincos` for Python: cached, so that a start does not compile it."""
    return sincos(x)


@kernel
def sincos_excess(x: float) -> tuple[float, float, float, float]:
    """sin x, cos x, sin x − x and cos x − 1; the last two keep their digits for small x."""
    if abs(x) <= 0.78:
        se, ce = excesses(x)
        return x + se, 1.0 + ce, se, ce
    s, c = sincos(x)
    return s, c, s - x, c - 1.0


@rare_kernel
def arcsine(c: float) -> float:
    """Angle in [0, π/2] whose sine is c in [0, 1]: a fit (error 7e-5), then Newton steps."""
    x = 0.5 * math.pi - math.sqrt(1.0 - c) * (
        1.5707288 + c * (-0.2121144 + c * (0.0742610 - c * 0.0187293))
    )
    for _ in range(3):
        sine, cosine = sincos(x)
        if cosine > 1e-8:
            x += (c - sine) / cosine
    return x


@kernel
def arccosine(c: float) -> float:
    """Angle in [0, π/2] whose cosine is c in [0, 1], to 2e-16 or so."""
    steep = c > 0.75  # there the arcsine of c itself has few digits
    x = arcsine(math.sqrt((1.0 - c) * (1.0 + c)) if steep else c)
    return x if steep else 0.5 * math.pi - x


@kernel
def wrapped(x: float) -> float:
    """x in [0, 2π) taken into it by whole turns, for x in (−2π, 4π)."""
    if x >= TWO_PI:
        x -= TWO_PI
    elif x < 0.0:
        x += TWO_PI
    if x >= TWO_PI or x < 0.0:
        return 0.0
    return x


@rare_kernel
def shortest_angle(t: float, phase: float) -> float:
    """Shortest angular distance of an angle t from a phase, in [−π, π]."""
    off = t - phase
    return off - TWO_PI * math.floor(off / TWO_PI + 0.5)
