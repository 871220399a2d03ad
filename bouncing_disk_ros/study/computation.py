"""What a study is: named axes, fields over them, and a function that computes one region.

After it what studies over a plane of two parameters share.
"""

from __future__ import annotations

import itertools
import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from bouncing_disk_ros.errors import InputError, one_of
from bouncing_disk_ros.parameters import Value

Arrays = Mapping[str, NDArray[np.generic]]
IMPACTS_IN_REPETITION = (
    "impacts in one repetition, the last ones of a chatter as one; 0: none known"
)
CONTACTS_PER_IMPACT = "phases of contact per impact, the last ones of a chatter as one"
"""A chatter has impacts without end: they are counted up to where its rest is summed."""


@dataclass(frozen=True)
class Axis:
    """One coordinate of the result: its values, with the names that a plot shows."""

    values: NDArray[np.generic]  # (n,)
    units: str
    long_name: str
    symbol: str = ""


@dataclass(frozen=True)
class Field:
    """One array of the result. `fill` is its value where nothing was computed yet."""

    dims: tuple[str, ...]
    dtype: str
    units: str
    long_name: str
    symbol: str = ""
    fill: float | int = math.nan
    flags: Mapping[int, str] | None = None  # meaning of each whole number (CF flag_values)


@dataclass(frozen=True)
class Region:
    """One region of the result: its range along each axis."""

    number: int
    slices: Mapping[str, slice]

    def select(self, dims: tuple[str, ...]) -> tuple[slice, ...]:
        """The place of this region in an array over `dims`."""
        return tuple(self.slices.get(dim, slice(None)) for dim in dims)


class Study(ABC):
    """A long computation whose result depends on its parameters alone.

    A study is picklable: workers of other processes and machines are sent the study and a region.
    Results must not depend on how it is cut into regions, nor on their order, unless `sequential`.
    """

    name: ClassVar[str]
    title: ClassVar[str]
    sequential: bool = False
    """Whether each region starts from the result of the one before."""
    revision: ClassVar[int] = 1
    """Grows when the same parameters give other numbers: an older store is then not resumed."""

    added: ClassVar[Mapping[str, tuple[str, str]]] = {}
    """Variables that `finish` adds -> their unit and what they are."""

    def __init__(self, parameters: Mapping[str, Value]) -> None:
        self.parameters = dict(parameters)

    def __repr__(self) -> str:
        """The study, its shape, and what it was given."""
        shape = " × ".join(f"{count} {name}" for name, count in self.shape.items())
        given = ", ".join(f"{name}={value!r}" for name, value in self.parameters.items())
        return f"<study {self.name}: {shape}; {given}>"

    @property
    @abstractmethod
    def axes(self) -> Mapping[str, Axis]:
        """The coordinates."""

    @property
    @abstractmethod
    def fields(self) -> Mapping[str, Field]:
        """The arrays, each over some of the axes."""

    @property
    @abstractmethod
    def chunks(self) -> Mapping[str, int]:
        """Length of a region along each axis that is cut; one region is a second of work or so."""

    def context(self) -> Arrays:
        """What all regions need and is computed once, stored with the result; may be empty."""
        return {}

    @abstractmethod
    def compute(self, region: Region, context: Arrays, before: Arrays | None) -> Arrays:
        """The fields over one region. `before`: those of the region before, if `sequential`."""

    def finish(self, result: xr.Dataset, context: Arrays) -> xr.Dataset:  # noqa: ARG002
        """Add what is derived from the whole result (fractions, extremal points), not stored."""
        return result

    @property
    def shape(self) -> dict[str, int]:
        """Length of each axis."""
        return {name: len(axis.values) for name, axis in self.axes.items()}

    def region_counts(self) -> tuple[int, ...]:
        """Number of regions along each axis that is cut."""
        shape = self.shape
        return tuple(-(-shape[dim] // length) for dim, length in self.chunks.items())

    def regions(self) -> Iterator[Region]:
        """All regions, the last axis fastest."""
        return regions_of(self.shape, self.chunks)


def regions_of(shape: Mapping[str, int], lengths: Mapping[str, int]) -> Iterator[Region]:
    """Regions of arrays with axes of this shape, cut into these lengths; the last axis fastest."""
    cuts = [
        [(dim, slice(i, min(i + length, shape[dim]))) for i in range(0, shape[dim], length)]
        for dim, length in lengths.items()
    ]
    for number, slices in enumerate(itertools.product(*cuts)):
        yield Region(number, dict(slices))


# --- studies over a plane of two parameters -------------------------------------------------------
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
    at = ", ".join(at_value(known[axis], float(best[axis])) for axis in reversed(known.dims))
    return [f"  largest {name} {float(best):{digits}}{unit} at {at}"]


def at_value(axis: xr.DataArray, value: float, digits: str = ".6g") -> str:
    """A value of the axis, with the symbol and the unit of its parameter."""
    unit = axis.attrs["units"]
    return f"{axis.attrs['symbol']} = {value:{digits}}{'' if unit == '1' else f' {unit}'}"
