"""Stored results that were damaged, or made to do harm: read right, computed anew, or refused.

Flipped bits, links, FIFOs and false sizes; a refusal is one line.
"""

from __future__ import annotations

import json
import os
import random
import shutil
import struct
import warnings
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import google_crc32c
import numpy as np
import pytest
import xarray as xr

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.study import Arrays, Study, open_result, run
from bouncing_disk_ros.study.lock import exclusive_lock, token_of
from bouncing_disk_ros.study.store import DIGEST, REGIONS, metadata_digest, metadata_nodes
from bouncing_disk_ros.study.stored_array import stored_array
from reference.cases import FIRST, examples, in_soak
from support.checks import refused, there
from support.studies import VALUES, Products, Sums

Change = Callable[[Path], object]
SQUARE = {"rows": 4, "columns": 4, "length": 2, "factor": 0.5}


def whole(path: Path) -> Study:
    """Store a small result at the path; its study."""
    study = Products(SQUARE)
    assert run(study, path, workers=1) is not None
    return study


def files(path: Path) -> list[Path]:
    """All files of a store, in order."""
    return sorted(file for file in path.rglob("*") if file.is_file())


def flip(path: Path, seed: int) -> str:
    """Flip one bit of one file; where."""
    draw = random.Random(seed)
    file = draw.choice(files(path))
    data = bytearray(file.read_bytes())
    bit = draw.randrange(8 * len(data))
    data[bit // 8] ^= 1 << bit % 8
    file.write_bytes(data)
    return f"bit {bit} of {file.relative_to(path)}"


def disturb(path: Path, seed: int) -> str:
    """Change one file otherwise: cut it, remove it, fill it with noise, make it longer."""
    draw = random.Random(seed)
    file = draw.choice(files(path))
    data = file.read_bytes()
    what = draw.choice(["cut", "removed", "noise", "longer"])
    if what == "removed":
        file.unlink()
    else:
        file.write_bytes({
            "cut": data[: draw.randrange(len(data))],
            "noise": draw.randbytes(len(data)),
            "longer": data + draw.randbytes(1 + draw.randrange(1000)),
        }[what])  # fmt: skip
    return f"{file.relative_to(path)} {what}"


def attempt(study: Study, path: Path, expected: xr.Dataset) -> tuple[str, str]:
    """What opening it and running the study again give: 'same', 'unfinished' or the refusal's line.

    Other numbers, and errors of another kind, fail.
    """
    try:
        result = open_result(path)
        unfinished = not result["region_done"].values.all()  # a mark is gone: that part is not done
        opened = "unfinished" if unfinished else _same(result, expected.drop_attrs(deep=False))
    except InputError as error:
        opened = error.line
    try:
        with warnings.catch_warnings(record=True):
            warnings.simplefilter("always")
            found = run(study, path, workers=1, progress=False)
        assert found is not None
        again = _same(found, expected)
    except InputError as error:
        again = error.line
    assert "\n" not in opened + again
    return opened, again


def _same(found: xr.Dataset, expected: xr.Dataset) -> str:
    loaded = found.load()
    for name, variable in expected.variables.items():
        assert loaded[name].dtype == variable.dtype, name
        assert np.array_equal(loaded[name].values, variable.values), name
    assert expected.attrs.items() <= loaded.attrs.items()
    return "same"


def _edit(file: str, change: Callable[[dict[str, Any]], object], *, reseal: bool = True) -> Change:
    """Change the metadata of a node; the digests are made right unless told otherwise."""

    def apply(path: Path) -> None:
        metadata = json.loads((path / file).read_text())
        change(metadata)
        (path / file).write_text(json.dumps(metadata))
        if reseal:
            root = json.loads((path / "zarr.json").read_text())
            root["attributes"][DIGEST] = metadata_digest(metadata_nodes(path))
            (path / "zarr.json").write_text(json.dumps(root))

    return apply


def _array(**values: object) -> Change:
    return _edit("product/zarr.json", lambda found: found.update(values))


def _identity(**values: object) -> Change:
    return _edit("zarr.json", lambda found: found["attributes"]["identity"].update(values))


def _regions(lengths: object) -> Change:
    return _edit("zarr.json", lambda found: found["attributes"].update({REGIONS: lengths}))


def _replaced_by(file: str, make: Callable[[Path], object]) -> Change:
    def apply(path: Path) -> None:
        place = path / file
        if place.is_dir() or place.exists():
            shutil.move(place, path.parent / "elsewhere")
        make(place)

    return apply


def _link(place: Path) -> None:
    place.symlink_to("nowhere")


def _link_back(place: Path) -> None:
    """A link to what stood there."""
    (aside,) = [one for one in place.parents if (one / "elsewhere").exists()]
    place.symlink_to(aside / "elsewhere")


def _bytes(file: str, data: bytes) -> Change:
    return lambda path: (path / file).write_bytes(data)


def _bomb(path: Path) -> None:
    """A chunk that says it holds 2 GiB, with its checksum right."""
    file = path / "product/c/0/0"
    data = bytearray(file.read_bytes()[:-4])
    data[4:8] = struct.pack("<I", 2**31 - 1)
    file.write_bytes(bytes(data) + google_crc32c.value(bytes(data)).to_bytes(4, "little"))


def _nested(path: Path) -> None:
    (path / "/".join("d" * 40)).mkdir(parents=True)


REFUSED, ANEW = "refused", "computed anew"
CHUNK, ROOT, ARRAY = "product/c/1/0", "zarr.json", "product/zarr.json"
HUGE = [1 << 40, 1 << 40]
GRID = {"name": "regular", "configuration": {"chunk_shape": [1 << 30, 1 << 30]}}
HOSTILE: dict[str, tuple[Change, str]] = {
    "FIFO as root": (_replaced_by(ROOT, os.mkfifo), REFUSED),
    "FIFO as array": (_replaced_by(ARRAY, os.mkfifo), REFUSED),
    "FIFO as chunk": (_replaced_by(CHUNK, os.mkfifo), REFUSED),
    "FIFO beside": (_replaced_by("pipe", os.mkfifo), REFUSED),
    "folder as root": (_replaced_by(ROOT, os.mkdir), REFUSED),
    "folder as chunk": (_replaced_by(CHUNK, os.mkdir), ANEW),
    "link as root": (_replaced_by(ROOT, _link_back), REFUSED),
    "link as chunk": (_replaced_by(CHUNK, _link_back), REFUSED),
    "link as array": (_replaced_by("label", _link_back), REFUSED),
    "link nowhere": (_replaced_by(CHUNK, _link), REFUSED),
    "link as store": (_replaced_by("", _link_back), REFUSED),
    "no root": (lambda path: (path / ROOT).unlink(), REFUSED),
    "no array": (lambda path: shutil.rmtree(path / "product"), REFUSED),
    "no chunk": (lambda path: (path / CHUNK).unlink(), ANEW),
    "no chunks": (lambda path: shutil.rmtree(path / "label" / "c"), ANEW),
    "no axis": (lambda path: (path / "x/c/0").unlink(), ANEW),
    "empty root": (_bytes(ROOT, b""), REFUSED),
    "empty chunk": (_bytes(CHUNK, b""), ANEW),
    "empty mark": (_bytes("region_done/c/1", b""), ANEW),
    "long chunk": (_bytes(CHUNK, bytes(1 << 20)), ANEW),
    "not UTF-8": (_bytes(ROOT, b"\xff\xfe{}"), REFUSED),
    "no JSON": (_bytes(ARRAY, b"{'shape'"), REFUSED),
    "a list": (_bytes(ARRAY, b"[]"), REFUSED),
    "deep JSON": (_bytes(ROOT, b"[" * 100_000), REFUSED),
    "large JSON": (_bytes(ROOT, b" " * (17 << 20)), REFUSED),
    "deep folders": (_nested, REFUSED),
    "extra array": (lambda path: shutil.copytree(path / "product", path / "more"), REFUSED),
    "other group": (_edit("zarr.json", lambda found: found.update(attributes={}), reseal=False),
                    REFUSED),
    "attributes a list": (_edit(ROOT, lambda found: found.update(attributes=[]), reseal=False),
                          REFUSED),
    "no digests": (_edit(ROOT, lambda found: found["attributes"].pop(DIGEST), reseal=False),
                  REFUSED),
    "digests a list": (_edit(ROOT, lambda found: found["attributes"].update({DIGEST: ["."]}),
                            reseal=False), REFUSED),
    "other fill": (_edit(ARRAY, lambda found: found.update(fill_value=1.0), reseal=False), REFUSED),
    "huge shape": (_array(shape=HUGE), REFUSED),
    "huge chunks": (_array(shape=HUGE, chunk_grid=GRID), REFUSED),
    "negative shape": (_array(shape=[-4, 4]), REFUSED),
    "shape of texts": (_array(shape=["4", 4]), REFUSED),
    "other shape": (_array(shape=[4, 6]), REFUSED),
    "other type": (_array(data_type="float32"), REFUSED),
    "objects": (_array(data_type="object"), REFUSED),
    "unknown type": (_array(data_type={"name": "pickle"}), REFUSED),
    "other codecs": (_array(codecs=[{"name": "bytes"}]), REFUSED),
    "no grid": (_array(chunk_grid=None), REFUSED),
    "Zarr 2": (_edit(ARRAY, lambda found: found.update(zarr_format=2), reseal=False), REFUSED),
    "other study": (_identity(study="basins"), REFUSED),
    "other parameters": (_identity(parameters={"rows": 9}), REFUSED),
    "parameters a list": (_identity(parameters=[]), REFUSED),
    "other format": (_identity(format=9), REFUSED),
    "format a text": (_identity(format="3"), REFUSED),
    "regions without length": (_regions([["y", 0], ["x", 0]]), REFUSED),
    "many regions": (_regions([["y", 1], ["x", 1]]), REFUSED),
    "regions back to front": (_regions([["y", -2], ["x", -2]]), REFUSED),
    "regions of no axis": (_regions([["z", 1]]), REFUSED),
    "other key in the root": (_edit(ROOT, lambda found: found.update(mine=1)), REFUSED),
    "other fill, sealed": (_array(fill_value="none"), REFUSED),
    "bomb": (_bomb, ANEW),
}  # fmt: skip
"""Name -> what is done to a store, and what a run of its study does then."""


def check_hostile(name: str, study: Study, path: Path, expected: xr.Dataset) -> None:
    """Change a store as the name says: its study then runs anew or refuses it, as is stated."""
    change, outcome = HOSTILE[name]
    change(path)
    _, again = attempt(study, path, expected)
    assert (again == "same") == (outcome == ANEW), (name, again)


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
