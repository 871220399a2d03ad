"""Regions on their way to the store: given out, computed, stored."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from contextlib import AbstractContextManager
from itertools import islice
from typing import Any

from bouncing_disk_ros.study.computation import Arrays, Region, Study
from bouncing_disk_ros.study.store import Store, put, token_of

PREFETCH = 2
"""Regions on their way for each worker: one at work, one waiting."""
FIRST_BATCH = 32
"""Most regions on their way until it is seen that results do not pile up here."""
MAX_BACKLOG = 8
"""So many results sent back at once are a pile: then no more is given out."""
POLL_SECONDS = 0.2
"""How often a run that waits for results looks whether it is to stop."""

Work = Callable[[Region], Arrays | None]
"""Computes a region; gives the arrays back if it has not stored them."""


def compute_here(
    study: Study, context: Arrays, store: Store, slots: AbstractContextManager[Any], region: Region
) -> None:
    """Work for threads of this process: so many compute as there are slots, others store."""
    with slots:
        arrays = study.compute(region, context, None)
    store.put(region, arrays)


def compute_region(
    study: Study, context: Arrays, path: str, token: str, region: Region
) -> Arrays | None:
    """Work for any process: it stores what it computes if it can read the claim of the run."""
    arrays = study.compute(region, context, None)
    if token_of(path) != token:
        return arrays
    put(path, study, region, arrays)
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
