"""Many single tosses: in lanes where they are usual, by `ride.rides` where they are not."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.core import ride
from bouncing_disk_ros.core.arithmetic import TWO_PI
from bouncing_disk_ros.core.engine import disk_record
from bouncing_disk_ros.core.lanes import in_slices, scratch
from bouncing_disk_ros.core.lanes_toss import (
    CLOSE,
    COSINE,
    FIELDS,
    LEAVE,
    LEFT_TO_RIDE,
    PHI,
    SINE,
    SPEED,
    TAU,
    A,
    ride_lanes,
)
from bouncing_disk_ros.core.layout import BOOKS, STATE_DTYPE
from bouncing_disk_ros.core.model import Disk


def tosses(
    starts: NDArray[np.float64], frequency: float, disk: Disk, *, workers: int = 1
) -> tuple[NDArray[np.float64], NDArray[np.int8]]:
    """What `ride.rides` gives for starts (n, 5): columns (n, 4) in SI units, and codes (n,).

    A row depends on its own start alone. Nothing is checked.
    """
    k = disk_record(disk, 0.0)
    n, omega = len(starts), TWO_PI * frequency
    out, codes = np.full((n, 4), math.nan), np.full(n, LEFT_TO_RIDE, np.int8)
    amplitude = starts[:, ride.AXIAL_AMPLITUDE]
    fall = float(k["g"][0]) / omega**2
    codes[amplitude < fall * (1.0 - CLOSE)] = ride.RIDE_STAYS
    usual = k["lag"][0] == 0.0 and k["grip"][0] > 0.0
    fine = np.flatnonzero((amplitude > fall * (1.0 + CLOSE)) & usual)
    lag = starts[fine, ride.PHASE_LAG]
    table = np.empty((7, len(fine)))
    table[A], table[PHI] = amplitude[fine], starts[fine, ride.ANGULAR_AMPLITUDE]
    table[SINE], table[COSINE] = np.sin(lag), np.cos(lag)
    table[TAU], table[SPEED] = (
        starts[fine, ride.FORCING_PHASE],
        starts[fine, ride.START_SPEED] / omega,
    )
    table[LEAVE] = np.arcsin(fall / table[A])
    found, kinds = np.empty((len(fine), 4)), np.empty(len(fine), np.int8)

    def work(part: slice) -> None:
        work_space, columns = (scratch(FIELDS), scratch(FIELDS)), table[:, part].copy()
        ride_lanes(*work_space, float(k["grip"][0]), fall, columns, found[part], kinds[part])

    in_slices(work, len(fine), workers)
    _into_units(found, table, disk, omega)
    out[fine], codes[fine] = found, kinds
    rest = np.flatnonzero(codes == LEFT_TO_RIDE)
    if len(rest):
        state, books = np.zeros(1, STATE_DTYPE), np.zeros((2, len(BOOKS)))
        slow, slow_codes = np.empty((len(rest), 4)), np.empty(len(rest), np.int8)
        ride.rides(
            np.ascontiguousarray(starts[rest]), frequency, k, 1000, state, books, slow, slow_codes
        )
        out[rest], codes[rest] = slow, slow_codes
    return out, codes


def _into_units(
    found: NDArray[np.float64], table: NDArray[np.float64], disk: Disk, omega: float
) -> None:
    """SI units, the delay, and the axial work: the disk rises and gains the platform's velocity."""
    a, x, leave = table[A], table[TAU], table[LEAVE]
    s, s_end = np.sin(x), (disk.gravity + disk.preload / disk.mass) / (a * omega**2)
    lift = (disk.mass * disk.gravity + disk.preload) * a * (s_end - s)
    found[:, ride.WORK_AXIAL] = lift + 0.5 * disk.mass * (a * omega) ** 2 * (s - s_end) * (
        s + s_end
    )
    found[:, ride.WORK_ANGULAR] *= disk.mass * (disk.gyration_radius * omega) ** 2
    found[:, ride.AIRBORNE_SPEED] *= omega
    found[:, ride.DELAY] = np.where(leave > x, leave - x, (leave - x) + TWO_PI) / omega
