"""The study `basin_shares`: how much of the plane of starts each attractor has, over a parameter.

The "ease of a multiple toss" behind the paper's argument: the wider the basin, the wider the margin
of a performer; with the best phase lag and the speed beside it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar

import numpy as np
import xarray as xr

from bouncing_disk_ros.errors import InputError, one_of
from bouncing_disk_ros.maps.attractors import (
    Attractor,
    AttractorKind,
    Attractors,
    refuse_conservative,
)
from bouncing_disk_ros.maps.basin_measures import UNRESOLVED, shares
from bouncing_disk_ros.maps.best_lag import best_lag
from bouncing_disk_ros.maps.next_collision import NextCollisionMap
from bouncing_disk_ros.maps.window_basins import IN_CONTACT, Labelled, label_window
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.study.attractor_lines import (
    FLAGS,
    MOST_POINTS,
    THRESHOLD,
    lines_of,
    put_attractor,
)
from bouncing_disk_ros.study.computation import Arrays, Axis, Field, Region, Study

MOST_ATTRACTORS = 12
"""Attractors at each value that are kept for their lines, those with the largest shares."""
CLASSES = ("rest", "chattering", "period-1", "other periodic", "chaotic", "unresolved")
AXES = {"axial_forcing": "Γ", "restitution": "ε", "angular_forcing": "Γ_T"}


class BasinShares(Study):
    """Shares of the window τ_imp ∈ [0, 2π), w_A ∈ (velocity_begin, 0) at each value."""

    name: ClassVar[str] = "basin_shares"
    title: ClassVar[str] = "Shares of the basins of attraction over a parameter"
    revision: ClassVar[int] = 4

    def __init__(self, parameters: Mapping[str, Value]) -> None:
        super().__init__(parameters)
        given = self.parameters
        one_of("along", given["along"], AXES)
        if given["along"] != "restitution":
            refuse_conservative(float(given["restitution"]))
        low = {"axial_forcing": 0.0, "restitution": 0.0, "angular_forcing": 1e-9}
        for end in ("begin", "end"):
            least, value = low[str(given["along"])], float(given[end])
            if value < least or (given["along"] == "restitution" and value >= 1.0):
                allowed = "0 to less than 1" if given["along"] == "restitution" else f">= {least:g}"
                raise InputError(end, value, allowed)
        if not float(given["velocity_begin"]) < 0.0:
            raise InputError("velocity_begin", given["velocity_begin"], "less than 0",
                             "The window is empty.")  # fmt: skip

    @property
    def axes(self) -> Mapping[str, Axis]:
        """The parameter, and the classes of attractors."""
        given = self.parameters
        values = np.linspace(float(given["begin"]), float(given["end"]), int(given["count"]))
        label = str(given["along"])
        return {
            "value": Axis(values, "1", label.replace("_", " "), AXES[label]),
            "kind": Axis(np.arange(len(CLASSES)), "1", ", ".join(CLASSES)),
            "attractor": Axis(np.arange(MOST_ATTRACTORS), "1", "attractors at one value"),
            "point": Axis(np.arange(MOST_POINTS), "1", "points of an attractor"),
        }

    @property
    def fields(self) -> Mapping[str, Field]:
        """Shares with their standard errors; best phase lag and speed of the main attractor."""
        both, line, one = ("value", "kind"), ("value",), ("value", "attractor")
        main = "of the largest attractor that is neither rest nor chattering"
        return {
            "fraction": Field(both, "float64", "1", "share of the window"),
            "fraction_uncertainty": Field(both, "float64", "1", "standard error of the share"),
            "attractors": Field(line, "int32", "1", "number of attractors", fill=0),
            "missed": Field(
                line, "int32", "1",
                "how many of them only starts left open led to", fill=0,
            ),
            "best_phase_lag": Field(line, "float64", "rad", f"best phase lag {main}", "θ"),
            "best_speed": Field(line, "float64", "omega Phi", f"mean speed there {main}"),
            "share_in_contact": Field(line, "float64", "1", "share that comes to contact"),
            "kind_of_attractor": Field(one, "int32", "1", "its kind", fill=-1, flags=FLAGS),
            "impacts_of_attractor": Field(one, "int32", "1", "impacts in one repetition", fill=0),
            "cycles_of_attractor": Field(one, "int32", "1", "periods in one repetition", fill=0),
            "share_of_attractor": Field(one, "float64", "1", "share of the window"),
            "share_without_contact": Field(
                one, "float64", "1", "share that reaches it without contact before"
            ),
            "point_forcing_phase": Field((*one, "point"), "float64", "rad", "its impacts", "τ"),
            "point_velocity": Field((*one, "point"), "float64", "pi g/omega", "its impacts", "w_A"),
        }  # fmt: skip

    @property
    def chunks(self) -> Mapping[str, int]:
        """One value at a time."""
        return {"value": 1}

    def compute(self, region: Region, context: Arrays, before: Arrays | None) -> Arrays:  # noqa: ARG002
        """One value of the parameter."""
        given = self.parameters
        value = float(self.axes["value"].values[region.slices["value"]][0])
        own = {name: float(given[name]) for name in AXES} | {str(given["along"]): value}
        section = NextCollisionMap(**own)
        n, lowest = int(given["samples"]), float(given["velocity_begin"])
        window = label_window(section, n, lowest)
        found, missed = window.known, window.missed
        labels = window.ends()
        kinds = np.array([class_of(a) for a in found.found] + [CLASSES.index("unresolved")])
        merged = kinds[np.where(labels == UNRESOLVED, len(kinds) - 1, labels)].astype(np.int32)
        parts = shares(merged, len(CLASSES))
        lag = _best(found, labels, section)
        return {
            "fraction": np.array([[part.fraction for part in parts]]),
            "fraction_uncertainty": np.array([[part.uncertainty for part in parts]]),
            "attractors": np.array([len(found.found)], np.int32),
            "missed": np.array([missed], np.int32),
            "best_phase_lag": np.array([lag[0]]),
            "best_speed": np.array([lag[1]]),
            **self._attractors(window),
        }

    def _attractors(self, window: Labelled) -> dict[str, np.ndarray]:
        """Those with the largest shares, with their points, for their lines."""
        shape = self.shape
        arrays = {
            name: np.full([1, *(shape[dim] for dim in field.dims[1:])], field.fill, field.dtype)
            for name, field in self.fields.items()
            if "attractor" in field.dims
        }
        found, ends = window.known.found, window.ends()
        counts = np.bincount(ends[ends >= 0], minlength=len(found))
        for slot, label in enumerate(np.argsort(-counts, kind="stable")[:MOST_ATTRACTORS]):
            put_attractor(arrays, slot, found[int(label)], _ABOUT)
            direct = np.count_nonzero(window.labels.label == label)
            arrays["share_of_attractor"][0, slot] = counts[label] / ends.size
            arrays["share_without_contact"][0, slot] = direct / ends.size
        in_contact = np.count_nonzero(window.labels.label == IN_CONTACT) / ends.size
        return {**arrays, "share_in_contact": np.array([in_contact])}

    def finish(self, result: xr.Dataset, context: Arrays) -> xr.Dataset:  # noqa: ARG002
        """Give each attractor its number along the axis: fields line_* over lines."""
        return result.assign(lines_of(result, _LINES, THRESHOLD))


_ABOUT = {name: f"{name}_of_attractor" for name in ("kind", "impacts", "cycles")}
_LINES = _ABOUT | {
    "share": "share_of_attractor", "share_without_contact": "share_without_contact",
}  # fmt: skip


def class_of(attractor: Attractor) -> int:
    """Index in CLASSES."""
    if attractor.kind is AttractorKind.PERIODIC:
        single = len(attractor.forcing_phases) == attractor.cycles == 1
        return CLASSES.index("period-1" if single else "other periodic")
    return CLASSES.index(str(attractor.kind))


def _best(found: Attractors, labels: np.ndarray, section: NextCollisionMap) -> tuple[float, float]:
    counts = [int(np.sum(labels == i)) for i in range(len(found.found))]
    skipped = (AttractorKind.REST, AttractorKind.CHATTERING)
    main = [i for i, a in enumerate(found.found) if a.kind not in skipped]
    if not main:
        return math.nan, math.nan
    largest = found.found[max(main, key=counts.__getitem__)]
    return best_lag(largest, section)
