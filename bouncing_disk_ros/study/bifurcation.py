"""The study `bifurcation`: an attractor followed along one parameter (paper, Fig. 3)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cached_property
from typing import ClassVar

import numpy as np
import xarray as xr

from bouncing_disk_ros.analysis.bifurcation import STATE, Branch, begin, follow
from bouncing_disk_ros.analysis.continuation import (
    Doubling,
    existence_limit,
    feigenbaum_ratios,
    period_doublings,
)
from bouncing_disk_ros.analysis.next_collision import MapState, NextCollisionMap
from bouncing_disk_ros.analysis.periodic_orbit import fixed_point
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.study.definition import Arrays, Axis, Field, Region, Study

NAMES = {
    "axial_forcing": ("forcing", "Γ", "1"),
    "restitution": ("restitution", "ε", "1"),
    "phase_lag": ("phase_lag", "θ", "rad"),
    "angular_forcing": ("angular_forcing", "Γ_T", "1"),
}
"""Parameter that a diagram can run along -> its name in the map, symbol and unit."""
VALUES_OF_A_REGION = 64
_BESIDE_BIRTH = 1e-4
"""So far from the value where the period-1 orbit is born its continuation begins."""


class Bifurcation(Study):
    """Impacts on the attractor over a parameter, each value from where the one before ended."""

    name: ClassVar[str] = "bifurcation"
    title: ClassVar[str] = "Bifurcation diagram of the next-collision map"
    sequential: ClassVar[bool] = True

    def __init__(self, parameters: Mapping[str, Value]) -> None:
        super().__init__(parameters)
        given = self.parameters
        if given["along"] not in NAMES:
            raise InputError("along", given["along"], "one of " + ", ".join(NAMES))
        if given["begin"] == given["end"] and int(given["count"]) > 1:
            raise InputError("end", given["end"], "another value than begin", "The axis is empty.")
        self.axis = NAMES[str(given["along"])][0]
        if int(given["kept"]) > int(given["measured"]):
            raise InputError("kept", given["kept"], f"at most measured = {given['measured']}")
        for end in ("begin", "end"):
            self._check_end(end)
        self._start()

    def _check_end(self, name: str) -> None:
        value = float(self.parameters[name])
        try:
            self.section(**{self.axis: value})
        except InputError as error:
            along = str(self.parameters["along"])
            raise InputError(name, value, error.allowed, f"It is a value of {along}.") from None

    def section(self, **changed: float) -> NextCollisionMap:
        """The map at the fixed parameters, some of them changed."""
        fixed = {inner: float(self.parameters[name]) for name, (inner, _, _) in NAMES.items()}
        return NextCollisionMap(**{**fixed, **changed})

    def _start(self) -> np.ndarray:
        """The state of the first value: that given, or the period-1 orbit there."""
        given = self.parameters
        section = self.section(**{self.axis: float(given["begin"])})
        velocity = float(given["initial_velocity"])
        if velocity == 0.0:
            try:
                return begin(section)
            except InputError as error:
                hint = (
                    "It starts on the period-1 orbit, which begin does not have; choose another "
                    "begin, or a start of your own: initial_velocity < 0 and initial_phase."
                )
                raise InputError("begin", given["begin"], _threshold(error), hint) from None
        return begin(section, MapState(float(given["initial_phase"]) % math.tau, velocity))

    @property
    def axes(self) -> Mapping[str, Axis]:
        """The parameter, and the impacts kept at each value."""
        given = self.parameters
        _, symbol, unit = NAMES[str(given["along"])]
        values = np.linspace(float(given["begin"]), float(given["end"]), int(given["count"]))
        label = str(given["along"]).replace("_", " ")
        return {
            "value": Axis(values, unit, label, symbol),
            "impact": Axis(np.arange(int(given["kept"])), "1", "impacts, the last ones measured"),
            "number": Axis(np.arange(STATE), "1", "numbers of the state that the next begins with"),
        }

    @property
    def fields(self) -> Mapping[str, Field]:
        """As in analysis.bifurcation.Branch."""
        cloud, line, speed = ("value", "impact"), ("value",), "omega Phi"
        return {
            "forcing_phase": Field(cloud, "float64", "rad", "forcing phase at impact", "τ_imp"),
            "axial_impact_velocity": Field(
                cloud, "float64", "pi g/omega", "relative velocity before impact", "w_A"
            ),
            "angular_velocity": Field(cloud, "float64", speed, "speed before impact", "α̇/(ωΦ)"),
            "contact": Field(cloud, "uint8", "1", "whether it rode on the platform before", fill=0),
            "mean_speed": Field(line, "float64", speed, "mean speed in time"),
            "mean_speed_per_impact": Field(line, "float64", speed, "mean speed of the impacts"),
            "lyapunov_exponent": Field(line, "float64", "1", "Lyapunov exponent per impact", "λ"),
            "contacts": Field(line, "float64", "1", "rides on the platform per impact"),
            "state": Field(("value", "number"), "float64", "1", "state after the last impact"),
        }

    @property
    def chunks(self) -> Mapping[str, int]:
        """Values in a row."""
        return {"value": VALUES_OF_A_REGION}

    def compute(self, region: Region, context: Arrays, before: Arrays | None) -> Arrays:  # noqa: ARG002
        """Follow on from the state of the region before."""
        given = self.parameters
        values = self.axes["value"].values[region.slices["value"]].astype(float)
        state = self._start() if before is None else before["state"][-1:].astype(float)
        branch = follow(
            self.section(), self.axis, values, state, settling=int(given["settling"]),
            measured=int(given["measured"]), kept=int(given["kept"]),
        )  # fmt: skip
        return _fields_of(branch)

    def finish(self, result: xr.Dataset, context: Arrays) -> xr.Dataset:  # noqa: ARG002
        """Add the period doublings between the ends of the axis, where it is Γ or ε."""
        points = self.doublings
        values = [point.value for point in points]
        ratios = feigenbaum_ratios(values) if len(values) > 2 else np.empty(0)
        return result.assign(
            {
                "doubling": ("doubling_number", np.array(values)),
                "doubling_impacts": ("doubling_number", [point.impacts for point in points]),
                "feigenbaum_ratio": ("ratio_number", np.asarray(ratios)),
            }
        )

    @cached_property
    def doublings(self) -> list[Doubling]:
        """Period doublings of the period-1 orbit, by continuation, not read off the diagram."""
        count = int(self.parameters["doublings"])
        if self.axis not in ("forcing", "restitution") or not count:
            return []
        low, high = sorted(float(self.parameters[name]) for name in ("begin", "end"))
        fixed = self.section(**{self.axis: low})
        # (1 − ε)/(1 + ε) = Γ where the orbit is born, the same with Γ and ε exchanged
        born = existence_limit(fixed.restitution if self.axis == "forcing" else fixed.forcing)
        section = self.section(**{self.axis: max(low, born + _BESIDE_BIRTH)})
        if not getattr(section, self.axis) < high:
            return []
        try:
            orbit = fixed_point(section.forcing, section.restitution)
        except InputError:  # no period-1 orbit there
            return []
        if not orbit.stable:  # its doublings lie below the axis
            return []
        return list(period_doublings(orbit, self.axis, high, count))


def _threshold(error: InputError) -> str:
    return f"Γ {error.allowed}" if error.field == "forcing" else error.allowed


def _fields_of(branch: Branch) -> Arrays:
    return {
        "forcing_phase": branch.forcing_phase[:, 0],
        "axial_impact_velocity": branch.axial_impact_velocity[:, 0],
        "angular_velocity": branch.angular_velocity[:, 0],
        "contact": branch.contact[:, 0].astype(np.uint8),
        "mean_speed": branch.mean_speed[:, 0],
        "mean_speed_per_impact": branch.mean_speed_per_impact[:, 0],
        "lyapunov_exponent": branch.lyapunov_exponent[:, 0],
        "contacts": branch.contacts[:, 0],
        "state": branch.ends[:, 0],
    }


def branch_of(result: xr.Dataset) -> Branch:
    """A stored diagram as the analysis gives it."""
    one = {name: result[name].values[:, None] for name in result.data_vars
           if name in Branch._fields}  # fmt: skip
    one["contact"] = one["contact"].astype(bool)
    return Branch(values=result["value"].values, ends=result["state"].values[:, None], **one)
