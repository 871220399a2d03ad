"""Studies in chunks: cutting changes nothing, interrupted work goes on, what waits is bounded."""

from __future__ import annotations

import json
import os
import shutil
import sys
from collections.abc import Callable, Mapping
from concurrent.futures import Executor, Future
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import psutil
import pytest
import xarray as xr
import zarr

from bouncing_disk_ros import __version__
from bouncing_disk_ros.command_line.stop import Stop
from bouncing_disk_ros.errors import FailedError, InputError
from bouncing_disk_ros.niceness import NICENESS
from bouncing_disk_ros.study import (
    Arrays,
    Progress,
    Region,
    Study,
    export,
    export_tables,
    exports,
    open_result,
    run,
    runner,
)
from bouncing_disk_ros.study.by_name import definition_of
from bouncing_disk_ros.study.command import run_command
from bouncing_disk_ros.study.computation import Axis
from bouncing_disk_ros.study.lock import exclusive_lock, token_of
from bouncing_disk_ros.study.runner import PREFETCH, Pipeline, RunLock, compute_region
from bouncing_disk_ros.study.store import Store
from bouncing_disk_ros.study.stored_array import StoredArray
from support.checks import refused, there
from support.studies import VALUES, Products, Sums


@pytest.fixture(autouse=True)
def _count_afresh() -> None:
    Products.computed.clear()


def watched(look: Callable[[Region], object]) -> Products:
    """Products; at each region something is looked at first."""

    class Watched(Products):
        def compute(self, region: Region, context: Arrays, before: Arrays | None) -> Arrays:
            look(region)
            return super().compute(region, context, before)

    return Watched(VALUES)


@pytest.mark.parametrize(("length", "workers"), [(1, 3), (2, 1), (7, 1)])
def test_result_does_not_depend_on_cutting_or_workers(
    tmp_path: Path, length: int, workers: int
) -> None:
    study = Products({**VALUES, "length": length})
    result = there(run(study, tmp_path / "r.zarr", workers=workers))
    expected = 0.5 * np.multiply.outer(np.arange(7.0), np.arange(5.0))
    assert np.array_equal(result["product"], expected)
    assert np.array_equal(result["label"], expected.astype(int))
    assert result.attrs["total"] == expected.sum()
    assert result["product"].attrs["units"] == "m²"
    assert result.attrs["parameter_factor"] == 0.5


def ports() -> set[int]:
    """The ports at which this process listens."""
    every = psutil.Process().net_connections()
    return {one.laddr.port for one in every if one.status == "LISTEN"}


def test_a_study_without_a_scheduler_opens_no_port(tmp_path: Path) -> None:
    before, seen = ports(), []
    run(watched(lambda _: seen.append(ports())), tmp_path / "r.zarr", workers=2)
    assert seen
    assert set().union(*seen) <= before


class Lettered(Products):
    """Products whose columns have letters for names."""

    @property
    def axes(self) -> Mapping[str, Axis]:
        return {**super().axes, "letter": Axis(np.array(["a", "bc"]), "1", "name of a column")}


def written_by_zarr(path: Path, other: Path) -> None:
    """The store at `path` once more, by Zarr."""
    attributes = json.loads((path / "zarr.json").read_text())["attributes"]
    made = zarr.open_group(other, mode="w-", attributes=attributes)
    for name, one in zarr.open_group(path, mode="r").members(max_depth=1):
        if isinstance(one, zarr.Group):
            made.create_group(name)
            continue
        made.create_array(
            name, shape=one.shape, chunks=one.chunks, dtype=one.dtype, fill_value=one.fill_value,
            dimension_names=one.metadata.dimension_names, attributes=one.attrs.asdict(),
            compressors=one.compressors, config={"write_empty_chunks": True},
        )[...] = one[...]  # fmt: skip


@pytest.mark.filterwarnings("ignore:The data type")  # Zarr has no specification for texts
@pytest.mark.parametrize("kind", [Products, Lettered])
def test_a_store_has_the_bytes_that_zarr_writes(tmp_path: Path, kind: type[Study]) -> None:
    run(kind(VALUES), tmp_path / "ours", workers=2)  # 7 × 5 in squares of 2: edges are cut
    written_by_zarr(tmp_path / "ours", tmp_path / "zarr")
    ours, others = (
        {file.relative_to(tmp_path / who): file.read_bytes()
         for file in tmp_path.glob(f"{who}/**/*") if file.is_file()}
        for who in ("ours", "zarr")
    )  # fmt: skip
    assert len(ours) > 2 * 12
    assert ours == others


