"""The study `parameter_map`: what a disk settles on over a plane of two parameters."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.attractors import AttractorKind
from bouncing_disk_ros.maps.next_collision import NextCollisionMap
from bouncing_disk_ros.maps.parameter_plane import (
    UNRESOLVED,
    Settled,
    settle_states,
    start_states,
)
from bouncing_disk_ros.maps.scales import MAP_PARAMETERS
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.study.computation import (
    CONTACTS_PER_IMPACT,
    IMPACTS_IN_REPETITION,
    Arrays,
    Axis,
    Field,
    Region,
)
from bouncing_disk_ros.study.plane_study import PlaneStudy

IMPACTS_OF_A_REGION, SIDES = 20_000_000, (16, 128)
"""About so many impacts, with least and largest side (points)."""
FLAGS = {UNRESOLVED: "unresolved", **{i: str(kind) for i, kind in enumerate(AttractorKind)}}


class ParameterMap(PlaneStudy):
    """Kind, period, exponent and speed over the plane; parameters as in the table."""

    name: ClassVar[str] = "parameter_map"
    title: ClassVar[str] = "Attractors of the next-collision map over two parameters"
    revision: ClassVar[int] = 2
    axis_names: ClassVar[tuple[str, ...]] = tuple(MAP_PARAMETERS)
    conservative_hint: ClassVar[str] = "At 1 the map keeps areas: it has no attractors."

    def __init__(self, parameters: Mapping[str, Value]) -> None:
        super().__init__(parameters)
        self._check_start()

    def check_value(self, name: str, value: float) -> None:
        """As the next-collision map takes it."""
        NextCollisionMap(**{"axial_forcing": 1.0, "restitution": 0.5, name: value})

    def axis_of(self, name: str, values: NDArray[np.float64]) -> Axis:
        """With unit and symbol of the map's parameter."""
        symbol, unit = MAP_PARAMETERS[name]
        return Axis(values, unit, name.replace("_", " "), symbol)

    def _check_start(self) -> None:
        given = self.parameters
        start = str(given["start"])
        if start == "given":
            if not float(given["initial_velocity"]) < 0.0:
                hint = "It is w_A of the first impact; start:=contact: it lies on the platform."
                raise InputError("initial_velocity", given["initial_velocity"], "< 0", hint)
            return
        for name in ("initial_phase", "initial_velocity"):
            value = given.pop(name)
            if value != 0.0:
                hint = f"start is {start}; with start:=given it is used."
                raise InputError(name, value, f"0 with start:={start}", hint)

    @property
    def fields(self) -> Mapping[str, Field]:
        """As in `parameter_plane.Settled`."""
        dims, speed = (self.up, self.across), "omega Phi"
        return {
            "kind": Field(dims, "int32", "1", "kind of attractor", fill=UNRESOLVED, flags=FLAGS),
            "period": Field(dims, "int32", "1", IMPACTS_IN_REPETITION, fill=0),
            "cycles": Field(
                dims, "int32", "1", "periods of the platform in one repetition, 0: none known",
                fill=0,
            ),
            "lyapunov_exponent": Field(dims, "float64", "1", "Lyapunov exponent per impact", "λ"),
            "mean_speed": Field(dims, "float64", speed, "mean speed in time"),
            "mean_speed_change": Field(
                dims, "float64", speed, "change of the mean speed between the halves measured"
            ),
            "contacts": Field(dims, "float64", "1", CONTACTS_PER_IMPACT),
        }  # fmt: skip

    @property
    def chunks(self) -> Mapping[str, int]:
        """Squares."""
        impacts = int(self.parameters["settling"]) + int(self.parameters["measured"])
        side = min(max(SIDES[0], math.isqrt(IMPACTS_OF_A_REGION // impacts)), SIDES[1])
        return {self.up: side, self.across: side}

    def compute(self, region: Region, context: Arrays, before: Arrays | None) -> Arrays:  # noqa: ARG002
        """Settle at each point of a region."""
        given = self.parameters
        sides = [
            self.axes[name].values[region.slices[name]].astype(float)
            for name in (self.up, self.across)
        ]
        points = dict(zip((self.up, self.across), np.meshgrid(*sides, indexing="ij"), strict=True))
        shape = points[self.up].shape
        columns = [
            points.get(name, np.broadcast_to(given.get(name, 0.0), shape))
            for name in MAP_PARAMETERS
        ]
        parameters = np.stack([column.ravel() for column in columns], axis=1).astype(float)
        own = [float(given.get(name, 0.0)) for name in ("initial_phase", "initial_velocity")]
        states = start_states(parameters, str(given["start"]), *own)
        found = settle_states(parameters, states, int(given["settling"]), int(given["measured"]))
        return {name: getattr(found, name).reshape(shape) for name in Settled._fields}
