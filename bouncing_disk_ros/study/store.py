"""The store of a study: a Zarr group that xarray opens, with a mark for each finished region.

First the checks of a stored result before it is read, then the store and `open_result`.

Each chunk ends with its crc32c. The attribute `digests` of a group holds a SHA-256 of its own
metadata and of the metadata of each of its arrays.
"""

from __future__ import annotations

import functools
import hashlib
import itertools
import json
import math
import os
import shutil
import stat
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import google_crc32c
import numpy as np
import xarray as xr
import zarr
from numpy.typing import NDArray
from zarr.codecs import BloscCodec, Crc32cCodec

import bouncing_disk_ros
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.executables import STUDIES
from bouncing_disk_ros.limits import RESULT_ARRAYS, RESULT_CHUNK, RESULT_CHUNKS, RESULT_METADATA
from bouncing_disk_ros.regular_file import open_regular, read_text
from bouncing_disk_ros.study.computation import Arrays, Axis, Field, Region, Study
from bouncing_disk_ros.study.definition import definition_of

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

DONE = "region_done"
RESULT = "result.zarr"
"""The store in the output folder of a study's command."""
BYTES = "bytes"
REGIONS = "regions"
"""Attribute: the axes that are cut, and the length of a region along each."""
_UNCHECKED = "made by an earlier version without checksums: damage in it cannot be seen"
_SHOWN = 5
"""Damaged parts that a line names."""
_ALL_NEED = "what all parts need"
_ALL_CHUNKS = {"write_empty_chunks": True}
_PACKAGE = "bouncing_disk_ros"

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


