"""Nanoseconds per impact of the core beside its peers, interleaved so that noise hits all alike."""

from __future__ import annotations

import math
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.axial import (
    FREQUENCY,
    GRAVITY,
    REGIMES,
    RESTITUTION,
    Regime,
    impacts,
    motion_of,
    starts,
)
from bench.c_reference import CReference
from bench.heyoka_reference import ByHeyoka
from bench.many_references import missing
from bench.table import Aim, Row, compared
from bench.turns import Run, interleaved
from bouncing_disk_ros.core.model import Disk, InitialState, Motion
from bouncing_disk_ros.core.simulation import Simulation

PART = "ns per impact"
IMPACTS = 2000
CYCLES_OF_HEYOKA = 50
ROUNDS = 1000
COMPARED = 20
AGREEMENT = 1e-12  # rad and πg/ω, over the first impacts
# heyoka starts each flight HAIR = 1e-12 above the platform; chaos magnifies that some hundred times
AGREEMENT_OF_HEYOKA = 1e-9


def full_simulation(regime: Regime) -> Simulation:
    """The same axial problem in a whole simulation: rotation, energy books and rows besides."""
    climb = regime.axial_forcing * math.cos(regime.phase)
    return Simulation(
        Motion(regime.axial_forcing, 1.0, FREQUENCY, -0.7),
        Disk(1.0, RESTITUTION, 0.5, 0.1, 0.1, GRAVITY),
        InitialState(axial_velocity=climb + regime.speed, forcing_phase=regime.phase),
    )


def runs_of(regime: Regime, c: CReference | None, heyoka: ByHeyoka | None) -> dict[str, Run]:
    """One run of each: does some impacts and returns how many. Peers are checked first."""
    motion, out = motion_of(regime.axial_forcing), np.empty((IMPACTS, 2))
    launch = (regime.phase, regime.speed)
    simulation = full_simulation(regime)
    span = round(IMPACTS * math.tau * 1e9)

    def core() -> int:
        impacts(motion, GRAVITY, RESTITUTION, *launch, out)
        return IMPACTS

    def full() -> int:
        return len(simulation.advance(simulation.time_ns + span)[0])

    core()
    expected = out.copy()
    rows = full_simulation(regime).advance(round(COMPARED * math.tau * 2e9))[0]
    agree("Simulation.advance", rows["forcing_phase"], expected[:, 0])
    runs: dict[str, Run] = {"core": core, "full": full}
    if c is not None:
        by_c, out_of_c = c, np.empty((IMPACTS, 2))

        def compiled() -> int:
            by_c.impacts(regime.axial_forcing, RESTITUTION, *launch, out_of_c)
            return IMPACTS

        compiled()
        agree("C", out_of_c[:, 0], expected[:, 0])
        agree("C", out_of_c[:, 1], expected[:, 1])

        def chain(*, other: bool) -> int:
            by_c.divisions(IMPACTS, other=other)
            return IMPACTS

        runs["C"] = compiled
        runs["chain"] = lambda: chain(other=False)
        runs["chain, work"] = lambda: chain(other=True)
    if heyoka is not None:
        integrator, first = heyoka, starts(regime, 1)
        integrator.iterate(*first, 2 * COMPARED)
        phases = np.array(integrator.times) % math.tau
        agree("heyoka", phases, expected[:, 0], AGREEMENT_OF_HEYOKA)
        runs["heyoka"] = lambda: integrator.iterate(*first, CYCLES_OF_HEYOKA)
    return runs


def agree(
    name: str, found: NDArray[np.float64], expected: NDArray[np.float64], limit: float = AGREEMENT
) -> None:
    """AssertionError unless the first impacts are the core's."""
    apart = float(np.max(np.abs(found[:COMPARED] - expected[:COMPARED])))
    assert apart <= limit, f"{name} differs from the core by {apart:.3g} in the first impacts"


def measure(folder: Path) -> tuple[list[Row], list[str]]:
    """The rows of this part, and the names of peers that were skipped."""
    skipped = [f"skipped: {why}" for why in (CReference.missing(), missing("heyoka")) if why]
    c = None if CReference.missing() else CReference(folder)
    rows: list[Row] = []
    notes = [f"C: {c.name()}, libm sincos"] if c else []
    for regime in REGIMES:
        heyoka = None if missing("heyoka") else ByHeyoka(regime.axial_forcing, batch=False)
        times = interleaved(runs_of(regime, c, heyoka), ROUNDS, time.perf_counter_ns)
        rows += rows_of(f"Γ = {regime.axial_forcing} ({regime.name})", times)
        if heyoka is not None:
            callback = heyoka.callback_ns()
            notes.append(
                f"heyoka (one of the peers below), Γ = {regime.axial_forcing}: at each impact it "
                f"calls a Python function, which takes {callback:.0f} ns"
            )
    return rows, skipped + notes


def rows_of(regime: str, times: dict[str, NDArray[np.float64]]) -> list[Row]:
    """Times, and ratios round by round."""
    names = {
        "core": "scalar stepper, axial",
        "full": "Simulation.advance, all",
        "C": "scalar C, axial",
        "heyoka": "heyoka, scalar, axial",
        "chain": "a chain of ten divisions",
        "chain, work": "the chain with other work beside it",
    }
    pairs = (
        ("core", "C", Aim(1.1)),
        ("full", "C", Aim(1.8)),
        ("heyoka", "core", Aim(None, 20)),
        ("chain, work", "chain", None),
    )
    ratios = [(names[a], names[b], f"{names[a]} / {names[b]}", aim) for a, b, aim in pairs]
    return compared(PART, regime, "ns", {names[key]: t for key, t in times.items()}, ratios)
