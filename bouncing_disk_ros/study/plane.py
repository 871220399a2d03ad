"""What studies over a plane of two parameters share: axes, their validation, printed lines."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping
from typing import ClassVar

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from bouncing_disk_ros.errors import InputError, closest
from bouncing_disk_ros.maps.attractors import refuse_conservative
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.study.computation import Axis, Study


class PlaneStudy(Study):
    """A study over two of its parameters: `x_axis` across, `y_axis` up.

    Raises InputError for axes that are not among `axis_names`, for one parameter twice, for ends in
    the wrong order or beyond what the parameter may be, and for restitution 1.
    """

    axis_names: ClassVar[tuple[str, ...]]
    conservative_hint: ClassVar[str]  # why restitution may not be 1

    def __init__(self, parameters: Mapping[str, Value]) -> None:
        super().__init__(parameters)
        given = self.parameters
        self.across, self.up = str(given["x_axis"]), str(given["y_axis"])
        for key in ("x_axis", "y_axis"):
            if given[key] not in self.axis_names:
                hint = closest(str(given[key]), self.axis_names)
                raise InputError(key, given[key], "one of " + ", ".join(self.axis_names), hint)
        if self.across == self.up:
            raise InputError("y_axis", self.up, "another parameter than x_axis")
        for name in (self.across, self.up):  # no part of what is computed
            del given[name]
        for key in ("x", "y"):
            self._check_axis(key)
        if "restitution" in given:
            refuse_conservative(float(given["restitution"]))

    def _check_axis(self, key: str) -> None:
        """The ends of an axis: in order, within what the parameter may be."""
        begin, end = (float(self.parameters[f"{key}_{side}"]) for side in ("begin", "end"))
        name = str(self.parameters[f"{key}_axis"])
        if not begin < end and not (begin == end and self.parameters[f"{key}_count"] == 1):
            raise InputError(f"{key}_begin", begin, f"less than {key}_end = {end:g}")
        for side, value in (("begin", begin), ("end", end)):
            try:
                self.check_value(name, value)
            except InputError as error:
                hint = f"It is a value of {name}."
                raise InputError(f"{key}_{side}", value, error.allowed, hint) from None
        if name == "restitution" and end == 1.0:
            raise InputError(f"{key}_end", end, "less than 1", self.conservative_hint)

    @abstractmethod
    def check_value(self, name: str, value: float) -> None:
        """Raise InputError for a value that the parameter may not have."""

    @abstractmethod
    def axis_of(self, name: str, values: NDArray[np.float64]) -> Axis:
        """The axis of a parameter, with its unit and symbol."""

    def values_of(self, key: str) -> NDArray[np.float64]:
        """The values along the axis `x` or `y`."""
        begin, end = (float(self.parameters[f"{key}_{side}"]) for side in ("begin", "end"))
        return np.linspace(begin, end, int(self.parameters[f"{key}_count"]))

    @property
    def axes(self) -> Mapping[str, Axis]:
        """The two parameters, by their names: rows, then columns."""
        return {
            name: self.axis_of(name, self.values_of(key))
            for key, name in (("y", self.up), ("x", self.across))
        }


# --- printed lines --------------------------------------------------------------------------------
def kind_shares(result: xr.Dataset) -> list[str]:
    """At which share of the points each kind of motion is."""
    kind = result["kind"]
    rows = []
    for number, name in zip(kind.attrs["flag_values"], kind.attrs["flag_meanings"].split(),
                            strict=True):  # fmt: skip
        share = 100.0 * float((kind == number).mean())
        if share > 0.0:
            rows.append(f"  {name:12} {share:7.3f} % of the points")
    return rows


def largest(result: xr.Dataset, field: str, name: str, unit: str, digits: str) -> list[str]:
    """Where a field is largest, written with `digits`; nothing where it is nowhere finite."""
    values = result[field]
    known = values.where(abs(values) < math.inf)
    if not bool(known.notnull().any()):
        return []
    best = known.isel(known.argmax(...))
    at = ", ".join(f"{axis} = {float(best[axis]):.6g}" for axis in reversed(known.dims))
    return [f"  largest {name} {float(best):{digits}}{unit} at {at}"]
