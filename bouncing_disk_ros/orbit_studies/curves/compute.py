"""The study `curves`: where orbits fold, double, graze and come to contact in the plane of Γ and ε.

Behind the curves lies the map of what a disk settles on, as in the study `parameter_map`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
import xarray as xr

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.attractors import refuse_conservative
from bouncing_disk_ros.maps.next_collision import NextCollisionMap
from bouncing_disk_ros.orbit_studies.curve_family import curve_family
from bouncing_disk_ros.orbit_studies.orbit_curves import Curve, SpecialKind, Window
from bouncing_disk_ros.orbit_studies.orbit_equations import CurveKind
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.study.by_name import named
from bouncing_disk_ros.study.computation import Arrays, Axis, Field, Region, Row, Study, variables

KINDS, SPECIAL_KINDS = list(CurveKind), list(SpecialKind)


class Curves(Study):
    """Curves of the attractors at one point, over the map of attractors."""

    name: ClassVar[str] = "curves"
    title: ClassVar[str] = "Folds, doublings, grazes and onset of contact over two parameters"

    def __init__(self, parameters: Mapping[str, Value]) -> None:
        super().__init__(parameters)
        given = self.parameters
        refuse_conservative(float(given["restitution"]))
        place = float(given["axial_forcing"]), float(given["restitution"])
        for name, value in zip(Window._fields, place, strict=True):
            low, high = float(given[f"{name}_begin"]), float(given[f"{name}_end"])
            if not low < high:
                raise InputError(f"{name}_begin", low, f"less than {name}_end = {high:g}")
            if not low <= value <= high:
                raise InputError(name, value, f"within the window, {low:g} to {high:g}")
        self._section = NextCollisionMap(*place)
        self._behind = named("parameter_map", **_map_parameters(given))

    @property
    def window(self) -> Window:
        """The part of the plane."""
        given = self.parameters
        sides = [
            (float(given[f"{name}_begin"]), float(given[f"{name}_end"])) for name in Window._fields
        ]
        return Window(*sides)

    @property
    def axes(self) -> Mapping[str, Axis]:
        """ε in rows, Γ in columns."""
        return self._behind.axes

    @property
    def fields(self) -> Mapping[str, Field]:
        """Those of the map of attractors."""
        kept = ("kind", "period", "cycles", "lyapunov_exponent", "contacts")
        return {name: field for name, field in self._behind.fields.items() if name in kept}

    @property
    def chunks(self) -> Mapping[str, int]:
        """Squares."""
        return self._behind.chunks

    def context(self) -> Arrays:
        """The curves."""
        given = self.parameters
        lost: list[str] = []
        found = curve_family(
            self._section, self.window, doublings=int(given["doublings"]),
            largest_step=float(given["largest_step"]), lost=lost,
        )  # fmt: skip
        return {**curves_to_arrays(found), "lost_orbits": np.array(len(lost), np.int64)}

    def compute(self, region: Region, context: Arrays, before: Arrays | None) -> Arrays:  # noqa: ARG002
        """The map of attractors over one region."""
        found = self._behind.compute(region, {}, None)
        return {name: found[name] for name in self.fields}

    def finish(self, result: xr.Dataset, context: Arrays) -> xr.Dataset:
        """Add the curves."""
        return result.assign(variables(curve_rows(context)))


def _map_parameters(given: Mapping[str, Value]) -> dict[str, Value]:
    """Parameters of the map behind the curves."""
    found: dict[str, Value] = {"x_axis": "axial_forcing", "y_axis": "restitution"}
    for key, name in (("x", "axial_forcing"), ("y", "restitution")):
        for part in ("begin", "end", "count"):
            found[f"{key}_{part}"] = given[f"{name}_{part}"]
        if given[f"{name}_count"] == 1:
            found[f"{key}_end"] = given[f"{name}_begin"]  # of the map; the window keeps its end
    found |= {"phase_lag": 0.0, "angular_forcing": 1e12, "start": "period-1"}
    found |= {"initial_phase": 0.0, "initial_velocity": 0.0}
    return found | {"settling": given["settling"], "measured": given["measured"]}


def curves_to_arrays(curves: list[Curve]) -> Arrays:
    """Curves as arrays, to be stored."""
    special = [(i, point) for i, curve in enumerate(curves) for point in curve.special]
    return {
        "curve_kind": np.array([KINDS.index(c.kind) for c in curves], np.int64),
        "curve_impacts": np.array([c.impacts for c in curves], np.int64),
        "curve_cycles": np.array([c.cycles for c in curves], np.int64),
        "point_curve": np.repeat(np.arange(len(curves)), [len(c.axial_forcing) for c in curves]),
        "point_axial_forcing": _joined([c.axial_forcing for c in curves]),
        "point_restitution": _joined([c.restitution for c in curves]),
        "point_forcing_phase": _joined([c.forcing_phase[:, 0] for c in curves]),
        "point_admissible": _joined([c.admissible.astype(float) for c in curves]).astype(np.int64),
        "special_curve": np.array([i for i, _ in special], np.int64),
        "special_kind": np.array([SPECIAL_KINDS.index(p.kind) for _, p in special], np.int64),
        "special_axial_forcing": np.array([p.axial_forcing for _, p in special], float),
        "special_restitution": np.array([p.restitution for _, p in special], float),
    }


def _joined(parts: list[np.ndarray]) -> np.ndarray:
    return np.concatenate([np.empty(0), *parts])


def curve_rows(arrays: Arrays) -> dict[str, Row]:
    """The curves as rows of `variables`."""
    return {
        "curve_kind": ("curve", [str(KINDS[int(i)]) for i in arrays["curve_kind"]], "1",
                       "what happens to the orbit on the curve"),
        "special_kind": ("special", [str(SPECIAL_KINDS[int(i)]) for i in arrays["special_kind"]],
                         "1", "what a special point is"),
        **{name: (dims, arrays[name], units, about)
           for name, (dims, units, about) in _STORED.items()},
    }  # fmt: skip


_STORED: dict[str, tuple[str | tuple[str, ...], str, str]] = {
    "curve_impacts": (
        "curve", "1", "impacts in one repetition of the orbit; 0: an orbit with contact"
    ),
    "curve_cycles": ("curve", "1", "periods of the platform in one repetition"),
    "point_curve": ("curve_point", "1", "index of the curve of a point"),
    "point_axial_forcing": ("curve_point", "1", "axial forcing of a point of a curve"),
    "point_restitution": ("curve_point", "1", "restitution of a point of a curve"),
    "point_forcing_phase": ("curve_point", "rad", "forcing phase of the point"),
    "point_admissible": (
        "curve_point", "1", "1: the orbit is a motion of a disk, 0: a flight is cut short"
    ),
    "special_curve": ("special", "1", "index of the curve of a special point"),
    "special_axial_forcing": ("special", "1", "axial forcing of a special point"),
    "special_restitution": ("special", "1", "restitution of a special point"),
    "lost_orbits": ((), "1", "orbits that could not be followed"),
}  # fmt: skip
"""Arrays of the curves -> dimension, unit and what they are."""
