"""Regions on their way: bounds on what comes back, errors, workers that see the folder or not."""

from __future__ import annotations

from concurrent.futures import Executor, Future
from pathlib import Path
from typing import Any

import numpy as np

from bouncing_disk_ros.study import Arrays, Region, open_result
from bouncing_disk_ros.study.runner import FIRST_BATCH, PREFETCH, Pipeline, compute_region
from bouncing_disk_ros.study.store import Store, exclusive_lock, token_of
from support.studies import VALUES, Products

MANY: dict[str, Any] = {**VALUES, "rows": 40, "columns": 40, "length": 4}  # 100 regions


class AtOnce(Executor):
    """Does the work when it is given; the most that was on its way at any time is kept."""

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        future.set_result(fn(*args, **kwargs))
        return future


def piled_up(tmp_path: Path, *, sends_back: bool, workers: int) -> tuple[int, Store]:
    """The most regions that were on their way, and the store."""
    study = Products(MANY)
    store = Store(tmp_path / "r.zarr", study)
    context = study.context()

    def work(region: Region) -> Arrays | None:
        arrays = study.compute(region, context, None)
        if sends_back:
            return arrays
        store.put(region, arrays)
        return None

    pipeline, missing, most = Pipeline(work, store, AtOnce(), workers), study.regions(), 0
    while True:
        pipeline.submit(missing)
        if pipeline.empty:
            return most, store
        most = max(most, len(pipeline._at_work))
        for region in pipeline.collect():
            store.mark(region)


def test_results_sent_back_do_not_pile_up_and_workers_that_store_are_kept_busy(
    tmp_path: Path,
) -> None:
    expected = 0.5 * np.multiply.outer(np.arange(40.0), np.arange(40.0))
    for sends_back, workers, limit in (
        (True, 1, PREFETCH), (True, 100, FIRST_BATCH), (False, 100, 2 * FIRST_BATCH),
    ):  # fmt: skip
        folder = tmp_path / f"{sends_back}{workers}"
        most, store = piled_up(folder, sends_back=sends_back, workers=workers)
        assert most == limit
        assert store.regions_done == 100
        assert np.array_equal(open_result(store.path)["product"], expected)


def test_worker_stores_only_where_it_reads_the_claim(tmp_path: Path) -> None:
    study, path = Products(VALUES), tmp_path / "r.zarr"
    region = next(study.regions())
    with exclusive_lock(path) as token:
        store = Store(path, study)
        given = (study, study.context(), str(path))
        assert token_of(str(path)) == token
        sent_back = compute_region(*given, "of another run", region)
        assert sent_back is not None
        assert np.isnan(store.read(region)["product"]).all()
        assert compute_region(*given, token, region) is None
        assert np.array_equal(store.read(region)["product"], sent_back["product"])
    assert token_of(str(path)) == ""
