"""The store of a study: a Zarr group that xarray opens, with a mark for each finished region.

Zarr makes and reads it. `put` writes the chunks of a region, with the bytes of Zarr: a third of the
work, and without Zarr's threads, which hold the GIL. Each chunk ends with its crc32c, which Zarr
compares whenever it reads the chunk. But Zarr reads a missing chunk as fill values, follows links,
decompresses as much as a chunk says that it holds, and has no checksum of metadata, such as
parameters. So a stored result is checked before it is read: its files and metadata by `contents`,
its chunks by `damage`.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import shutil
import stat
import uuid
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import cache
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple

import google_crc32c
import numpy as np
import xarray as xr
import zarr
from numcodecs import Blosc
from numpy.typing import NDArray
from zarr.codecs import BloscCodec, BytesCodec, Crc32cCodec, ZstdCodec

import bouncing_disk_ros
from bouncing_disk_ros.errors import FailedError, InputError
from bouncing_disk_ros.executables import STUDIES
from bouncing_disk_ros.folders import PACKAGE
from bouncing_disk_ros.limits import RESULT_ARRAYS, RESULT_CHUNK, RESULT_CHUNKS, RESULT_METADATA
from bouncing_disk_ros.regular_file import not_made, read_bytes
from bouncing_disk_ros.study.by_name import definition_of
from bouncing_disk_ros.study.computation import Arrays, Field, Region, Study

FORMAT = 3
WITHOUT_CHECKSUMS = 2
"""The format of version 0.2: its chunks and metadata cannot be checked for damage."""
DIGEST, REGIONS = "digest", "regions"
"""Attributes: SHA-256 of all metadata; the axes that are cut, with the length of a region along
each."""
EARLIER = "digests"
"""The attribute of version 0.3.0 in place of DIGEST: of its stores only the chunks are checked."""
CONTEXT, BYTES = "context", "bytes"
"""The group of what all regions need, which xarray does not show, and the array in it."""
DONE, REGION = "region_done", "region"
"""The array of marks, and its axis."""
RESULT = "result.zarr"
"""The store in the output folder of a study's command."""
COMPRESSORS = (BloscCodec(cname="lz4", clevel=5, shuffle="shuffle"), Crc32cCodec())
"""Basins take less room so than by Zarr's default, and two thirds of the time."""
_BLOSC = Blosc(cname="lz4", clevel=5, shuffle=Blosc.SHUFFLE)
_CODECS = [BytesCodec, BloscCodec, Crc32cCodec]
_OLDER_CODECS = {BytesCodec, BloscCodec, ZstdCodec}
_HEADER, _CHECKSUM = 16, 4
"""Bytes before and after the numbers of a chunk: Blosc's header, the crc32c."""
_HELD = f"{CONTEXT}/{BYTES}"
_METADATA = "zarr.json"
_DEEPEST = 8
_ALL_CHUNKS = {"write_empty_chunks": True}
_UNCHECKED = "made by an earlier version without checksums: damage in it cannot be seen"
_OTHER_NUMBERS = (
    "was made by an earlier version, which computed other numbers: they are shown as they are; "
    "remove it to compute them anew"
)
_SHOWN = 5
"""Damaged parts that a line names."""

Place = tuple[int, ...]
Layout = dict[str, tuple[Field, Place, Place]]
"""Arrays of a store by name: what each holds, its shape, the shape of its chunks."""


# --- what is checked before it is read ------------------------------------------------------------
class Contents(NamedTuple):
    """A store whose files can be opened and whose metadata are undamaged."""

    path: Path
    attributes: Mapping[str, Any]
    arrays: dict[str, zarr.Array]  # the context too
    sealed: bool  # whether it has checksums


def contents(field: str, path: Path) -> Contents:
    """Contents of a store; InputError, naming `field`, where it cannot be used.

    A link, a FIFO or a device anywhere in the folder is refused: nothing of it is opened.
    """
    why = _irregular(path)
    try:
        if not why:
            digest = metadata_digest(path)
            group = zarr.open_group(str(path), mode="r", zarr_format=3, use_consolidated=False)
            sealed = group.attrs["identity"].get("format") != WITHOUT_CHECKSUMS
            if not sealed or EARLIER in group.attrs or group.attrs[DIGEST] == digest:
                nodes = dict(group.members(max_depth=1))
                arrays = {name: one for name, one in nodes.items() if isinstance(one, zarr.Array)}
                if DONE in arrays and all(_fits(one, sealed=sealed) for one in arrays.values()):
                    return Contents(path, group.attrs.asdict(), arrays, sealed)
                why = "It lacks marks, or has an array that no study stores"
            else:
                why = "Its metadata were damaged, changed, added or removed"
    except Exception:  # noqa: BLE001 (Zarr has errors of many kinds for what it cannot use)
        why = "It holds other data, damaged metadata, or those of another version"
    hint = f"{why}. Remove it, or choose another output"
    raise InputError(field, str(path), "a whole result of a study", hint)