class Store:
    """The growing result of one study in a folder; a region is marked after it was written.

    `note`: what the user is to know of a store that was there: damaged parts that are computed
    anew, missing checksums; '' else.
    """

    def __init__(self, path: Path, study: Study) -> None:
        """Make the store, or open the one that an earlier run of the same study left there."""
        self.path, self._study, self.note = path, study, ""
        try:
            # a link that leads nowhere counts as something that is there
            self._group = self._opened() if os.path.lexists(path) else self._made()
        except OSError as error:
            raise InputError("output", str(path), "a folder that can be written", str(error)) from (
                error
            )
        self._done: NDArray[np.uint8] = np.asarray(self._group[DONE][:])

    def _identity(self) -> dict[str, Any]:
        study = self._study
        return {
            "format": FORMAT,
            "study": study.name,
            "revision": study.revision,
            "parameters": json.loads(json.dumps(study.parameters)),
        }

    def _opened(self) -> zarr.Group:
        """The store that is there, after all of it was checked; damaged parts count as not done."""
        hint = "Choose another output, or remove it."
        wanted_here = "a new folder, or an unfinished result"
        found = contents("output", self.path)
        identity, wanted = found.attributes.get("identity"), self._identity()
        if not isinstance(identity, dict) or not isinstance(identity.get("parameters"), dict):
            raise InputError("output", str(self.path), f"{wanted_here} of this study",
                             f"It holds other data. {hint}")  # fmt: skip
        identity = _completed(identity, wanted)
        if not found.has_checksums:
            wanted["format"], self.note = WITHOUT_CHECKSUMS, f"{self.path} was {_UNCHECKED}"
        older = self._is_older(identity, wanted)
        if identity != wanted and not older:
            raise InputError("output", str(self.path), f"{wanted_here} with the same parameters",
                             f"There {_difference(identity, wanted)}. {hint}")  # fmt: skip
        if older:
            self._check_older(found, f"there {_difference(identity, wanted)}. {hint}")
            return zarr.open_group(str(self.path), mode="r+")
        for name, layout in self._layouts().items():
            if found.arrays.get(name) != layout:
                raise InputError("output", str(self.path), f"{wanted_here} with the same arrays",
                                 f"{name} has another shape or type. {hint}")  # fmt: skip
        group = zarr.open_group(str(self.path), mode="r+")
        if parts := self._repaired(group, found):
            self.note = f"{self.path}: {parts}; it is computed anew"
        return group

    def _check_older(self, found: Contents, hint: str) -> None:
        """InputError where a result of an older revision is not whole."""
        parts = _damage(found) if found.has_checksums else ""
        done = found.arrays.get(DONE)
        if done and not parts and not all(found.file(DONE, at).exists() for at in done.places()):
            parts = "unfinished"
        if parts or not done:
            raise InputError("output", str(self.path), "a whole result", f"{parts}: {hint}")

    def _is_older(self, found: Mapping[str, Any], wanted: Mapping[str, Any]) -> bool:
        """Whether it is a result of an older revision: a whole one is read as it is."""
        same = {**found, "revision": wanted["revision"]} == wanted
        return (
            same and type(found.get("revision")) is int and found["revision"] < wanted["revision"]
        )

    def _repaired(self, group: zarr.Group, found: Contents) -> str:
        """Take damaged parts out of the store; what they are, in words."""
        axes = found.damaged(list(self._study.axes))
        for name in axes:
            _writing(group, name)[...] = self._study.axes[name].values
        damaged = [f"axis {name}" for name in axes]
        context = self.path / CONTEXT
        if os.path.lexists(context) and not _is_whole(context, sealed=found.has_checksums):
            shutil.rmtree(context)
            damaged.append(_ALL_NEED)
        marks, parts = damaged_parts(found, DONE, self._study.chunks, list(self._study.fields))
        for number in [*marks, *parts]:
            (self.path / DONE / "c" / str(number)).unlink()
        return _listed([*damaged, *_in_words(marks, parts)])

    def _made(self) -> zarr.Group:
        """A new store: made beside its place, so that a half-made one is never found."""
        study = self._study
        draft = self.path.with_name(f".{self.path.name}.draft")
        if draft.is_dir() and not draft.is_symlink():
            shutil.rmtree(draft)
        else:
            draft.unlink(missing_ok=True)
        draft.mkdir(parents=True)  # fails where a link has taken its place
        group = zarr.open_group(str(draft), mode="w-")
        group.attrs.update(
            {
                "identity": self._identity(),
                "title": study.title,
                "source": f"{_PACKAGE} {bouncing_disk_ros.__version__}",
                REGIONS: list(study.chunks.items()),
                **{f"parameter_{name}": value for name, value in study.parameters.items()},
            }
        )
        layouts = self._layouts()
        for name, axis in study.axes.items():
            _array(group, name, _axis_field(name, axis), layouts[name])
            _writing(group, name)[...] = axis.values
        for name, field in study.fields.items():
            _array(group, name, field, layouts[name])
        marks = Field(("region",), "uint8", "1", "whether the part is computed", fill=0)
        _array(group, DONE, marks, layouts[DONE])
        group.attrs[DIGESTS] = seal(draft)
        draft.rename(self.path)
        return zarr.open_group(str(self.path), mode="r+")

    def _layouts(self) -> dict[str, Layout]:
        """The layout of each array."""
        study = self._study
        axes = {name: _axis_field(name, axis) for name, axis in study.axes.items()}
        found = {name: self._layout(field, {}) for name, field in axes.items()}
        found |= {name: self._layout(field, study.chunks) for name, field in study.fields.items()}
        return found | {
            DONE: Layout((math.prod(study.region_counts()),), (1,), "uint8", ("region",))
        }

    def _layout(self, field: Field, lengths: Mapping[str, int]) -> Layout:
        shape = tuple(self._study.shape[dim] for dim in field.dims)
        pairs = zip(field.dims, shape, strict=True)
        chunks = tuple(max(1, min(lengths.get(dim, size), size)) for dim, size in pairs)
        kind = np.dtype(field.dtype)
        return Layout(shape, chunks, kind.str if kind.kind == "U" else kind.name, field.dims)

    def is_done(self, region: Region) -> bool:
        """Whether this region is in the store."""
        return bool(self._done[region.number])

    @property
    def regions_done(self) -> int:
        """How many regions are in the store."""
        return int(self._done.sum())

    def put(self, region: Region, arrays: Arrays) -> None:
        """Put a region into the store, on any thread; it counts when it is marked."""
        put(self._group, self._study, region, arrays)

    def mark(self, region: Region) -> None:
        """Mark a region that is in the store as done."""
        self._group[DONE][region.number] = 1
        self._done[region.number] = 1

    def read(self, region: Region) -> Arrays:
        """A region that is in the store."""
        return {
            name: np.asarray(self._group[name][region.select(field.dims)])
            for name, field in self._study.fields.items()
        }

    def context(self) -> Arrays:
        """What all regions need: from the store, or computed now and kept there."""
        if CONTEXT in self._group:
            held = self._group[CONTEXT][BYTES]
            try:
                return _unpacked(np.asarray(held[...]), held.attrs["arrays"])
            except (KeyError, TypeError, ValueError):
                raise InputError("output", str(self.path), "a result that a study has stored",
                                 "Remove it, or choose another output.") from None  # fmt: skip
        arrays = {name: np.asarray(one) for name, one in self._study.context().items()}
        if arrays:  # as one array: each costs its files
            about = [[name, one.dtype.str, list(one.shape)] for name, one in arrays.items()]
            packed = np.frombuffer(b"".join(one.tobytes() for one in arrays.values()), np.uint8)
            draft = self._group.require_group(CONTEXT_DRAFT, overwrite=True)
            draft.create_array(
                BYTES, data=packed, attributes={"arrays": about}, compressors=COMPRESSORS,
                config=_ALL_CHUNKS,
            )  # fmt: skip
            place = self.path / draft.basename
            draft.attrs[DIGESTS] = seal(place)
            place.rename(self.path / CONTEXT)
        return arrays


