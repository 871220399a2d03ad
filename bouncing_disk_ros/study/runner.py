"""Run a study: compute the regions that its store does not hold, on any executor."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from threading import Semaphore
from typing import NamedTuple

import xarray as xr

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.study.definition import Arrays, Region, Study
from bouncing_disk_ros.study.lock import exclusive_lock
from bouncing_disk_ros.study.pipeline import PREFETCH, Pipeline, compute_here, compute_region
from bouncing_disk_ros.study.store import Store, open_result

NICENESS = 10
"""Of threads that compute regions: with another program at work, 1 kHz ticks in the same process
were late by 2.6 ms at p99 so, and by 3.9 ms without."""


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
    workers of that Dask cluster do; those that see the folder store what they compute, the others
    send it back. Returns the whole result, or None when `stopped` said so: then the store holds
    every finished region, and the same call goes on from there.
    Raises InputError for a path that holds something else, is at work in another run or cannot be
    written, or a scheduler that does not answer; OSError for a disk or a cluster that fails in
    mid-work.
    """
    if study.sequential and scheduler:
        hint = "Each part starts from the one before: this study computes in order, here."
        raise InputError("scheduler", scheduler, f"none for {study.name}", hint)
    with exclusive_lock(Path(path)) as token:
        store = Store(Path(path), study)
        regions = list(study.regions())
        resumed = store.regions_done
        on_progress(Progress(resumed, len(regions), resumed))
        missing = iter([region for region in regions if not store.is_done(region)])
        context = store.context()
        if study.sequential:
            stored = _in_order(study, store, context, regions, stopped)
            _keep(stored, store, on_progress, len(regions))
        else:
            with _executor(workers, scheduler) as (executor, count):
                work = (
                    partial(compute_region, study, context, str(store.path.resolve()), token)
                    if scheduler
                    else partial(compute_here, study, context, store, Semaphore(workers))
                )
                pipeline = Pipeline(work, store, executor, count)
                stored = _side_by_side(pipeline, missing, stopped)
                _keep(stored, store, on_progress, len(regions))
    return study.finish(open_result(path), context) if store.regions_done == len(regions) else None


def _keep(
    finished: Iterable[Region], store: Store, on_progress: Callable[[Progress], None], total: int
) -> None:
    """Mark what is in the store."""
    resumed = store.regions_done
    for region in finished:
        store.mark(region)
        on_progress(Progress(store.regions_done, total, resumed))


def _in_order(
    study: Study, store: Store, context: Arrays, regions: list[Region], stopped: Callable[[], bool]
) -> Iterator[Region]:
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
        store.put(region, before)
        yield region


def _side_by_side(
    pipeline: Pipeline, missing: Iterator[Region], stopped: Callable[[], bool]
) -> Iterator[Region]:
    """Regions as they are stored; what is at work when it is to stop, or one fails, is kept."""
    try:
        while True:
            pipeline.submit(missing)
            if pipeline.empty:
                break
            yield from pipeline.collect()
            if pipeline.error or stopped():
                missing = iter(())
                pipeline.cancel()
    finally:
        pipeline.cancel()
    if pipeline.error:
        raise pipeline.error


@contextmanager
def _executor(workers: int, scheduler: str) -> Iterator[tuple[Executor, int]]:
    """Where the regions are computed, and how many at a time."""
    if not scheduler:
        with ThreadPoolExecutor(PREFETCH * workers, initializer=_give_way) as pool:
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


def _give_way() -> None:
    """Let a thread come after others, so that a simulator beside it keeps its ticks."""
    if sys.platform == "linux":  # elsewhere it would be the whole process
        os.nice(NICENESS)
