"""Studies as a whole: cores, memory, cost against work, and how far a cluster would carry them."""

from __future__ import annotations

import heapq
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import islice
from pathlib import Path

import numpy as np

from bench.table import Aim, Row, row
from bouncing_disk_ros.core.lanes_axial import iterate
from bouncing_disk_ros.nodes.basins import OPTIONS
from bouncing_disk_ros.nodes.study_options import COMMON
from bouncing_disk_ros.study import Region, run
from bouncing_disk_ros.study.basins import Basins
from bouncing_disk_ros.study.store import Store

PART = "studies"
ROUNDS = 3
FORCING = {"period-1": 0.45, "chaos": 0.55}
LARGE = 4000
CLUSTER = 100_000  # pixels along each side of the map that no one machine would compute
MEMORY = """
import sys
from bench.studies import basins, memory
from bouncing_disk_ros.study import run
run(basins(200), sys.argv[1] + "/small")
before = memory()
run(basins(int(sys.argv[2])), sys.argv[1] + "/large", workers=1)
print(memory() - before)
"""


def basins(side: int, forcing: float = 0.45) -> Basins:
    """The study of a square map, all else by default."""
    values = {name: spec.default for name, spec in OPTIONS.items() if name not in COMMON}
    return Basins({**values, "width": side, "height": side, "axial_forcing": forcing})


