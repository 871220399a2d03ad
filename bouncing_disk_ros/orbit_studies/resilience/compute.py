"""The study `resilience`: how easy each attractor is to reach and how hard to lose, over Γ or ε."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
import xarray as xr

from bouncing_disk_ros.angles import numbers_of
from bouncing_disk_ros.errors import InputError, one_of
from bouncing_disk_ros.maps.attractors import refuse_conservative
from bouncing_disk_ros.maps.next_collision import NextCollisionMap
from bouncing_disk_ros.maps.window_basins import IN_CONTACT, label_window
from bouncing_disk_ros.orbit_studies import NO_ROTATION
from bouncing_disk_ros.orbit_studies.fatal_changes import FatalRule
from bouncing_disk_ros.orbit_studies.resilience.measures import measure
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.study.attractor_lines import (
    FLAGS,
    MOST_POINTS,
    lines_of,
    put_attractor,
)
from bouncing_disk_ros.study.computation import Arrays, Axis, Field, Region, Study

AXES = {"axial_forcing": "Γ", "restitution": "ε"}


class ResilienceStudy(Study):
    """Measures of every attractor at each value; parameters as in the table of the executable."""

    name: ClassVar[str] = "resilience"
    title: ClassVar[str] = "Fatal impulses, convergence and shares of attractors over a parameter"
    revision: ClassVar[int] = 2

    def __init__(self, parameters: Mapping[str, Value]) -> None:
        super().__init__(parameters)
        given = self.parameters
        along = str(given["along"])
        why = NO_ROTATION if along in ("phase_lag", "angular_forcing") else ""
        one_of("along", along, AXES, why)
        del given[along]  # no part of what is computed
        if "restitution" in given:
            refuse_conservative(float(given["restitution"]))
        for end in ("begin", "end"):
            if along == "restitution" and not float(given[end]) < 1.0:
                raise InputError(end, given[end], "less than 1")
        if not float(given["velocity_begin"]) < 0.0:
            raise InputError("velocity_begin", given["velocity_begin"], "less than 0",
                             "The window is empty.")  # fmt: skip
        self._rule = FatalRule(
            float(given["periods"]), largest=float(given["largest_impulse"]),
            resolution=float(given["resolution"]),
        ).checked()  # fmt: skip
        allowed = "numbers of periods above 0, such as '5 10 20'"
        self._after = np.array(numbers_of("after", str(given["after"]), allowed))
        if not len(self._after) or not np.all(self._after > 0.0):
            raise InputError("after", given["after"], allowed)

    @property
    def axes(self) -> Mapping[str, Axis]:
        """The parameter; attractors at each value in no order; instants; periods; signs."""
        given = self.parameters
        along = str(given["along"])
        values = np.linspace(float(given["begin"]), float(given["end"]), int(given["count"]))
        m = int(given["instants"])
        return {
            "value": Axis(values, "1", along.replace("_", " "), AXES[along]),
            "attractor": Axis(np.arange(int(given["most_attractors"])), "1",
                              "attractors at one value"),
            "point": Axis(np.arange(MOST_POINTS), "1", "points of an attractor"),
            "instant": Axis((np.arange(m) + 0.5) / m, "1", "part of a repetition that has passed"),
            "after": Axis(self._after, "2 pi/omega", "periods after the start"),
            "sign": Axis(np.array([1, -1]), "1", "1: impulse upwards, -1: downwards"),
            "sense": Axis(np.array([1, -1]), "1", "1: impact late, -1: early"),
        }  # fmt: skip

    @property
    def fields(self) -> Mapping[str, Field]:
        """Of each attractor what it is and its measures; of each value the rest of the starts."""
        one = ("value", "attractor")
        unit, period = "m pi g/omega", "2 pi/omega"
        return {
            "kind": Field(one, "int32", "1", "kind of attractor", fill=-1, flags=FLAGS),
            "impacts": Field(one, "int32", "1", "impacts in one repetition", fill=0),
            "cycles": Field(one, "int32", "1", "periods in one repetition", fill=0),
            "multiplier": Field(one, "float64", "1", "largest multiplier in magnitude"),
            "point_forcing_phase": Field((*one, "point"), "float64", "rad", "its impacts", "τ"),
            "point_velocity": Field((*one, "point"), "float64", "pi g/omega", "its impacts", "w_A"),
            "share": Field(one, "float64", "1", "share of the window"),
            "share_uncertainty": Field(one, "float64", "1", "standard error of the share"),
            "share_without_contact": Field(
                one, "float64", "1", "share of starts that reach it without contact before"
            ),
            "share_in_time": Field(
                (*one, "after"),
                "float64",
                "1",
                "share of starts on it after so many periods; nan: chaotic",
            ),
            "convergence_time": Field(one, "float64", period, "time constant near it"),
            "median_time": Field(one, "float64", period, "median time to reach it"),
            "slow_time": Field(one, "float64", period, "time within which 95 % reach it"),
            "fatal_impulse": Field(
                (*one, "sign", "instant"),
                "float64",
                unit,
                "smallest fatal impulse; nan: not decided",
                "J",
            ),
            "least_fatal_impulse": Field(
                (*one, "sign"),
                "float64",
                unit,
                "smallest fatal impulse at any instant; nan: not decided",
                "J",
            ),
            "fatal_timing_error": Field(
                (*one, "sense"),
                "float64",
                "rad",
                "smallest fatal timing error; nan: not decided",
                "δ",
            ),
            "share_in_contact": Field(
                ("value",), "float64", "1", "share of starts that come to contact"
            ),
            "unresolved": Field(("value",), "float64", "1", "share of starts without an end"),
            "left_out": Field(("value",), "int32", "1", "attractors left out", fill=0),
        }

    @property
    def chunks(self) -> Mapping[str, int]:
        """One value at a time."""
        return {"value": 1}

    def compute(self, region: Region, context: Arrays, before: Arrays | None) -> Arrays:  # noqa: ARG002
        """One value of the parameter."""
        given = self.parameters
        along = str(given["along"])
        value = float(self.axes["value"].values[region.slices["value"]][0])
        own = {name: float(given.get(name, value)) for name in AXES} | {along: value}
        section = NextCollisionMap(**own)
        lowest = float(given["velocity_begin"])
        window = label_window(section, int(given["samples"]), lowest)
        shape = self.shape
        arrays = {
            name: np.full([1, *(shape[dim] for dim in field.dims[1:])], field.fill, field.dtype)
            for name, field in self.fields.items()
        }
        ends = window.ends()
        found = window.known.found
        counts = np.bincount(ends[ends >= 0], minlength=len(found))
        for slot, label in enumerate(np.argsort(-counts, kind="stable")[: shape["attractor"]]):
            put_attractor(arrays, slot, found[int(label)], _ABOUT)
            measured = measure(
                section, window, int(label), shape["instant"], self._after, self._rule
            )
            for name, of_attractor in measured.items():
                arrays[name][0, slot] = of_attractor
        arrays["share_in_contact"][0] = np.mean(window.labels.label == IN_CONTACT)
        arrays["unresolved"][0] = np.mean(ends < 0)
        arrays["left_out"][0] = max(0, len(found) - shape["attractor"])
        return arrays

    def finish(self, result: xr.Dataset, context: Arrays) -> xr.Dataset:  # noqa: ARG002
        """Give each attractor its number: all fields are then over `line` too, by name line_*."""
        fields = {
            name: name
            for name, field in self.fields.items()
            if "attractor" in field.dims and "point" not in field.dims
        }
        return result.assign(lines_of(result, fields, float(self.parameters["match"])))


_ABOUT = {"kind": "kind", "impacts": "impacts", "cycles": "cycles", "multiplier": "multiplier"}
