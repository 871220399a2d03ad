"""Many single tosses: in lanes where they are usual, by `single_toss.toss_each` where they are not.

What each toss needs before and after its lane is computed in the lanes too: over whole tables, in
numpy, that took longer than the tosses.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import types
from numpy.typing import NDArray

from bouncing_disk_ros.core.arithmetic import TWO_PI
from bouncing_disk_ros.core.layout import LEDGER_FIELDS, STATE_DTYPE, disk_record
from bouncing_disk_ros.core.model import Disk
from bouncing_disk_ros.maps import single_toss
from bouncing_disk_ros.maps.lanes.lane_table import (
    LANES,
    in_slices,
    lane,
    lane_entry,
    scratch,
)
from bouncing_disk_ros.maps.lanes.toss_contact import (
    advance_slip,
    advance_sticking,
    find_falling_piece,
    search_zero,
    separation_speed,
)
from bouncing_disk_ros.maps.lanes.toss_table import (
    CLOSE,
    TOSS_AHEAD,
    TOSS_AMPLITUDE,
    TOSS_BEGUN,
    TOSS_DONE,
    TOSS_END_SINE,
    TOSS_FIELDS,
    TOSS_JOB,
    TOSS_LAG,
    TOSS_RESULT_DELAY,
    TOSS_RESULT_SPEED,
    TOSS_RESULT_WORK_ANGULAR,
    TOSS_RESULT_WORK_AXIAL,
    TOSS_RISE,
    TOSS_SPEED,
    TOSS_STATUS,
    TOSS_STAYS_STUCK,
    TOSS_TURNING,
    TOSS_WORK,
    TOSS_X,
    begin_tosses,
)

_LEFT_TO_SCALAR = -2  # code of a toss that `single_toss.toss_each` is to do
_LARGEST_LAG = 1e6  # rad: what `lane_turn` takes
_SLIPS = 20  # of one toss; from rest there are two or three
_SEARCHES = 3
_TABLE, _CODES = types.float64[:, ::1], types.int8[::1]


def tosses(
    starts: NDArray[np.float64], frequency: float, disk: Disk, *, workers: int = 1
) -> tuple[NDArray[np.float64], NDArray[np.int8]]:
    """Simulate single tosses, in lanes where they are usual.

    starts (n, 5) as for `single_toss.toss_each`; returns its columns (n, 4) in SI units and the
    codes (n,).

    A row depends on its own start alone. Nothing is checked.
    """
    record = disk_record(disk, 0.0)
    n, omega, grip = len(starts), TWO_PI * frequency, float(record["grip"][0])
    starts = np.ascontiguousarray(starts, np.float64)
    out, codes = np.empty((n, 4)), np.empty(n, np.int8)
    fall = float(record["g"][0]) / omega**2
    usual = bool(record["lag"][0] == 0.0 and grip > 0.0)
    units = (
        omega,
        float(record["mass"][0]),
        float(record["weight"][0]),
        float(record["inertia"][0]),
    )

    def work(part: slice) -> None:
        z = scratch(TOSS_FIELDS)
        _toss_lanes(z, usual, grip, fall, units, starts[part], out[part], codes[part])

    in_slices(work, n, workers)
    rest = np.flatnonzero(codes == _LEFT_TO_SCALAR)
    if len(rest):
        state, ledger = np.zeros(1, STATE_DTYPE), np.zeros((2, len(LEDGER_FIELDS)))
        slow, slow_codes = np.empty((len(rest), 4)), np.empty(len(rest), np.int8)
        single_toss.toss_each(
            starts[rest], frequency, record, 1000, state, ledger, slow, slow_codes
        )
        out[rest], codes[rest] = slow, slow_codes
    return out, codes


@lane
def _fill(
    z: Any, usual: bool, fall: float, starts: Any, row: int, out: Any, codes: Any
) -> tuple[int, int]:
    """Give the lanes the next usual rows: how many, and the row to go on with. Who stays is nan."""
    filled = 0
    while filled < LANES and row < len(starts):
        amplitude, lag = (
            starts[row, single_toss.START_AXIAL_AMPLITUDE],
            starts[row, single_toss.START_PHASE_LAG],
        )
        if usual and amplitude > fall * (1.0 + CLOSE) and abs(lag) < _LARGEST_LAG:
            z[TOSS_AMPLITUDE + filled], z[TOSS_LAG + filled] = amplitude, lag
            z[TOSS_TURNING + filled] = starts[row, single_toss.START_ANGULAR_AMPLITUDE]
            z[TOSS_X + filled] = starts[row, single_toss.START_FORCING_PHASE]
            z[TOSS_SPEED + filled] = starts[row, single_toss.START_ANGULAR_SPEED]
            z[TOSS_JOB + filled] = row
            filled += 1
        elif amplitude < fall * (1.0 - CLOSE):
            codes[row] = single_toss.TOSS_STAYS
            out[row, :] = math.nan
        else:
            codes[row] = _LEFT_TO_SCALAR
        row += 1
    for i in range(filled, LANES):
        z[TOSS_JOB + i] = -1.0
    return filled, row


@lane
def _write(z: Any, filled: int, grip: float, fall: float, units: Any, out: Any, codes: Any) -> None:
    """What the separation finds, in SI units."""
    omega, mass, weight, inertia = units
    for i in range(LANES):
        amplitude, sine, begun = z[TOSS_RISE + i] / grip, z[TOSS_END_SINE + i], z[TOSS_BEGUN + i]
        speed = amplitude * omega
        # the disk rises and gains the platform's velocity
        rises = weight * amplitude * (sine - begun)
        z[TOSS_RESULT_SPEED + i] = omega * separation_speed(z, i, grip * fall)
        z[TOSS_RESULT_DELAY + i] = z[TOSS_AHEAD + i] / omega
        z[TOSS_RESULT_WORK_AXIAL + i] = rises + 0.5 * mass * speed * speed * (begun - sine) * (
            begun + sine
        )
        z[TOSS_RESULT_WORK_ANGULAR + i] = inertia * omega * omega * z[TOSS_WORK + i]
    for i in range(filled):
        row, ask = int(z[TOSS_JOB + i]), z[TOSS_STATUS + i]
        out[row, single_toss.RESULT_AIRBORNE_SPEED] = z[TOSS_RESULT_SPEED + i]
        out[row, single_toss.RESULT_DELAY] = z[TOSS_RESULT_DELAY + i]
        out[row, single_toss.RESULT_WORK_AXIAL] = z[TOSS_RESULT_WORK_AXIAL + i]
        out[row, single_toss.RESULT_WORK_ANGULAR] = z[TOSS_RESULT_WORK_ANGULAR + i]
        codes[row] = single_toss.TOSS_SLID if ask == TOSS_DONE else single_toss.TOSS_STUCK
        if ask != TOSS_DONE and ask != TOSS_STAYS_STUCK:
            codes[row] = _LEFT_TO_SCALAR


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
def _toss_lanes(
    z: Any,
    usual: bool,
    grip: float,
    fall: float,
    units: Any,
    starts: Any,
    out: Any,
    codes: Any,
) -> None:
    """Write the tosses of all rows of starts."""
    down, row = grip * fall, 0
    while row < len(starts):
        filled, row = _fill(z, usual, fall, starts, row, out, codes)
        begin_tosses(z, fall, grip, units[0])
        for _ in range(_SLIPS):
            advance_sticking(z, down)
            looking, looks = find_falling_piece(z, down), 0
            while looking > 0 and looks < _SEARCHES:
                looking, looks = search_zero(z, down), looks + 1
            if advance_slip(z, down) == 0:
                break
        _write(z, filled, grip, fall, units, out, codes)