def memory() -> int:
    """Most memory that this process ever held, B."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(1024 * int(line.split()[1]) for line in lines if line.startswith("VmHWM"))


def measure() -> tuple[list[Row], list[str]]:
    """The rows of this part, and its notes."""
    cluster, notes = _cluster()
    return [*_cores(), _memory(), _linear(), *cluster], notes


def _seconds(work: Callable[[], object]) -> float:
    begin = time.perf_counter()
    work()
    return time.perf_counter() - begin


def _stored(study: Basins, workers: int) -> float:
    with tempfile.TemporaryDirectory() as folder:
        return _seconds(lambda: run(study, Path(folder, "r"), workers=workers))


def _cores() -> list[Row]:
    study = basins(2000)
    _stored(basins(200), 2)
    pairs = [(_stored(study, 1), _stored(study, 2)) for _ in range(ROUNDS)]
    one, two = (list(times) for times in zip(*pairs, strict=True))
    ratio = [a / b for a, b in pairs]
    return [
        *labels_on_two_cores(),
        row(PART, "basin 2000 × 2000, Γ = 0.45, stored, one core", "s", one),
        row(PART, "basin 2000 × 2000, Γ = 0.45, stored, two cores", "s", two),
        row(PART, "two cores against one, basin 2000 × 2000, stored", "×", ratio),
    ]


def labels_on_two_cores() -> list[Row]:
    """Labels alone, without search, store and measures, which one process does by itself."""
    study = basins(2000)
    context = study.context()
    regions = list(study.regions())

    def labelled(workers: int) -> float:
        with ThreadPoolExecutor(workers) as pool:
            return _seconds(lambda: list(pool.map(lambda r: study.compute(r, context, None),
                                                  regions)))  # fmt: skip

    labelled(2)
    ratio = [labelled(1) / labelled(2) for _ in range(2 * ROUNDS)]
    return [row(PART, "two cores against one, labels alone", "×", ratio, Aim(at_least=1.8))]


def _memory() -> Row:
    """In a process of its own: memory once taken is not given back."""
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(
            [sys.executable, "-c", MEMORY, folder, str(LARGE)], capture_output=True, text=True,
            check=True, timeout=300, env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
        )  # fmt: skip
    size = LARGE * LARGE * (4 + 4 + 8)  # label, impacts, time
    name = f"memory of a {LARGE} × {LARGE} basin / size of the result"
    return row(PART, name, "×", [int(done.stdout) / size], Aim(3.0))


def _linear() -> Row:
    """The exponent of time against impacts over four decades, 10⁴ to 10⁸."""
    slopes = []
    works = [10_000, 100_000, 1_000_000, 10_000_000, 100_000_000]
    for _ in range(ROUNDS):
        times = []
        for work in works:
            n = 1024
            rng = np.random.default_rng(7)
            tau, w = rng.uniform(0, 6.28, n), -rng.uniform(1.0, 2.0, n)
            forcing, restitution = np.full(n, 0.45), np.full(n, 0.5)
            counts = np.zeros((n, 2), np.int64)
            begin = time.perf_counter()
            iterate(tau, w, forcing, restitution, max(1, work // n), counts)
            times.append(time.perf_counter() - begin)
        slopes.append(float(np.polyfit(np.log(works), np.log(times), 1)[0]))
    return row(PART, "exponent of time against impacts, 10⁴ to 10⁸", "1", slopes)


def _cluster() -> tuple[list[Row], list[str]]:
    """Measured costs of one region, and a run on many workers simulated with them."""
    rows: list[Row] = []
    notes: list[str] = []
    overhead = _overhead()
    if overhead is None:
        return [], ["skipped: distributed is not installed: the cluster"]
    rows.append(row("cluster", "Dask, one region there and back", "s", overhead))
    for name, forcing in FORCING.items():
        study = basins(CLUSTER, forcing)
        compute, write = _costs(study)
        rows += [
            row("cluster", f"region of 1024 × 1024, {name}, to compute", "s", compute),
            row("cluster", f"region of 1024 × 1024, {name}, to store", "s", write),
        ]
        serial = float(np.median(write)) + float(np.median(overhead))
        for workers in (10, 100, 1000):
            share = efficiency(compute, serial, workers)
            rows.append(row("cluster", f"share of {workers} workers used, {name} (simulated)", "1",
                            [share]))  # fmt: skip
            regions = np.prod(study.region_counts())
            hours = regions * float(np.mean(compute)) / (workers * share) / 3600.0
            rows.append(row("cluster", f"10⁵ × 10⁵ basin, {workers} workers, {name} (simulated)",
                            "h", [float(hours)]))  # fmt: skip
    return rows, notes


def _costs(study: Basins) -> tuple[list[float], list[float]]:
    """Seconds to compute and to store some regions over the map."""
    small = basins(2048, study.parameters["axial_forcing"])  # type: ignore[arg-type]
    context = small.context()
    last = int(np.prod(study.region_counts()))
    places = [int(place) for place in np.linspace(0, last - 1, 4)]
    regions = [next(islice(study.regions(), place, None)) for place in places]
    compute, write = [], []
    with tempfile.TemporaryDirectory() as folder:
        store = Store(Path(folder, "r"), small)
        for region in regions:
            begin = time.perf_counter()
            arrays = study.compute(region, context, None)
            compute.append(time.perf_counter() - begin)
            shape = next(iter(arrays.values())).shape
            spot = Region(0, {"velocity": slice(0, shape[0]), "forcing_phase": slice(0, shape[1])})
            begin = time.perf_counter()
            store.write(spot, arrays)
            write.append(time.perf_counter() - begin)
    return compute, write


def _overhead() -> list[float] | None:
    """Seconds for one call through a scheduler and a worker of this machine, many in flight."""
    try:
        import distributed
    except ImportError:
        return None
    found = []
    with (
        distributed.LocalCluster(
            n_workers=1, threads_per_worker=2, processes=True, dashboard_address=None,
            silence_logs=50,
        ) as cluster,
        distributed.Client(cluster) as client,
        client.get_executor(pure=False) as pool,
    ):  # fmt: skip
        for _ in range(ROUNDS):
            begin = time.perf_counter()
            for future in [pool.submit(int, "1") for _ in range(100)]:
                future.result()
            found.append((time.perf_counter() - begin) / 100)
    return found


def efficiency(compute: list[float], serial: float, workers: int, ahead: int = 2) -> float:
    """Share of the workers' time that is spent computing, by simulation.

    Each worker has up to `ahead` regions given out. A finished region is stored, and the next one
    given out, by one process that takes `serial` seconds for it and does one after the other.
    """
    rng = np.random.default_rng(5)
    total = 40 * workers
    times = rng.choice(compute, total)
    free = [(0.0, worker) for worker in range(workers)]  # when each can begin its next region
    heapq.heapify(free)
    given = [0.0] * (ahead * workers)  # regions given out: the instant at which each may begin
    heapq.heapify(given)
    keeper = end = 0.0
    for seconds in times:
        ready, worker = heapq.heappop(free)
        begin = max(ready, heapq.heappop(given))
        done = begin + float(seconds)
        heapq.heappush(free, (done, worker))
        keeper = max(keeper, done) + serial
        heapq.heappush(given, keeper)
        end = max(end, keeper)
    return float(times.sum() / (workers * end))
