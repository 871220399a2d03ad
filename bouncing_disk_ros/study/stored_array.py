"""An array of a store in its files: metadata and chunks, with the bytes of Zarr 3.

Zarr is not used for it: it would read and write with an event loop, whose work holds the
interpreter's lock, so that ticks of a simulator in the same process would wait.
"""

from __future__ import annotations

import itertools
import math
import uuid
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import google_crc32c
import numpy as np
from numcodecs import Blosc, Zstd
from numpy.typing import NDArray

from bouncing_disk_ros.errors import FailedError, InputError
from bouncing_disk_ros.regular_file import read_bytes

Place = tuple[int, ...]
Key = tuple[int | slice, ...]

METADATA = "zarr.json"
SEALED = ("bytes", "blosc", "crc32c")
"""Codecs of each array of a store with checksums."""
OLDER = {("bytes", "blosc"), ("bytes", "zstd")}
"""Codecs of arrays of version 0.2: of fields, and of marks."""
_HEADER, _CHECKSUM = 16, 4
"""Bytes before and after the numbers of a chunk: Blosc's header, the crc32c."""
_KEYS = {"name": "default", "configuration": {"separator": "/"}}
_BLOSC = {"cname": "lz4", "clevel": 5, "shuffle": "shuffle", "blocksize": 0}
"""Compression of chunks: smaller than Zarr's default for basins, in two thirds of its time."""
_blosc = Blosc(cname="lz4", clevel=5, shuffle=Blosc.SHUFFLE)
_zstd = Zstd(level=0)


def _checksum(data: bytes) -> bytes:
    return int(google_crc32c.value(data)).to_bytes(_CHECKSUM, "little")


def _unsealed(data: bytes) -> bytes:
    """A chunk without its checksum; ValueError where it is another."""
    data, stored = data[:-_CHECKSUM], data[-_CHECKSUM:]
    if _checksum(data) != stored:
        raise ValueError
    return data


def _type(dtype: np.dtype[Any]) -> str | dict[str, Any]:
    """Name of a type in Zarr."""
    if dtype.kind == "U":
        return {"name": "fixed_length_utf32", "configuration": {"length_bytes": dtype.itemsize}}
    return dtype.name


