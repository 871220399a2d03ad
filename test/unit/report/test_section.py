"""The section and the return map: the right pairs, in the right units."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bouncing_disk_ros.core.model import ImpactKind
from bouncing_disk_ros.maps.period_one import period_one
from bouncing_disk_ros.report.section import section_velocity, single_impacts, successive_impacts
from bouncing_disk_ros.run.session import motion_of as motion_in
from support.map_rows import DISK, map_rows, motion_of


def test_units_are_those_of_the_map() -> None:
    motion, rows = motion_of(0.40), map_rows(0.40, 10, skip=1000)
    orbit = period_one(motion, DISK)
    assert orbit is not None
    assert rows["forcing_phase"] == pytest.approx(orbit.forcing_phase, abs=1e-12)
    assert rows["forcing_phase"][0] == pytest.approx(math.acos(1.0 / 1.2), abs=1e-12)
    assert section_velocity(rows, motion, DISK) == pytest.approx(-4.0 / 3.0, abs=1e-12)


def test_rows_of_the_log_hold_the_same_section() -> None:
    """x and y of a row (float32) are the section of the live picture."""
    from bouncing_disk_ros import simulate
    from bouncing_disk_ros.core.model import Disk

    result = simulate(20.0, axial_amplitude=0.06, preload=0.5)
    disk = Disk.of(result.parameters)
    motion = motion_in(result.parameters)
    rows = result.impacts[single_impacts(result.impacts)]
    assert len(rows) > 20
    assert rows["forcing_phase"] / math.tau == pytest.approx(rows["x"], rel=1e-7)
    assert section_velocity(rows, motion, disk) == pytest.approx(rows["y"], rel=1e-7)


def test_no_pair_crosses_a_gap_or_a_sum() -> None:
    rows = map_rows(0.549, 20)
    first, second = successive_impacts(rows)
    assert np.array_equal(first, rows[:-1])
    assert np.array_equal(second, rows[1:])
    rows["kind"][5], rows["count"][5] = ImpactKind.CHATTER_CUT, 3
    rows["kind"][12] = ImpactKind.CHATTER_TAIL
    first, second = successive_impacts(np.delete(rows, 9))
    broken = {4, 5, 8, 9, 11, 12, 19}  # the first of a pair with 5, 9 (lost), 12, or none after
    assert first["index"].tolist() == [i for i in range(20) if i not in broken]
    assert np.array_equal(second["index"], first["index"] + 1.0)
    assert np.flatnonzero(~single_impacts(rows)).tolist() == [5, 12]


@pytest.mark.parametrize("n", [0, 1])
def test_few_rows_have_no_pair(n: int) -> None:
    assert not len(successive_impacts(map_rows(0.549, 20)[:n])[0])
