"""Damaged and hostile results of a study: flipped bits, links, FIFOs, false sizes, and their check.

A result is read right, or computed anew where it is damaged, or refused in one line.
"""

from __future__ import annotations

import json
import os
import random
import shutil
import struct
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import google_crc32c
import numpy as np
import xarray as xr

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.study import Study, open_result, run
from bouncing_disk_ros.study.store import DIGEST, REGIONS, metadata_digest, metadata_nodes
from support.studies import Products

Change = Callable[[Path], object]
VALUES = {"rows": 4, "columns": 4, "length": 2, "factor": 0.5}


def whole(path: Path) -> Study:
    """Store a small result at the path; its study."""
    study = Products(VALUES)
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
