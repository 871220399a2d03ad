"""Run a study: compute the regions that its store does not hold, on any executor.

`run` takes a study or its name. `study_function` makes the function of a study.
"""

from __future__ import annotations

import logging
import os
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from contextlib import AbstractContextManager, ExitStack, contextmanager
from functools import cache, partial
from itertools import islice
from pathlib import Path
from threading import Semaphore
from typing import Any, NamedTuple, Protocol

import xarray as xr
from tqdm import tqdm

import bouncing_disk_ros
from bouncing_disk_ros.errors import FailedError, InputError
from bouncing_disk_ros.folders import PACKAGE
from bouncing_disk_ros.niceness import give_way
from bouncing_disk_ros.study.by_name import definition_of, named
from bouncing_disk_ros.study.computation import Arrays, Region, Study
from bouncing_disk_ros.study.lock import exclusive_lock, token_of
from bouncing_disk_ros.study.store import DONE, RESULT, Store, layout, put

PREFETCH = 2
"""Regions on their way for each worker: one at work, one waiting."""
FIRST_BATCH = 32
"""Most regions on their way until it is seen that results do not pile up here."""
MAX_BACKLOG = 8
"""So many results sent back at once are a pile: then no more is given out."""
POLL_SECONDS = 0.2
"""How often a run that waits for results looks whether it is to stop."""
WORKER_SECONDS = 5.0
"""How often a run looks whether its cluster has a worker."""

Work = Callable[[Region], Arrays | None]
"""Computes a region; gives the arrays back if it has not stored them."""

COORDINATES = ("attractor_name", "attractor_kind", "attractor_period", "attractor_cycles")


class Progress(NamedTuple):
    """Progress of a run of a study."""

    done: int  # regions in the store
    total: int
    resumed: int  # of these, found there at the start
    note: str = ""  # once: what was damaged there and is computed anew, or cannot be checked


def never() -> bool:
    """Nobody asks to stop."""
    return False


def run(
    study: Study | str,
    path: str | Path | None = None,
    *,
    workers: int = 0,
    scheduler: str = "",
    progress: bool | None = None,
    on_progress: Callable[[Progress], None] | None = None,
    stopped: Callable[[], bool] = never,
    **parameters: object,
) -> xr.Dataset | None:
    """Result of a study, computed into the Zarr store at `path`; a result there is continued.

    `study`: a study, or the name of a study with its `parameters`, as `named` takes them. `path`
    None: the result is kept in memory alone. `workers`: threads (the kernels release the GIL), 0:
    one on each core. `scheduler` (tcp://host:port): the workers of this Dask cluster compute
    instead; a worker that sees the folder stores its parts, another one sends them back.
    `progress`: whether to show a bar on stderr; None: where stderr is a terminal or a notebook, and
    `on_progress` is not given. Returns the whole result, or None when `stopped` said so: then the
    store holds every finished region, and the same call continues from there.
    Raises InputError for a study or parameters that cannot be used, a path that holds something
    else, is at work in another run or cannot be written, or a scheduler that does not answer;
    OSError for a disk or a cluster that fails in mid-work, FailedError for a store that is moved or
    removed meanwhile.

    >>> run("basins", axial_forcing=0.34, width=60, height=60)["fraction"]
    """
    study = _study_of(study, parameters)
    if workers < 0:
        raise InputError("workers", workers, "a whole number >= 0; 0: one for each core")
    workers = workers or os.cpu_count() or 1
    if study.sequential and scheduler:
        hint = "Each part starts from the one before, so it is computed in order in one process."
        raise InputError("scheduler", scheduler, f"none for {study.name}", hint)
    with _bar(study.name, progress, on_progress) as note:
        if path is not None:
            return _run(study, Path(path), workers, scheduler, note, stopped)
        with tempfile.TemporaryDirectory(prefix=f"{study.name}-") as folder:
            found = _run(study, Path(folder, RESULT), workers, scheduler, note, stopped)
            return None if found is None else found.load()


