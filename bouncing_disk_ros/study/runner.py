"""Run a study: compute the regions that its store does not hold, on any executor."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import xarray as xr

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.study.definition import Arrays, Region, Study
from bouncing_disk_ros.study.store import Store, open_result

AHEAD = 2
"""Regions given out for each worker: one at work, one waiting, so that memory stays bounded."""
LOOK_SECONDS = 0.2
"""How often a run that waits for results looks whether it is to stop."""


class Progress(NamedTuple):
    """How far a run is."""

    done: int  # regions in the store
    total: int
    resumed: int  # of these, found there at the start


def never() -> bool:
    """Nobody asks to stop."""
    return False


def run(
    study: Study,
    path: str | Path,
    *,
    workers: int = 1,
    scheduler: str = "",
    on_progress: Callable[[Progress], None] = lambda _: None,
    stopped: Callable[[], bool] = never,
) -> xr.Dataset | None:
    """Compute a study into the Zarr store at `path`, or go on with what is there.

    `workers` threads compute (the kernels release the GIL); with `scheduler` (tcp://host:port) the
    workers of that Dask cluster do. Returns the whole result, or None when `stopped` said so: then
    the store holds every finished region, and the same call goes on from there.
    Raises InputError for a path that holds something else or cannot be written, or a scheduler
    that does not answer; OSError for a disk or a cluster that fails in mid-work.
    """
    if study.sequential and scheduler:
        hint = "Each part starts from the one before: this study computes in order, here."
        raise InputError("scheduler", scheduler, f"none for {study.name}", hint)
    store = Store(Path(path), study)
    regions = list(study.regions())
    resumed = store.regions_done
    on_progress(Progress(resumed, len(regions), resumed))
    missing = iter([region for region in regions if not store.is_done(region)])
    context = store.context()
    if study.sequential:
        finished = _in_order(study, store, context, regions, stopped)
        _keep(finished, store, on_progress, len(regions))
    else:
        with executor_of(workers, scheduler) as (executor, count):
            finished = _side_by_side(study, context, missing, executor, count, stopped)
            _keep(finished, store, on_progress, len(regions))
    return study.finish(open_result(path), context) if store.regions_done == len(regions) else None


def _keep(
    finished: Iterator[tuple[Region, Arrays]], store: Store,
    on_progress: Callable[[Progress], None], total: int,
) -> None:  # fmt: skip
    """Store what comes."""
    resumed = store.regions_done
    for region, arrays in finished:
        store.write(region, arrays)
        on_progress(Progress(store.regions_done, total, resumed))


def _in_order(
    study: Study, store: Store, context: Arrays, regions: list[Region], stopped: Callable[[], bool]
) -> Iterator[tuple[Region, Arrays]]:
    """Each region from the one before it; those already in the store are read where needed."""
    before: Arrays | None = None
    for place, region in enumerate(regions):
        if store.is_done(region):
            continue
        if stopped():
            return
        if before is None and place:
            before = store.read(regions[place - 1])
        before = study.compute(region, context, before)
        yield region, before


def _side_by_side(
    study: Study, context: Arrays, missing: Iterator[Region], executor: Executor, workers: int,
    stopped: Callable[[], bool],
) -> Iterator[tuple[Region, Arrays]]:  # fmt: skip
    """Regions as they are finished; what is at work when it is to stop is waited for and kept."""
    pending: dict[Future[Arrays], Region] = {}
    try:
        while True:
            for region in islice(missing, AHEAD * workers - len(pending)):
                pending[executor.submit(study.compute, region, context, None)] = region
            if not pending:
                return
            done, _ = wait(pending, LOOK_SECONDS, FIRST_COMPLETED)
            for future in done:
                yield pending.pop(future), future.result()
            if stopped():
                missing = iter(())
                for future in [future for future in pending if future.cancel()]:
                    del pending[future]
    finally:
        for future in pending:
            future.cancel()


@contextmanager
def executor_of(workers: int, scheduler: str) -> Iterator[tuple[Executor, int]]:
    """Where the regions are computed, and how many at a time."""
    if not scheduler:
        with ThreadPoolExecutor(workers) as pool:
            yield pool, workers
        return
    try:
        from distributed import CancelledError, Client, KilledWorker
    except ImportError:
        raise InputError(
            "scheduler", scheduler, "nothing, where Dask is missing", "pip install distributed"
        ) from None
    try:
        client = Client(scheduler, timeout="10s", set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(
            "scheduler", scheduler, "the address of a Dask scheduler, such as tcp://host:8786",
            str(error) or "nobody answers",
        ) from None  # fmt: skip
    with client:
        count = max(1, sum(client.nthreads().values()))
        # a lost worker costs the region it had: Dask gives it to another one
        with client.get_executor(pure=False, retries=3) as pool:
            try:
                yield pool, count
            except (CancelledError, KilledWorker) as error:
                raise ConnectionError(f"the Dask cluster lost the work: {error}") from error
