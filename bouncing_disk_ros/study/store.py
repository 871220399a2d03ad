"""The store of a study: a Zarr group that xarray opens, with a mark for each finished region."""

from __future__ import annotations

import json
import math
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import xarray as xr
import zarr
from numpy.typing import NDArray
from zarr.codecs import BloscCodec

import bouncing_disk_ros
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.study.definition import Arrays, Field, Region, Study

FORMAT = 2
DONE = "region_done"
RESULT = "result.zarr"
"""The store in the output folder of a study's command."""
CONTEXT, BYTES = "context", "bytes"
LARGE = 2**25
"""Arrays of more numbers are exported in parts."""
PACKED = BloscCodec(cname="lz4", clevel=5, shuffle="shuffle")
"""Basins take less room so than by Zarr's default, and two thirds of the time."""
_PACKAGE = "bouncing_disk_ros"


class Store:
    """The growing result of one study in a folder; a region is marked after it was written."""

    def __init__(self, path: Path, study: Study) -> None:
        """Make the store, or open the one that an earlier run of the same study left there."""
        self.path, self._study = path, study
        try:
            self._group = self._opened() if path.exists() else self._made()
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
        try:
            group = zarr.open_group(str(self.path), mode="r+")
            found = dict(group.attrs).get("identity")
        except (FileNotFoundError, ValueError, zarr.errors.GroupNotFoundError):
            found = None
        hint = "Choose another output, or remove it."
        if found is None:
            raise InputError("output", str(self.path), "a new folder, or an unfinished result of "
                             "this study", f"It holds other data. {hint}")  # fmt: skip
        wanted = self._identity()
        if found != wanted and not self._finished_before(group, found, wanted):
            differs = _difference(found, wanted)
            raise InputError("output", str(self.path), "a new folder, or an unfinished result with "
                             "the same parameters", f"There {differs}. {hint}")  # fmt: skip
        return group

    def _finished_before(
        self, group: zarr.Group, found: Mapping[str, Any], wanted: Mapping[str, Any]
    ) -> bool:
        """Whether it is a whole result of an older revision, which is read as it is."""
        same = {**found, "revision": wanted["revision"]} == wanted
        older = isinstance(found.get("revision"), int) and found["revision"] < wanted["revision"]
        return same and older and bool(np.all(np.asarray(group[DONE][:])))

    def _made(self) -> zarr.Group:
        """A new store: made beside its place, so that a half-made one is never found."""
        study = self._study
        draft = self.path.with_name(f".{self.path.name}.draft")
        shutil.rmtree(draft, ignore_errors=True)
        group = zarr.open_group(str(draft), mode="w")
        group.attrs.update(
            {
                "identity": self._identity(),
                "title": study.title,
                "source": f"{_PACKAGE} {bouncing_disk_ros.__version__}",
                **{f"parameter_{name}": value for name, value in study.parameters.items()},
            }
        )
        for name, axis in study.axes.items():
            field = Field((name,), str(axis.values.dtype), axis.units, axis.long_name, axis.symbol)
            self._array(group, name, field, {})[:] = axis.values
        for name, field in study.fields.items():
            self._array(group, name, field, study.chunks)
        count = int(np.prod(study.region_counts()))
        group.create_array(
            DONE, shape=(count,), chunks=(1,), dtype="uint8", fill_value=0,
            dimension_names=("region",),
        )  # fmt: skip
        self.path.parent.mkdir(parents=True, exist_ok=True)
        draft.rename(self.path)
        return zarr.open_group(str(self.path), mode="r+")

    def _array(
        self, group: zarr.Group, name: str, field: Field, lengths: Mapping[str, int]
    ) -> zarr.Array:
        shape = tuple(self._study.shape[dim] for dim in field.dims)
        chunks = tuple(
            min(lengths.get(dim, size), size) for dim, size in zip(field.dims, shape, strict=True)
        )
        fill = field.fill if np.dtype(field.dtype).kind == "f" else int(np.nan_to_num(field.fill))
        attributes: dict[str, Any] = {"units": field.units, "long_name": field.long_name}
        if field.symbol:
            attributes["symbol"] = field.symbol
        if field.flags:
            attributes["flag_values"] = list(field.flags)
            attributes["flag_meanings"] = " ".join(field.flags.values())
        return group.create_array(
            name, shape=shape, chunks=chunks, dtype=field.dtype, fill_value=fill,
            dimension_names=field.dims, attributes=attributes, compressors=PACKED,
        )  # fmt: skip

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
            return _unpacked(np.asarray(held[...]), held.attrs["arrays"])
        arrays = {name: np.asarray(one) for name, one in self._study.context().items()}
        if arrays:  # as one array: each costs its files
            about = [[name, one.dtype.str, list(one.shape)] for name, one in arrays.items()]
            packed = np.frombuffer(b"".join(one.tobytes() for one in arrays.values()), np.uint8)
            draft = self._group.require_group(f"{CONTEXT}_draft", overwrite=True)
            draft.create_array(BYTES, data=packed, attributes={"arrays": about})
            (self.path / draft.basename).rename(self.path / CONTEXT)
        return arrays


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
        group[name][region.select(field.dims)] = arrays[name]


def open_result(path: str | Path) -> xr.Dataset:
    """Open a stored result, complete or not: arrays are read when they are used.

    `path`: a store that `run` made, or the output folder of a command. Raises InputError where
    there is none.

    >>> open_result("output/small.zarr")["label"]
    """
    store = Path(path)
    if (store / RESULT).is_dir():
        store /= RESULT
    if not (store / "zarr.json").is_file():
        allowed = "the output folder of a study, or a store that run made"
        raise InputError("path", str(path), allowed)
    return xr.open_zarr(str(store), consolidated=False, chunks=None)


def export(result: xr.Dataset, path: Path) -> None:
    """Write a result as NetCDF; nested attributes become JSON texts. Raises OSError.

    Arrays too large for memory are read and written some rows at a time.
    """
    plain = result.drop_vars(DONE, errors="ignore")
    plain.attrs = {name: _plain(value) for name, value in plain.attrs.items()}
    large = [str(name) for name, array in plain.data_vars.items() if array.size > LARGE]
    plain.drop_vars(large).to_netcdf(path, engine="netcdf4")
    if not large:
        return
    with netCDF4.Dataset(path, "a") as file:
        for name in large:
            _copy(plain[name], file)


def _copy(array: xr.DataArray, file: netCDF4.Dataset) -> None:
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


def _difference(found: Mapping[str, Any], wanted: Mapping[str, Any]) -> str:
    """The first difference of two identities, in words."""
    for key in ("format", "study", "revision"):
        if found.get(key) != wanted[key]:
            return f"the {key} is {found.get(key)}, not {wanted[key]}"
    before, now = found["parameters"], wanted["parameters"]
    name = next(name for name in {**before, **now} if before.get(name) != now.get(name))
    return f"{name} is {before.get(name)}, not {now.get(name)}"