run_study = run
"""Name of `run` in the package, where `run` is a folder."""


def _study_of(study: object, parameters: dict[str, object]) -> Study:
    if isinstance(study, str):
        return named(study, **parameters)
    if not isinstance(study, Study):
        hint = "Give its parameters after the name: run('basins', axial_forcing=0.34)"
        raise InputError("study", study, "the name of a study, or what named() gives", hint)
    if parameters:
        given = ", ".join(parameters)
        raise InputError("parameters", given, "none with a study that has its own")
    return study


@contextmanager
def _bar(
    name: str, progress: bool | None, on_progress: Callable[[Progress], None] | None
) -> Iterator[Callable[[Progress], None]]:
    """What takes the progress of a run: `on_progress`, a bar on stderr, or nobody."""
    if progress is None:
        progress = on_progress is None and (sys.stderr.isatty() or "ipykernel" in sys.modules)
    with tqdm(desc=name, unit="part", disable=not progress) as bar:

        def note(now: Progress) -> None:
            bar.total = now.total
            bar.initial, bar.n = now.resumed, max(bar.n, now.resumed)  # for the time left
            bar.update(now.done - bar.n)
            if on_progress is not None:
                on_progress(now)
            elif now.note:
                warnings.warn(now.note, RuntimeWarning, stacklevel=5)

        yield note


def _run(
    study: Study,
    path: Path,
    workers: int,
    scheduler: str,
    on_progress: Callable[[Progress], None],
    stopped: Callable[[], bool],
) -> xr.Dataset | None:
    with exclusive_lock(path) as token:
        store = Store(path, study)
        regions = list(study.regions())
        resumed = store.regions_done
        on_progress(Progress(resumed, len(regions), resumed, store.note))
        context = store.context()
        with ExitStack() as ending:
            if study.sequential:
                stored = _in_order(study, store, context, regions, stopped)
            else:
                executor, count, has_worker = ending.enter_context(_executor(workers, scheduler))
                alone = f"{scheduler} has no worker: the run waits for one"
                stopped = _watched(
                    stopped, has_worker,
                    lambda: on_progress(
                        Progress(store.regions_done, len(regions), resumed, alone)
                    ),
                )  # fmt: skip
                held = token if store.sealed else ""  # without it workers send their parts back
                lock = RunLock(str(store.path.resolve()), held, bouncing_disk_ros.__version__)
                work = (
                    partial(compute_region, study, context, lock)
                    if scheduler
                    else partial(compute_here, study, context, store, Semaphore(workers))
                )
                missing = iter([region for region in regions if not store.is_done(region)])
                stored = _side_by_side(Pipeline(work, store, executor, count), missing, stopped)
            for region in stored:
                if token_of(str(path)) != token:
                    raise FailedError(f"{path} was moved or removed while it was computed")
                store.mark(region)
                on_progress(Progress(store.regions_done, len(regions), resumed))
    if store.regions_done < len(regions):
        return None
    return _described(study, study.finish(store.result(), context))


def _watched(
    stopped: Callable[[], bool], has_worker: Callable[[], bool], report: Callable[[], None]
) -> Callable[[], bool]:
    """`stopped`, which also calls `report` each time that the last worker is lost."""
    asked, is_reported = time.monotonic(), False

    def watched() -> bool:
        nonlocal asked, is_reported
        if time.monotonic() - asked > WORKER_SECONDS:
            asked, is_alone = time.monotonic(), not has_worker()
            if is_alone and not is_reported:
                report()
            is_reported = is_alone
        return stopped()

    return watched


def _in_order(
    study: Study, store: Store, context: Arrays, regions: list[Region], stopped: Callable[[], bool]
) -> Iterator[Region]:
    """Each region from the one before it; those already in the store are read where needed."""
    before: Arrays | None = None
    for place, region in enumerate(regions):
        if store.is_done(region):
            before = None
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