def _axis_field(name: str, axis: Axis) -> Field:
    return Field((name,), str(axis.values.dtype), axis.units, axis.long_name, axis.symbol)


def _array(group: zarr.Group, name: str, field: Field, layout: Layout) -> zarr.Array:
    fill = field.fill if np.dtype(field.dtype).kind == "f" else int(np.nan_to_num(field.fill))
    attributes: dict[str, Any] = {"units": field.units, "long_name": field.long_name}
    if field.symbol:
        attributes["symbol"] = field.symbol
    if field.flags:
        attributes["flag_values"] = list(field.flags)
        attributes["flag_meanings"] = " ".join(field.flags.values())
    return group.create_array(
        name, shape=layout.shape, chunks=layout.chunks, dtype=field.dtype, fill_value=fill,
        dimension_names=field.dims, attributes=attributes, compressors=COMPRESSORS,
    )  # fmt: skip


def _unpacked(packed: NDArray[np.uint8], about: list[tuple[str, str, list[int]]]) -> Arrays:
    """Arrays from their bytes in a row; about: name, type and shape of each."""
    found, begin = {}, 0
    for name, kind, shape in about:
        end = begin + np.dtype(kind).itemsize * math.prod(shape)
        found[name] = packed[begin:end].view(kind).reshape(shape)
        begin = end
    return found


def put(group: zarr.Group | str, study: Study, region: Region, arrays: Arrays) -> None:
    """Put a region into the group of a store, or into its folder: another process has no store."""
    if isinstance(group, str):
        group = zarr.open_group(group, mode="r+")
    for name, field in study.fields.items():
        _writing(group, name)[region.select(field.dims)] = arrays[name]


def _writing(group: zarr.Group, name: str) -> zarr.Array:
    """An array that also writes the chunks that hold nothing but fill values: none is missing."""
    return group[name].with_config(_ALL_CHUNKS)


