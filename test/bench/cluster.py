"""How far a cluster would carry a study: runs on this machine, costs of regions, simulated runs."""

from __future__ import annotations

import heapq
import os
import tempfile
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from bench.table import Row, row
from bench.turns import elapsed
from bouncing_disk_ros.study import Region, Study, named, open_result, run
from bouncing_disk_ros.study.store import Store

PART = "cluster"
ROUNDS = 3
FORCING = {"period-1": 0.45, "chaos": 0.55}
SIDE = 100_000  # pixels along each side of the map that no one machine would compute
REGION, TILE = 1024, 256
TILES = 32  # computed of each map, at random places
WORKERS = (10, 100, 1000)
MEASURED_SIDE = 4000  # of the map whose measures are timed, and that processes compute
PROCESSES = (4, 8)


def basins(side: int, axial_forcing: float = 0.45) -> Study:
    """The study of a square map, all else by default."""
    return named("basins", width=side, height=side, axial_forcing=axial_forcing)


def measure() -> tuple[list[Row], list[str]]:
    """Measured costs of the parts, and runs on many workers simulated with them."""
    overhead = _overhead()
    if overhead is None:
        return [], ["skipped: distributed is not installed: the cluster"]
    store = _seconds_to_store()
    rows = [
        row(PART, "Dask, one region there and back", "s", overhead),
        row(PART, f"region of {REGION} × {REGION}, to store", "s", store),
        row(PART, "shares and measures of 10⁵ × 10⁵ labels, by one process", "h", _measures()),
        *_processes(),
    ]
    call, put = float(np.median(overhead)), float(np.median(store))
    for name, axial_forcing in FORCING.items():
        compute = _seconds_to_compute(basins(SIDE, axial_forcing))
        mean = float(np.mean(compute))
        # the spread is that of the tiles, wider than that of whole regions
        rows.append(row(PART, f"region of {REGION} × {REGION}, to compute, {name}", "s", compute))
        rows.append(row(PART, f"the same, mean over the map, {name}", "s", [mean]))
        there = [seconds + put for seconds in compute]
        for workers in WORKERS:
            rows += _simulated(f"{workers} workers that store, {name}", there, call, workers)
        for workers in WORKERS:
            where = f"{workers} workers that send back, {name}"
            rows += _simulated(where, compute, call + put, workers)
    return rows, []


def _simulated(where: str, busy: list[float], serial: float, workers: int) -> list[Row]:
    regions = int(np.prod(basins(SIDE).region_counts()))
    share, seconds = simulated(busy, serial, workers, regions)
    return [
        row(PART, f"share of the workers used, {where} (simulated)", "1", [share]),
        row(PART, f"10⁵ × 10⁵ basin, {where} (simulated)", "h", [seconds / 3600.0]),
    ]


def _seconds_to_compute(study: Study) -> list[float]:
    """For a region each, from tiles over the map."""
    context = basins(2048, float(study.parameters["axial_forcing"])).context()
    rng = np.random.default_rng(11)
    found = []
    for first_row, first_column in rng.integers(0, SIDE - TILE, (TILES, 2)).tolist():
        tile = _square(first_row, first_column, TILE)
        found.append(elapsed(partial(study.compute, tile, context, None)) * (REGION / TILE) ** 2)
    return found


def _seconds_to_store() -> list[float]:
    """For a region of the map with settled starts."""
    study, small = basins(SIDE), basins(4 * REGION)  # of 16 regions of this side
    context = small.context()
    found = []
    with tempfile.TemporaryDirectory() as folder:
        store = Store(Path(folder, "r"), small)
        for place in (0.1, 0.4, 0.6, 0.9):
            first = int(place * SIDE)
            arrays = study.compute(_square(first, first, REGION), context, None)
            found.append(elapsed(partial(store.put, _square(0, 0, REGION), arrays)))
    return found


def _measures() -> list[float]:
    """Hours that `finish` would take, by its time for a smaller map: it goes with the pixels."""
    found = []
    with tempfile.TemporaryDirectory() as folder:
        study = basins(MEASURED_SIDE)
        run(study, Path(folder, "r"), workers=2)
        context = study.context()
        for _ in range(ROUNDS):
            result = open_result(Path(folder, "r"))
            seconds = elapsed(partial(study.finish, result, context))
            found.append(seconds * (SIDE / MEASURED_SIDE) ** 2 / 3600.0)
    return found


def _square(first_row: int, first_column: int, side: int) -> Region:
    rows = slice(first_row, first_row + side)
    return Region(0, {"velocity": rows, "forcing_phase": slice(first_column, first_column + side)})


@contextmanager
def _local(processes: int, threads: int) -> Iterator[Any]:
    """A Dask cluster on this machine."""
    import distributed

    with distributed.LocalCluster(
        n_workers=processes, threads_per_worker=threads, processes=True, dashboard_address=None,
        silence_logs=50,
    ) as cluster:  # fmt: skip
        yield cluster


def _processes() -> list[Row]:
    """A whole study on Dask processes of this machine, and on its threads."""
    study, cores = basins(MEASURED_SIDE), len(os.sched_getaffinity(0))
    what = f"basin {MEASURED_SIDE} × {MEASURED_SIDE}, Γ = 0.45, stored"

    def stored(which: Study, **executor: Any) -> float:
        with tempfile.TemporaryDirectory() as folder:
            return elapsed(lambda: run(which, Path(folder, "r"), **executor))

    threads = [stored(study, workers=cores) for _ in range(ROUNDS)]
    rows = [row(PART, f"{what}, {cores} threads", "s", threads)]
    for count in PROCESSES:
        with _local(count, 1) as cluster:
            given = {"scheduler": cluster.scheduler_address}
            stored(basins(400), **given)  # each process loads its kernels
            times = [stored(study, **given) for _ in range(ROUNDS)]
        name = f"{what}, {count} Dask processes on {cores} cores"
        rows.append(row(PART, name, "s", times))
    return rows


def _overhead() -> list[float] | None:
    """Seconds for one call through a scheduler and a worker of this machine, many in flight."""
    try:
        import distributed
    except ImportError:
        return None
    found = []
    with (
        _local(1, 2) as cluster,
        distributed.Client(cluster) as client,
        client.get_executor(pure=False) as pool,
    ):

        def many() -> None:
            for future in [pool.submit(int, "1") for _ in range(100)]:
                future.result()

        found += [elapsed(many) / 100 for _ in range(ROUNDS)]
    return found


def simulated(
    busy: list[float], serial: float, workers: int, regions: int, ahead: int = 2
) -> tuple[float, float]:
    """Share of the workers' time that is spent on regions, and seconds until all are done.

    Each worker has up to `ahead` regions given out, which take it one of the times `busy`. For each
    finished region, one process takes `serial` seconds, one after the other (to store it if it came
    back, to give out the next one).
    """
    rng = np.random.default_rng(5)
    times = rng.choice(busy, regions).tolist()
    left = regions - ahead * workers
    given = deque([0.0] * min(regions, ahead * workers))  # when each can begin, not yet begun
    idle = deque([0.0] * workers)  # since when
    ends: list[float] = []  # of the regions at work
    keeper, begun = 0.0, 0
    while True:
        while given and idle:
            heapq.heappush(ends, max(given.popleft(), idle.popleft()) + times[begun])
            begun += 1
        if not ends:
            return sum(times) / (workers * keeper), keeper
        done = heapq.heappop(ends)
        idle.append(done)
        keeper = max(keeper, done) + serial
        if left > 0:
            given.append(keeper)
            left -= 1