def _described(study: Study, result: xr.Dataset) -> xr.Dataset:
    """The result with a unit and a name of each variable, and its axis by its parameter's name.

    An axis `value` along a parameter can be used by that name too: `result["restitution"]`,
    `result.sel(restitution=0.4, method="nearest")`.
    """
    result = result.copy()
    for name, variable in result.variables.items():
        about = "whether the part is computed" if name == DONE else str(name).replace("_", " ")
        variable.attrs = {"units": "1", "long_name": about, **variable.attrs}
    result = result.set_coords([name for name in COORDINATES if name in result])
    along = str(study.parameters.get("along", ""))
    if along and "value" in result.coords and along not in result.variables:
        values = result["value"]
        result = result.assign_coords({along: ("value", values.values, values.attrs)})
        result = result.set_xindex(along)
    return result


# --- regions on their way ----------------------------------------------------------------------
def compute_here(
    study: Study, context: Arrays, store: Store, slots: AbstractContextManager[Any], region: Region
) -> None:
    """Work for threads of this process: so many compute as there are slots, others store."""
    with slots:
        arrays = study.compute(region, context, None)
    store.put(region, arrays)


class RunLock(NamedTuple):
    """The lock of a run on a store: the store, what the lock holds, the version of the package."""

    path: str
    token: str
    version: str


def compute_region(study: Study, context: Arrays, lock: RunLock, region: Region) -> Arrays | None:
    """Work for any process: it stores what it computes if it can read the lock of the run.

    InputError in a process with another version, which may compute other numbers.
    """
    if (mine := bouncing_disk_ros.__version__) != lock.version:
        allowed = f"workers with version {lock.version}"
        raise InputError("scheduler", f"a worker with version {mine}", allowed)
    arrays = study.compute(region, context, None)
    if token_of(lock.path) != lock.token:
        return arrays
    put(layout(Path(lock.path), study), study, region, arrays)
    return None


class Pipeline:
    """Gives regions to an executor; keeps what comes back, and how much is on its way, in bounds.

    Results that come back wait in the memory of this process until they are stored, so a run begins
    with few regions on their way and doubles them only while none pile up.
    """

    def __init__(self, work: Work, store: Store, executor: Executor, workers: int) -> None:
        self.error: BaseException | None = None  # the first of a region
        self._work, self._store, self._executor = work, store, executor
        self._most = PREFETCH * workers
        self._allowed = min(self._most, FIRST_BATCH)
        self._at_work: dict[Future[Arrays | None], Region] = {}

    @property
    def empty(self) -> bool:
        """Whether nothing is on its way."""
        return not self._at_work

    def submit(self, missing: Iterator[Region]) -> None:
        """As many regions as there is room for."""
        for region in islice(missing, max(0, self._allowed - len(self._at_work))):
            self._at_work[self._executor.submit(self._work, region)] = region

    def collect(self) -> Iterator[Region]:
        """Wait for a while; the regions that are in the store now. Raises OSError of the store."""
        finished = wait(self._at_work, POLL_SECONDS, FIRST_COMPLETED).done
        done = [future for future in self._at_work if future in finished]
        sent_back = 0
        for future in done:
            region = self._at_work.pop(future)
            if error := future.exception():
                self.error = self.error or error
                continue
            if (arrays := future.result()) is not None:
                self._store.put(region, arrays)
                sent_back += 1
            yield region
        if done:
            piled = sent_back >= MAX_BACKLOG
            self._allowed = min(self._most, FIRST_BATCH if piled else 2 * self._allowed)

    def cancel(self) -> None:
        """Take back what no worker has begun."""
        for future in [future for future in self._at_work if future.cancel()]:
            del self._at_work[future]


_VERSION = f"__import__('{PACKAGE}').__version__"


