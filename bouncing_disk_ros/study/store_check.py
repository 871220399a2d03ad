"""Checks of a stored result before it is read: kinds of files, metadata, sizes, checksums.

A result is a Zarr group. Each chunk ends with its crc32c. The attribute `digests` of a group holds
a SHA-256 of its own metadata and of the metadata of each of its arrays.
"""

from __future__ import annotations

import functools
import hashlib
import itertools
import json
import math
import os
import stat
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import google_crc32c
import numpy as np
from zarr.codecs import BloscCodec, Crc32cCodec

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.limits import RESULT_ARRAYS, RESULT_CHUNK, RESULT_CHUNKS, RESULT_METADATA
from bouncing_disk_ros.regular_file import open_regular, read_text

FORMAT = 3
WITHOUT_CHECKSUMS = 2
"""The format of version 0.2: its chunks and metadata cannot be checked for damage."""
DIGESTS = "digests"
CONTEXT, CONTEXT_DRAFT = "context", "context_draft"
"""The group of what all regions need, and its place until it is whole."""
COMPRESSORS = (BloscCodec(cname="lz4", clevel=5, shuffle="shuffle"), Crc32cCodec())
"""Basins take less room so than by Zarr's default, and two thirds of the time."""
_CODECS = ["bytes", "blosc", "crc32c"]
_HEADER, _CHECKSUM = 16, 4
"""Bytes before and after the numbers of a chunk: Blosc's header, the crc32c."""
_ITSELF = "."
_METADATA = "zarr.json"
_DEEPEST = 8
_FIXED_TEXT = "fixed_length_utf32"
_WHOLE = "a whole result of a study"
_REMOVE = "Remove it, or choose another output"

Place = tuple[int, ...]