def _is_whole(path: Path, *, sealed: bool) -> bool:
    """Whether a group in a store can be read."""
    try:
        found = contents("output", path, sealed=sealed)
    except InputError:
        return False
    return not found.damaged(list(found.arrays))


def _in_words(marks: Sequence[int], parts: Mapping[int, Sequence[str]]) -> list[str]:
    """Damaged marks and parts."""
    named = [f"part {number} ({', '.join(names)})" for number, names in parts.items()]
    return [*(f"the mark of part {number}" for number in marks), *named]


def _listed(damaged: Sequence[str]) -> str:
    """What is damaged as one text, '' for nothing."""
    if not damaged:
        return ""
    more = f" and {len(damaged) - _SHOWN} more" if len(damaged) > _SHOWN else ""
    return "damaged: " + ", ".join(damaged[:_SHOWN]) + more


def open_result(path: str | Path) -> xr.Dataset:
    """Stored result of a study, complete or not: all is checked now, arrays are read when used.

    `path`: a store that `run` made, or the output folder of a command. Raises InputError where
    there is no result, or a damaged one; the study's own run computes damaged parts again.

    >>> basins("small.zarr", axial_forcing=0.34, width=24, height=24)
    >>> open_result("small.zarr")["label"]
    """
    store = Path(path)
    if os.path.lexists(store / RESULT):
        store /= RESULT
    if not (store / "zarr.json").is_file():
        allowed = "the output folder of a study, or a store that run made"
        raise InputError("path", str(path), allowed)
    found = contents("path", store)
    if not found.has_checksums:
        warnings.warn(f"{store} was {_UNCHECKED}", RuntimeWarning, stacklevel=2)
    elif damaged := _damage(found):
        hint = f"{damaged[:1].upper()}{damaged[1:]}. Run the same study there again: it mends them."
        raise InputError("path", str(store), "a whole result of a study", hint)
    return opened(store)


def opened(path: Path) -> xr.Dataset:
    """Open a store that was checked."""
    result = xr.open_zarr(str(path), consolidated=False, chunks=None)
    for name in (DIGESTS, REGIONS):
        result.attrs.pop(name, None)
    return result


def _damage(found: Contents) -> str:
    """What is damaged in a store, in words."""
    try:
        lengths = {str(dim): int(length) for dim, length in found.attributes[REGIONS]}
        axes = [name for name, layout in found.arrays.items() if layout.dims == (name,)]
        fields = [name for name in found.arrays if name not in (*axes, DONE)]
        marks, parts = damaged_parts(found, DONE, lengths, fields)
    except (KeyError, TypeError, ValueError):
        raise InputError("path", str(found.path), "a store that run made") from None
    damaged = [f"axis {name}" for name in found.damaged(axes)]
    if os.path.lexists(found.path / CONTEXT) and not _is_whole(found.path / CONTEXT, sealed=True):
        damaged.append(_ALL_NEED)
    return _listed([*damaged, *_in_words(marks, parts)])


def _completed(identity: Mapping[str, Any], wanted: Mapping[str, Any]) -> dict[str, Any]:
    """An identity with options that its version did not have: defaults are what it did."""
    name = str(wanted["study"])
    table = definition_of(name).options if name in STUDIES else {}
    defaults = {name: table[name].default for name in wanted["parameters"] if name in table}
    return {**identity, "parameters": {**defaults, **identity["parameters"]}}


def _difference(found: Mapping[str, Any], wanted: Mapping[str, Any]) -> str:
    """The first difference of two identities, in words."""
    for key in ("format", "study", "revision"):
        if found.get(key) != wanted[key]:
            return f"the {key} is {found.get(key)}, not {wanted[key]}"
    before, now = found["parameters"], wanted["parameters"]
    name = next(name for name in {**before, **now} if before.get(name) != now.get(name))
    return f"{name} is {before.get(name)}, not {now.get(name)}"