def _check_versions(client: Any, scheduler: str) -> None:
    """InputError where the package is missing on scheduler or workers, or has another version.

    Such a worker dies of its first part, without a word to this process, which then waits.
    """
    mine = bouncing_disk_ros.__version__
    try:
        found = {client.run_on_scheduler(eval, _VERSION), *client.run(eval, _VERSION).values()}
    except (ImportError, AttributeError) as error:
        found = {str(error)}
    if others := found - {mine}:
        allowed = f"a scheduler whose process and workers have {PACKAGE} {mine}"
        raise InputError("scheduler", scheduler, allowed, f"Found: {', '.join(sorted(others))}.")


def _has_worker(client: Any) -> bool:
    """Whether a cluster has a worker; a scheduler that is gone is an error of the work."""
    try:
        return bool(client.nthreads())
    except OSError:
        return True


@contextmanager
def _executor(workers: int, scheduler: str) -> Iterator[tuple[Executor, int, Callable[[], bool]]]:
    """Where the regions are computed, how many at a time, and whether there is a worker."""
    if not scheduler:
        with ThreadPoolExecutor(PREFETCH * workers, initializer=give_way) as pool:
            yield pool, workers, lambda: True
        return
    try:
        from distributed import CancelledError, Client, KilledWorker
    except ImportError:
        raise InputError(
            "scheduler", scheduler, "nothing, where Dask is missing", "pip install distributed"
        ) from None
    logging.getLogger("distributed.client").setLevel(logging.CRITICAL)  # it is raised too
    try:
        client = Client(scheduler, timeout="10s", set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(
            "scheduler", scheduler, "the address of a Dask scheduler, such as tcp://host:8786",
            str(error) or "there is no answer",
        ) from None  # fmt: skip
    with client:
        _check_versions(client, scheduler)
        count = max(1, sum(client.nthreads().values()))
        # a lost worker costs the region it had: Dask gives it to another one
        with client.get_executor(pure=False, retries=3) as pool:
            try:
                yield pool, count, partial(_has_worker, client)
            except (CancelledError, KilledWorker) as error:
                why = str(error) or "its scheduler has gone"
                raise ConnectionError(f"the Dask cluster lost the work: {why}") from error


# --- the studies as functions: parameters in, dataset out -----------------------------------------
Place = str | Path | None
_ABOUT = """
`path`: the folder of a store that keeps the result; the same call goes on from it. `workers`:
threads that compute, 0 for one on each core. `progress`: whether a bar shows on stderr; None where
it is a terminal or a notebook. Raises InputError for what cannot be used. `preset` and `bag` are
of the command alone. Parameters, with their defaults:
"""


class StudyFunction(Protocol):
    """A study as a function."""

    __name__: str

    def __call__(
        self,
        path: Place = None,
        *,
        workers: int = 0,
        progress: bool | None = None,
        **parameters: object,
    ) -> xr.Dataset:
        """Run the study; what it takes and returns is in its own docstring."""
        ...


@cache
def study_function(name: str) -> StudyFunction:
    """Function of the study called `name`, with its parameters in the docstring."""
    definition = definition_of(name)

    def function(
        path: Place = None, *, workers: int = 0, progress: bool | None = None, **parameters: object
    ) -> xr.Dataset:
        found = run(name, path, workers=workers, progress=progress, **parameters)  # type: ignore[arg-type]
        if found is None:
            raise FailedError(f"{name} was stopped")  # nobody asks it to
        return found

    lines = [
        f"- `{spec.name}` ({f'{spec.default!r} {spec.shown_unit}'.rstrip()}): {spec.description}"
        for spec in definition.specs
    ]
    function.__name__ = function.__qualname__ = name
    function.__module__ = PACKAGE  # which has it by this name
    text = "\n".join([*_ABOUT.splitlines(), "", *lines, ""])
    function.__doc__ = f"{definition.function.strip()}\n{text}"
    return function
