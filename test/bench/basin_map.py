"""The basin map of Fig. 4 by the lanes and their peers, decided by the same rule.

heyoka and SciPy label a sample of pixels, drawn by a fixed seed, where the whole map would take
long. Their time for a pixel is the time for an impact of the sample times the impacts that a pixel
of the whole map takes: so the luck of the draw does not count.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.axial import RESTITUTION
from bench.basin_peers import ByHeyoka, ByScipy, Rule
from bench.c_reference import CLanes, CReference
from bench.many_references import missing
from bench.table import Aim, Row, compared, row
from bench.turns import Run, interleaved
from bouncing_disk_ros.maps.basin_labels import (
    LaneRule,
    StartLabels,
    known_points,
    label_lanes,
)

PART = "many trajectories"
PIXELS, CAP, CONFIRM, TOLERANCE = 200, 300, 8, 1e-6
ROUNDS, PEER_ROUNDS, SEED = 20, 3, 1
#: Γ -> pixels labelled by heyoka and by SciPy. At 0.55 chaos magnifies roundings into other labels
SAMPLES = {0.45: (PIXELS * PIXELS, 24), 0.55: (2000, 12)}
CHAOTIC = 0.5
AGREEMENT = 1e-3  # share of pixels that may have another label without chaos
AIMS = {"heyoka, scalar": 60.0, "heyoka, batch": 45.0, "SciPy": 1e4}

Label = Callable[[NDArray[np.float64], NDArray[np.float64], NDArray[np.int32]], None]


class BasinMap:
    """The starts of the map, row by row, and their labels by the lanes."""

    def __init__(self, axial_forcing: float) -> None:
        phases = math.tau * np.arange(PIXELS) / PIXELS
        speeds = -5.0 + 5.0 * (np.arange(PIXELS) + 0.5) / PIXELS
        grid = np.meshgrid(phases, speeds)
        self.tau, self.w = (np.ascontiguousarray(a.ravel()) for a in grid)
        ratio = (1.0 - RESTITUTION) / (1.0 + RESTITUTION)
        point = (math.acos(ratio / axial_forcing), -2.0 / (1.0 + RESTITUTION))
        self.rule = Rule(axial_forcing, point, TOLERANCE, CONFIRM, CAP)
        n = len(self.tau)
        self.labels, self.impacts = np.empty(n, np.int32), np.empty(n, np.int32)
        self._time = np.empty(n)

    def lanes(self) -> int:
        """Label by the lanes; how many pixels."""
        known = known_points(np.array([self.rule.point]), np.ones(1, np.int32))
        rule = LaneRule(TOLERANCE, float(CONFIRM), 0, 2, CAP)
        found = StartLabels(self.labels, self.impacts, self._time)
        label_lanes(self.tau, self.w, self.rule.axial_forcing, RESTITUTION, known, rule, found)
        return len(self.tau)

    def by_c(self, c: CLanes) -> tuple[Run, NDArray[np.int32]]:
        """What labels by vectorised C, and where it writes."""
        labels, rule = np.empty(len(self.tau), np.int32), self.rule

        def run() -> int:
            given = (rule.axial_forcing, RESTITUTION, rule.point, (TOLERANCE, CONFIRM, CAP))
            c.label(self.tau, self.w, *given, labels)
            return len(self.tau)

        return run, labels


def measure(axial_forcing: float, folder: Path) -> list[Row]:
    """The rows of the map at Γ = 0.45 or 0.55."""
    subject = BasinMap(axial_forcing)
    where = f"basin map {PIXELS} × {PIXELS}, Γ = {axial_forcing}"
    runs: dict[str, Run] = {"lanes": subject.lanes}
    if not CReference.missing():
        runs["C"], labels = subject.by_c(CLanes(folder))
    times = interleaved(runs, ROUNDS)
    ratio = ("lanes", "C", "lanes / vectorised C", Aim(1.1))
    rows = compared(PART, where, "ns a pixel", times, [ratio])
    if "C" in runs:  # chaos on the boundary of a basin magnifies roundings into other labels
        differ = float(np.mean(subject.labels != labels))
        rows.append(row(PART, f"pixels with another label than by C, {where}", "of all", [differ]))
    for name, peer, pixels in _peers(subject.rule):
        rows += _beside(subject, name, peer, pixels, where)
    return rows


def _peers(rule: Rule) -> list[tuple[str, Label, int]]:
    """Name, function and pixels of the peers that can be had."""
    many, few = SAMPLES[rule.axial_forcing]
    peers: list[tuple[str, Label, int]] = []
    if not missing("heyoka"):
        peers.append(("heyoka, scalar", ByHeyoka(rule, batch=False).label, many))
        peers.append(("heyoka, batch", ByHeyoka(rule, batch=True).label, many))
    if not missing("scipy"):
        peers.append(("SciPy", ByScipy(rule).label, few))
    return peers


def _beside(subject: BasinMap, name: str, peer: Label, pixels: int, where: str) -> list[Row]:
    """One peer and the lanes in turn: time, ratio and labels that differ."""
    n = len(subject.tau)
    picked = np.sort(np.random.default_rng(SEED).choice(n, pixels, replace=False))
    tau, w, labels = subject.tau[picked], subject.w[picked], np.empty(pixels, np.int32)
    impacts = subject.impacts
    share = int(impacts[picked].sum()) * n // int(impacts.sum())  # pixels that the sample is worth

    def run() -> int:
        peer(tau, w, labels)
        return share

    times = interleaved({"lanes": subject.lanes, name: run}, PEER_ROUNDS)
    differ = int(np.sum(labels != subject.labels[picked]))
    allowed = math.ceil(AGREEMENT * pixels)
    agree = subject.rule.axial_forcing > CHAOTIC or differ <= allowed
    assert agree, f"{differ} of {pixels} pixels have another label by {name}"
    ratio = (name, "lanes", f"{name} / lanes", Aim(at_least=AIMS[name]))
    what = f"pixels with another label than by {name}, {where}"
    return [
        *compared(PART, where, "ns a pixel", times, [ratio])[1:],  # the lanes have their row
        row(PART, what, f"of {pixels}", [differ]),
    ]
