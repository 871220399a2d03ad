"""Small studies: of each kind, and some whose results are known."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import xarray as xr

from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.study import Arrays, Axis, Field, Region, Study

SMALLEST: dict[str, dict[str, Any]] = {
    "toss_paths": {"points": 16},
    "toss_map": {"phase_lag_count": 5, "amplitude_angle_count": 3},
    "bifurcation": {"along": "restitution", "begin": 0.5, "end": 0.6, "count": 3, "settling": 10,
                    "measured": 20, "kept": 5, "doublings": 0},
    "parameter_map": {"x_count": 2, "y_count": 2, "settling": 10, "measured": 256},
    "basins": {"axial_forcing": 0.55, "width": 60, "height": 60},
    "basin_shares": {"begin": 0.4, "count": 2, "samples": 8},
    "motor": {"x_count": 3, "y_count": 2},
    "curves": {"axial_forcing_count": 2, "restitution_count": 2, "settling": 9, "doublings": 0,
               "axial_forcing_begin": 0.4, "axial_forcing_end": 0.5, "restitution_begin": 0.45,
               "restitution_end": 0.55},
    "manifolds": {"axial_forcing": 0.34, "width": 8, "height": 8, "distance": 0.1},
    "resilience": {"begin": 0.4, "count": 1, "samples": 9, "instants": 2, "resolution": 0.5},
    "juggling": {"width": 2, "height": 2, "deadline": 5.0},
}  # fmt: skip
"""Options of each study of the package with which it takes a moment."""

VALUES: dict[str, Value] = {"rows": 7, "columns": 5, "length": 2, "factor": 0.5}


class Products(Study):
    """x times y times a factor, which is the context; counts how often it computes."""

    name = "products"
    title = "Products of two numbers"
    computed: ClassVar[list[int]] = []

    @property
    def axes(self) -> Mapping[str, Axis]:
        rows, columns = int(self.parameters["rows"]), int(self.parameters["columns"])
        return {
            "y": Axis(np.arange(rows, dtype=float), "m", "height", "y"),
            "x": Axis(np.arange(columns, dtype=float), "m", "width", "x"),
        }

    @property
    def fields(self) -> Mapping[str, Field]:
        return {
            "product": Field(("y", "x"), "float64", "m²", "product", "xy"),
            "label": Field(("y", "x"), "int32", "1", "whole part", fill=-1, flags={-1: "open"}),
        }

    @property
    def chunks(self) -> Mapping[str, int]:
        length = int(self.parameters["length"])
        return {"y": length, "x": length}

    def context(self) -> Arrays:
        Products.computed.append(-1)
        return {"factor": np.array(float(self.parameters["factor"]))}

    def compute(self, region: Region, context: Arrays, before: Arrays | None) -> Arrays:
        Products.computed.append(region.number)
        y = self.axes["y"].values[region.slices["y"]].astype(float)
        x = self.axes["x"].values[region.slices["x"]].astype(float)
        product = np.multiply.outer(y, x) * float(context["factor"])
        return {"product": product, "label": product.astype(np.int32)}

    def finish(self, result: xr.Dataset, context: Arrays) -> xr.Dataset:
        return result.assign_attrs(total=float(result["product"].sum()))


class Sums(Products):
    """A running sum along y: each region starts from the one before."""

    name = "sums"
    sequential = True

    @property
    def chunks(self) -> Mapping[str, int]:
        return {"y": int(self.parameters["length"])}

    def compute(self, region: Region, context: Arrays, before: Arrays | None) -> Arrays:
        Products.computed.append(region.number)
        begin = 0.0 if before is None else np.asarray(before["product"])[-1]
        y = self.axes["y"].values[region.slices["y"]].astype(float)
        product = begin + np.cumsum(np.repeat(y[:, None], self.shape["x"], 1), axis=0)
        return {"product": product, "label": product.astype(np.int32)}


class Murderous(Products):
    """Products; the worker that takes region 2 first is killed by it (a file says that it was)."""

    name = "murderous"

    def compute(self, region: Region, context: Arrays, before: Arrays | None) -> Arrays:
        mark = Path(str(self.parameters["mark"]))
        time.sleep(0.05)  # so that the work is spread over the workers
        if region.number == 2 and not mark.exists():
            mark.write_text(str(os.getpid()))
            os.kill(os.getpid(), signal.SIGKILL)
        return super().compute(region, context, before)


class Patient(Products):
    """Products; each region waits until a file `mark` is there, and writes `mark`.begun."""

    name = "patient"

    def compute(self, region: Region, context: Arrays, before: Arrays | None) -> Arrays:
        mark = Path(str(self.parameters["mark"]))
        mark.with_suffix(".begun").touch()
        while not mark.exists():
            time.sleep(0.05)  # a poll of the condition
        return super().compute(region, context, before)
