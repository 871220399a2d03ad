"""The referee of single tosses: right ones are proved, others refuted."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bouncing_disk_ros.core.layout import disk_record
from bouncing_disk_ros.core.model import Disk
from bouncing_disk_ros.maps.lanes.toss_lanes import tosses
from bouncing_disk_ros.proof.event_trace import disk_of
from bouncing_disk_ros.proof.exact_records import MotionRecord, Outcome
from support.toss_proof import NONE, SLID, STAYS, STUCK, Toss, prove_toss

#: the toss of the paper's Fig. 2
DISK = Disk(0.3, 0.5, 0.6, 0.12, 0.3 / (2.0 * math.sqrt(2.0)), 10.0)
FREQUENCY, ARC = 3.0, 0.25


def some_tosses(n: int, seed: int = 1) -> list[Toss]:
    """Tosses along the paper's map, a few from other starts."""
    rng = np.random.default_rng(seed)
    angle = rng.uniform(-0.5, 0.5, n) * math.pi
    amplitude, turning = ARC * np.cos(angle), ARC * np.abs(np.sin(angle)) / DISK.friction_radius
    amplitude[::7] *= 0.05  # never leaves
    turning[::11] = 0.0
    tau = np.where(np.arange(n) % 5 == 0, rng.uniform(0.0, math.tau, n), 1.5 * math.pi)
    speed = np.where(np.arange(n) % 3 == 0, rng.normal(size=n) * 10.0, 0.0)
    lag = rng.uniform(-math.pi, math.pi, n)
    leave = np.arcsin(np.minimum(DISK.gravity / (amplitude * (math.tau * FREQUENCY) ** 2), 1.0))
    lag[::6] = -leave[::6]  # no torque is needed where the load is zero: no slip before it
    starts = np.stack([amplitude, turning, lag, tau, speed], axis=1)
    out, codes = tosses(starts, FREQUENCY, DISK)
    record = disk_record(DISK, 0.0)
    disk, inertia = disk_of(record), float(record["inertia"][0])
    found = []
    for (a, p, theta, phase, start), row, code in zip(
        starts.tolist(), out.tolist(), codes.tolist(), strict=True
    ):
        motion = MotionRecord(False, 0, 0, 0, 0.0, a, 0.0, p, 0.0, FREQUENCY, 0.0, theta, 0.0)
        works = (row[2] / DISK.mass, row[3] / inertia)
        found.append(Toss(motion, disk, phase, start, code, row[0], row[1], *works))
    return found


def test_tosses_are_proved() -> None:
    found = some_tosses(300)
    assert {toss.code for toss in found} >= {SLID, STUCK, NONE, STAYS}
    for toss in found:
        verdict = prove_toss(toss)
        assert verdict.outcome is Outcome.PROVED, (toss, verdict)


@pytest.mark.parametrize("field", ["speed", "delay", "work_axial", "work_angular"])
def test_other_numbers_are_refuted(field: str) -> None:
    for toss in some_tosses(60):
        if toss.code in (NONE, STAYS):
            continue
        other = toss._replace(**{field: getattr(toss, field) * (1.0 + 1e-10) + 1e-10})
        verdict = prove_toss(other)
        assert verdict.outcome is Outcome.REFUTED, (other, verdict)
        assert " ".join(reversed(field.split("_"))) in verdict.reason


def test_another_end_is_refuted() -> None:
    for toss in some_tosses(60):
        for code in {SLID, STUCK, NONE, STAYS} - {toss.code}:
            assert prove_toss(toss._replace(code=code)).outcome is Outcome.REFUTED