def test_a_result_is_read_as_xarray_reads_it_by_zarr(tmp_path: Path) -> None:
    run(Lettered(VALUES), tmp_path / "r.zarr")
    (tmp_path / "r.zarr/region_done/c/5").unlink()
    (tmp_path / "r.zarr/product/c/1/2").unlink()
    ours = open_result(tmp_path / "r.zarr")
    other = xr.open_zarr(tmp_path / "r.zarr", consolidated=False, chunks=None)
    assert set(other.attrs) - set(ours.attrs) == {"digest", "regions"}
    xr.testing.assert_identical(ours, other.drop_attrs(deep=False).assign_attrs(ours.attrs))
    parts = (np.s_[1:6, 2], np.s_[::3, 1:1], np.s_[-1], np.s_[5:0:-2, ::2], np.s_[[4, 0], [1, 3]])
    for part in parts:
        for name in ("product", "label"):
            again = open_result(tmp_path / "r.zarr")[name][part]
            np.testing.assert_array_equal(again.values, other[name].load()[part].values)


class Empty(Products):
    """Fields without a point."""

    @property
    def axes(self) -> Mapping[str, Axis]:
        return {**super().axes, "x": Axis(np.empty(0), "m", "width", "x")}

    @property
    def chunks(self) -> Mapping[str, int]:
        return {"y": 2}

    def compute(self, region: Region, context: Arrays, before: Arrays | None) -> Arrays:
        rows = region.slices["y"]
        return dict.fromkeys(self.fields, np.empty((rows.stop - rows.start, 0)))


def test_fields_without_points_are_whole(tmp_path: Path) -> None:
    """Zarr wrote no chunk of them: they counted as damaged."""
    seen: list[Progress] = []
    for _ in range(2):
        result = there(run(Empty(VALUES), tmp_path / "r.zarr", on_progress=seen.append))
        assert result["product"].shape == (7, 0)
    assert seen[-1] == Progress(4, 4, 4)


@pytest.mark.parametrize("kind", [Products, Sums])
def test_interrupted_run_goes_on_without_computing_twice(tmp_path: Path, kind: type[Study]) -> None:
    study, path = kind(VALUES), tmp_path / "r.zarr"
    seen: list[Progress] = []
    assert run(study, path, on_progress=seen.append, stopped=lambda: len(seen) > 2) is None
    assert 0 < seen[-1].done < seen[-1].total
    result = there(run(kind(VALUES), path, on_progress=seen.append))
    assert seen[-1].done == seen[-1].total
    assert seen[-1].resumed > 0
    regions = [number for number in Products.computed if number >= 0]
    assert sorted(regions) == list(range(seen[-1].total))
    assert Products.computed.count(-1) == 1, "the context is computed once"
    Products.computed.clear()
    there(run(kind(VALUES), path))
    assert Products.computed == [], "a finished run is only read"
    at_once = there(run(kind(VALUES), tmp_path / "other.zarr"))
    assert np.array_equal(result["product"], at_once["product"])


