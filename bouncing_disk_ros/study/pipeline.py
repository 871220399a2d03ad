"""Regions on their way to the store: given out, computed, stored."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from itertools import islice
from typing import Any

from bouncing_disk_ros.study.definition import Arrays, Region, Study
from bouncing_disk_ros.study.store import Store

AHEAD = 2
"""Regions on their way for each worker: one at work, one waiting or being stored, so that memory
stays bounded."""
WRITERS = 2
"""Threads that store regions; Zarr itself has one event loop for all."""
LOOK_SECONDS = 0.2
"""How often a run that waits for results looks whether it is to stop."""


class Pipeline:
    """Workers compute regions, threads of this process store them.

    They are stored here, for workers of other machines do not see the folder; on threads, for that
    takes a share of the time that computing does.
    """

    def __init__(
        self, study: Study, store: Store, context: Arrays, executor: Executor, workers: int
    ) -> None:
        self.error: BaseException | None = None  # the first of a region
        self._study, self._store, self._context = study, store, context
        self._executor, self._most = executor, AHEAD * workers
        self._writers = ThreadPoolExecutor(WRITERS)
        self._computing: dict[Future[Arrays], Region] = {}
        self._storing: dict[Future[None], Region] = {}

    @contextmanager
    def closing(self) -> Iterator[Pipeline]:
        """Until the end of the block: then nothing is at work any more."""
        with self._writers:
            try:
                yield self
            finally:
                self.withdraw()

    @property
    def empty(self) -> bool:
        """Whether nothing is on its way."""
        return not self._computing and not self._storing

    def give_out(self, missing: Iterator[Region]) -> None:
        """As many regions as there is room for."""
        room = self._most - len(self._computing) - len(self._storing)
        for region in islice(missing, max(0, room)):
            future = self._executor.submit(self._study.compute, region, self._context, None)
            self._computing[future] = region

    def collect(self) -> list[Region]:
        """Wait for a while; the regions that are in the store now. Raises OSError of the store."""
        at_work: list[Future[Any]] = [*self._computing, *self._storing]
        done = wait(at_work, LOOK_SECONDS, FIRST_COMPLETED).done
        for future in [future for future in self._computing if future in done]:
            region = self._computing.pop(future)
            if error := future.exception():
                self.error = self.error or error
            else:
                written = self._writers.submit(self._store.put, region, future.result())
                self._storing[written] = region
        stored = [future for future in self._storing if future in done]
        for written in stored:
            written.result()
        return [self._storing.pop(written) for written in stored]

    def withdraw(self) -> None:
        """Take back what no worker has begun."""
        for future in [future for future in self._computing if future.cancel()]:
            del self._computing[future]
