"""Many single tosses: in lanes where they are usual, by `ride.rides` where they are not.

What each ride needs before and after its lane is computed in the lanes too: over whole tables, in
numpy, that took longer than the rides.
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
from bouncing_disk_ros.core.lanes.contact import aim, hold, move, search, separation_speed
from bouncing_disk_ros.core.lanes.lane import LANES, in_slices, lane, lane_entry, scratch
from bouncing_disk_ros.core.lanes.toss import (
    AHEAD,
    ASK,
    BEGUN,
    CLOSE,
    DONE,
    END_SINE,
    FIELDS,
    JOB,
    LAG,
    RISE,
    SPEED,
    STUCK,
    TURNING,
    WORK,
    X,
    begin,
)
from bouncing_disk_ros.core.layout import BOOKS, STATE_DTYPE
from bouncing_disk_ros.core.model import Disk

_LEFT_TO_RIDE = -2  # code of a ride that `ride.rides` is to do
_LARGEST_LAG = 1e6  # rad: what `lane_turn` takes
_SLIPS = 20  # of one ride; from rest there are two or three
_SEARCHES = 3
_TABLE, _CODES = types.float64[:, ::1], types.int8[::1]


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
    fall = float(k["g"][0]) / omega**2
    usual = bool(k["lag"][0] == 0.0 and grip > 0.0)
    units = (omega, float(k["mass"][0]), float(k["weight"][0]), float(k["inertia"][0]))

    def work(part: slice) -> None:
        z = scratch(FIELDS)
        _ride_lanes(z, usual, grip, fall, units, starts[part], out[part], codes[part])

    in_slices(work, n, workers)
    rest = np.flatnonzero(codes == _LEFT_TO_RIDE)
    if len(rest):
        state, books = np.zeros(1, STATE_DTYPE), np.zeros((2, len(BOOKS)))
        slow, slow_codes = np.empty((len(rest), 4)), np.empty(len(rest), np.int8)
        ride.rides(starts[rest], frequency, k, 1000, state, books, slow, slow_codes)
        out[rest], codes[rest] = slow, slow_codes
    return out, codes


@lane
def _fill(
    z: Any, usual: bool, fall: float, starts: Any, row: int, out: Any, codes: Any
) -> tuple[int, int]:
    """Give the lanes the next usual rows: how many, and the row to go on with. Who stays is nan."""
    filled = 0
    while filled < LANES and row < len(starts):
        amplitude, lag = starts[row, ride.AXIAL_AMPLITUDE], starts[row, ride.PHASE_LAG]
        if usual and amplitude > fall * (1.0 + CLOSE) and abs(lag) < _LARGEST_LAG:
            z[RISE + filled], z[LAG + filled] = amplitude, lag
            z[TURNING + filled] = starts[row, ride.ANGULAR_AMPLITUDE]
            z[X + filled] = starts[row, ride.FORCING_PHASE]
            z[SPEED + filled] = starts[row, ride.START_SPEED]
            z[JOB + filled] = row
            filled += 1
        elif amplitude < fall * (1.0 - CLOSE):
            codes[row] = ride.RIDE_STAYS
            out[row, :] = math.nan
        else:
            codes[row] = _LEFT_TO_RIDE
        row += 1
    for i in range(filled, LANES):
        z[JOB + i] = -1.0
    return filled, row


@lane
def _write(z: Any, filled: int, grip: float, fall: float, units: Any, out: Any, codes: Any) -> None:
    """What the separation finds, in SI units."""
    omega, mass, weight, inertia = units
    for i in range(LANES):
        amplitude, s, begun = z[RISE + i] / grip, z[END_SINE + i], z[BEGUN + i]
        speed = amplitude * omega
        # the disk rises and gains the platform's velocity
        rises = weight * amplitude * (s - begun)
        z[SPEED + i] = omega * separation_speed(z, i, grip * fall)
        z[X + i] = z[AHEAD + i] / omega
        z[RISE + i] = rises + 0.5 * mass * speed * speed * (begun - s) * (begun + s)
        z[WORK + i] = inertia * omega * omega * z[WORK + i]
    for i in range(filled):
        row, ask = int(z[JOB + i]), z[ASK + i]
        out[row, ride.AIRBORNE_SPEED] = z[SPEED + i]
        out[row, ride.DELAY] = z[X + i]
        out[row, ride.WORK_AXIAL] = z[RISE + i]
        out[row, ride.WORK_ANGULAR] = z[WORK + i]
        codes[row] = ride.RIDE_SLID if ask == DONE else ride.RIDE_STUCK
        if ask != DONE and ask != STUCK:
            codes[row] = _LEFT_TO_RIDE


@lane_entry(
    types.void(
        types.float64[::1],
        types.boolean,
        *[types.float64] * 2,
        types.UniTuple(types.float64, 4),
        _TABLE,
        _TABLE,
        _CODES,
    )
)
def _ride_lanes(
    z: Any,
    usual: bool,
    grip: float,
    fall: float,
    units: Any,
    starts: Any,
    out: Any,
    codes: Any,
) -> None:
    """Write the rides of all rows of starts."""
    down, row = grip * fall, 0
    while row < len(starts):
        filled, row = _fill(z, usual, fall, starts, row, out, codes)
        begin(z, fall, grip, units[0])
        for _ in range(_SLIPS):
            hold(z, down)
            looking, looks = aim(z, down), 0
            while looking > 0 and looks < _SEARCHES:
                looking, looks = search(z, down), looks + 1
            if move(z, down) == 0:
                break
        _write(z, filled, grip, fall, units, out, codes)
