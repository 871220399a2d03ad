"""A result with all that says what it is: attributes on each variable, axes by their parameters."""

from __future__ import annotations

import xarray as xr

from bouncing_disk_ros.study.definition import Study
from bouncing_disk_ros.study.store import DONE

COORDINATES = ("attractor_name", "attractor_kind", "attractor_period", "attractor_cycles")


def described(study: Study, result: xr.Dataset) -> xr.Dataset:
    """The result with a unit and a name of each variable, and its axis by its parameter's name.

    An axis `value` along a parameter can be used by that name too: `result["restitution"]`,
    `result.sel(restitution=0.4, method="nearest")`.
    """
    result = result.copy()
    about = {**study.added, DONE: ("1", "whether the part is computed")}
    for name, variable in result.variables.items():
        units, long_name = about.get(str(name), ("1", str(name).replace("_", " ")))
        own = {"units": units, "long_name": long_name}
        variable.attrs = {**own, **variable.attrs}
    result = result.set_coords([name for name in COORDINATES if name in result])
    along = str(study.parameters.get("along", ""))
    if along and "value" in result.coords and along not in result.variables:
        values = result["value"]
        result = result.assign_coords({along: ("value", values.values, values.attrs)})
        result = result.set_xindex(along)
    return result