def _irregular(path: Path) -> str:
    """Why nothing in a folder may be opened, '' where it holds but folders and regular files."""
    inside = (Path(folder, name) for folder, *names in os.walk(path) for name in chain(*names))
    for place in chain([path], inside):
        try:
            mode = place.lstat().st_mode
        except FileNotFoundError:
            continue  # renamed in between by the run that writes it
        if not (stat.S_ISDIR(mode) or stat.S_ISREG(mode)):
            return f"{place.name!r} is a link, or no file"
        if len(place.parts) > len(path.parts) + _DEEPEST:
            return "It is too deep"
    return ""


def metadata_digest(path: Path) -> str:
    """SHA-256 of all metadata of a store but this digest itself, and of the names of its arrays.

    Raises errors of many kinds where metadata cannot be read.
    """
    files = [file for folders in ("", "*/", "*/*/") for file in path.glob(folders + _METADATA)]
    if len(files) > RESULT_ARRAYS:
        raise ValueError
    nodes = {
        str(file.relative_to(path)): json.loads(read_bytes("path", file, RESULT_METADATA))
        for file in files
    }
    nodes[_METADATA].get("attributes", {}).pop(DIGEST, None)
    return hashlib.sha256(json.dumps(nodes, sort_keys=True).encode()).hexdigest()


def _fits(array: zarr.Array, *, sealed: bool) -> bool:
    """Whether an array is of a kind and size that a study stores."""
    codecs = [*map(type, array.metadata.codecs)]
    return (
        (codecs == _CODECS if sealed else _OLDER_CODECS.issuperset(codecs))
        and array.dtype.kind in "biufU"
        and _chunk_bytes(array) <= RESULT_CHUNK
        and array.nchunks <= RESULT_CHUNKS
    )


