"""The section and the return map: the right pairs, in the right units."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bouncing_disk_ros.core.model import ImpactKind
from bouncing_disk_ros.maps.scales import period_one
from bouncing_disk_ros.report.section import return_map_of, section_of
from support.map_rows import DISK, map_rows, motion_of

MOTION = motion_of(0.549)


def test_units_are_those_of_the_map() -> None:
    motion = motion_of(0.40)
    section = section_of(map_rows(0.40, 10, skip=1000), motion, DISK)
    orbit = period_one(motion, DISK)
    assert orbit is not None
    assert section.forcing_phase.values == pytest.approx(orbit.forcing_phase, abs=1e-12)
    assert section.axial_impact_velocity.values == pytest.approx(-4.0 / 3.0, abs=1e-12)
    assert section.forcing_phase.label == "τ_imp (rad)"
    assert section.axial_impact_velocity.label == "w_A (πg/ω)"
    assert section.forcing_phase.values[0] == pytest.approx(math.acos(1.0 / 1.2), abs=1e-12)


def test_rows_of_the_log_hold_the_same_section() -> None:
    """x and y of a row (float32) are the section of the live picture."""
    from bouncing_disk_ros import simulate
    from bouncing_disk_ros.core.model import Disk, Motion

    result = simulate(20.0, axial_amplitude=0.06, preload=0.5)
    disk = Disk(*(float(result.parameters[name]) for name in Disk._fields))
    motion = Motion(*(float(result.parameters[name]) for name in Motion._fields))
    section = section_of(result.impacts, motion, disk)
    rows = result.impacts[np.isin(result.impacts["index"], section.row_index)]
    assert len(rows) > 20
    assert section.forcing_phase.values / math.tau == pytest.approx(rows["x"], rel=1e-7)
    assert section.axial_impact_velocity.values == pytest.approx(rows["y"], rel=1e-7)


def test_pairs_follow_one_another() -> None:
    rows = map_rows(0.549, 50)
    pairs = return_map_of(rows, MOTION, DISK)
    section = section_of(rows, MOTION, DISK)
    assert pairs.row_index.tolist() == list(range(49))
    assert np.array_equal(pairs.forcing_phase.values, section.forcing_phase.values[:-1])
    assert np.array_equal(pairs.next_forcing_phase.values, section.forcing_phase.values[1:])
    speeds = section.axial_impact_velocity.values
    assert np.array_equal(pairs.axial_impact_velocity.values, speeds[:-1])
    assert np.array_equal(pairs.next_axial_impact_velocity.values, speeds[1:])
    assert pairs.next_forcing_phase.symbol == "τ_n+1"


def test_no_pair_crosses_a_gap_or_a_sum() -> None:
    rows = map_rows(0.549, 20)
    rows["kind"][5], rows["count"][5] = ImpactKind.CHATTER_CUT, 3
    rows["kind"][12] = ImpactKind.CHATTER_TAIL
    rows = np.delete(rows, 9)
    pairs = return_map_of(rows, MOTION, DISK)
    broken = {4, 5, 8, 9, 11, 12, 19}  # the first of a pair with 5, 9 (lost), 12, or none after
    assert pairs.row_index.tolist() == [i for i in range(20) if i not in broken]
    section = section_of(rows, MOTION, DISK)
    assert section.row_index.tolist() == [i for i in range(20) if i not in {5, 9, 12}]


@pytest.mark.parametrize("n", [0, 1])
def test_few_rows(n: int) -> None:
    rows = map_rows(0.549, 20)[:n]
    assert len(section_of(rows, MOTION, DISK).row_index) == n
    assert len(return_map_of(rows, MOTION, DISK).row_index) == 0
