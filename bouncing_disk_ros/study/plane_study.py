"""Studies over a plane of two parameters: what they share."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.errors import InputError, one_of
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
            one_of(key, given[key], self.axis_names)
        if self.across == self.up:
            raise InputError("y_axis", self.up, "another parameter than x_axis")
        for name in (self.across, self.up):  # no part of what is computed
            del given[name]
        for key in ("x", "y"):
            self._check_axis(key)
        if "restitution" in given:
            from bouncing_disk_ros.maps.attractors import refuse_conservative  # brings its kernels

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