def test_error_in_a_region_is_raised_and_the_rest_is_kept(tmp_path: Path) -> None:
    seen: list[Progress] = []
    failing = watched(lambda region: 1 // (region.number - 3))
    with pytest.raises(ZeroDivisionError):
        run(failing, tmp_path / "r.zarr", on_progress=seen.append)
    again: list[Progress] = []
    there(run(Products(VALUES), tmp_path / "r.zarr", on_progress=again.append))
    assert again[0].done == seen[-1].done >= 1


@pytest.mark.skipif(sys.platform != "linux", reason="niceness is that of the process elsewhere")
def test_workers_come_after_the_threads_of_a_simulator(tmp_path: Path) -> None:
    found: list[int] = []
    here = os.getpriority(os.PRIO_PROCESS, 0)  # 0: of this thread
    look = watched(lambda _: found.append(os.getpriority(os.PRIO_PROCESS, 0)))
    run(look, tmp_path / "r.zarr", workers=2)
    assert set(found) == {min(here + NICENESS, 19)}
    assert os.getpriority(os.PRIO_PROCESS, 0) == here


Errors = type[Exception] | tuple[type[Exception], ...]


def test_a_store_that_is_removed_or_moved_meanwhile_is_no_result(tmp_path: Path) -> None:
    """It read fill values where chunks were missing: nan, with exit code 0."""
    place = tmp_path / "out" / "a.zarr"

    def fails(act: Callable[[], object], error: Errors, words: str) -> None:
        study = watched(lambda region: act() if region.number == 2 else None)
        with pytest.raises(error, match=words):
            run(study, place, workers=1)

    removed = "moved or removed|No such file"
    fails(lambda: shutil.rmtree(place.parent), (FailedError, OSError), removed)
    assert not place.exists(), "nothing that a later run would stumble on"
    fails(lambda: place.parent.rename(tmp_path / "moved"), (FailedError, OSError), removed)
    assert not place.exists()
    # a chunk may be written there at that moment
    lost = "in use: product|No such file"
    fails(lambda: shutil.rmtree(place / "product" / "c" / "0"), (FailedError, OSError), lost)
    notes: list[Progress] = []
    whole = there(run(Products(VALUES), place, on_progress=notes.append))
    assert notes[0].note.endswith("it is computed anew")
    assert np.all(whole["product"] == there(run(Products(VALUES)))["product"])


def test_a_chunk_whose_folder_is_moved_as_it_is_made_is_not_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It "exists" for mkdir, and then it does not: the message was "File exists"."""
    array = StoredArray(tmp_path / "product", ("x",), np.dtype(float), (2,), (2,))

    def exists_until_now(*_: object, **__: object) -> None:
        raise FileExistsError

    monkeypatch.setattr(Path, "mkdir", exists_until_now)
    with pytest.raises(FileNotFoundError):
        array.write((0,), np.zeros(2))


def test_second_run_on_one_result_is_refused(tmp_path: Path) -> None:
    """While one run is at work; neither its end nor the refusal leaves a trace.

    The lock of a dead process is void, though its file is still there.
    """
    path = tmp_path / "r.zarr"
    (tmp_path / ".r.zarr.lock").touch()

    def again(_: Progress) -> None:
        refused("a result that no other run is writing", run, Products(VALUES), path)

    there(run(Products(VALUES), path, on_progress=again))
    assert [entry.name for entry in tmp_path.iterdir()] == ["r.zarr"]


def test_where_nothing_may_be_written_nothing_is_nor_into_a_store_of_other_parameters(
    tmp_path: Path,
) -> None:
    (tmp_path / "file").write_text("")
    refused("output", run, Products(VALUES), tmp_path / "file" / "r.zarr")
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "notes.txt").write_text("keep")
    refused("It holds other data", run, Products(VALUES), tmp_path / "mine")
    assert (tmp_path / "mine" / "notes.txt").read_text() == "keep"
    run(Products(VALUES), tmp_path / "r.zarr")
    with pytest.raises(InputError, match=r"There factor is 0\.5, not 0\.25"):
        run(Products({**VALUES, "factor": 0.25}), tmp_path / "r.zarr")
    refused("the study is products, not sums", run, Sums(VALUES), tmp_path / "r.zarr")


@pytest.mark.parametrize("large", [8, 2**25])
def test_exports_keep_numbers_units_and_parameters(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, large: int
) -> None:
    """As netCDF, and as tables with a row for each point; whole, or in parts of so many numbers."""
    monkeypatch.setattr(exports, "LARGE", large)
    result = there(run(Products(VALUES), tmp_path / "r.zarr"))
    export(result, tmp_path / "r.nc")
    with xr.open_dataset(tmp_path / "r.nc", engine="netcdf4") as read:
        assert np.array_equal(read["product"], result["product"])
        assert np.array_equal(read["label"], result["label"])
        assert read["label"].attrs == result["label"].attrs | {"flag_values": -1}
        assert read["product"].attrs["units"] == "m²"
        assert read.attrs["parameter_rows"] == 7
        assert read["x"].attrs["long_name"] == "width"
    files = export_tables(result.assign(total=3.5), tmp_path)
    assert [file.name for file in files] == ["result_y_x.csv", "result.csv"]
    lines = files[0].read_text("utf-8").splitlines()
    comments = [line for line in lines if line.startswith("#")]
    assert "# product (m²): product" in comments
    header, *rows = lines[len(comments) :]
    names = header.split(",")
    assert names[:2] == ["y", "x"]
    columns = np.array([row.split(",") for row in rows], float).T
    stacked = result.stack(point=("y", "x"))
    for name, column in zip(names, columns, strict=True):
        np.testing.assert_array_equal(column, stacked[name].values)
    assert files[1].read_text("utf-8").splitlines()[-2:] == ["total", "3.5"]


def test_tables_of_an_axis_without_points_have_no_row(tmp_path: Path) -> None:
    """Such as the saddles of a window in which there is none."""
    result = xr.Dataset(
        {"share": ("saddle", np.zeros(0)), "at": (("x", "saddle"), np.zeros((2, 0)))}
    )
    files = export_tables(result, tmp_path)
    assert [file.read_text("utf-8").splitlines()[-1] for file in files] == [
        "saddle,share", "x,saddle,at",
    ]  # fmt: skip


def test_where_netcdf_is_missing_it_is_refused_or_left_out_in_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "netCDF4", None)
    words = "pip install 'bouncing_disk_ros\\[netcdf\\]' brings it"
    refused(words, export, there(run(Products(VALUES))), tmp_path / "r.nc")
    definition = definition_of("toss_paths")
    values = {name: spec.default for name, spec in definition.table.items()}
    values |= {"points": 16, "figures": "none", "output": str(tmp_path / "p")}
    refused(words, run_command, definition, values, {"netcdf"}, Stop())
    assert run_command(definition, values, {"points"}, Stop()) == 0
    told = capsys.readouterr()
    assert told.err == (
        "toss_paths: no result.nc: netCDF4 is not installed; pip install "
        "'bouncing_disk_ros[netcdf]' brings it.\n"
    )
    assert {path.name for path in (tmp_path / "p").iterdir()} == {"result.zarr"}


def test_scheduler_that_does_not_answer_is_one_line(tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    with pytest.raises(InputError, match="scheduler: got 'nonsense'"):
        run(Products(VALUES), tmp_path / "r.zarr", scheduler="nonsense")


# --- regions on their way -------------------------------------------------------------------------
MANY: dict[str, Any] = {**VALUES, "rows": 20, "columns": 20, "length": 4}  # 25 regions


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
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(runner, "FIRST_BATCH", 8)
    expected = 0.5 * np.multiply.outer(np.arange(20.0), np.arange(20.0))
    for sends_back, workers, limit in ((True, 1, PREFETCH), (True, 100, 8), (False, 100, 16)):
        folder = tmp_path / f"{sends_back}{workers}"
        most, store = piled_up(folder, sends_back=sends_back, workers=workers)
        assert most == limit
        assert store.regions_done == 25
        assert np.array_equal(open_result(store.path)["product"], expected)


@pytest.mark.parametrize("found", ["0.2.0", ModuleNotFoundError("No module named 'x'")])
def test_a_cluster_without_this_version_is_refused(found: str | Exception) -> None:
    """Its workers died of their first part, and the run waited without a word."""

    def on_workers(_: object, __: str) -> dict[str, str]:
        if isinstance(found, Exception):
            raise found
        return {"tcp://one": __version__, "tcp://two": found}

    client = SimpleNamespace(run_on_scheduler=lambda run, text: run(text), run=on_workers)
    with pytest.raises(InputError, match=rf"^scheduler: got '?tcp://s'?, .*Found: {found}\."):
        runner._check_versions(client, "tcp://s")


def test_worker_stores_only_where_it_reads_the_lock(tmp_path: Path) -> None:
    study, path = Products(VALUES), tmp_path / "r.zarr"
    region = next(study.regions())
    with exclusive_lock(path) as token:
        store = Store(path, study)
        given, lock = (study, study.context()), RunLock(str(path), token, __version__)
        assert token_of(str(path)) == token
        with pytest.raises(InputError, match=r"a worker with version .*, allowed: workers with"):
            compute_region(*given, lock._replace(version="0.2.0"), region)
        sent_back = compute_region(*given, lock._replace(token="of another run"), region)
        assert sent_back is not None
        with pytest.raises(FailedError, match="removed, while in use: product"):
            store.read(region)
        assert compute_region(*given, lock, region) is None
        assert np.array_equal(store.read(region)["product"], sent_back["product"])
    assert token_of(str(path)) == ""
