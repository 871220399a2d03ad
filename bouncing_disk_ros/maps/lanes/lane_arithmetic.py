"""Arithmetic in lanes: selections in place of branches, turns, sine and cosine to a few digits."""

from __future__ import annotations

from typing import Any

from numba import types
from numba.extending import intrinsic

from bouncing_disk_ros.core.arithmetic import (
    C4,
    C6,
    C8,
    C10,
    C12,
    C14,
    C16,
    HALF_PI_1,
    HALF_PI_2,
    HALF_PI_3,
    ROUNDER,
    S3,
    S5,
    S7,
    S9,
    S11,
    S13,
    S15,
    TWO_OVER_PI,
    TWO_PI,
)
from bouncing_disk_ros.maps.lanes.lane_table import lane

COARSE = 0.0562
"""Error of `coarse_turn`, rounded up: 0.05601."""


@intrinsic
def chosen(_context: Any, _condition: Any, _yes: Any, _no: Any) -> Any:
    """`yes if condition else no` of numbers that are both computed: a selection, not a branch."""

    def selection(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        return builder.select(*arguments)

    return types.float64(types.boolean, types.float64, types.float64), selection


@intrinsic
def fused(_context: Any, _a: Any, _b: Any, _c: Any) -> Any:
    """Return a b + c, rounded once where the processor has such an instruction, else twice."""

    def fused_code(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        number = arguments[0].type
        of_three = type(builder.function.function_type)(number, [number] * 3)
        function = builder.module.declare_intrinsic("llvm.fmuladd", [number], of_three)
        return builder.call(function, arguments)

    number = types.float64
    return number(number, number, number), fused_code


def _same_bits(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    return builder.bitcast(arguments[0], context.get_value_type(signature.return_type))


@intrinsic
def bits_of(_context: Any, _number: Any) -> Any:
    """The bits of a float64 as an int64."""
    return types.int64(types.float64), _same_bits


@intrinsic
def number_of(_context: Any, _bits: Any) -> Any:
    """The float64 with these bits."""
    return types.float64(types.int64), _same_bits


@lane
def lane_excesses(r: float) -> tuple[float, float]:
    """`excesses`, fused."""
    z = r * r
    z2 = z * z
    z4 = z2 * z2
    p = fused(z2, fused(S9, z, S7), fused(S5, z, S3))
    p = fused(z4, fused(z2, S15, fused(S13, z, S11)), p)
    q = fused(z2, fused(C10, z, C8), fused(C6, z, C4))
    q = fused(z4, fused(z2, C16, fused(C14, z, C12)), q)
    return (r * z) * p, fused(z2, q, -0.5 * z)


@lane
def lane_turn(x: float) -> tuple[float, float, float, float]:
    """`sincos_excess` for 0 ≤ x < 1e6 without a branch, to a rounding."""
    rounded = fused(x, TWO_OVER_PI, ROUNDER)
    quadrant = bits_of(rounded)  # modulo 4 in its last two bits
    quarters = rounded - ROUNDER
    small = quarters == 0.0
    r = fused(
        -quarters,
        HALF_PI_3,
        fused(-quarters, HALF_PI_2, fused(-quarters, HALF_PI_1, x)),
    )
    se, ce = lane_excesses(r)
    sine, cosine = bits_of(r + se), bits_of(1.0 + ce)
    swap = (sine ^ cosine) & -(quadrant & 1)
    p = number_of(sine ^ swap ^ ((quadrant & 2) << 62))
    q = number_of(cosine ^ swap ^ (((quadrant + 1) & 2) << 62))
    return p, q, chosen(small, se, p - x), chosen(small, ce, q - 1.0)


@lane
def lane_phase_after(tau: float, d: float) -> float:
    """`phase_after` for d < 1e6 without a branch; whole turns are taken off in three parts."""
    grown = tau + d
    turns = (fused(grown, 1.0 / TWO_PI, -0.5) + ROUNDER) - ROUNDER
    four = -4.0 * turns
    grown = fused(four, HALF_PI_3, fused(four, HALF_PI_2, fused(four, HALF_PI_1, grown)))
    grown = chosen(grown < 0.0, grown + TWO_PI, grown)
    return chosen(grown >= TWO_PI, grown - TWO_PI, grown)


@lane
def coarse_turn(x: float) -> tuple[float, float]:
    """Return sin x and cos x to COARSE, 0 ≤ x < 1e6: parabolas through their zeros and extremes."""
    t = x * (1.0 / TWO_PI)
    t = t - ((t + ROUNDER) - ROUNDER)
    q = 0.25 - abs(t)
    return 16.0 * (t * (0.5 - abs(t))), 16.0 * (q * (0.5 - abs(q)))
