"""The toss map of Fig. 2 by lanes, by the scalar rides of the core, and by scalar C."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.c_reference import CReference, CTosses
from bouncing_disk_ros.core.layout import LEDGER_FIELDS, STATE_DTYPE, disk_record
from bouncing_disk_ros.maps import single_toss
from bouncing_disk_ros.maps.lanes.toss_lanes import tosses
from bouncing_disk_ros.maps.tosses import LOWEST, PAPER, amplitudes

LAGS, ANGLES = 400, 250
AGREEMENT = 1e-10  # of the largest speed, delay and work; roundings are magnified near a graze
Found = tuple[NDArray[np.float64], NDArray[np.int8]]


class TossMap:
    """Tosses from rest at the lowest point, and what runs on them: whole calls."""

    def __init__(self, lags: int, angles: int) -> None:
        angle = (np.arange(angles) + 0.5) / angles * 0.5 * math.pi
        lag = math.tau * (np.arange(lags) / lags - 0.5)
        all_angles, all_lags = (a.ravel() for a in np.meshgrid(angle, lag))
        axial, angular = amplitudes(all_angles, PAPER)
        self.starts = np.zeros((lags * angles, 5))
        self.starts[:, single_toss.START_AXIAL_AMPLITUDE] = axial
        self.starts[:, single_toss.START_ANGULAR_AMPLITUDE] = angular
        self.starts[:, single_toss.START_PHASE_LAG] = all_lags
        self.starts[:, single_toss.START_FORCING_PHASE] = LOWEST

    def _room(self) -> Found:
        return np.empty((len(self.starts), 4)), np.empty(len(self.starts), np.int8)

    def lanes(self) -> Found:
        """The lanes."""
        return tosses(self.starts, PAPER.frequency, PAPER.disk)

    def scalar(self) -> Found:
        """One ride after the other by the functions of the stepper."""
        out, codes = self._room()
        state, ledger = np.zeros(1, STATE_DTYPE), np.zeros((2, len(LEDGER_FIELDS)))
        disk = disk_record(PAPER.disk, 0.0)
        single_toss.toss_each(self.starts, PAPER.frequency, disk, 1000, state, ledger, out, codes)
        return out, codes

    def by(self, peer: CTosses) -> Found:
        """Scalar C."""
        found = self._room()
        peer.tosses(self.starts, PAPER.frequency, disk_record(PAPER.disk, 0.0), *found)
        return found


def peer_of(folder: Path) -> CTosses | None:
    """Scalar C, compared with the lanes over a map of 200 × 100; None without a compiler."""
    if CReference.missing():
        return None
    peer, subject = CTosses(folder), TossMap(200, 100)
    expected, expected_codes = subject.lanes()
    found, codes = subject.by(peer)
    np.testing.assert_array_equal(codes, expected_codes)
    scale = np.nanmax(np.abs(expected), axis=0)
    np.testing.assert_allclose(found / scale, expected / scale, rtol=0.0, atol=AGREEMENT)
    return peer
