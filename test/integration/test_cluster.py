"""Studies on a Dask cluster of this machine: the same numbers, also when a worker dies."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from bouncing_disk_ros.study import Progress, run, runner
from bouncing_disk_ros.study.store import Store
from support.studies import VALUES, Murderous, Patient, Products

TEST = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="module")
def scheduler(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The address of a scheduler with a worker process that knows the tests' studies."""
    distributed = pytest.importorskip("distributed")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", f"{TEST.parent}:{TEST}")
        with distributed.LocalCluster(
            n_workers=1, threads_per_worker=1, processes=True, dashboard_address=None,
            scheduler_kwargs={"dashboard_address": ":0"},  # not 8787, which another test may take
            local_directory=str(tmp_path_factory.mktemp("dask")), silence_logs=50,
        ) as cluster:  # fmt: skip
            yield cluster.scheduler_address


def test_workers_store_what_they_compute_and_a_lost_one_costs_its_region_only(
    scheduler: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(*_: object) -> None:
        raise AssertionError("a region came back to be stored")

    with monkeypatch.context() as patch:
        patch.setattr(Store, "put", refused)  # in this process alone
        result = run(Products(VALUES), tmp_path / "r.zarr", scheduler=scheduler)
    assert result is not None
    assert result.attrs["total"] == 0.5 * 21 * 10
    values = {**VALUES, "mark": str(tmp_path / "mark")}
    there = run(Murderous(values), tmp_path / "there.zarr", scheduler=scheduler)
    assert there is not None
    assert (tmp_path / "mark").exists(), "no worker was killed"
    assert np.array_equal(result["product"], there["product"])
    assert np.array_equal(result["label"], there["label"])


def test_an_end_waits_for_no_part_that_workers_compute(scheduler: str, tmp_path: Path) -> None:
    """These parts end when the file is there, which it is only after the run has ended."""
    mark = tmp_path / "mark"
    study = Patient({**VALUES, "mark": str(mark)})
    begun = mark.with_suffix(".begun")
    store = tmp_path / "r.zarr"
    assert run(study, store, scheduler=scheduler, stopped=begun.exists) is None
    mark.touch()
    found = run(study, store, scheduler=scheduler)
    assert found is not None
    assert found.attrs["total"] == 0.5 * 21 * 10


def test_a_cluster_without_workers_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The run waited without a word."""
    distributed = pytest.importorskip("distributed")
    monkeypatch.setattr(runner, "WORKER_SECONDS", 0.1)
    notes: list[str] = []

    def on_progress(progress: Progress) -> None:
        if progress.note:
            notes.append(progress.note)

    with distributed.LocalCluster(
        n_workers=0, processes=False, dashboard_address=None, silence_logs=50,
        scheduler_kwargs={"dashboard_address": ":0"}, protocol="tcp",
    ) as cluster:  # fmt: skip
        address = cluster.scheduler_address
        found = run(
            Products(VALUES), tmp_path / "r.zarr", scheduler=address, on_progress=on_progress,
            stopped=lambda: bool(notes),
        )  # fmt: skip
    assert found is None
    assert notes == [f"{address} has no worker: the run waits for one"]
