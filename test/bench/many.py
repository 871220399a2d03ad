"""Many trajectories and basins by the lanes, beside their peers, in turns.

Times are those of the processor, so that the load of other programs counts for less: of the calling
thread, but for JAX, which has threads of its own, of the process.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench import basin_map
from bench.axial import REGIMES, RESTITUTION, Regime, starts
from bench.c_reference import CLanes, CReference
from bench.heyoka_reference import ByHeyoka
from bench.lyapunov import PYNAMICALSYS, lyapunov_runs
from bench.many_references import ByJax, by_numpy, by_scipy, missing
from bench.processor import by_vectors
from bench.table import Aim, Row, compared
from bench.turns import Run, interleaved
from bouncing_disk_ros.maps.lanes.axial_lanes import iterate_axial

PART = "many trajectories"
TRAJECTORIES, IMPACTS, ROUNDS = 1024, 200, 60
COMPARED = 10
AGREEMENT = 1e-11  # rad and πg/ω after so many impacts; chaos magnifies a rounding a hundredfold
# heyoka starts each flight HAIR = 1e-12 above the platform
COMPARED_OF_HEYOKA, AGREEMENT_OF_HEYOKA = 5, 1e-9
Floats = NDArray[np.float64]


class Subject:
    """Starts near those of a regime, and what runs on them: each returns its impacts."""

    def __init__(self, regime: Regime, folder: Path) -> None:
        n = TRAJECTORIES
        self.axial_forcing = regime.axial_forcing
        self._tau, self._w = starts(regime, n)
        self._forcings, self._restitutions = (
            np.full(n, regime.axial_forcing),
            np.full(n, RESTITUTION),
        )
        self._counts = np.zeros((n, 2), np.int64)
        self._folder = folder
        self._out = np.empty((TRAJECTORIES, 2))

    def states(self) -> tuple[Floats, Floats]:
        """Fresh copies of the starts."""
        return self._tau.copy(), self._w.copy()

    def lanes(self, impacts: int = IMPACTS) -> tuple[Floats, Floats]:
        """Where the lanes go."""
        tau, w = self.states()
        iterate_axial(tau, w, self._forcings, self._restitutions, impacts, self._counts)
        return tau, w

    def by_lanes(self) -> int:
        """The lanes."""
        self.lanes()
        return TRAJECTORIES * IMPACTS

    def by_c(self, c: CLanes) -> Run:
        """Vectorised C."""
        given = self.axial_forcing, RESTITUTION
        return self.in_place(lambda tau, w, impacts: c.iterate(tau, w, *given, impacts), IMPACTS)

    def in_place(self, function: Callable[[Floats, Floats, int], object], impacts: int) -> Run:
        """Run of a peer, compared with the lanes first."""
        tau, w = self.states()
        function(tau, w, COMPARED)
        expected = self.lanes(COMPARED)
        apart = max(float(np.abs(tau - expected[0]).max()), float(np.abs(w - expected[1]).max()))
        assert apart <= AGREEMENT, f"a peer differs from the lanes by {apart:.3g}"

        def run() -> int:
            function(*self.states(), impacts)
            return TRAJECTORIES * impacts

        run()
        return run

    def peers(self) -> tuple[dict[str, Run], list[str]]:
        """What can be had, and what is missing."""
        runs: dict[str, Run] = {}
        notes = [why for why in (CReference.missing(), missing("jax"), missing("heyoka")) if why]
        if not CReference.missing():
            one = CReference(self._folder)
            runs["C"] = self.by_c(CLanes(self._folder))

            def scalar() -> int:
                launch = (self._tau[0], -RESTITUTION * self._w[0])
                one.impacts(self.axial_forcing, RESTITUTION, *launch, self._out)
                return len(self._out)

            runs["scalar C"] = scalar
        runs["numpy"] = self.in_place(lambda tau, w, n: by_numpy(tau, w, self.axial_forcing, n), 5)
        if not missing("jax"):
            runs["JAX"] = self.in_place(ByJax(self.axial_forcing).iterate, 20)
        if not missing("heyoka"):
            batch = ByHeyoka(self.axial_forcing, batch=True)
            batch.iterate(self._tau, self._w, 2 * COMPARED_OF_HEYOKA)
            for k in range(COMPARED_OF_HEYOKA):
                apart = abs(batch.times[k] % math.tau - self.lanes(k + 1)[0][0])
                assert apart <= AGREEMENT_OF_HEYOKA, f"heyoka differs from the lanes by {apart:.3g}"
            runs["heyoka"] = lambda: batch.iterate(self._tau, self._w, 50)
        return runs, notes

    def scipy(self) -> int:
        """SciPy: one trajectory, a few impacts."""
        by_scipy(self._tau[0], self._w[0], self.axial_forcing, 3)
        return 3


def _trajectories(regime: Regime, folder: Path) -> tuple[list[Row], list[str]]:
    subject = Subject(regime, folder)
    peers, notes = subject.peers()
    times = interleaved({"lanes": subject.by_lanes, **peers}, ROUNDS)
    if why := missing("scipy"):
        notes.append(why)
    else:
        times |= interleaved({"SciPy": subject.scipy}, 5)
    where = f"Γ = {regime.axial_forcing} ({regime.name})"
    slower = {"heyoka": 250.0, "numpy": by_vectors(35.0, 25.0), "JAX": 15.0}
    ratios = [("lanes", "C", "lanes / vectorised C", Aim(1.0))]
    ratios += [(name, "lanes", f"{name} / lanes", Aim(None, aim)) for name, aim in slower.items()]
    return compared(PART, where, "ns an impact", times, ratios), notes


def _lyapunov(regime: Regime) -> list[Row]:
    """Settled, measured with the exponent, the last impacts kept."""
    times = interleaved(lyapunov_runs(regime), ROUNDS)
    where = f"Γ = {regime.axial_forcing} ({regime.name})"
    named = {f"Lyapunov, {name}": found for name, found in times.items()}
    aim = Aim(by_vectors(0.1, 0.15))
    ratios = [
        ("Lyapunov, lanes", "Lyapunov, scalar", "Lyapunov, lanes / scalar", aim),
        *(
            (f"Lyapunov, {PYNAMICALSYS}", f"Lyapunov, {own}", f"Lyapunov, {PYNAMICALSYS} / {own}",
             None)
            for own in ("scalar", "lanes")
        ),
    ]  # fmt: skip
    return compared(PART, where, "ns an impact", named, ratios)


def measure(folder: Path) -> tuple[list[Row], list[str]]:
    """The rows of this part, and the names of peers that were skipped."""
    rows: list[Row] = []
    skipped: set[str] = set()
    for regime in REGIMES:
        more, notes = _trajectories(regime, folder)
        rows += more + _lyapunov(regime)
        skipped |= {*notes, missing(PYNAMICALSYS)} - {""}
    for axial_forcing in (0.45, 0.55):
        rows += basin_map.measure(axial_forcing, folder)
    return rows, [f"skipped among many trajectories: {why}" for why in sorted(skipped)]
