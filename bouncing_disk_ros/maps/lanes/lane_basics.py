"""Many flights at once: the next-collision map in lanes, which the compiler turns into SIMD.

Units of maps/axial_map.py. The physics is that of the stepper: the gap, the proof that one
root lies ahead, the steps and the polynomials are its functions, inlined (`lane`). What SIMD forces
to be written a second time is control flow alone: the range reduction, the wrapping of the phase
and the search take both sides of each branch and choose. Anything rare (a chatter that may be
complete, contact, a search that is long) is left to `axial_map.next_impact`, one lane at a time.

A lane is a trajectory between two impacts. Its numbers are in one array of float64, field after
field (one array with constant offsets: the compiler must see that the fields do not overlap). A
round is `launch_lanes` for the lanes that have just had an impact, `search_step` for all,
`refine_roots` for those that see one root ahead, and `land_lanes` for those that have found it; the
others keep their delay and search on in the next round, so no lane waits for another. A lane that
is done is given the next trajectory at once. Most flights take one round: the first delay is
certified as all others are, and ends shortly before the impact.

The compiler cuts the lanes into vectors of the width that the processor has (NUMBA_CPU_NAME is
honoured, numba's cache distinguishes processors). Of 16, 32, 64 and 128 lanes, 64 were the best or
no further from it than the measurement, with vectors of 2, 4 and 8 numbers: fewer leave vectors of
8 idle between loops (16 took 1.6 times as long), more gain nothing. Each trajectory is computed
from its own numbers by the same instructions in any lane: it has the same bits in any order,
company, number of lanes and number of threads, and on all processors with fused multiply-add (AVX2,
AVX-512); without it (SSE) sums differ by their rounding.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numba import types
from numba.extending import intrinsic
from numpy.typing import NDArray

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
    sincos,
)
from bouncing_disk_ros.core.chatter import chatter_scale
from bouncing_disk_ros.core.compilation import Kernel, add_attribute, entry, inner, kernel
from bouncing_disk_ros.core.platform import ROOM, axial_jet
from bouncing_disk_ros.core.restitution import rebound as scalar_rebound
from bouncing_disk_ros.core.restitution import rebounded
from bouncing_disk_ros.maps.axial_map import GRAVITY, MapDisk, after_impact, axial_motion

Scratch = Any  # float64 (FIELDS * LANES,)

LANES = 64
TAU = 0 * LANES  # phase of the last impact
W = 1 * LANES  # w_A of the last impact
SINE = 2 * LANES  # of TAU
COSINE = 3 * LANES
SPEED = 4 * LANES  # u after it
FORCING = 5 * LANES
RESTITUTION = 6 * LANES
DELAY = 7 * LANES  # so far: no root before it
BEGIN = 8 * LANES  # between BEGIN and END the disk is above all the platform can reach
END = 9 * LANES
SLOPE = 10 * LANES  # of the gap where the last step ends
LANDED = 11 * LANES  # 1: DELAY is a root; 0: not yet
SEARCHES = 12 * LANES  # rounds since the launch
CHATTER = 13 * LANES  # `chatter_scale`
IMPACTS_LEFT = 14 * LANES  # impacts to come
TRAJECTORY = 15 * LANES  # index of the trajectory, −1: none
NEEDS_SCALAR = 16 * LANES  # 1: its next step is left to the scalar map
STEP = 17 * LANES  # a step, or 1/h₁
T0, T1, T2, T3 = 18 * LANES, 19 * LANES, 20 * LANES, 21 * LANES  # between loops of one function
PULL = 22 * LANES  # Γ sin τ
JERK = 23 * LANES  # Γ cos τ
CURVATURE = 24 * LANES  # bound of the second derivative of the gap
FIELDS = 25

MANY_SEARCHES = 40.0  # rounds of a flight; a longer search is left to the scalar map


def lane(function: Kernel) -> Kernel:
    """Compile an inner function for lanes; a kernel of the core is compiled once more.

    A product and a sum are one rounding only where `fused` says so: a
    compiler that may choose which products of a sum it fuses chooses anew with each compilation.
    Nothing is reordered, and inf and nan are as they should be. Arrays are not counted (`_nrt`),
    which costs more than a flight, and so none can be made.
    """
    python = getattr(function, "py_func", function)
    return inner(python, inlined=True, _nrt=False, fastmath={"nsz"})


rebound = lane(rebounded)


def lane_entry(*signature: object) -> Callable[[Kernel], Kernel]:
    """`entry` for a function whose arrays are not counted."""
    return entry(*signature, scalar=False, _nrt=False)


def scratch(fields: int) -> NDArray[np.float64]:
    """Room for so many fields, aligned to a cache line: no vector is to lie across two."""
    z = np.zeros(fields * LANES + 8)
    shift = (-z.ctypes.data // 8) % 8
    return z[shift : shift + fields * LANES]


@lane
def assign_lane(z: Scratch, i: int, job: int, left: float, state: Any) -> None:
    """Give a lane a trajectory: state = (τ, w, Γ, ε) at an impact."""
    tau, w, forcing, restitution = state
    z[TRAJECTORY + i] = job
    z[IMPACTS_LEFT + i] = left
    z[FORCING + i] = forcing
    z[RESTITUTION + i] = restitution
    z[CHATTER + i] = chatter_scale(restitution)
    z[CURVATURE + i] = GRAVITY + forcing * ROOM
    set_impact(z, i, tau, w)
    z[NEEDS_SCALAR + i] = 1.0 if left <= 0.0 else 0.0


@lane
def set_impact(z: Scratch, i: int, tau: float, w: float) -> None:
    """Put a lane at an impact; its delay is nan, and nothing happens, until `launch_lanes`."""
    z[TAU + i] = tau
    z[W + i] = w
    z[SPEED + i] = rebound(w, z[RESTITUTION + i])
    z[DELAY + i] = math.nan
    z[LANDED + i] = 0.0
    z[SEARCHES + i] = 0.0
    z[NEEDS_SCALAR + i] = 0.0


@lane
def park_lane(z: Scratch, i: int) -> None:
    """Give a lane nothing to do: it bounces for ever on a platform that does not move."""
    assign_lane(z, i, -1, math.inf, (0.0, -1.0, 0.0, 1.0))
    z[CHATTER + i] = -1.0  # and never needs the scalar map


@kernel
def chatter_outcome(tau: float, w: float, forcing: float, restitution: float) -> int:
    """What the impact with (τ, w) leads to: a kind of `after_impact`."""
    sine, cosine = sincos(tau)
    motion = axial_motion(forcing)
    jet = axial_jet(motion, sine, cosine, 0.0)
    disk = MapDisk(restitution, GRAVITY, 0.0, 0.0, 0.0)
    kind: int = after_impact(motion, disk, tau, jet, scalar_rebound(w, restitution))[0]
    return kind


# ------------------------------------------------------------------------------------------------
# Arithmetic in lanes: selections in place of branches, turns, sine and cosine to a few digits.


COARSE = 0.0562
"""Error of `coarse_turn`, rounded up: 0.05601."""


@intrinsic
def in_widest_vectors(_context: Any) -> Any:
    """Let the calling function use vectors of 512 bits, where LLVM prefers 256: a tenth faster.

    Without AVX-512 it changes nothing. It never changes a bit of a result.
    """

    def widen(_context: Any, builder: Any, _signature: Any, _arguments: Any) -> None:
        add_attribute(builder.function, "prefer-vector-width", "512")

    return types.void(), widen


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
