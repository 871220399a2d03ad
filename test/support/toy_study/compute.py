"""The study `toy`: squares of numbers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
import xarray as xr

from bouncing_disk_ros.study.computation import Arrays, Axis, Field, Region, Study, variables


class Toy(Study):
    """Squares of numbers, with their sum."""

    name: ClassVar[str] = "toy"
    title: ClassVar[str] = "Squares of numbers"

    @property
    def axes(self) -> Mapping[str, Axis]:
        """The numbers."""
        count, largest = int(self.parameters["count"]), float(self.parameters["largest"])
        return {"number": Axis(np.linspace(0.0, largest, count), "m", "number")}

    @property
    def fields(self) -> Mapping[str, Field]:
        """Their squares."""
        return {"square": Field(("number",), "f8", "m2", "square of the number")}

    @property
    def chunks(self) -> Mapping[str, int]:
        """Two numbers in a region."""
        return {"number": 2}

    def compute(self, region: Region, context: Arrays, before: Arrays | None) -> Arrays:
        """The squares of one region."""
        return {"square": self.axes["number"].values[region.slices["number"]] ** 2}

    def finish(self, result: xr.Dataset, context: Arrays) -> xr.Dataset:
        """Add their sum."""
        total = float(result["square"].sum())
        return result.assign(variables({"sum": ((), total, "m2", "sum of the squares")}))
