"""Studies as a whole: cores, memory, cost against work."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path

from bench import cluster
from bench.cluster import basins
from bench.table import Aim, Row, row
from bench.turns import elapsed, in_process
from bouncing_disk_ros.study import Study, run

PART = "studies"
ROUNDS = 5
LARGE = 4000
MEMORY = """
import sys
from bench.cluster import basins
from bench.studies import memory
from bouncing_disk_ros.study import run
run(basins(200), sys.argv[1] + "/small")
before = memory()
run(basins(int(sys.argv[2])), sys.argv[1] + "/large", workers=1)
print(memory() - before)
"""


def memory() -> int:
    """Most memory that this process ever held, B."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(1024 * int(line.split()[1]) for line in lines if line.startswith("VmHWM"))


def measure() -> tuple[list[Row], list[str]]:
    """The rows of this part, and its notes."""
    rows, notes = cluster.measure()
    return [*_cores(), _memory(), *rows], notes


def _stored(study: Study, workers: int) -> float:
    with tempfile.TemporaryDirectory() as folder:
        return elapsed(lambda: run(study, Path(folder, "r"), workers=workers))


@contextmanager
def on_cores(count: int) -> Iterator[None]:
    """All threads of this process on so many processors: those that store count as well."""
    allowed = os.sched_getaffinity(0)
    _pin(set(sorted(allowed)[:count]))
    try:
        yield
    finally:
        _pin(allowed)


def _pin(processors: set[int]) -> None:
    for thread in Path("/proc/self/task").iterdir():
        with suppress(ProcessLookupError):  # it has ended
            os.sched_setaffinity(int(thread.name), processors)


def _stored_on(study: Study, cores: int) -> float:
    with on_cores(cores):
        return _stored(study, cores)


def _cores() -> list[Row]:
    if len(os.sched_getaffinity(0)) < 2:
        return []
    study = basins(2000)
    _stored(basins(200), 2)
    pairs = [(_stored_on(study, 1), _stored_on(study, 2)) for _ in range(ROUNDS)]
    one, two = (list(times) for times in zip(*pairs, strict=True))
    ratio = [a / b for a, b in pairs]
    return [
        *labels_on_two_cores(),
        row(PART, "basin 2000 × 2000, Γ = 0.45, stored, one core", "s", one),
        row(PART, "basin 2000 × 2000, Γ = 0.45, stored, two cores", "s", two),
        row(
            PART, "two cores against one, basin 2000 × 2000, stored", "×", ratio, Aim(at_least=1.8)
        ),
    ]


def labels_on_two_cores() -> list[Row]:
    """Labels alone, without search, store and measures, which one process does by itself."""
    study = basins(2000)
    context = study.context()
    regions = list(study.regions())

    def labelled(workers: int) -> float:
        with on_cores(workers), ThreadPoolExecutor(workers) as pool:
            return elapsed(lambda: list(pool.map(lambda r: study.compute(r, context, None),
                                                  regions)))  # fmt: skip

    labelled(2)
    ratio = [labelled(1) / labelled(2) for _ in range(2 * ROUNDS)]
    return [row(PART, "two cores against one, labels alone", "×", ratio, Aim(at_least=1.8))]


def _memory() -> Row:
    """In a process of its own: memory once taken is not given back."""
    with tempfile.TemporaryDirectory() as folder:
        printed = in_process("-c", MEMORY, folder, str(LARGE))
    size = LARGE * LARGE * (4 + 4 + 8)  # label, impacts, time
    name = f"memory of a {LARGE} × {LARGE} basin / size of the result"
    return row(PART, name, "×", [int(printed) / size], Aim(3.0))