class StoredArray(NamedTuple):
    """An array in a folder; what it holds is `attributes`, `codecs` are the ways it is packed."""

    path: Path
    dims: tuple[str, ...]
    dtype: np.dtype[Any]
    shape: Place
    chunks: Place
    fill: float | int = 0  # where nothing was computed yet
    attributes: Mapping[str, Any] = {}
    codecs: tuple[str, ...] = SEALED

    @property
    def chunk_bytes(self) -> int:
        """Size of a chunk that is not packed."""
        return int(self.dtype.itemsize * math.prod(self.chunks))

    @property
    def counts(self) -> Place:
        """Number of chunks along each axis."""
        return tuple(-(-n // length) for n, length in zip(self.shape, self.chunks, strict=True))

    def file(self, place: Place) -> Path:
        """File of a chunk."""
        return Path(self.path, "c", *map(str, place))

    def metadata(self) -> dict[str, Any]:
        """Content of `zarr.json`, as Zarr writes it."""
        order = {} if self.dtype.itemsize == 1 else {"configuration": {"endian": "little"}}
        blosc = {"typesize": self.dtype.itemsize, **_BLOSC}
        fill: Any = self.dtype.type(self.fill).item()
        if self.dtype.kind == "f" and not math.isfinite(fill):
            fill = str(fill).replace("inf", "Infinity").replace("nan", "NaN")
        return {
            "shape": list(self.shape),
            "data_type": _type(self.dtype),
            "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": list(self.chunks)}},
            "chunk_key_encoding": _KEYS,
            "fill_value": fill,
            "codecs": [
                {"name": "bytes", **order},
                {"name": "blosc", "configuration": blosc},
                {"name": "crc32c"},
            ],
            "attributes": dict(self.attributes),
            **({"dimension_names": list(self.dims)} if any(self.dims) else {}),
            "zarr_format": 3,
            "node_type": "array",
            "storage_transformers": [],
        }  # fmt: skip

    def write(self, place: Place, values: NDArray[np.generic]) -> None:
        """Write a chunk, on any thread of any process: under a passing name first.

        `values`: what the chunk holds of the array; at an edge it may be less than a whole chunk.
        OSError where the array's folder is there no more: the chunk would belong to no store.
        """
        values = np.asarray(values, self.dtype, order="C")
        if values.shape != self.chunks:  # at an edge: Zarr stores whole chunks
            values, given = np.full(self.chunks, self.fill, self.dtype), values
            values[tuple(map(slice, given.shape))] = given
        data = self._packing.encode(values)
        file = self.file(place)
        for folder in reversed(file.relative_to(self.path).parents[:-1]):
            with suppress(FileExistsError):  # exist_ok looks again, when it may have been moved
                Path(self.path, folder).mkdir()
        passing = file.with_name(f"{file.name}.{uuid.uuid4().hex}.partial")
        try:
            with passing.open("wb") as open_file:
                open_file.write(data)
                if self.codecs == SEALED:
                    open_file.write(_checksum(data))
            passing.replace(file)
        except OSError:
            passing.unlink(missing_ok=True)
            raise

    def write_all(self, values: NDArray[np.generic]) -> None:
        """Write all chunks."""
        for place in np.ndindex(self.counts):
            part = (slice(i * n, (i + 1) * n) for i, n in zip(place, self.chunks, strict=True))
            self.write(place, values[tuple(part)])

    def read(self, key: Key, *, whole: bool = True) -> NDArray[Any]:
        """Numbers at a key of whole numbers and slices with steps > 0, one for each axis.

        InputError for a chunk that is damaged. FailedError for a missing chunk of an array with
        checksums, unless it need not be `whole`: a missing chunk then holds fill values.
        """
        spans = [range(n)[one] for one, n in zip(key, self.shape, strict=True)]
        ranges = [one if isinstance(one, range) else range(one, one + 1) for one in spans]
        lows = [one[0] if one else 0 for one in ranges]
        highs = [one[-1] + 1 if one else 0 for one in ranges]
        found = np.empty([high - low for low, high in zip(lows, highs, strict=True)], self.dtype)
        axes = list(zip(lows, highs, self.chunks, strict=True))
        for place in itertools.product(*(range(low // n, -(-high // n)) for low, high, n in axes)):
            here = [(i * n, low, high, n) for i, (low, high, n) in zip(place, axes, strict=True)]
            outer = tuple(
                slice(max(a - low, 0), min(a + n, high) - low) for a, low, high, n in here
            )
            inner = tuple(slice(max(low - a, 0), min(high - a, n)) for a, low, high, n in here)
            found[outer] = self._chunk(place, whole)[inner]
        shifted = (
            slice(one.start - low, one.stop - low, one.step)
            if isinstance(one, range)
            else one - low
            for one, low in zip(spans, lows, strict=True)
        )
        return np.asarray(found[tuple(shifted)], order="C")

    @property
    def _packing(self) -> Blosc | Zstd:
        return _zstd if "zstd" in self.codecs else _blosc

    def _chunk(self, place: Place, whole: bool) -> NDArray[Any]:
        file = self.file(place)
        try:
            data = file.read_bytes()
        except FileNotFoundError:
            if whole and self.codecs == SEALED:
                what = "was moved, or parts were removed, while in use"
                raise FailedError(f"{self.path.parent} {what}: {self.path.name}") from None
            return np.full(self.chunks, self.fill, self.dtype)
        try:
            if self.codecs == SEALED:
                data = _unsealed(data)
            return np.frombuffer(self._packing.decode(data), self.dtype).reshape(self.chunks)
        except (RuntimeError, ValueError):
            raise InputError("path", str(file), "an undamaged part of a result") from None

    def is_whole(self) -> bool:
        """Whether all chunks are there and undamaged; of an array with checksums."""
        return all(self.is_sound(place) for place in np.ndindex(self.counts))

    def is_sound(self, place: Place) -> bool:
        """Whether a chunk is there, with the checksum that it holds and as many bytes as it shall.

        To decompress it would find the same: from two times to fifteen times as long.
        """
        size = self.chunk_bytes
        try:
            data = _unsealed(read_bytes("path", self.file(place), _HEADER + size + _CHECKSUM))
        except (InputError, ValueError):
            return False
        return int.from_bytes(data[4:8], "little") == size  # as Blosc will decompress


def stored_array(path: Path, node: Mapping[str, Any]) -> StoredArray:
    """Array in a folder by the content of its `zarr.json`.

    Raises errors of many kinds for an array that no study stores.
    """
    kind, shape = node["data_type"], node["shape"]
    if isinstance(kind, dict):
        kind = f"U{kind['configuration']['length_bytes'] // np.dtype('U1').itemsize}"
    dtype = np.dtype(kind).newbyteorder("<")
    grid, codecs = node["chunk_grid"], node["codecs"]
    chunks, dims = (
        grid["configuration"]["chunk_shape"],
        node.get("dimension_names") or [""] * len(node["shape"]),
    )
    order = codecs[0].get("configuration", {}).get("endian", "little")
    fill = dtype.type(node["fill_value"]).item()
    found = StoredArray(
        path, tuple(map(str, dims)), dtype, tuple(shape), tuple(chunks), fill, node["attributes"],
        tuple(one["name"] for one in codecs),
    )  # fmt: skip
    if (
        (node["zarr_format"], node["node_type"], grid["name"]) != (3, "array", "regular")
        or node["chunk_key_encoding"] != _KEYS
        or node.get("storage_transformers")
        or dtype.kind not in "biufU"
        or _type(dtype) != node["data_type"]
        or order != "little"
        or found.codecs not in {SEALED, *OLDER}
        or len(shape) != len(chunks)
        or len(dims) != len(shape)
        or not all(type(n) is int for n in (*shape, *chunks))
        or min((0, *shape)) < 0
        or min((1, *chunks)) < 1
    ):
        raise ValueError
    return found
