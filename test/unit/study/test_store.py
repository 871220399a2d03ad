"""Stored results that were damaged, or made to do harm: read right, computed anew, or refused."""

from __future__ import annotations

import json
import os
import shutil
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.study import Arrays, Study, open_result, run
from bouncing_disk_ros.study.lock import exclusive_lock, token_of
from bouncing_disk_ros.study.store import DIGEST, metadata_digest, metadata_nodes
from bouncing_disk_ros.study.stored_array import stored_array
from reference.cases import FIRST, examples
from support.checks import refused, there
from support.coverage import in_soak
from support.hostile_stores import HOSTILE, attempt, check_hostile, disturb, flip, whole
from support.studies import VALUES, Products, Sums

FLIPS = examples(9, 1_000)
SOME = [
    "FIFO as root", "FIFO beside", "link as root", "link as chunk", "link as store", "no array",
    "no chunk", "empty mark", "not UTF-8", "deep JSON", "deep folders", "digests a list",
    "other fill", "huge shape", "objects", "other codecs", "other study", "format a text", "bomb",
    "regions without length", "other key in the root", "other fill, sealed",
]  # fmt: skip
"""One of each kind; `make soak` takes all."""


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> tuple[Study, Path, xr.Dataset]:
    """A study, its whole store, and the result."""
    path = tmp_path_factory.mktemp("whole") / "r.zarr"
    study = whole(path)
    found = there(run(study, path))
    return study, path, found.load()


