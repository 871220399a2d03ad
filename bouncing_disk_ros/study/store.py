"""The store of a study: a Zarr group that xarray opens, with a mark for each finished region.

First the checks of a stored result before it is read, then the store and `open_result`. Zarr
validates the metadata. It reads a missing chunk as fill values, and it decompresses as much as a
chunk says that it holds: so chunks are checked here first.

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
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
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
from bouncing_disk_ros.regular_file import RegularFile, read_text
from bouncing_disk_ros.study.computation import Arrays, Field, Region, Study
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
    dtype: np.dtype[Any]
    dims: tuple[str, ...]

    @property
    def chunk_bytes(self) -> int:
        """Bytes of the numbers of one chunk."""
        return self.dtype.itemsize * math.prod(self.chunks)

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
            opened = RegularFile("path", file)
        except InputError:
            return not self.has_checksums and not file.exists()
        with opened:
            if not self.has_checksums:
                return opened.size <= 2 * most + 64
            if not _HEADER + _CHECKSUM <= opened.size <= most:
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


@dataclass(frozen=True)
class Damage:
    """What is damaged in a store.

    `marks`: regions with a damaged mark. `parts`: regions marked as done -> their damaged arrays.
    """

    axes: Sequence[str]
    context: bool
    marks: Sequence[int]
    parts: Mapping[int, Sequence[str]]

    @property
    def words(self) -> str:
        """What is damaged as one text, '' for nothing."""
        named = [f"axis {name}" for name in self.axes] + [_ALL_NEED] * self.context
        named += [f"the mark of part {number}" for number in self.marks]
        named += [f"part {number} ({', '.join(names)})" for number, names in self.parts.items()]
        more = f" and {len(named) - _SHOWN} more" if len(named) > _SHOWN else ""
        return "damaged: " + ", ".join(named[:_SHOWN]) + more if named else ""


def damage(found: Contents, regions: Iterable[tuple[str, int]]) -> Damage:
    """What is damaged; ValueError, LookupError, TypeError or ArithmeticError: no store of a study.

    `regions`: the axes that are cut, in the order in which regions are numbered, and the length of
    a region along each.
    """
    axes = [name for name, layout in found.arrays.items() if layout.dims == (name,)]
    fields = {name: one for name, one in found.arrays.items() if name not in (*axes, DONE)}
    sizes: dict[str, int] = {}
    for layout in fields.values():
        sizes |= zip(layout.dims, layout.shape, strict=True)
    counts = {dim: len(range(0, sizes[dim], length)) for dim, length in regions}
    if found.arrays[DONE].grid != (math.prod(counts.values()),):
        raise ValueError
    marks, parts = [], {}
    is_sound = functools.cache(found.is_sound)  # a chunk may belong to several regions
    for number, place in enumerate(itertools.product(*map(range, counts.values()))):
        if not found.file(DONE, (number,)).exists():
            continue
        if not found.is_sound(DONE, (number,)):
            marks.append(number)
            continue
        at = dict(zip(counts, place, strict=True))
        damaged = [
            name
            for name, layout in fields.items()
            if not is_sound(name, tuple(at.get(dim, 0) for dim in layout.dims))
        ]
        if damaged:
            parts[number] = damaged
    context = found.path / CONTEXT
    broken = os.path.lexists(context) and not _is_whole(context, sealed=found.has_checksums)
    return Damage(found.damaged(axes), broken, marks, parts)


def _stored_damage(found: Contents) -> Damage:
    """What is damaged in a store with checksums, which says how it is cut into regions."""
    try:
        return damage(found, found.attributes[REGIONS])
    except (ArithmeticError, LookupError, TypeError, ValueError):
        raise InputError("path", str(found.path), "a store that run made") from None


def _is_whole(path: Path, *, sealed: bool) -> bool:
    """Whether a group in a store can be read."""
    try:
        found = contents("output", path, sealed=sealed)
    except InputError:
        return False
    return not found.damaged(list(found.arrays))


def contents(field: str, path: Path, *, sealed: bool | None = None) -> Contents:
    """The checked metadata of a group; InputError, naming `field`, where it cannot be used.

    `sealed`: whether it must have checksums; None where its own identity says so. A link, a FIFO or
    a device anywhere in the folder is refused: nothing of it is opened.
    """
    folders = _folders(field, path)
    root = _metadata(field, path)
    try:
        group = zarr.open_group(str(path), mode="r", zarr_format=3, use_consolidated=False)
        attributes = group.attrs.asdict()
        if sealed is None:
            sealed = attributes["identity"].get("format") != WITHOUT_CHECKSUMS
    except Exception:  # noqa: BLE001 (Zarr has errors of many kinds for what it cannot use)
        raise _unusable(field, path, "It holds other data") from None
    names = sorted(folders.keys() - {CONTEXT, CONTEXT_DRAFT})
    if len(names) > RESULT_ARRAYS:
        raise InputError(field, str(path), f"a result of at most {RESULT_ARRAYS} arrays")
    found = {name: _metadata(field, path / name) for name in names}
    if sealed and (changed := _changed(attributes.get(DIGESTS), _digests(root, found))):
        why = f"The metadata of {changed} were damaged, changed, added or removed"
        raise _unusable(field, path, why)
    arrays = {name: _layout(field, path / name, group, one, sealed) for name, one in found.items()}
    for name, layout in arrays.items():
        if folders[name] > len(layout.shape):  # c/0/1: the last number is the name of a file
            raise _unusable(field, path, f"In {name!r} a folder is in the place of a chunk")
    return Contents(path, attributes, arrays, sealed)


def _unusable(field: str, path: Path, why: str) -> InputError:
    allowed = "a whole result of a study"
    return InputError(field, str(path), allowed, f"{why}. {_REMOVE}")


def seal(path: Path) -> dict[str, str]:
    """The attribute `digests` of a group: a digest for itself and for each array in it."""
    names = sorted(entry.name for entry in path.iterdir() if entry.is_dir())
    found = {name: _metadata("output", path / name) for name in names}
    return _digests(_metadata("output", path), found)


def _digests(root: Mapping[str, Any], arrays: Mapping[str, Any]) -> dict[str, str]:
    """The digest of the group covers its list of arrays, but no digest."""
    attributes = {**root.get("attributes", {}), DIGESTS: sorted(arrays)}
    nodes = {_ITSELF: {**root, "attributes": attributes}, **arrays}
    texts = {name: json.dumps([name, node], sort_keys=True) for name, node in nodes.items()}
    return {name: hashlib.sha256(text.encode()).hexdigest() for name, text in texts.items()}


def _changed(digests: object, wanted: Mapping[str, str]) -> str:
    """The names of nodes that have another digest, or only one of the two."""
    held = digests if isinstance(digests, dict) else {}
    names = sorted(held.keys() | wanted.keys())
    changed = [name for name in names if held.get(name) != wanted.get(name)]
    return ", ".join("the result" if name == _ITSELF else name for name in changed)


def _folders(field: str, path: Path, level: int = 0) -> dict[str, int]:
    """The folders in a folder of a store, and how many folders deep each is.

    InputError where anything in it is neither a folder nor a regular file.
    """
    if level > _DEEPEST:
        raise _unusable(field, path, "It is too deep")
    try:
        if not stat.S_ISDIR(path.lstat().st_mode):
            raise _unusable(field, path, "It is a link, or no folder")
        with os.scandir(path) as found:
            entries = list(found)
    except OSError as error:
        if level and isinstance(error, FileNotFoundError):
            return {}  # renamed in between by the run that writes it
        raise InputError(field, str(path), "a folder that can be read", str(error)) from None
    depths = {}
    for entry in entries:
        if entry.is_dir(follow_symlinks=False):
            inside = _folders(field, Path(entry), level + 1)
            depths[entry.name] = max((1 + depth for depth in inside.values()), default=0)
        elif not entry.is_file(follow_symlinks=False):
            raise _unusable(field, path, f"{entry.name!r} in it is a link, or no file")
    return depths


def _metadata(field: str, folder: Path) -> dict[str, Any]:
    """The metadata of an array or a group."""
    if not os.path.lexists(folder / _METADATA):
        raise _unusable(field, folder, f"It holds other data, or lacks {_METADATA}")
    text = read_text(field, folder / _METADATA, RESULT_METADATA)
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        found = None
    if not isinstance(found, dict) or found.get("zarr_format") != 3:
        raise _unusable(field, folder, f"Its {_METADATA} is damaged")
    return found


def _layout(
    field: str, folder: Path, group: zarr.Group, metadata: Mapping[str, Any], has_checksums: bool
) -> Layout:
    """The layout of an array, InputError where it is none that a study stores."""
    try:
        array = group[folder.name]
        dims = tuple(map(str, metadata.get("dimension_names") or [""] * array.ndim))
        layout = Layout(array.shape, array.chunks, array.dtype, dims)
        codecs = [codec["name"] for codec in metadata["codecs"]]
        key = metadata["chunk_key_encoding"]
        usual = key["name"] == "default" and key["configuration"]["separator"] == "/"
        few = len(dims) <= _DEEPEST - 2 and math.prod(layout.grid) <= RESULT_CHUNKS
        fits = few and usual and layout.dtype.kind in "biufU"
    except Exception:  # noqa: BLE001 (Zarr has errors of many kinds for what it cannot use)
        fits = False
    if not fits or (has_checksums and codecs != _CODECS):
        raise InputError(field, str(folder), "an array of a study's result", _REMOVE)
    if layout.chunk_bytes > RESULT_CHUNK:
        allowed = f"chunks of at most {RESULT_CHUNK} bytes"
        raise InputError(field, f"{folder}, chunks of {layout.chunk_bytes} bytes", allowed)
    return layout


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
        layouts = {name: layout for name, (_, layout) in self._arrays().items()}
        for name, layout in layouts.items():
            if found.arrays.get(name) != layout:
                raise InputError("output", str(self.path), f"{wanted_here} with the same arrays",
                                 f"{name} has another shape or type. {hint}")  # fmt: skip
        group = zarr.open_group(str(self.path), mode="r+")
        damaged = damage(replace(found, arrays=layouts), self._study.chunks.items())
        self._repair(group, damaged)
        if damaged.words:
            self.note = f"{self.path}: {damaged.words}; it is computed anew"
        return group

    def _check_older(self, found: Contents, hint: str) -> None:
        """InputError where a result of an older revision is not whole."""
        parts = _stored_damage(found).words if found.has_checksums else ""
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

    def _repair(self, group: zarr.Group, damaged: Damage) -> None:
        """Write damaged axes again, and take what else is damaged out of the store."""
        for name in damaged.axes:
            _writing(group, name)[...] = self._study.axes[name].values
        if damaged.context:
            shutil.rmtree(self.path / CONTEXT)
        for number in [*damaged.marks, *damaged.parts]:
            (self.path / DONE / "c" / str(number)).unlink()

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
        for name, (field, layout) in self._arrays().items():
            _array(group, name, field, layout)
        for name, axis in study.axes.items():
            _writing(group, name)[...] = axis.values
        group.attrs[DIGESTS] = seal(draft)
        draft.rename(self.path)
        return zarr.open_group(str(self.path), mode="r+")

    def _arrays(self) -> dict[str, tuple[Field, Layout]]:
        """What each array holds, and its layout."""
        study, found = self._study, {}
        for name, axis in study.axes.items():
            kind = str(axis.values.dtype)
            field = Field((name,), kind, axis.units, axis.long_name, axis.symbol)
            found[name] = field, self._layout(field, {})
        for name, field in study.fields.items():
            found[name] = field, self._layout(field, study.chunks)
        marks = Field(("region",), "uint8", "1", "whether the part is computed", fill=0)
        shape = (math.prod(study.region_counts()),)
        found[DONE] = marks, Layout(shape, (1,), np.dtype("uint8"), marks.dims)
        return found

    def _layout(self, field: Field, lengths: Mapping[str, int]) -> Layout:
        shape = tuple(self._study.shape[dim] for dim in field.dims)
        pairs = zip(field.dims, shape, strict=True)
        chunks = tuple(max(1, min(lengths.get(dim, size), size)) for dim, size in pairs)
        return Layout(shape, chunks, np.dtype(field.dtype), field.dims)

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
    elif damaged := _stored_damage(found).words:
        hint = f"{damaged[:1].upper()}{damaged[1:]}. Run the same study there again: it mends them."
        raise InputError("path", str(store), "a whole result of a study", hint)
    return opened(store)


def opened(path: Path) -> xr.Dataset:
    """Open a store that was checked."""
    result = xr.open_zarr(str(path), consolidated=False, chunks=None)
    for name in (DIGESTS, REGIONS):
        result.attrs.pop(name, None)
    return result


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
