"""What a study is: named axes, fields over them, and a function that computes one region."""

from __future__ import annotations

import itertools
import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import xarray as xr
from numpy.typing import NDArray

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


Row = tuple[str | tuple[str, ...], Any, str, str]
"""A variable that is derived from fields: its dimensions, values, unit, and what it is."""


def variables(rows: Mapping[str, Row]) -> dict[str, xr.Variable]:
    """Variables by name from such rows, to be assigned to a result."""
    return {
        name: xr.Variable(dims, values, {"units": units, "long_name": about})
        for name, (dims, values, units, about) in rows.items()
    }


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
        """Add what is derived from the whole result (fractions, extremal points), not stored.

        By `variables`, with unit and meaning of each.
        """
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
        shape = self.shape
        cuts = [
            [(dim, slice(i, min(i + length, shape[dim]))) for i in range(0, shape[dim], length)]
            for dim, length in self.chunks.items()
        ]
        for number, slices in enumerate(itertools.product(*cuts)):
            yield Region(number, dict(slices))