def damage(field: str, found: Contents) -> dict[str, list[Path]]:
    """What is damaged in a store with checksums, in words -> what to remove from it.

    Axes, the context, and regions that are marked. Raises InputError, naming `field`, where the
    store does not say its regions.
    """
    arrays, damaged = dict(found.arrays), {}
    axes = {name: f"axis {name}" for name, one in arrays.items() if _dims(one) == (name,)}
    for name, words in {**axes, _HELD: "what all parts need"}.items():
        one = arrays.pop(name, None)
        if one is not None and not _is_whole(one):
            damaged[words] = [found.path / name / "c"]
    is_sound = cache(lambda name, place: _is_sound(arrays[name], place))  # of several regions
    try:
        named = (zip(_dims(one), one.shape, strict=True) for one in found.arrays.values())
        sizes = set(chain.from_iterable(named))  # one of each dimension
        shape, cuts = dict(sizes), dict(found.attributes[REGIONS])
        counts = [-(-shape[dim] // length) for dim, length in cuts.items()]
        if len(shape) < len(sizes) or arrays[DONE].shape != (math.prod(counts),):
            raise ValueError
        for number, region in enumerate(np.ndindex(*counts)):
            chunk = {**dict(zip(cuts, region, strict=True)), REGION: number}
            places = {
                name: tuple(chunk.get(dim, 0) for dim in _dims(one)) for name, one in arrays.items()
            }
            mark = _file(arrays[DONE], places[DONE])
            if not mark.exists():
                continue
            names = [name for name, place in places.items() if not is_sound(name, place)]
            if names:
                files = [mark, *(_file(arrays[name], places[name]) for name in names)]
                damaged[f"part {number} ({', '.join(names)})"] = files
    except (ArithmeticError, LookupError, TypeError, ValueError):
        raise InputError(field, str(found.path), "a store that run made") from None
    return damaged


def _words(damaged: Mapping[str, object]) -> str:
    """What is damaged as one text, '' for nothing."""
    more = f" and {len(damaged) - _SHOWN} more" if len(damaged) > _SHOWN else ""
    return f"damaged: {', '.join(list(damaged)[:_SHOWN])}{more}" if damaged else ""


def _is_whole(array: zarr.Array) -> bool:
    """Whether all chunks of an array are there and undamaged."""
    return all(_is_sound(array, place) for place in np.ndindex(array.cdata_shape))


def _is_sound(array: zarr.Array, place: Place) -> bool:
    """Whether a chunk is there, with the checksum that it holds and as many bytes as it shall.

    Zarr would decompress each chunk to find the same: from two times to fifteen times as long.
    """
    size = _chunk_bytes(array)
    try:
        data = read_bytes("path", _file(array, place), _HEADER + size + _CHECKSUM)
    except InputError:
        return False
    stored = int.from_bytes(data[-_CHECKSUM:], "little")
    numbers = int.from_bytes(data[4:8], "little")  # as Blosc will decompress
    return google_crc32c.value(data[:-_CHECKSUM]) == stored and numbers == size


def _file(array: zarr.Array, place: Place) -> Path:
    return Path(array.store.root, array.path, array.metadata.encode_chunk_key(place))


def _dims(array: zarr.Array) -> tuple[str, ...]:
    return tuple(map(str, array.metadata.dimension_names or [""] * array.ndim))


def _chunk_bytes(array: zarr.Array) -> int:
    return int(array.dtype.itemsize * math.prod(array.chunks))


# --- the store ------------------------------------------------------------------------------------
class Store:
    """The growing result of one study in a folder; a region is marked after it was written.

    `note`: what the user is to know of a store that was there: damaged parts that are computed
    anew, missing checksums, numbers of an older revision; '' else.
    `sealed`: whether its chunks have checksums; to a store of 0.2, without them, Zarr writes.
    """

    def __init__(self, path: Path, study: Study) -> None:
        """Make the store, or open the one that an earlier run of the same study left there."""
        self.path, self._study, self.note, self.sealed = path, study, "", True
        try:
            # a link that leads nowhere counts as something that is there
            self._group = self._opened() if os.path.lexists(path) else self._made()
        except OSError as error:
            raise not_made("output", path, "a folder that can be written", error) from error
        self._done: NDArray[np.uint8] = np.asarray(self._group[DONE][:])
        self._fields = field_layout(study)

    def _identity(self) -> dict[str, Any]:
        study = self._study
        return {
            "format": FORMAT,
            "study": study.name,
            "revision": study.revision,
            "parameters": json.loads(json.dumps(study.parameters)),
        }

    def _opened(self) -> zarr.Group:
        """The store that is there, after all of it was checked; damaged parts are taken out."""
        found = contents("output", self.path)
        self.sealed = found.sealed
        if not found.sealed:
            self.note = f"{self.path} was {_UNCHECKED}"
        older = self._older(found)
        damaged = damage("output", found) if found.sealed else {}
        group = zarr.open_group(str(self.path), mode="r+")
        if older:
            if not damaged and np.all(found.arrays[DONE][:]):
                self.note = "; ".join(filter(None, (self.note, f"{self.path} {_OTHER_NUMBERS}")))
                return group
            raise self._refusal("a whole result", f"{_words(damaged) or 'unfinished'}: t{older}")
        for name, (field, shape, chunks) in layout(self._study).items():
            array, wanted = found.arrays.get(name), (shape, chunks, np.dtype(field.dtype))
            if (
                array is None
                or (array.shape, array.chunks, array.dtype) != wanted
                or _dims(array) != field.dims
            ):
                why = f"{name} has another shape or type"
                raise self._refusal("an unfinished result with the same arrays", why)
        if damaged:
            self.note = f"{self.path}: {_words(damaged)}; it is computed anew"
            for place in chain(*damaged.values()):
                shutil.rmtree(place) if place.is_dir() else place.unlink(missing_ok=True)
            self._write_axes(group)
        return group

    def _refusal(self, allowed: str, why: str) -> InputError:
        hint = f"{why}. Choose another output, or remove it."
        return InputError("output", str(self.path), f"a new folder, or {allowed}", hint)

    def _older(self, found: Contents) -> str:
        """How the result of an older revision differs from this study, '' where none does.

        InputError for another study or other parameters. A whole result of an older revision is
        read as it is.
        """
        identity, wanted = found.attributes["identity"], self._identity()
        if not found.sealed:
            wanted["format"] = WITHOUT_CHECKSUMS
        if not isinstance(identity.get("parameters"), dict):
            raise self._refusal("an unfinished result of this study", "It holds other data")
        identity = _completed(identity, wanted)
        if identity == wanted:
            return ""
        difference = f"here {_difference(identity, wanted)}"
        before, now = identity.get("revision"), wanted["revision"]
        if {**identity, "revision": now} != wanted or type(before) is not int or before > now:
            allowed = "an unfinished result with the same parameters"
            raise self._refusal(allowed, f"T{difference}")
        return difference

    def _made(self) -> zarr.Group:
        """A new store: made beside its place, so that a half-made one is never found."""
        packed, about = _packed(self._study.context())  # first: it may take long, or be refused
        draft = self.path.with_name(f".{self.path.name}.draft")
        if draft.is_dir() and not draft.is_symlink():
            shutil.rmtree(draft)
        else:
            draft.unlink(missing_ok=True)
        draft.mkdir(parents=True)  # fails where a link has taken its place
        study = self._study
        attributes = {  # all at once: each one set later writes all metadata again
            "identity": self._identity(),
            "title": study.title,
            "source": f"{PACKAGE} {bouncing_disk_ros.__version__}",
            REGIONS: list(study.chunks.items()),
            **{f"parameter_{name}": value for name, value in study.parameters.items()},
        }
        group = zarr.open_group(str(draft), mode="w-", attributes=attributes)
        for name, array in layout(study).items():
            _create_array(group, name, *array)
        self._write_axes(group)
        if about:
            group.create_group(CONTEXT).create_array(
                BYTES, data=packed, attributes={"arrays": about}, compressors=COMPRESSORS,
                config=_ALL_CHUNKS,
            )  # fmt: skip
        group.attrs[DIGEST] = metadata_digest(draft)
        draft.rename(self.path)
        return zarr.open_group(str(self.path), mode="r+")

    def _write_axes(self, group: zarr.Group) -> None:
        for name, axis in self._study.axes.items():
            _writing(group, name)[...] = axis.values

    def is_done(self, region: Region) -> bool:
        """Whether this region is in the store."""
        return bool(self._done[region.number])

    @property
    def regions_done(self) -> int:
        """How many regions are in the store."""
        return int(self._done.sum())

    def put(self, region: Region, arrays: Arrays) -> None:
        """Put a region into the store, on any thread; it counts when it is marked."""
        if self.sealed:
            put(self.path, self._fields, region, arrays)
            return
        for name, field in self._study.fields.items():
            _writing(self._group, name)[region.select(field.dims)] = arrays[name]

    def mark(self, region: Region) -> None:
        """Mark a region that is in the store as done."""
        if self.sealed:
            _write_chunk(self.path / DONE, (region.number,), np.ones(1, np.uint8))
        else:
            _writing(self._group, DONE)[region.number] = 1
        self._done[region.number] = 1

    def read(self, region: Region) -> Arrays:
        """A region that is in the store."""
        return {
            name: np.asarray(self._group[name][region.select(field.dims)])
            for name, field in self._study.fields.items()
        }

    def context(self) -> Arrays:
        """What all regions need, as it is stored."""
        if CONTEXT not in self._group:
            return self._study.context()  # none, or begun by an earlier version
        held = self._group[_HELD]
        if held.nchunks_initialized < held.nchunks:  # it was damaged, and taken out
            packed, about = _packed(self._study.context())
            if about != held.attrs["arrays"]:
                raise self._refusal("a whole result", "What all parts need is another here")
            _writing(self._group, _HELD)[...] = packed
        try:
            return _unpacked(np.asarray(held[...]), held.attrs["arrays"])
        except (KeyError, TypeError, ValueError):
            raise self._refusal("a whole result", "What all parts need is damaged") from None


def layout(study: Study) -> Layout:
    """What each array of a store holds, its shape, and the shape of its chunks."""
    fields = {
        name: Field((name,), str(axis.values.dtype), axis.units, axis.long_name, axis.symbol)
        for name, axis in study.axes.items()
    }
    marks = Field((REGION,), "uint8", "1", "whether the part is computed", fill=0)
    sizes = {**study.shape, REGION: math.prod(study.region_counts())}
    lengths = {**study.chunks, REGION: 1}
    found = {}
    for name, field in {**fields, **study.fields, DONE: marks}.items():
        cut = {} if name in fields else lengths
        shape = tuple(sizes[dim] for dim in field.dims)
        chunks = (max(1, min(cut.get(dim, sizes[dim]), sizes[dim])) for dim in field.dims)
        found[name] = field, shape, tuple(chunks)
    return found


def _fill(field: Field) -> float | int:
    """The value of an array where nothing was computed yet, as its type holds it."""
    floats = np.dtype(field.dtype).kind == "f"
    return field.fill if floats else int(np.nan_to_num(field.fill))


def _create_array(group: zarr.Group, name: str, field: Field, shape: Place, chunks: Place) -> None:
    attributes: dict[str, Any] = {"units": field.units, "long_name": field.long_name}
    if field.symbol:
        attributes["symbol"] = field.symbol
    if field.flags:
        attributes["flag_values"] = list(field.flags)
        attributes["flag_meanings"] = " ".join(field.flags.values())
    group.create_array(
        name, shape=shape, chunks=chunks, dtype=field.dtype, fill_value=_fill(field),
        dimension_names=field.dims, attributes=attributes, compressors=COMPRESSORS,
    )  # fmt: skip


def _packed(arrays: Arrays) -> tuple[NDArray[np.uint8], list[Any]]:
    """The bytes of all arrays in a row, as each array costs its files; what `_unpacked` needs."""
    whole = {name: np.asarray(one) for name, one in arrays.items()}
    about = [[name, one.dtype.str, list(one.shape)] for name, one in whole.items()]
    return np.frombuffer(b"".join(one.tobytes() for one in whole.values()), np.uint8), about


def _unpacked(packed: NDArray[np.uint8], about: list[tuple[str, str, list[int]]]) -> Arrays:
    """Arrays from their bytes in a row; about: name, type and shape of each."""
    found, begin = {}, 0
    for name, kind, shape in about:
        end = begin + np.dtype(kind).itemsize * math.prod(shape)
        found[name] = packed[begin:end].view(kind).reshape(shape)
        begin = end
    return found


def field_layout(study: Study) -> Layout:
    """The `layout` of the fields of a study alone."""
    kept = layout(study)
    return {name: kept[name] for name in study.fields}


def put(path: str | Path, fields: Layout, region: Region, arrays: Arrays) -> None:
    """Put a region into the sealed store at `path`, on any thread of any process."""
    for name, (field, shape, chunk) in fields.items():
        slices = [
            region.slices.get(dim, slice(0, n)) for dim, n in zip(field.dims, shape, strict=True)
        ]
        values = np.asarray(arrays[name], field.dtype)
        if values.shape != chunk:  # at an edge: Zarr stores whole chunks
            part = tuple(slice(one.stop - one.start) for one in slices)
            values, given = np.full(chunk, _fill(field), field.dtype), values
            values[part] = given
        place = tuple(one.start // n for one, n in zip(slices, chunk, strict=True))
        _write_chunk(Path(path, name), place, values)


def _write_chunk(array: Path, place: Place, values: NDArray[np.generic]) -> None:
    """Write a chunk of an array in a folder, as Zarr does: under a passing name first.

    OSError where the array's folder is there no more: what is written would belong to no store.
    """
    data = _BLOSC.encode(np.ascontiguousarray(values))
    file = Path(array, "c", *map(str, place))
    for folder in reversed(file.relative_to(array).parents[:-1]):
        Path(array, folder).mkdir(exist_ok=True)
    passing = file.with_name(f"{file.name}.{uuid.uuid4().hex}.partial")
    try:
        with passing.open("wb") as open_file:
            open_file.write(data)
            open_file.write(google_crc32c.value(data).to_bytes(_CHECKSUM, "little"))
        passing.replace(file)
    except OSError:
        passing.unlink(missing_ok=True)
        raise


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
    if not found.sealed:
        warnings.warn(f"{store} was {_UNCHECKED}", RuntimeWarning, stacklevel=2)
    elif damaged := _words(damage("path", found)):
        hint = f"{damaged[:1].upper()}{damaged[1:]}. Run the same study there again: it mends them."
        raise InputError("path", str(store), "a whole result of a study", hint)
    return opened(store)


def opened(path: Path) -> xr.Dataset:
    """Open a store that was checked."""
    result = xr.open_zarr(str(path), consolidated=False, chunks=None)
    for name in (DIGEST, EARLIER, REGIONS):
        result.attrs.pop(name, None)
    return result


@contextmanager
def kept_whole(path: Path) -> Iterator[None]:
    """Within it a whole store is read, in which Zarr takes fill values for a missing chunk.

    FailedError at the end, whatever else failed, where chunks were removed, or the store.
    """
    try:
        yield
    finally:
        lacking: list[str] = []
        with suppress(FileNotFoundError):
            lacking = ["all"]
            arrays = [one for _, one in zarr.open_group(str(path), mode="r").arrays()]
            lacking = [
                one.basename for one in arrays
                if [*map(type, one.metadata.codecs)] == _CODECS
                and one.nchunks_initialized < one.nchunks
            ]  # fmt: skip
        if lacking:
            what = ", ".join(sorted(lacking))
            raise FailedError(f"{path} was moved, or parts were removed, while in use: {what}")


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
