"""Impact rows as text: columns stand under their headings, CSV loses no bit, gaps are counted."""

from __future__ import annotations

import csv
import io

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.core.model import IMPACT_DTYPE, ImpactKind
from bouncing_disk_ros.report import impact_text
from bouncing_disk_ros.running_numbers import Gaps


def some_rows(indices: list[int]) -> NDArray[np.void]:
    rows = np.zeros(len(indices), IMPACT_DTYPE)
    rows["index"] = indices
    rows["time"] = 1.0 / 3.0
    rows["axial_impact_velocity"] = -2.0 / 3.0
    rows["forcing_phase"] = np.pi
    rows["count"] = 1
    rows["x"] = 0.1
    return rows


def test_a_line_reads_as_its_heading_says_and_columns_stay_apart() -> None:
    row = some_rows([12])[0]
    row["kind"], row["count"] = ImpactKind.CHATTER_TAIL, 7
    titles, units = impact_text.heading().splitlines()
    values = impact_text.line(row).split()
    named = dict(zip(titles.split(), values, strict=True))
    assert named["index"] == "12"
    assert named["time"] == "0.333333"
    assert named["τ/2π"] == "0.50000"
    assert named["w_A"] == "-6.6667e-01"
    assert named["count"] == "7"
    assert named["kind"] == "chatter_tail"
    assert units.split() == ["s", "1", "m/s", "rad/s", "N·s", "N·m·s", "rad/s"]
    row = some_rows([10**6])[0]
    for name in ("angular_impact_velocity", "axial_impulse", "angular_impulse", "angular_velocity"):
        row[name] = -1.23456789e-105
    row["time"], row["cycles"] = 123456.789, 4.0e6
    row["axial_impact_velocity"] = -1.23456789e-105
    text = impact_text.line(row)
    assert len(text.split()) == len(impact_text.heading().splitlines()[0].split())
    usual = some_rows([123456])[0]
    usual["axial_impact_velocity"], usual["time"] = -1.2e-10, 12345.6
    assert len(impact_text.line(usual)) == len(impact_text.line(some_rows([1])[0]))


def test_csv_gives_every_bit_back() -> None:
    row = some_rows([3])[0]
    text = impact_text.csv_heading() + "\n" + impact_text.csv_line(row) + "\n"
    (read,) = csv.DictReader(io.StringIO(text))
    assert list(read) == list(IMPACT_DTYPE.names or ())
    for name in read:
        assert np.array(float(read[name]), IMPACT_DTYPE[name]) == row[name]


def test_gaps_and_new_runs_are_told() -> None:
    gaps = Gaps()
    for indices, told in (
        ([5, 6], ""),  # joined late: nothing is lost
        ([10, 11], "3 row(s) lost up to index 11, 3 in all"),
        ([12, 15], "2 row(s) lost up to index 15, 5 in all"),
        ([0, 1], "the index starts again at 0: another run"),
    ):
        assert impact_text.lost_rows(gaps, some_rows(indices)) == told