class Layout(NamedTuple):
    """The shape of an array, of its chunks, the type of its numbers, the names of its axes."""

    shape: tuple[int, ...]
    chunks: tuple[int, ...]
    dtype: str
    dims: tuple[str, ...]

    @property
    def chunk_bytes(self) -> int:
        """Bytes of the numbers of one chunk."""
        return np.dtype(self.dtype).itemsize * math.prod(self.chunks)

    @property
    def grid(self) -> Place:
        """Number of chunks along each axis."""
        pairs = zip(self.shape, self.chunks, strict=True)
        return tuple(-(-size // length) for size, length in pairs)

    def places(self) -> Iterator[Place]:
        """The place of each chunk."""
        return itertools.product(*map(range, self.grid))


@dataclass(frozen=True)
class Contents:
    """A group whose metadata were checked: its attributes, and its arrays by name."""

    path: Path
    attributes: Mapping[str, Any]
    arrays: Mapping[str, Layout]
    has_checksums: bool

    def file(self, name: str, place: Place) -> Path:
        """Where a chunk is stored."""
        return self.path.joinpath(name, "c", *map(str, place))

    def is_sound(self, name: str, place: Place) -> bool:
        """Whether the chunk is there, of the size of its array, with the checksum that it holds.

        Without checksums: whether it is small enough, or missing, which stands for the fill value.
        """
        layout = self.arrays[name]
        file = self.file(name, place)
        most = _HEADER + layout.chunk_bytes + _CHECKSUM
        try:
            number, size = open_regular("path", file)
        except InputError:
            return not self.has_checksums and not file.exists()
        with open(number, "rb") as opened:  # noqa: PTH123 (a descriptor, which it closes)
            if not self.has_checksums:
                return size <= 2 * most + 64
            if not _HEADER + _CHECKSUM <= size <= most:
                return False
            data = opened.read(most)
        stored = int.from_bytes(data[-_CHECKSUM:], "little")
        numbers = int.from_bytes(data[4:8], "little")  # as Blosc will decompress
        return google_crc32c.value(data[:-_CHECKSUM]) == stored and numbers == layout.chunk_bytes

    def damaged(self, names: Sequence[str]) -> list[str]:
        """Those arrays of these that miss a chunk or have a damaged one."""
        return [
            name
            for name in names
            if not all(self.is_sound(name, place) for place in self.arrays[name].places())
        ]


def damaged_parts(
    found: Contents, marks: str, lengths: Mapping[str, int], fields: Sequence[str]
) -> tuple[list[int], dict[int, list[str]]]:
    """Regions with a damaged mark; regions marked as done -> their damaged arrays.

    `marks`: the array with one chunk for each region. `lengths`: the length of a region along each
    axis that is cut, in the order in which regions are numbered.
    """
    sizes: dict[str, int] = {}
    for name in fields:
        sizes |= zip(found.arrays[name].dims, found.arrays[name].shape, strict=True)
    counts = [range(-(-sizes[dim] // length)) for dim, length in lengths.items()]
    bad_marks, parts = [], {}
    is_sound = functools.cache(found.is_sound)  # a chunk may belong to several regions
    for number, place in enumerate(itertools.product(*counts)):
        if not found.file(marks, (number,)).exists():
            continue
        if not found.is_sound(marks, (number,)):
            bad_marks.append(number)
            continue
        at = dict(zip(lengths, place, strict=True))
        chunks = {name: tuple(at.get(dim, 0) for dim in found.arrays[name].dims) for name in fields}
        if damaged := [name for name in fields if not is_sound(name, chunks[name])]:
            parts[number] = damaged
    return bad_marks, parts


def contents(field: str, path: Path, *, sealed: bool | None = None) -> Contents:
    """The checked metadata of a group; InputError, naming `field`, where it cannot be used.

    `sealed`: whether it must have checksums; None where its own identity says so. A link, a FIFO or
    a device anywhere in the folder is refused: nothing of it is opened.
    """
    folders = _folders(field, path)
    root = _metadata(field, path)
    attributes = root.get("attributes")
    if root.get("node_type") != "group" or not isinstance(attributes, dict):
        raise InputError(field, str(path), _WHOLE, f"It holds other data. {_REMOVE}")
    if sealed is None:
        identity = attributes.get("identity")
        if not isinstance(identity, dict):
            raise InputError(field, str(path), _WHOLE, f"It holds other data. {_REMOVE}")
        sealed = identity.get("format") != WITHOUT_CHECKSUMS
    digests = attributes.get(DIGESTS, {})
    if sealed:
        names = _checked_names(field, path, digests)
    else:
        names = sorted(name for name in folders if (path / name / _METADATA).is_file())
    if sealed and (more := folders.keys() - {*names, CONTEXT, CONTEXT_DRAFT}):
        raise InputError(
            field, str(path), _WHOLE, f"{min(more)!r} in it is no part of one. {_REMOVE}"
        )
    if len(names) > RESULT_ARRAYS:
        raise InputError(field, str(path), f"a result of at most {RESULT_ARRAYS} arrays")
    found = {name: _metadata(field, path / name) for name in names}
    if sealed and (changed := _changed(root, found, digests)):
        hint = f"The metadata of {changed} were damaged or changed. {_REMOVE}"
        raise InputError(field, str(path), _WHOLE, hint)
    arrays = {
        name: _layout(field, path / name, one, sealed)
        for name, one in found.items()
        if sealed or one.get("node_type") == "array"
    }
    for name, layout in arrays.items():
        if folders[name] > len(layout.shape):  # c/0/1: the last number is the name of a file
            hint = f"In {name!r} a folder is in the place of a chunk. {_REMOVE}"
            raise InputError(field, str(path), _WHOLE, hint)
    return Contents(path, attributes, arrays, sealed)


def seal(path: Path) -> dict[str, str]:
    """The attribute `digests` of a group: a digest for itself and for each array in it."""
    names = sorted(entry.name for entry in path.iterdir() if entry.is_dir())
    found = {name: _metadata("output", path / name) for name in names}
    return _digests(_metadata("output", path), found)


def _digests(root: Mapping[str, Any], arrays: Mapping[str, Any]) -> dict[str, str]:
    """The digest of the group covers its list of arrays, but no digest."""
    attributes = {**root.get("attributes", {}), DIGESTS: sorted(arrays)}
    nodes = {_ITSELF: {**root, "attributes": attributes}, **arrays}
    return {name: _digest(name, node) for name, node in nodes.items()}


def _digest(name: str, metadata: object) -> str:
    text = json.dumps([name, metadata], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


def _changed(root: Mapping[str, Any], arrays: Mapping[str, Any], digests: Any) -> str:
    """The names of nodes whose metadata have another digest."""
    wanted = _digests(root, arrays)
    changed = [name for name in wanted if digests.get(name) != wanted[name]]
    return ", ".join("the result" if name == _ITSELF else name for name in changed)


def _checked_names(field: str, path: Path, digests: object) -> list[str]:
    """The names of arrays in the digests; each is a plain name of a folder."""
    names = [name for name in digests if name != _ITSELF] if isinstance(digests, dict) else ["/"]
    if not all(name.isidentifier() for name in names):
        raise InputError(field, str(path), _WHOLE, f"Its digests are damaged. {_REMOVE}")
    return names


def _folders(field: str, path: Path) -> dict[str, int]:
    """The folders in a store, and how many folders deep each is.

    InputError where anything in it is neither a folder nor a regular file.
    """
    try:
        if not stat.S_ISDIR(path.lstat().st_mode):
            raise InputError(field, str(path), _WHOLE, "It is a link, or no folder")
        inside = _entries_checked(field, path)
        return {folder.name: _depth(field, folder) for folder in inside}
    except OSError as error:
        raise InputError(field, str(path), "a folder that can be read", str(error)) from None


def _depth(field: str, path: Path, level: int = 1) -> int:
    """How many folders deep a folder is, 0 without any in it."""
    if level > _DEEPEST:
        raise InputError(field, str(path), _WHOLE, f"It is too deep. {_REMOVE}")
    try:
        inside = _entries_checked(field, path)
    except FileNotFoundError:  # renamed in between by the run that writes it
        return 0
    return max((1 + _depth(field, folder, level + 1) for folder in inside), default=0)


def _entries_checked(field: str, path: Path) -> list[Path]:
    """The folders in a folder; InputError where it holds anything else but regular files."""
    with os.scandir(path) as found:
        entries = list(found)
    for entry in entries:
        if not entry.is_dir(follow_symlinks=False) and not entry.is_file(follow_symlinks=False):
            hint = f"{entry.name!r} in it is a link, or no file. {_REMOVE}"
            raise InputError(field, str(path), _WHOLE, hint)
    return [Path(entry) for entry in entries if entry.is_dir(follow_symlinks=False)]


def _metadata(field: str, folder: Path) -> dict[str, Any]:
    """The metadata of an array or a group."""
    if not os.path.lexists(folder / _METADATA):
        hint = f"It holds other data, or lacks {_METADATA}. {_REMOVE}"
        raise InputError(field, str(folder), _WHOLE, hint)
    text = read_text(field, folder / _METADATA, RESULT_METADATA)
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        found = None
    if not isinstance(found, dict) or found.get("zarr_format") != 3:
        raise InputError(field, str(folder), _WHOLE, f"Its {_METADATA} is damaged. {_REMOVE}")
    return found


def _layout(field: str, folder: Path, metadata: Mapping[str, Any], has_checksums: bool) -> Layout:
    """The layout of an array, InputError where it is none that a study stores."""
    try:
        shape = _numbers(metadata["shape"], 0)
        chunks = _numbers(metadata["chunk_grid"]["configuration"]["chunk_shape"], 1)
        dims = tuple(map(str, metadata.get("dimension_names") or [""] * len(shape)))
        layout = Layout(shape, chunks, _dtype(metadata["data_type"]), dims)
        codecs = [codec["name"] for codec in metadata["codecs"]]
        key = metadata["chunk_key_encoding"]
        usual = key["name"] == "default" and key["configuration"]["separator"] == "/"
        fits = len(shape) == len(chunks) == len(dims) and math.prod(layout.grid) <= RESULT_CHUNKS
    except (KeyError, TypeError, ValueError):
        fits = False
    if not fits or not usual or (has_checksums and codecs != _CODECS):
        raise InputError(field, str(folder), "an array of a study's result", f"{_REMOVE}.")
    if layout.chunk_bytes > RESULT_CHUNK:
        allowed = f"chunks of at most {RESULT_CHUNK} bytes"
        raise InputError(field, f"{folder}, chunks of {layout.chunk_bytes} bytes", allowed)
    return layout


def _numbers(values: object, least: int) -> Place:
    if not isinstance(values, list) or len(values) > _DEEPEST - 2:
        raise ValueError
    if not all(type(value) is int and least <= value < 1 << 48 for value in values):
        raise ValueError
    return tuple(values)


def _dtype(found: Any) -> str:
    """The type of numbers, or of texts of one length, in numpy's words."""
    if isinstance(found, dict) and found["name"] == _FIXED_TEXT:
        (length,) = _numbers([found["configuration"]["length_bytes"]], 4)
        return f"<U{length // 4}"
    kind = np.dtype(found) if isinstance(found, str) else None
    if kind is None or kind.kind not in "biuf":
        raise ValueError
    return kind.name