def test_flipped_bits_give_the_same_numbers_or_a_refusal(
    store: tuple[Study, Path, xr.Dataset], tmp_path: Path
) -> None:
    study, path, expected = store
    seen = []
    for k, seed in enumerate(range(FIRST, FIRST + FLIPS)):
        copy = shutil.copytree(path, tmp_path / f"{seed}.zarr")
        hurt = flip if k % 3 else disturb
        where = [hurt(copy, seed + FLIPS * further) for further in range(1 + k // 9 % 3)]
        opened, again = attempt(study, copy, expected)
        if len(where) == 1:
            assert not (k % 3 and opened == "same"), f"{where}: a flip that nobody saw"
            assert again == "same" or opened == again.replace("output:", "path:"), (where, again)
        seen.append((opened == "same", again == "same"))
        shutil.rmtree(copy)
    assert {(False, True), (False, False)} <= set(seen)


@pytest.mark.parametrize("name", in_soak(*HOSTILE) or SOME)
def test_hostile_stores_are_refused_in_one_line_or_computed_anew(
    store: tuple[Study, Path, xr.Dataset], tmp_path: Path, name: str
) -> None:
    study, path, expected = store
    copy = shutil.copytree(path, tmp_path / "in" / "r.zarr")
    check_hostile(name, study, copy, expected)


def test_what_was_damaged_is_named_and_only_that_is_computed(tmp_path: Path) -> None:
    run(Products(VALUES), tmp_path / "r.zarr")
    for file in ("product/c/1/2", "label/c/3/0", "y/c/0", "context/bytes/c/0"):
        place = tmp_path / "r.zarr" / file
        place.write_bytes(place.read_bytes()[:-1])
    parts = r"Damaged: axis y, what all parts need, part 5 \(product\), part 9 \(label\)"
    refused(parts, open_result, tmp_path / "r.zarr")
    Products.computed.clear()
    parts = r"axis y, what all parts need, part 5 \(product\), part 9 \(label\); it is computed"
    with pytest.warns(RuntimeWarning, match=parts):
        run(Products(VALUES), tmp_path / "r.zarr")
    assert sorted(Products.computed) == [-1, 5, 9]
    open_result(tmp_path / "r.zarr")


def test_a_store_of_version_0_3_0_is_read_and_its_chunks_are_checked(
    store: tuple[Study, Path, xr.Dataset], tmp_path: Path
) -> None:
    """It had a digest of each array in place of one of all metadata."""
    study, whole_path, expected = store
    path = shutil.copytree(whole_path, tmp_path / "r.zarr")
    root = json.loads((path / "zarr.json").read_text())
    del root["attributes"]["digest"]
    root["attributes"]["digests"] = {".": "0" * 64}
    (path / "zarr.json").write_text(json.dumps(root))
    assert set(open_result(path).attrs) == set(open_result(whole_path).attrs)
    found = there(run(study, path))
    xr.testing.assert_equal(found.load(), expected)
    chunk = next(file for file in sorted(path.glob("product/c/*/*")) if file.is_file())
    chunk.write_bytes(chunk.read_bytes()[:-1])
    refused("Damaged: part", open_result, path)


def test_a_damaged_part_of_a_sequence_is_computed_from_the_one_before(tmp_path: Path) -> None:
    expected = there(run(Sums(VALUES), tmp_path / "r.zarr"))
    expected.load()
    for number in (0, 2, 3):
        (tmp_path / "r.zarr/product/c" / str(number) / "0").unlink()
    with pytest.warns(RuntimeWarning, match="part 0 .*part 2 .*part 3 "):
        found = run(Sums(VALUES), tmp_path / "r.zarr")
    assert found is not None
    xr.testing.assert_identical(found.load(), expected)


def test_locks_and_results_follow_no_link(tmp_path: Path) -> None:
    """Where a link, a second name of a file or a FIFO stands, nothing is written or waited for."""
    mine, lock, path = tmp_path / "mine", tmp_path / ".r.zarr.lock", tmp_path / "r.zarr"
    mine.write_text("keep")
    for make in (lock.symlink_to, lock.hardlink_to):
        make(mine)
        refused("output", run, Products(VALUES), path)
        assert "keep" not in token_of(str(path)) or make == lock.hardlink_to
        lock.unlink()
    os.mkfifo(lock)
    assert token_of(str(path)) == ""
    with pytest.raises(InputError, match="output"), exclusive_lock(path):
        pass
    lock.unlink()
    folder = tmp_path / "folder"
    folder.mkdir()
    (folder / "mine").write_text("keep")
    (tmp_path / ".r.zarr.draft").symlink_to(folder)
    run(Products(VALUES), path)
    assert mine.read_text() == (folder / "mine").read_text() == "keep"
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["folder", "mine", "r.zarr"]


def test_what_all_parts_need_may_lie_in_several_chunks(tmp_path: Path) -> None:
    """As Zarr cut it in earlier versions."""
    path = tmp_path / "r.zarr"
    run(Products(VALUES), path)
    held, nodes = path / "context/bytes", metadata_nodes(path)
    array = stored_array(held, nodes["context/bytes"])
    whole_bytes, array = array.read((slice(None),)), array._replace(chunks=(3,))
    nodes["context/bytes"] = array.metadata()
    nodes[""]["attributes"][DIGEST] = metadata_digest(nodes)
    for name in ("context/bytes", ""):
        (path / name / "zarr.json").write_text(json.dumps(nodes[name]))
    array.write_all(whole_bytes)
    open_result(path)
    (held / "c/1").unlink()
    Products.computed.clear()
    for _ in range(2):
        with (
            nullcontext() if Products.computed else pytest.warns(RuntimeWarning, match="all parts")
        ):
            run(Products(VALUES), path)
        assert Products.computed == [-1]
    assert len(list((held / "c").iterdir())) == 3


def test_what_all_parts_need_is_not_replaced_by_another_and_leaves_nothing_if_it_fails(
    tmp_path: Path,
) -> None:
    class Refused(Products):
        def context(self) -> Arrays:
            raise InputError("factor", 0.5, "another")

    class Longer(Products):
        def context(self) -> Arrays:
            return {"factor": np.array([0.5, 1.0])}

    refused("factor", run, Refused(VALUES), tmp_path / "r.zarr")
    assert list(tmp_path.iterdir()) == []
    run(Products(VALUES), tmp_path / "r.zarr")
    (tmp_path / "r.zarr/context/bytes/c/0").unlink()
    with (
        pytest.warns(RuntimeWarning, match="what all parts need"),
        pytest.raises(InputError, match="is another here"),
    ):
        run(Longer(VALUES), tmp_path / "r.zarr")
