"""How far a cluster would carry a study: measured costs of its regions, and a simulated run."""

from __future__ import annotations

import heapq
import tempfile
import time
from itertools import islice
from pathlib import Path

import numpy as np

from bench.basin_study import basins
from bench.table import Row, row
from bouncing_disk_ros.study import Region
from bouncing_disk_ros.study.basins import Basins
from bouncing_disk_ros.study.store import Store

PART = "cluster"
ROUNDS = 3
FORCING = {"period-1": 0.45, "chaos": 0.55}
SIDE = 100_000  # pixels along each side of the map that no one machine would compute


def measure() -> tuple[list[Row], list[str]]:
    """Measured costs of one region, and a run on many workers simulated with them."""
    rows: list[Row] = []
    notes: list[str] = []
    overhead = _overhead()
    if overhead is None:
        return [], ["skipped: distributed is not installed: the cluster"]
    rows.append(row(PART, "Dask, one region there and back", "s", overhead))
    for name, forcing in FORCING.items():
        study = basins(SIDE, forcing)
        compute, write = _costs(study)
        rows += [
            row(PART, f"region of 1024 × 1024, {name}, to compute", "s", compute),
            row(PART, f"region of 1024 × 1024, {name}, to store", "s", write),
        ]
        serial = float(np.median(write)) + float(np.median(overhead))
        for workers in (10, 100, 1000):
            share = efficiency(compute, serial, workers)
            rows.append(row(PART, f"share of {workers} workers used, {name} (simulated)", "1",
                            [share]))  # fmt: skip
            regions = np.prod(study.region_counts())
            hours = regions * float(np.mean(compute)) / (workers * share) / 3600.0
            rows.append(row(PART, f"10⁵ × 10⁵ basin, {workers} workers, {name} (simulated)",
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
            store.put(spot, arrays)
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
