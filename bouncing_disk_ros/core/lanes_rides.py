"""Many single tosses: in lanes where they are usual, by `ride.rides` where they are not.

What each ride needs before and after its lane is computed as it enters and leaves: over whole
tables, in numpy, that took longer than the lanes.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import types
from numpy.typing import NDArray

from bouncing_disk_ros.core import ride
from bouncing_disk_ros.core.arithmetic import TWO_PI
from bouncing_disk_ros.core.engine import disk_record
from bouncing_disk_ros.core.lanes import LANES, in_slices, lane, lane_entry, scratch
from bouncing_disk_ros.core.lanes_flight import lane_turn
from bouncing_disk_ros.core.lanes_toss import (
    ASK,
    BEGUN,
    CLOSE,
    COSINE,
    DONE,
    DRIVE,
    END,
    ENTERED,
    FALL,
    FIELDS,
    FROM,
    GIVEN_UP,
    IDLE,
    JOB,
    LAG_COSINE,
    LAG_SINE,
    LOOKS,
    MODE,
    MOST_LOOKS,
    RISE,
    SIGN,
    SINE,
    SLIP,
    START,
    STEP,
    STICK,
    TURNING,
    WORK,
    X,
    friction_work,
    go,
    look,
)
from bouncing_disk_ros.core.layout import BOOKS, STATE_DTYPE
from bouncing_disk_ros.core.model import Disk

_LEFT_TO_RIDE = -2  # code of a ride that `ride.rides` is to do
_LARGEST_LAG = 1e6  # rad: what `lane_turn` takes
_ARRAY, _TABLE, _CODES = types.float64[::1], types.float64[:, ::1], types.int8[::1]


def tosses(
    starts: NDArray[np.float64], frequency: float, disk: Disk, *, workers: int = 1
) -> tuple[NDArray[np.float64], NDArray[np.int8]]:
    """What `ride.rides` gives for starts (n, 5): columns (n, 4) in SI units, and codes (n,).

    A row depends on its own start alone. Nothing is checked.
    """
    k = disk_record(disk, 0.0)
    n, omega, grip = len(starts), TWO_PI * frequency, float(k["grip"][0])
    starts = np.ascontiguousarray(starts, np.float64)
    out, codes = np.empty((n, 4)), np.empty(n, np.int8)
    rows, sines = np.empty(n, np.int64), np.empty(n)
    fall = float(k["g"][0]) / omega**2
    usual = k["lag"][0] == 0.0 and grip > 0.0
    usuals = _usual_rows(starts, fall, usual, rows, sines, out, codes)
    leave = np.arcsin(sines[:usuals], out=sines[:usuals])
    units = (omega, float(k["mass"][0]), float(k["weight"][0]), float(k["inertia"][0]))

    def work(part: slice) -> None:
        work_space = scratch(FIELDS), scratch(FIELDS)
        which = rows[part], leave[part]
        _ride_lanes(*work_space, grip, fall, units, starts, *which, out, codes)

    in_slices(work, usuals, workers)
    rest = np.flatnonzero(codes == _LEFT_TO_RIDE)
    if len(rest):
        state, books = np.zeros(1, STATE_DTYPE), np.zeros((2, len(BOOKS)))
        slow, slow_codes = np.empty((len(rest), 4)), np.empty(len(rest), np.int8)
        ride.rides(starts[rest], frequency, k, 1000, state, books, slow, slow_codes)
        out[rest], codes[rest] = slow, slow_codes
    return out, codes


@lane_entry(
    types.int64(_TABLE, types.float64, types.boolean, types.int64[::1], _ARRAY, _TABLE, _CODES)
)
def _usual_rows(
    starts: Any, fall: float, usual: bool, rows: Any, sines: Any, out: Any, codes: Any
) -> int:
    """How many rows are for the lanes, which, and sin τ_sep of each; who stays is nan."""
    count = 0
    for i in range(len(starts)):
        amplitude, lag = starts[i, ride.AXIAL_AMPLITUDE], starts[i, ride.PHASE_LAG]
        codes[i] = _LEFT_TO_RIDE
        if amplitude < fall * (1.0 - CLOSE):
            codes[i] = ride.RIDE_STAYS
            out[i, :] = math.nan
        elif usual and amplitude > fall * (1.0 + CLOSE) and abs(lag) < _LARGEST_LAG:
            rows[count] = i
            sines[count] = fall / amplitude
            count += 1
    return count


@lane
def _finish(z: Any, i: int, units: Any, starts: Any, row: int, out: Any, codes: Any) -> None:
    """What separation finds, in SI units: sin x = g/(Aω²) there, and cos x > 0."""
    if z[ASK + i] == GIVEN_UP:
        codes[row] = _LEFT_TO_RIDE
        return
    omega, mass, weight, inertia = units
    x, sign, begun = z[END + i], z[SIGN + i], z[BEGUN + i]
    s = z[FALL + i] / z[RISE + i]
    c = math.sqrt((1.0 - s) * (1.0 + s))
    b1 = z[TURNING + i] * (c * z[LAG_COSINE + i] - s * z[LAG_SINE + i])
    sticks = z[MODE + i] == STICK
    codes[row] = ride.RIDE_STUCK if sticks else ride.RIDE_SLID
    slip = sign * (z[START + i] - z[FALL + i] * x - z[RISE + i] * c - sign * b1)
    rubbed = -sign * (friction_work(z, i, x, s, c) - z[FROM + i])
    work = z[WORK + i] + (0.5 * (b1 * b1 - z[FROM + i]) if sticks else rubbed)
    amplitude = starts[row, ride.AXIAL_AMPLITUDE]
    speed = amplitude * omega
    out[row, ride.AIRBORNE_SPEED] = omega * (b1 if sticks else b1 + slip)
    out[row, ride.DELAY] = (x - starts[row, ride.FORCING_PHASE]) / omega
    # the disk rises and gains the platform's velocity
    rises = weight * amplitude * (s - begun)
    out[row, ride.WORK_AXIAL] = rises + 0.5 * mass * speed * speed * (begun - s) * (begun + s)
    out[row, ride.WORK_ANGULAR] = inertia * omega * omega * work


@lane
def _prepare(
    z: Any, first: int, grip: float, fall: float, omega: float, starts: Any, rows: Any, leave: Any
) -> None:
    """The next rides, as they enter lanes; given up if the load at the start is next to none."""
    for i in range(min(LANES, len(rows) - first)):
        row = rows[first + i]
        z[X + i], z[STEP + i] = starts[row, ride.FORCING_PHASE], starts[row, ride.START_SPEED]
        z[RISE + i] = starts[row, ride.AXIAL_AMPLITUDE]
        z[TURNING + i] = starts[row, ride.ANGULAR_AMPLITUDE]
        z[LAG_SINE + i] = starts[row, ride.PHASE_LAG]
        z[END + i], z[JOB + i] = leave[first + i], row
    for i in range(LANES):
        s, c, _, _ = lane_turn(z[X + i])
        z[SINE + i] = s
        z[COSINE + i] = c
        z[BEGUN + i] = s
    for i in range(LANES):
        lag = z[LAG_SINE + i]
        s, c, _, _ = lane_turn(abs(lag))
        z[LAG_SINE + i] = s if lag >= 0.0 else -s
        z[LAG_COSINE + i] = c
    for i in range(LANES):
        x, s, c, end = z[X + i], z[SINE + i], z[COSINE + i], z[END + i]
        v = z[STEP + i] / omega
        st, ct, turning = z[LAG_SINE + i], z[LAG_COSINE + i], z[TURNING + i]
        rise, down = grip * z[RISE + i], grip * fall
        z[RISE + i] = rise
        z[FALL + i] = down
        sb, cb = turning * (s * ct + c * st), turning * (c * ct - s * st)
        slip = v - cb
        load = down - rise * s
        held = slip == 0.0
        sticks = held and abs(sb) <= load
        up = sb > 0.0 if held else slip > 0.0
        sign = 1.0 if up else -1.0
        drag = friction_work(z, i, x, s, c)
        z[END + i] = end if end > x else end + TWO_PI
        z[MODE + i] = STICK if sticks else (DRIVE if held else SLIP)
        z[SIGN + i] = sign
        z[START + i] = sign * v + down * x + rise * c
        z[FROM + i] = cb * cb if sticks else drag
        z[WORK + i] = 0.0
        z[LOOKS + i] = 0.0 if load > CLOSE * rise else MOST_LOOKS
        z[ASK + i] = 0.0


@lane
def _refill(z: Any, i: int, ready: Any, todo: int) -> None:
    for k in range(ENTERED):
        z[k * LANES + i] = ready[k * LANES + todo % LANES]


@lane_entry(
    types.void(
        *[_ARRAY] * 2,
        *[types.float64] * 2,
        types.UniTuple(types.float64, 4),
        _TABLE,
        types.int64[::1],
        _ARRAY,
        _TABLE,
        _CODES,
    )
)
def _ride_lanes(
    z: Any,
    ready: Any,
    grip: float,
    fall: float,
    units: Any,
    starts: Any,
    rows: Any,
    leave: Any,
    out: Any,
    codes: Any,
) -> None:
    """Write the rides of some rows of starts, which leave in the end at the phases `leave`."""
    n = len(rows)
    todo = done = 0
    for i in range(LANES):
        z[JOB + i] = -1.0
        z[ASK + i] = DONE
    while done < n:
        if todo > 0:
            look(z)
        if todo == 0 or go(z) > 0:
            for i in range(LANES):
                if z[ASK + i] == 0.0:
                    continue
                if z[JOB + i] >= 0.0:
                    _finish(z, i, units, starts, int(z[JOB + i]), out, codes)
                    done += 1
                if todo == n:
                    z[JOB + i], z[ASK + i], z[LOOKS + i], z[END + i] = IDLE
                    continue
                if todo % LANES == 0:
                    _prepare(ready, todo, grip, fall, units[0], starts, rows, leave)
                _refill(z, i, ready, todo)
                todo += 1
