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
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bouncing_disk_ros.core import restitution as restitution_law
from bouncing_disk_ros.core.arithmetic import (
    Kernel,
    kernel,
    sincos,
)
from bouncing_disk_ros.core.impact_law import chatter_scale
from bouncing_disk_ros.core.platform import ROOM, axial_jet
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
NEEDS_SCALAR = 16 * LANES  # 1: the lane wants attention
STEP = 17 * LANES  # a step, or 1/h₁
T0, T1, T2, T3 = 18 * LANES, 19 * LANES, 20 * LANES, 21 * LANES  # between loops of one function
PULL = 22 * LANES  # Γ sin τ
JERK = 23 * LANES  # Γ cos τ
CURVATURE = 24 * LANES  # bound of the second derivative of the gap
FIELDS = 25

MANY_SEARCHES = 40.0  # rounds of a flight; a longer search is left to the scalar map


def lane(function: Kernel) -> Kernel:
    """Compile for lanes, and a kernel of the core once more.

    A product and a sum are one rounding only where `lanes.lane_arithmetic.fused` says so: a
    compiler that may choose which products of a sum it fuses chooses anew with each compilation.
    Nothing is reordered, and inf and nan are as they should be. Arrays are not counted (`_nrt`),
    which costs more than a flight, and so none can be made.
    """
    compiled: Kernel = njit(
        error_model="numpy",
        nogil=True,
        forceinline=True,
        fastmath={"nsz"},
        _nrt=False,
    )(getattr(function, "py_func", function))
    return compiled


rebound = lane(restitution_law.rebounded)


def lane_entry(*signature: object) -> Callable[[Kernel], Kernel]:
    """`entry` for a function whose arrays are not counted."""

    def compile_entry(function: Kernel) -> Kernel:
        compiled: Kernel = njit(
            *signature, error_model="numpy", nogil=True, cache=True, _nrt=False
        )(function)
        return compiled

    return compile_entry


def scratch(fields: int) -> NDArray[np.float64]:
    """Room for so many fields, aligned to a cache line: no vector is to lie across two."""
    z = np.zeros(fields * LANES + 8)
    shift = (-z.ctypes.data // 8) % 8
    return z[shift : shift + fields * LANES]


def in_slices(work: Callable[[slice], object], n: int, workers: int) -> None:
    """Do `work` on all of range(n) by slices, on threads of their own if workers > 1.

    Work that releases the GIL, writes to its slice alone and reads nothing else of what is
    written gives the same results for any number of workers. The slices are smaller than the shares
    of the workers, for starts differ in cost. The first error is raised.
    """
    if workers <= 1:
        work(slice(0, n))
        return
    size = max(4 * LANES, -(-n // (8 * workers)))
    slices = [slice(first, min(first + size, n)) for first in range(0, n, size)]
    with ThreadPoolExecutor(workers) as pool:
        for _ in pool.map(work, slices):
            pass


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
    """Put a lane at an impact; until the next `launch` its delay is nan, and nothing happens."""
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
    z[CHATTER + i] = -1.0  # nor does it ask


@kernel
def chatter_outcome(tau: float, w: float, forcing: float, restitution: float) -> int:
    """What the impact with (τ, w) leads to: a kind of `after_impact`."""
    sine, cosine = sincos(tau)
    motion = axial_motion(forcing)
    jet = axial_jet(motion, sine, cosine, 0.0)
    disk = MapDisk(restitution, GRAVITY, 0.0, 0.0, 0.0)
    kind: int = after_impact(motion, disk, tau, jet, restitution_law.rebound(w, restitution))[0]
    return kind
