"""The lanes and vectorised C on narrower vectors: AVX2, and SSE2 as every x86-64 has it.

    python -m bench.widths PROCESSOR FOLDER

measures in a process of its own, whose numba compiles for that processor (its name is the same for
LLVM and gcc), and prints JSON. Times are those of this machine, which runs such code as its own.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np

from bench.axial import REGIMES
from bench.basin_map import PIXELS, BasinMap
from bench.c_reference import CLanes, CReference
from bench.many import Subject
from bench.processor import flags
from bench.table import Aim, Row, compared
from bench.turns import in_process, interleaved

PART = "narrower vectors"
#: name of the processor -> what its vectors are called, and the flags of /proc/cpuinfo it needs
WIDTHS = {"haswell": ("AVX2", {"avx2", "fma", "bmi2"}), "x86-64": ("SSE2", {"sse2"})}
ROUNDS, MAP_ROUNDS = 30, 10
FORCING = 0.45  # of the basin map


def measure(folder: Path) -> tuple[list[Row], list[str]]:
    """The rows of this part, and what was skipped."""
    if why := CReference.missing():
        return [], [f"skipped among narrower vectors: {why}"]
    rows: list[Row] = []
    notes = []
    for processor, (name, needed) in WIDTHS.items():
        if lacking := needed - flags():
            notes.append(f"skipped: {name}: this processor has no {', '.join(sorted(lacking))}")
            continue
        found = _in_process_of_its_own(processor, folder)
        for what, times in found.items():
            basin = what.startswith("basin")
            unit = "ns a pixel" if basin else "ns an impact"
            aim = Aim(1.1 if basin else 1.0)  # as with the widest vectors
            both = {who: np.array(values) for who, values in times.items()}
            ratio = ("lanes", "C", "lanes / vectorised C", aim)
            rows += compared(PART, f"{what}, {name}", unit, both, [ratio])
    return rows, notes


def _in_process_of_its_own(processor: str, folder: Path) -> dict[str, dict[str, list[float]]]:
    # without features of its own: else numba adds those of this machine
    env = {"NUMBA_CPU_NAME": processor, "NUMBA_CPU_FEATURES": ""}
    printed = in_process("-m", "bench.widths", processor, folder, env=env)
    found: dict[str, dict[str, list[float]]] = json.loads(printed)
    return found


def _here(processor: str, folder: Path) -> dict[str, dict[str, list[float]]]:
    """Times by what was measured, and by whom."""
    c = CLanes(folder, processor)
    found = {}
    for regime in REGIMES:
        what = f"Γ = {regime.axial_forcing} ({regime.name})"
        runs = Subject(regime, folder)
        found[what] = interleaved({"lanes": runs.by_lanes, "C": runs.by_c(c)}, ROUNDS)
    subject = BasinMap(FORCING)
    run, labels = subject.by_c(c)
    what = f"basin map {PIXELS} × {PIXELS}, Γ = {FORCING}"
    found[what] = interleaved({"lanes": subject.lanes, "C": run}, MAP_ROUNDS)
    differ = int(np.sum(subject.labels != labels))
    assert differ <= 1e-3 * len(labels), f"{differ} pixels have another label by C"
    return {
        what: {name: list(values) for name, values in times.items()}
        for what, times in found.items()
    }


if __name__ == "__main__":
    print(json.dumps(_here(sys.argv[1], Path(sys.argv[2]))))
