"""Studies on a Dask cluster of this machine: the same numbers, also when a worker dies."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from bouncing_disk_ros.study import run
from bouncing_disk_ros.study.store import Store
from support.studies import VALUES, Murderous, Products

TEST = Path(__file__).resolve().parents[1]


@pytest.fixture
def scheduler(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[str]:
    """The address of a scheduler with two worker processes that know the tests' studies."""
    distributed = pytest.importorskip("distributed")
    monkeypatch.setenv("PYTHONPATH", f"{TEST.parent}:{TEST}")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None,
        scheduler_kwargs={"dashboard_address": ":0"},  # not 8787, which another test may take
        local_directory=str(tmp_path), silence_logs=50,
    ) as cluster:  # fmt: skip
        yield cluster.scheduler_address


def test_workers_that_see_the_folder_store_what_they_compute(
    scheduler: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(*_: object) -> None:
        raise AssertionError("a region came back to be stored")

    monkeypatch.setattr(Store, "put", refused)  # in this process alone
    result = run(Products(VALUES), tmp_path / "r.zarr", scheduler=scheduler)
    assert result is not None
    assert result.attrs["total"] == 0.5 * 21 * 10


def test_cluster_gives_the_same_and_a_lost_worker_costs_its_region_only(
    scheduler: str, tmp_path: Path
) -> None:
    here = run(Products(VALUES), tmp_path / "here.zarr")
    values = {**VALUES, "mark": str(tmp_path / "mark")}
    there = run(Murderous(values), tmp_path / "there.zarr", scheduler=scheduler)
    assert here is not None
    assert there is not None
    assert (tmp_path / "mark").exists(), "no worker was killed"
    assert np.array_equal(here["product"], there["product"])
    assert np.array_equal(here["label"], there["label"])
