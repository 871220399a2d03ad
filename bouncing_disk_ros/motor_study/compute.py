"""The study `motor`: speed, powers and losses of an ultrasonic motor over two of its parameters.

Before its class `Motor` what follows from a whole map: no-load speed, stall torque, the best of
each row.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import ClassVar

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from bouncing_disk_ros.core.model import Disk, Motion
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.motor_curves import friction_limit, preload_regimes, runs_away
from bouncing_disk_ros.maps.scales import axial_forcing_of
from bouncing_disk_ros.motor_study.motor_points import (
    KINDS,
    MEANS,
    UNKNOWN_KIND,
    Run,
    measure,
)
from bouncing_disk_ros.parameters import TABLE, Value
from bouncing_disk_ros.study.computation import (
    IMPACTS_IN_REPETITION,
    Arrays,
    Axis,
    Field,
    Region,
    Row,
    variables,
)
from bouncing_disk_ros.study.plane_study import PlaneStudy

Floats = NDArray[np.float64]


def derived(
    result: xr.Dataset, up: str, across: str, limits: Callable[[str], Floats]
) -> xr.Dataset:
    """The result with what its rows or columns amount to, arrays over the other axis.

    `limits` gives the torque T* of friction along an axis.
    """
    found = dict(zip((up, across), (across, up), strict=True))
    added: dict[str, Row] = {}
    for name, other in found.items():
        speed = _along(result, "mean_speed", name)
        if name in ("load_torque", "brake_torque"):
            loads = result[name].values
            best, place = _best(_along(result, "efficiency", name), loads)
            no_load = np.array([_at_zero(loads, row) for row in speed])
            about = f"{name.replace('_', ' ')} of the largest efficiency"
            added["best_efficiency"] = (other, best, "1", "largest efficiency")
            added[f"best_{name}"] = (other, place, "N·m", about)
            added["no_load_speed"] = (other, no_load, "rad/s", "no-load speed")
        if name == "load_torque":
            rows = zip(speed, limits(other), strict=True)
            stalls = [stall(result[name].values, row, top) for row, top in rows]
            added["stall_torque"] = (other, np.array(stalls), "N·m", "stall torque")
        if name == "phase_lag":
            # with its sign: a load that turns the rotor back can be faster than the stator forwards
            fastest, place = _best(speed, result[name].values)
            about = "phase lag of the largest mean speed"
            added["best_phase_lag"] = (other, place, "rad", about)
            about = "largest mean speed, with its sign"
            added["best_speed"] = (other, fastest, "rad/s", about)
    return result.assign(variables(added))


def _along(result: xr.Dataset, field: str, name: str) -> Floats:
    """A field with the axis called `name` last."""
    found: Floats = result[field].transpose(..., name).values
    return found


def _best(rows: Floats, places: Floats) -> tuple[Floats, Floats]:
    """The largest value of each row and where it is; nan where none is known."""
    known = np.isfinite(rows)
    at = np.where(known, rows, -math.inf).argmax(axis=1)
    any_known = known.any(axis=1)
    best = rows[np.arange(len(rows)), at]
    return np.where(any_known, best, math.nan), np.where(any_known, places[at], math.nan)


def _at_zero(loads: Floats, speed: Floats) -> float:
    """The speed at load 0, between the loads next to it; nan where the axis does not reach it."""
    if not loads[0] <= 0.0 <= loads[-1]:
        return math.nan
    return float(np.interp(0.0, loads, speed))


def stall(loads: Floats, speed: Floats, limit: float) -> float:
    """The load that brings a rotor to a stop: where the mean speed crosses 0, on a straight line.

    T* (`limit`) where friction gives way before: the line through the last two loads says so. nan
    where the axis ends before both, or has one load alone below T*.
    """
    begin = _at_zero(loads, speed)
    if not math.isfinite(begin):
        return math.nan
    if begin == 0.0:
        return 0.0
    sign = math.copysign(1.0, begin)
    ahead = loads * sign > 0.0
    places, values = (loads[ahead] * sign), (speed[ahead] * sign)
    if sign < 0.0:
        places, values = places[::-1], values[::-1]
    before, height, fall = 0.0, abs(begin), math.nan
    for place, value in zip(places, values, strict=True):
        if not math.isfinite(value):
            if place < limit or math.isnan(fall):
                return math.nan
            return sign * float(min(limit, before + height / fall) if fall > 0.0 else limit)
        fall = (height - value) / (place - before)
        if value <= 0.0:
            return sign * float(before + (place - before) * height / (height - value))
        before, height = float(place), float(value)
    return math.nan


AXES = (
    "load_torque", "brake_torque", "preload", "axial_amplitude", "angular_amplitude", "frequency",
    "phase_lag", "restitution", "friction",
)  # fmt: skip
"""Parameters that an axis may have."""
SIDE, POINTS_OF_A_REGION = 16, 400
"""Points along a side of a region, or in the rows of one where points follow each other."""


_COLUMNS: Mapping[str, tuple[str, str] | tuple[str, str, str]] = {
    "mean_speed": ("rad/s", "mean speed of the rotor"),
    "measured": ("1", "periods of the stator that the means are over"),
    "output_power": ("W", "output power: work on load and brake per second"),
    "brake_power": ("W", "the brake's part of the output power"),
    "axial_power": ("W", "work of the stator's axial motion per second"),
    "angular_power": ("W", "work of the stator's rotation per second"),
    "efficiency": ("1", "output over the work of the stator", "η"),
    "impact_loss": ("W", "lost by restitution per second"),
    "impact_friction_loss": ("W", "lost by slip in impacts per second"),
    "sliding_loss": ("W", "lost by slip in contact per second"),
    "friction_work_per_turn": ("J", "work of friction per turn of the rotor"),
    "contact_share": ("1", "share of time in contact"),
    "impact_rate": ("1/s", "impacts per second; the last ones of a chatter count as one"),
    "rise_time": ("s", "time from rest to 1 − 1/e of the mean speed"),
    "rise_time_95": ("s", "time from rest to 95 % of the mean speed"),
    "stop_time": ("s", "time to lose 1 − 1/e of the speed on a stator at rest"),
    "stop_time_95": ("s", "time to lose 95 % of the speed on a stator at rest"),
}
"""Means -> unit, what they are, symbol."""


class Motor(PlaneStudy):
    """Means over a plane of two parameters, in SI units; parameters as in the table."""

    name: ClassVar[str] = "motor"
    title: ClassVar[str] = "Means of a standing-wave motor over two parameters"
    revision: ClassVar[int] = 4
    axis_names: ClassVar[tuple[str, ...]] = AXES
    conservative_hint: ClassVar[str] = "At 1 impacts lose no energy, so the motion does not settle."

    def __init__(self, parameters: Mapping[str, Value]) -> None:
        super().__init__(parameters)
        given = self.parameters
        if int(given["longest"]) < int(given["settling"]) + 2 * int(given["measured"]):
            least = int(given["settling"]) + 2 * int(given["measured"])
            raise InputError("longest", given["longest"], f">= settling + 2 measured = {least}")
        self._check_preload()
        self._check_that_it_moves()

    def check_value(self, name: str, value: float) -> None:
        """As the simulator's parameter."""
        TABLE[name].checked(value)

    def axis_of(self, name: str, values: NDArray[np.float64]) -> Axis:
        """With unit and symbol of the simulator's parameter."""
        symbol = TABLE[name].symbol.split(" ")[0]
        return Axis(values, TABLE[name].unit, name.replace("_", " "), symbol)

    def _check_preload(self) -> None:
        given = self.parameters
        weight = float(given["mass"]) * float(given["gravity"])
        field, least = "preload", float(given.get("preload", 0.0))
        for key, name in (("x", self.across), ("y", self.up)):
            if name == "preload":
                field, least = f"{key}_begin", float(given[f"{key}_begin"])
        if not least > -weight:
            hint = "Otherwise nothing presses the rotor down."
            raise InputError(field, least, f"> −mass × gravity = {-weight:g} N", hint)

    def _check_that_it_moves(self) -> None:
        """Refuse a plane of which every point runs away or stands still."""
        corners = [
            self.motor_at({self.across: x, self.up: y})
            for x in _ends(self.values_of("x"))
            for y in _ends(self.values_of("y"))
        ]
        if all(runs_away(disk) for _, disk in corners):
            limit = max(friction_limit(disk) + disk.brake_torque for _, disk in corners)
            hint = "Above the torque of friction and brake the rotor runs away at every point."
            field = self._field_of("load_torque")
            least = min((disk.load_torque for _, disk in corners), key=abs)
            raise InputError(field, least, f"a torque up to {limit:.6g} N·m somewhere", hint)
        if all(_stands_still(motion, disk) for motion, disk in corners):
            field, value, allowed = self._what_holds_it(corners)
            raise InputError(field, value, allowed, "With these values nothing moves at any point.")

    def _field_of(self, name: str) -> str:
        ends = {self.across: "x_end", self.up: "y_end"}
        return ends.get(name, name)

    def _what_holds_it(self, corners: list[tuple[Motion, Disk]]) -> tuple[str, float, str]:
        moves = [m for m, _ in corners if m.axial_amplitude > 0.0 or m.angular_amplitude > 0.0]
        if not moves:
            return self._field_of("axial_amplitude"), 0.0, "> 0, or an angular_amplitude > 0"
        if all(disk.friction == 0.0 for _, disk in corners):
            return self._field_of("friction"), 0.0, "> 0, or a load"
        brake = min(disk.brake_torque for _, disk in corners)
        most = max(_largest_torque(motion, disk) for motion, disk in corners)
        return self._field_of("brake_torque"), brake, f"less than {most:.6g} N·m somewhere"

    def motor_at(self, point: Mapping[str, float]) -> tuple[Motion, Disk]:
        """The motor with these values of the axes."""
        values = {**self.parameters, **point}
        return Motion.of(values), Disk.of(values)

    @property
    def fields(self) -> Mapping[str, Field]:
        """Kind of motion, repetition, and the means with their errors."""
        dims = (self.up, self.across)
        flags = dict(KINDS)
        return {
            "kind": Field(dims, "int32", "1", "kind of motion", fill=UNKNOWN_KIND, flags=flags),
            "period": Field(dims, "int32", "1", IMPACTS_IN_REPETITION, fill=0),
            "cycles": Field(
                dims, "int32", "1", "periods of the stator in one repetition, 0: none known",
                fill=0,
            ),
            **{
                name: Field(dims, "float64", *about) for name, about in _COLUMNS.items()
            },
            **{
                f"{name}_error": Field(
                    dims, "float64", _COLUMNS[name][0], f"standard error: {_COLUMNS[name][1]}"
                )
                for name in MEANS
            },
        }  # fmt: skip

    @property
    def chunks(self) -> Mapping[str, int]:
        """Squares; whole rows where each point starts where the one before has ended."""
        if self.parameters["start"] != "followed":
            return {self.up: SIDE, self.across: SIDE}
        columns = int(self.parameters["x_count"])
        return {self.up: max(1, POINTS_OF_A_REGION // columns), self.across: columns}

    def compute(self, region: Region, context: Arrays, before: Arrays | None) -> Arrays:  # noqa: ARG002
        """Measure at each point of a region."""
        given = self.parameters
        up, across = (
            self.axes[name].values[region.slices[name]] for name in (self.up, self.across)
        )
        motors = [
            self.motor_at({self.up: float(y), self.across: float(x)}) for y in up for x in across
        ]
        run = Run(
            str(given["start"]), int(given["settling"]), int(given["measured"]),
            int(given["longest"]),
        )  # fmt: skip
        found = measure(motors, run, len(across))
        return {name: array.reshape(len(up), len(across)) for name, array in found.items()}

    def finish(self, result: xr.Dataset, context: Arrays) -> xr.Dataset:  # noqa: ARG002
        """Add no-load speed, stall torque, the best efficiency and phase lag; and the regimes."""
        first = {name: float(axis.values[0]) for name, axis in self.axes.items()}
        found = derived(result, self.up, self.across, self._limits)
        if "preload" in first:
            regimes = preload_regimes(*self.motor_at(first))
            if not {"axial_amplitude", "frequency", "restitution"} & set(first):
                found = found.assign_attrs(
                    {f"preload_{name}": value for name, value in regimes._asdict().items()}
                )
        return found

    def _limits(self, other: str) -> NDArray[np.float64]:
        """T* along the axis that is not the load."""
        values = self.axes[other].values
        return np.array(
            [
                friction_limit(self.motor_at({"load_torque": 0.0, other: float(v)})[1])
                for v in values
            ]
        )


def _ends(values: NDArray[np.float64]) -> tuple[float, ...]:
    """Both ends of an axis, and 0 where it lies between: loads are least there."""
    begin, end = float(values[0]), float(values[-1])
    return (begin, 0.0, end) if begin < 0.0 < end else (begin, end)


def _largest_torque(motion: Motion, disk: Disk) -> float:
    """The largest torque of load and friction on a rotor that never leaves the stator, N·m."""
    pressed = 1.0 + math.pi * axial_forcing_of(motion, disk)
    return abs(disk.load_torque) + friction_limit(disk) * pressed


def _stands_still(motion: Motion, disk: Disk) -> bool:
    """Whether a rotor on a stator that it never leaves is held for good, or nothing turns it."""
    if math.pi * axial_forcing_of(motion, disk) > 1.0:
        return disk.friction == 0.0 and abs(disk.load_torque) <= disk.brake_torque
    if motion.angular_amplitude == 0.0:
        return not runs_away(disk)
    if disk.friction == 0.0:
        return abs(disk.load_torque) <= disk.brake_torque
    return _largest_torque(motion, disk) <= disk.brake_torque
