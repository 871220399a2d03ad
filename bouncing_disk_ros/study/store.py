"""The store of a study: a Zarr group that xarray opens, with a mark for each finished region.

Each chunk ends with its crc32c, which is compared whenever the chunk is read. But a missing chunk
reads as fill values, links are followed, a chunk is decompressed to as much as it says that it
holds, and metadata, such as parameters, have no checksum in Zarr. So a stored result is checked
before it is read: its files and metadata by `contents`, its chunks by `damage`.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import shutil
import stat
import warnings
from collections.abc import Iterable, Mapping
from functools import cache, partial
from itertools import chain
from operator import attrgetter
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from xarray.backends import BackendArray, BackendEntrypoint
from xarray.core import indexing

import bouncing_disk_ros
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.executables import STUDIES
from bouncing_disk_ros.folders import PACKAGE
from bouncing_disk_ros.limits import RESULT_ARRAYS, RESULT_CHUNK, RESULT_CHUNKS, RESULT_METADATA
from bouncing_disk_ros.regular_file import not_made, read_bytes
from bouncing_disk_ros.study.by_name import definition_of
from bouncing_disk_ros.study.computation import Arrays, Field, Region, Study
from bouncing_disk_ros.study.stored_array import (
    METADATA,
    OLDER,
    SEALED,
    StoredArray,
    stored_array,
)

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
_HELD = f"{CONTEXT}/{BYTES}"
_DEEPEST = 8
_UNCHECKED = "made by an earlier version without checksums: damage in it cannot be seen"
_OTHER_NUMBERS = (
    "was made by an earlier version, which computed other numbers: they are shown as they are; "
    "remove it to compute them anew"
)
_HIDDEN = (DIGEST, EARLIER, REGIONS)
"""Attributes of a store that its result does not show."""
_KIND = attrgetter("dims", "dtype", "shape", "chunks")
"""What must be the same in an array that is continued."""
_SHOWN = 5
"""Damaged parts that a line names."""

Layout = dict[str, StoredArray]
"""Arrays of a store by name; of the context too, by its path."""


# --- what is checked before it is read ------------------------------------------------------------
class Contents(NamedTuple):
    """A store whose files can be opened and whose metadata are undamaged."""

    path: Path
    attributes: Mapping[str, Any]
    arrays: Layout
    sealed: bool  # whether it has checksums


def contents(field: str, path: Path) -> Contents:
    """Contents of a store; InputError, naming `field`, where it cannot be used.

    A link, a FIFO or a device anywhere in the folder is refused: nothing of it is opened.
    """
    why = _irregular(path)
    try:
        if not why:
            nodes = metadata_nodes(path)
            attributes = nodes[""]["attributes"]
            sealed = attributes["identity"].get("format") != WITHOUT_CHECKSUMS
            if not sealed or EARLIER in attributes or attributes[DIGEST] == metadata_digest(nodes):
                groups = {name for name, node in nodes.items() if node["node_type"] == "group"}
                arrays = {
                    name: stored_array(path / name, node)
                    for name, node in nodes.items()
                    if name not in groups
                }
                plain = all(nodes[name] == _group(nodes[name]["attributes"]) for name in groups)
                fits = plain and all(_fits(one, sealed=sealed) for one in arrays.values())
                if "" in groups and DONE in arrays and fits:
                    return Contents(path, attributes, arrays, sealed)
                why = "It lacks marks, or has an array that no study stores"
            else:
                why = "Its metadata were damaged, changed, added or removed"
    except Exception:  # noqa: BLE001 (errors of many kinds for what cannot be used)
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


def metadata_nodes(path: Path) -> dict[str, dict[str, Any]]:
    """Metadata of a store by the path of their group or array in it, '' for the store itself.

    Raises errors of many kinds where metadata cannot be read.
    """
    files = [file for folders in ("", "*/", "*/*/") for file in path.glob(folders + METADATA)]
    if len(files) > RESULT_ARRAYS:
        raise ValueError
    places = {file: "/".join(file.relative_to(path).parts[:-1]) for file in files}
    return {
        place: json.loads(read_bytes("path", file, RESULT_METADATA))
        for file, place in places.items()
    }


def metadata_digest(nodes: Mapping[str, Mapping[str, Any]]) -> str:
    """SHA-256 of all metadata of a store but this digest itself, and of the names of its arrays."""
    root = nodes[""]
    attributes = {name: one for name, one in root["attributes"].items() if name != DIGEST}
    every = {**nodes, "": {**root, "attributes": attributes}}
    named = {f"{name}/{METADATA}".lstrip("/"): node for name, node in every.items()}
    return hashlib.sha256(json.dumps(named, sort_keys=True).encode()).hexdigest()


def _fits(array: StoredArray, *, sealed: bool) -> bool:
    """Whether an array is of a kind and size that a study stores."""
    return (
        (array.codecs == SEALED if sealed else array.codecs in OLDER)
        and array.chunk_bytes <= RESULT_CHUNK
        and math.prod(array.counts) <= RESULT_CHUNKS
    )


def damage(field: str, found: Contents) -> dict[str, list[Path]]:
    """What is damaged in a store with checksums, in words -> what to remove from it.

    Axes, the context, and regions that are marked. Raises InputError, naming `field`, where the
    store does not say its regions.
    """
    arrays, damaged = dict(found.arrays), {}
    axes = {name: f"axis {name}" for name, one in arrays.items() if one.dims == (name,)}
    for name, words in {**axes, _HELD: "what all parts need"}.items():
        one = arrays.pop(name, None)
        if one is not None and not one.is_whole():
            damaged[words] = [found.path / name / "c"]
    is_sound = cache(lambda name, place: arrays[name].is_sound(place))  # of several regions
    try:
        named = (zip(one.dims, one.shape, strict=True) for one in found.arrays.values())
        sizes = set(chain.from_iterable(named))  # one of each dimension
        shape, cuts = dict(sizes), dict(found.attributes[REGIONS])
        counts = [-(-shape[dim] // length) for dim, length in cuts.items()]
        if len(shape) < len(sizes) or arrays[DONE].shape != (math.prod(counts),):
            raise ValueError
        for number, region in enumerate(np.ndindex(*counts)):
            chunk = {**dict(zip(cuts, region, strict=True)), REGION: number}
            places = {
                name: tuple(chunk.get(dim, 0) for dim in one.dims) for name, one in arrays.items()
            }
            mark = arrays[DONE].file(places[DONE])
            if not mark.exists():
                continue
            names = [name for name, place in places.items() if not is_sound(name, place)]
            if names:
                files = [mark, *(arrays[name].file(places[name]) for name in names)]
                damaged[f"part {number} ({', '.join(names)})"] = files
    except (ArithmeticError, LookupError, TypeError, ValueError):
        raise InputError(field, str(found.path), "a store that run made") from None
    return damaged


def _words(damaged: Mapping[str, object]) -> str:
    """What is damaged as one text, '' for nothing."""
    more = f" and {len(damaged) - _SHOWN} more" if len(damaged) > _SHOWN else ""
    return f"damaged: {', '.join(list(damaged)[:_SHOWN])}{more}" if damaged else ""


# --- the store ------------------------------------------------------------------------------------
class Store:
    """The growing result of one study in a folder; a region is marked after it was written.

    `note`: what the user is to know of a store that was there: damaged parts that are computed
    anew, missing checksums, numbers of an older revision; '' else.
    `sealed`: whether its chunks have checksums; stores of 0.2 have none.
    """

    def __init__(self, path: Path, study: Study) -> None:
        """Make the store, or open the one that an earlier run of the same study left there."""
        self.path, self._study, self.note = path, study, ""
        try:
            # a link that leads nowhere counts as something that is there
            self._attributes, self._arrays = (
                self._opened() if os.path.lexists(path) else self._made()
            )
        except OSError as error:
            raise not_made("output", path, "a folder that can be written", error) from error
        self.sealed = self._arrays[DONE].codecs == SEALED
        self._done: NDArray[np.uint8] = self._arrays[DONE].read((slice(None),), whole=False)

    def _identity(self) -> dict[str, Any]:
        study = self._study
        return {
            "format": FORMAT,
            "study": study.name,
            "revision": study.revision,
            "parameters": json.loads(json.dumps(study.parameters)),
        }

    def _opened(self) -> tuple[Mapping[str, Any], Layout]:
        """The store that is there, after all of it was checked; damaged parts are taken out."""
        found = contents("output", self.path)
        if not found.sealed:
            self.note = f"{self.path} was {_UNCHECKED}"
        older = self._older(found)
        damaged = damage("output", found) if found.sealed else {}
        if older:
            if not damaged and np.all(found.arrays[DONE].read((slice(None),), whole=False)):
                self.note = "; ".join(filter(None, (self.note, f"{self.path} {_OTHER_NUMBERS}")))
                return found.attributes, found.arrays
            raise self._refusal("a whole result", f"{_words(damaged) or 'unfinished'}: t{older}")
        for name, wanted in layout(self.path, self._study).items():
            array = found.arrays.get(name)
            if array is None or _KIND(array) != _KIND(wanted):
                why = f"{name} has another shape or type"
                raise self._refusal("an unfinished result with the same arrays", why)
        if damaged:
            self.note = f"{self.path}: {_words(damaged)}; it is computed anew"
            for place in chain(*damaged.values()):
                shutil.rmtree(place) if place.is_dir() else place.unlink(missing_ok=True)
            self._write_axes(found.arrays)
        return found.attributes, found.arrays

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

    def _made(self) -> tuple[Mapping[str, Any], Layout]:
        """A new store: made beside its place, so that a half-made one is never found."""
        if (self.path.parent / METADATA).exists():  # it would no longer be whole
            hint = f"This is a result itself. Its folder, {self.path.parent.parent}, continues it."
            raise InputError("output", str(self.path.parent), "a folder of results", hint)
        study, context = self._study, self._study.context()  # it may take long, or be refused
        draft = self.path.with_name(f".{self.path.name}.draft")
        if draft.is_dir() and not draft.is_symlink():
            shutil.rmtree(draft)
        else:
            draft.unlink(missing_ok=True)
        draft.mkdir(parents=True)  # fails where a link has taken its place
        attributes: dict[str, Any] = {
            "identity": self._identity(),
            "title": study.title,
            "source": f"{PACKAGE} {bouncing_disk_ros.__version__}",
            REGIONS: [list(cut) for cut in study.chunks.items()],
            **{f"parameter_{name}": value for name, value in study.parameters.items()},
        }
        arrays = layout(draft, study)
        nodes: dict[str, dict[str, Any]] = {"": _group(attributes)}
        if context:
            packed, about = _packed(context)
            kept = StoredArray(
                draft / _HELD, ("",), packed.dtype, packed.shape,
                (max(1, min(packed.size, RESULT_CHUNK)),),
                attributes={"arrays": about},
            )  # fmt: skip
            arrays[_HELD], nodes[CONTEXT] = kept, _group({})
        nodes |= {name: array.metadata() for name, array in arrays.items()}
        attributes[DIGEST] = metadata_digest(nodes)
        for name, node in nodes.items():
            file = draft / name / METADATA
            file.parent.mkdir(exist_ok=True)
            file.write_text(json.dumps(node, indent=2))
        self._write_axes(arrays)
        if context:
            kept.write_all(packed)
        draft.rename(self.path)
        return attributes, {
            name: array._replace(path=self.path / name) for name, array in arrays.items()
        }

    def _write_axes(self, arrays: Layout) -> None:
        for name, axis in self._study.axes.items():
            arrays[name].write_all(axis.values)

    def is_done(self, region: Region) -> bool:
        """Whether this region is in the store."""
        return bool(self._done[region.number])

    @property
    def regions_done(self) -> int:
        """How many regions are in the store."""
        return int(self._done.sum())

    def put(self, region: Region, arrays: Arrays) -> None:
        """Put a region into the store, on any thread; it counts when it is marked."""
        put(self._arrays, self._study, region, arrays)

    def mark(self, region: Region) -> None:
        """Mark a region that is in the store as done."""
        self._arrays[DONE].write((region.number,), np.ones(1, np.uint8))
        self._done[region.number] = 1

    def read(self, region: Region) -> Arrays:
        """A region that is in the store."""
        return {
            name: self._arrays[name].read(region.select(field.dims))
            for name, field in self._study.fields.items()
        }

    def result(self) -> xr.Dataset:
        """What is in the store, as `open_result` gives it."""
        return opened(self.path, self._attributes, self._arrays)

    def context(self) -> Arrays:
        """What all regions need, as it is stored."""
        if _HELD not in self._arrays:
            return self._study.context()  # none, or begun by an earlier version
        held = self._arrays[_HELD]
        if not all(held.file(place).exists() for place in np.ndindex(held.counts)):  # taken out
            packed, about = _packed(self._study.context())
            if about != held.attributes["arrays"]:
                raise self._refusal("a whole result", "What all parts need is another here")
            held.write_all(packed)
        try:
            return _unpacked(held.read((slice(None),)), held.attributes["arrays"])
        except (KeyError, TypeError, ValueError):
            raise self._refusal("a whole result", "What all parts need is damaged") from None


def layout(path: Path, study: Study) -> Layout:
    """The arrays of a study in the folder of its store."""
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
        found[name] = StoredArray(
            path / name, tuple(field.dims), np.dtype(field.dtype).newbyteorder("<"), shape,
            tuple(chunks), _fill(field), _described(field),
        )  # fmt: skip
    return found


def _fill(field: Field) -> float | int:
    """The value of an array where nothing was computed yet, as its type holds it."""
    floats = np.dtype(field.dtype).kind == "f"
    return field.fill if floats else int(np.nan_to_num(field.fill))


def _described(field: Field) -> dict[str, Any]:
    """Attributes of an array."""
    attributes: dict[str, Any] = {"units": field.units, "long_name": field.long_name}
    if field.symbol:
        attributes["symbol"] = field.symbol
    if field.flags:
        attributes["flag_values"] = list(field.flags)
        attributes["flag_meanings"] = " ".join(field.flags.values())
    return attributes


def _group(attributes: dict[str, Any]) -> dict[str, Any]:
    """Metadata of a group, as Zarr writes them."""
    return {"attributes": attributes, "zarr_format": 3, "node_type": "group"}


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


def put(found: Layout, study: Study, region: Region, arrays: Arrays) -> None:
    """Put a region into the arrays of a store, on any thread of any process."""
    for name in study.fields:
        array = found[name]
        slices = [
            region.slices.get(dim, slice(0, n))
            for dim, n in zip(array.dims, array.shape, strict=True)
        ]
        values = np.broadcast_to(arrays[name], [one.stop - one.start for one in slices])
        array.write(
            tuple(one.start // n for one, n in zip(slices, array.chunks, strict=True)), values
        )


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
    return opened(store, found.attributes, found.arrays)


def opened(path: Path, attributes: Mapping[str, Any], arrays: Layout) -> xr.Dataset:
    """Dataset of a store that was checked; its arrays are read when they are used.

    Parts that were not computed yet have fill values. A whole result in use whose parts are removed
    raises FailedError.
    """
    whole = bool(np.all(arrays[DONE].read((slice(None),), whole=False)))
    shown = {name: one for name, one in attributes.items() if name not in _HIDDEN}
    return xr.open_dataset(path, engine=_Opened, attributes=shown, arrays=arrays, whole=whole)


class _Opened(BackendEntrypoint):
    """What xarray opens a store with."""

    def open_dataset(  # type: ignore[override]  # arguments are added as xarray's guide says
        self,
        filename_or_obj: Any,  # noqa: ARG002
        *,
        drop_variables: str | Iterable[str] | None = None,  # noqa: ARG002
        attributes: Mapping[str, Any],
        arrays: Layout,
        whole: bool,
    ) -> xr.Dataset:
        lazy = {
            name: indexing.LazilyIndexedArray(_Lazy(one, whole)) for name, one in arrays.items()
        }
        found = {
            name: xr.Variable(one.dims, lazy[name], one.attributes)
            for name, one in arrays.items()
            if name != _HELD
        }
        return xr.Dataset(found, attrs=attributes)


class _Lazy(BackendArray):
    """An array that xarray reads when it is used."""

    def __init__(self, array: StoredArray, whole: bool) -> None:
        self.shape, self.dtype = array.shape, array.dtype
        self._read = partial(array.read, whole=whole)

    def __getitem__(self, key: indexing.ExplicitIndexer) -> Any:
        basic = indexing.IndexingSupport.BASIC
        return indexing.explicit_indexing_adapter(key, self.shape, basic, self._read)


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
