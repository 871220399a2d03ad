"""The store of a study: a Zarr group that xarray opens, with a mark for each finished region.

Before it the lock that lets one run at a time write to a folder; after it `open_result` and the
export to NetCDF.
"""

from __future__ import annotations

import fcntl
import importlib.util
import json
import math
import os
import shutil
import stat
import uuid
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
import zarr
from numpy.typing import NDArray

import bouncing_disk_ros
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.executables import STUDIES
from bouncing_disk_ros.study.computation import Arrays, Axis, Field, Region, Study
from bouncing_disk_ros.study.store_check import (
    COMPRESSORS,
    CONTEXT,
    CONTEXT_DRAFT,
    DIGESTS,
    FORMAT,
    WITHOUT_CHECKSUMS,
    Contents,
    Layout,
    contents,
    damaged_parts,
    seal,
)
from bouncing_disk_ros.study.studies import definition_of

_AS_IT_IS = os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
"""Open what stands there itself: no link is followed, no FIFO waited for."""
_TOKEN_LENGTH = 32


@contextmanager
def exclusive_lock(path: Path) -> Iterator[str]:
    """Hold the folder; InputError where another run, of this process or another one, holds it.

    The lock is on a hidden file beside the folder. The system drops it with the process, whatever
    ends that. Gives the token that this run writes into the file. (`filelock` follows links there,
    and leaves its file.)
    """
    lock = _lock_of(path)
    try:
        lock.parent.mkdir(parents=True, exist_ok=True)
        descriptor = os.open(lock, os.O_CREAT | os.O_RDWR | _AS_IT_IS, 0o666)
    except OSError as error:
        allowed = "a folder that can be written"
        raise InputError("output", str(path), allowed, str(error)) from error
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            status = os.fstat(descriptor)
            held = status.st_nlink > 0  # else its last holder has just removed it
        except BlockingIOError:
            held = False
        if held and (not stat.S_ISREG(status.st_mode) or status.st_nlink > 1):
            hint = f"{lock} is none, or a file with another name. Remove it."
            raise InputError("output", str(path), "a lock that is a regular file", hint)
        if not held:
            hint = "Wait for that run to end, or choose another output."
            raise InputError("output", str(path), "a result that no other run is writing", hint)
        token = uuid.uuid4().hex
        try:
            os.ftruncate(descriptor, 0)
            os.write(descriptor, token.encode())
            yield token
        finally:
            lock.unlink(missing_ok=True)
    finally:
        os.close(descriptor)


def token_of(path: str) -> str:
    """The token of the run that holds a folder, '' where none does or the folder is not seen."""
    try:
        descriptor = os.open(_lock_of(Path(path)), os.O_RDONLY | _AS_IT_IS)
    except OSError:
        return ""
    try:
        return os.read(descriptor, _TOKEN_LENGTH + 1).decode("ascii", "replace")
    except OSError:  # a folder, a FIFO without data
        return ""
    finally:
        os.close(descriptor)


def _lock_of(path: Path) -> Path:
    return path.with_name(f".{path.name}.lock")


# ------------------------------------------------------------------------------------------------
# The store of a study: a Zarr group that xarray opens, with a mark for each finished region.


DONE = "region_done"
RESULT = "result.zarr"
"""The store in the output folder of a study's command."""
BYTES = "bytes"
LARGE = 2**25
"""Arrays of more numbers are exported in parts."""
REGIONS = "regions"
"""Attribute: the axes that are cut, and the length of a region along each."""
_UNCHECKED = "made by an earlier version without checksums: damage in it cannot be seen"
_SHOWN = 5
"""Damaged parts that a line names."""
_ALL_NEED = "what all parts need"
_ALL_CHUNKS = {"write_empty_chunks": True}
_PACKAGE = "bouncing_disk_ros"


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
        _write(self._group, self._study, region, arrays)

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


def put(path: str, study: Study, region: Region, arrays: Arrays) -> None:
    """`Store.put` for another process, which has the folder but not the store."""
    _write(zarr.open_group(path, mode="r+"), study, region, arrays)


def _write(group: zarr.Group, study: Study, region: Region, arrays: Arrays) -> None:
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


def require_netcdf() -> None:
    """Raise InputError where netCDF4 is not installed."""
    if importlib.util.find_spec("netCDF4") is None:
        hint = "netCDF4 is not installed; pip install 'bouncing_disk_ros[netcdf]' brings it."
        raise InputError("netcdf", True, "false here", hint)


def export(result: xr.Dataset, path: Path) -> None:
    """NetCDF file of a result, written to `path`; nested attributes become JSON. Raises OSError.

    Arrays too large for memory are read and written some rows at a time. Raises InputError where
    netCDF4 is not installed.

    >>> export(open_result("small.zarr"), Path("small.nc"))
    """
    require_netcdf()
    plain = result.drop_vars(DONE, errors="ignore")
    plain.attrs = {name: _plain(value) for name, value in plain.attrs.items()}
    large = [str(name) for name, array in plain.data_vars.items() if array.size > LARGE]
    plain.drop_vars(large).to_netcdf(path, engine="netcdf4")
    if not large:
        return
    import netCDF4

    with netCDF4.Dataset(path, "a") as file:
        for name in large:
            _copy(plain[name], file)


def _copy(array: xr.DataArray, file: Any) -> None:
    dims = [str(dim) for dim in array.dims]
    for dim, length in zip(dims, array.shape, strict=True):
        if dim not in file.dimensions:
            file.createDimension(dim, length)
    kind = array.dtype.newbyteorder("=")
    fill = math.nan if kind.kind == "f" else False
    variable = file.createVariable(str(array.name), kind, dims, fill_value=fill)
    variable.setncatts(array.attrs)
    rows = max(1, LARGE // math.prod(array.shape[1:]))
    for first in range(0, len(array), rows):
        variable[first : first + rows] = array[first : first + rows].values


def _plain(value: object) -> object:
    if isinstance(value, bool):
        return int(value)
    return value if isinstance(value, (int, float, str)) else json.dumps(value)


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
