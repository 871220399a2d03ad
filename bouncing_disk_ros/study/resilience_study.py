"""The study `resilience`: how easy each attractor is to reach and how hard to lose, over Γ or ε."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar

import numpy as np
import xarray as xr

from bouncing_disk_ros.analysis.dynamics.attractor_matching import Seen, match_attractors
from bouncing_disk_ros.analysis.dynamics.attractors import (
    Attractor,
    AttractorKind,
    numbered,
    refuse_conservative,
)
from bouncing_disk_ros.analysis.dynamics.fatal_changes import FatalRule
from bouncing_disk_ros.analysis.dynamics.next_collision import NextCollisionMap
from bouncing_disk_ros.analysis.dynamics.resilience import (
    IN_CONTACT,
    label_window,
    measure,
    window_starts,
)
from bouncing_disk_ros.angles import numbers_of
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.study.definition import (
    Arrays,
    Axis,
    Field,
    Region,
    Study,
)

AXES = {"axial_forcing": "Γ", "restitution": "ε"}
MOST_POINTS = 64
"""Points of each attractor that are kept, for its line."""
KINDS = list(AttractorKind)
FLAGS = {-1: "none", **{i: str(kind) for i, kind in enumerate(KINDS)}}


class ResilienceStudy(Study):
    """Measures of every attractor at each value; parameters as in the table of the executable."""

    name: ClassVar[str] = "resilience"
    title: ClassVar[str] = "Fatal impulses, convergence and shares of attractors over a parameter"

    def __init__(self, parameters: Mapping[str, Value]) -> None:
        super().__init__(parameters)
        given = self.parameters
        along = str(given["along"])
        if along not in AXES:
            raise InputError("along", along, "one of " + ", ".join(AXES))
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
        """As in analysis.dynamics.resilience.Resilience."""
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
                (*one, "after"), "float64", "1", "share of starts on it after so many periods"
            ),
            "convergence_time": Field(one, "float64", period, "time constant near it"),
            "median_time": Field(one, "float64", period, "median time to reach it"),
            "slow_time": Field(one, "float64", period, "time within which 95 % reach it"),
            "fatal_impulse": Field(
                (*one, "sign", "instant"), "float64", unit, "smallest fatal impulse", "J"
            ),
            "least_fatal_impulse": Field(
                (*one, "sign"), "float64", unit, "smallest fatal impulse at any instant", "J"
            ),
            "fatal_timing_error": Field(
                (*one, "sense"), "float64", "rad", "smallest fatal timing error", "δ"
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
        window = label_window(section, window_starts(int(given["samples"]), lowest), lowest)
        shape = self.shape
        arrays = {
            name: np.full([1, *(shape[dim] for dim in field.dims[1:])], field.fill, field.dtype)
            for name, field in self.fields.items()
        }
        ends = window.ends()
        found = window.known.found
        counts = np.bincount(ends[ends >= 0], minlength=len(found))
        for slot, label in enumerate(np.argsort(-counts, kind="stable")[: shape["attractor"]]):
            self._put(arrays, slot, found[int(label)])
            measured = measure(
                section, window, int(label), shape["instant"], self._after, self._rule
            )
            for name, part in _FIELDS_OF.items():
                arrays[name][0, slot] = getattr(measured, part)
        arrays["share_in_contact"][0] = np.mean(window.labels.label == IN_CONTACT)
        arrays["unresolved"][0] = np.mean(ends < 0)
        arrays["left_out"][0] = max(0, len(found) - shape["attractor"])
        return arrays

    def _put(self, arrays: dict[str, np.ndarray], slot: int, attractor: Attractor) -> None:
        n = len(attractor.forcing_phases)
        chosen = np.unique(np.linspace(0, n - 1, min(n, MOST_POINTS)).astype(int))
        periodic = attractor.kind is AttractorKind.PERIODIC
        arrays["kind"][0, slot] = KINDS.index(attractor.kind)
        arrays["impacts"][0, slot] = n if periodic else 0
        arrays["cycles"][0, slot] = attractor.cycles
        arrays["multiplier"][0, slot] = attractor.multiplier
        arrays["point_forcing_phase"][0, slot, : len(chosen)] = attractor.forcing_phases[chosen]
        arrays["point_velocity"][0, slot, : len(chosen)] = attractor.velocities[chosen]

    def finish(self, result: xr.Dataset, context: Arrays) -> xr.Dataset:  # noqa: ARG002
        """Give each attractor its number: all fields are then over `line` too, by name line_*."""
        return result.assign(lines_of(result, float(self.parameters["match"])))


_FIELDS_OF = {
    "share": "share", "share_uncertainty": "share_error",
    "share_without_contact": "share_without_contact", "share_in_time": "share_in_time",
    "convergence_time": "convergence_time", "median_time": "median_time",
    "slow_time": "slow_time", "fatal_impulse": "impulses",
    "least_fatal_impulse": "least_impulses", "fatal_timing_error": "timing_errors",
}  # fmt: skip


def lines_of(result: xr.Dataset, threshold: float) -> dict[str, object]:
    """Fields over lines of attractors instead of their places at each value."""
    kinds = result["kind"].values
    seen = [
        [_seen(result, k, int(i)) for i in np.flatnonzero(row >= 0)] for k, row in enumerate(kinds)
    ]
    numbers = match_attractors(seen, threshold)
    count = max((line + 1 for row in numbers for line in row), default=0)
    found: dict[str, object] = {}
    for name in ("kind", "impacts", "cycles", "multiplier", *_FIELDS_OF):
        field = result[name]
        values = np.full((count, *field.shape[:1], *field.shape[2:]), _fill(name), field.dtype)
        for k, row in enumerate(numbers):
            for i, line in zip(np.flatnonzero(kinds[k] >= 0), row, strict=True):
                values[line, k] = field.values[k, i]
        about = {key: text for key, text in field.attrs.items() if key != "_FillValue"}
        found[f"line_{name}"] = (("line", "value", *field.dims[2:]), values, about)
    about = {"long_name": "name of the attractor where its share is largest"}
    found["line_name"] = ("line", numbered(_names(found, count)), about)
    return found


def _fill(name: str) -> float:
    return {"kind": -1, "impacts": 0, "cycles": 0}.get(name, math.nan)


def _seen(result: xr.Dataset, k: int, i: int) -> Seen:
    points = np.stack(
        [result[f"point_{name}"].values[k, i] for name in ("forcing_phase", "velocity")], axis=1
    )
    return Seen(KINDS[int(result["kind"].values[k, i])], points[~np.isnan(points[:, 0])])


def _names(found: Mapping[str, object], count: int) -> list[str]:
    """What each line is called: what it is first, and the last if that is something else."""
    fields = {name: value[1] for name, value in found.items() if isinstance(value, tuple)}
    names = []
    for line in range(count):
        places = np.flatnonzero(fields["line_kind"][line] >= 0)
        ends = [
            attractor_name(
                *(int(fields[f"line_{name}"][line, k]) for name in ("kind", "impacts", "cycles"))
            )
            for k in (places[0], places[-1])
        ]
        names.append(ends[0] if ends[0] == ends[1] else f"{ends[0]} … {ends[1]}")
    return names


def attractor_name(kind: int, impacts: int, cycles: int) -> str:
    """What an attractor is called, by the fields of the study."""
    if KINDS[kind] is not AttractorKind.PERIODIC:
        return str(KINDS[kind])
    return (
        f"period-{impacts}"
        if impacts == cycles
        else f"period-{impacts} in {cycles} cycle{'s' if cycles != 1 else ''}"
    )
