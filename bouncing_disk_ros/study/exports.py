"""Export of a study's result to NetCDF and to text tables (CSV)."""

from __future__ import annotations

import importlib.util
import json
import math
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.regular_file import replaced
from bouncing_disk_ros.study.store import DONE

LARGE = 2**25
"""Arrays of more numbers are exported in parts."""


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


def export_tables(result: xr.Dataset, folder: Path) -> list[Path]:
    """Text tables (CSV) of a result, one for each group of arrays with the same axes; their files.

    A table has a row for each point of its axes, whose names the name of the file holds:
    `result_velocity_forcing_phase.csv`; `result.csv` has the numbers without an axis. Lines with #
    say unit and meaning of each column. Raises FailedError where a file cannot be written.

    >>> export_tables(open_result("small.zarr"), Path("small"))
    """
    plain = result.drop_vars(DONE, errors="ignore")
    groups: dict[tuple[str, ...], list[str]] = {}
    for name, array in plain.variables.items():
        dims = tuple(map(str, array.dims))
        if name not in plain.coords or dims != (name,):
            groups.setdefault(dims, []).append(str(name))
    files = []
    for dims, names in groups.items():
        files.append(folder / f"{'_'.join(('result', *dims))}.csv")
        replaced(files[-1], partial(_write_table, plain[sorted(names)].reset_coords(), dims))
    return files


def _write_table(table: xr.Dataset, dims: Sequence[str], path: Path) -> None:
    """Some rows of the first axis at a time: an array may be larger than memory."""
    axes = dims or ("row",)
    table = table.assign_coords(
        {axis: np.arange(table.sizes[axis]) for axis in dims if axis not in table}
    )
    table = table if dims else table.expand_dims(axes)
    columns = [*dims, *map(str, table.data_vars)]
    with path.open("w", encoding="utf-8", newline="") as file:
        for name in columns:
            attrs = table[name].attrs
            meaning = attrs.get("long_name", "number along this axis")
            file.write(f"# {name} ({attrs.get('units', '1')}): {meaning}\n")
        file.write(",".join(columns) + "\n")
        length = table.sizes[axes[0]]
        rows = max(1, LARGE * length // max(1, math.prod(table.sizes.values())))
        for begin in range(0, length, rows):
            part = table.isel({axes[0]: slice(begin, begin + rows)}).to_dataframe(dim_order=axes)
            part.reset_index()[columns].to_csv(file, index=False, header=False)


def _copy(array: xr.DataArray, file: Any) -> None:
    dims = [str(dim) for dim in array.dims]
    for dim, length in zip(dims, array.shape, strict=True):
        if dim not in file.dimensions:
            file.createDimension(dim, length)
    kind = array.dtype.newbyteorder("=")
    fill = math.nan if kind.kind == "f" else False
    variable = file.createVariable(str(array.name), kind, dims, fill_value=fill)
    variable.setncatts(array.attrs)
    rows = max(1, LARGE // max(1, math.prod(array.shape[1:])))
    for first in range(0, len(array), rows):
        variable[first : first + rows] = array[first : first + rows].values


def _plain(value: object) -> object:
    if isinstance(value, bool):
        return int(value)
    return value if isinstance(value, (int, float, str)) else json.dumps(value)
