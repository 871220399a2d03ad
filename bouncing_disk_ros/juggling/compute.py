"""The study `juggling`: which starts each strategy brings onto an orbit, under which errors."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from bouncing_disk_ros.errors import InputError, closest
from bouncing_disk_ros.juggling.loop_settings import (
    HEARS_TIMES_ONLY,
    STRATEGIES,
    Limits,
    Sensor,
    check_strategy,
    controller_settings,
    period_one_points,
    plant_settings,
    sines_and_cosines,
)
from bouncing_disk_ros.juggling.target_orbit import OWN, best_phase_lag, orbit_named
from bouncing_disk_ros.maps.attractors import refuse_conservative
from bouncing_disk_ros.maps.basin_measures import centres
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.study.computation import Arrays, Axis, Field, Region, Row, Study, variables

WINDOW, REST = "window", "rest"
NUMBERS = ("axial_forcing", "restitution_error", "delay", "jitter", "missed", "impulse",
           "angular_forcing")  # fmt: skip
TEXTS = ("start", "target", "phase_lag")
"""What a condition can set, besides `learn`."""
_REST = 1.0  # kind of state, of the kernels
_RESULTS = ("verdict", "impacts", "time", "largest_offset", "largest_acceleration", "commands", "",
            "rotor_speed")  # fmt: skip
BEST = "best"
"""The phase lag with the largest rotor speed on the target."""
_FLAGS = {0: "never", 1: "captured", 2: "lost"}


class Condition(NamedTuple):
    """One case: the loop with its errors, where it starts and where it is to go."""

    name: str
    axial_forcing: float
    restitution_error: float  # of the ε that the controller believes, in parts of the true one
    sensor: Sensor
    impulse: float
    start: str
    target: str
    learns: bool
    angular_forcing: float
    phase_lag: str


class Juggling(Study):
    """Verdicts over strategies, conditions and starts; parameters as in the table."""

    name: ClassVar[str] = "juggling"
    title: ClassVar[str] = "Closed loops that keep a multiple toss going"
    revision: ClassVar[int] = 2

    def __init__(self, parameters: Mapping[str, Value]) -> None:
        super().__init__(parameters)
        given = self.parameters
        self.restitution = float(given["restitution"])
        refuse_conservative(self.restitution)
        self.strategies = str(given["strategies"]).replace(",", " ").split()
        if not self.strategies or len(set(self.strategies)) < len(self.strategies):
            allowed = "some of " + ", ".join(STRATEGIES) + ", each once"
            raise InputError("strategies", given["strategies"], allowed)
        for name in self.strategies:
            check_strategy(name)
        self.conditions = [self._condition(one) for one in str(given["conditions"]).split(";")]
        for one in self.conditions:
            if one.phase_lag != BEST:
                _number("phase_lag", one.phase_lag, f" or {BEST}")
            if not self.believed(one) <= 1.0:
                hint = f"The controller would believe in a restitution of {self.believed(one):g}."
                allowed = f"up to 1/ε − 1 = {1.0 / self.restitution - 1.0:.6g}"
                raise InputError("restitution_error", one.restitution_error, allowed, hint)
            if one.target == OWN or one.start == OWN:
                period_one_points(one.axial_forcing, self.restitution)
        if not float(given["velocity_begin"]) < float(given["velocity_end"]):
            allowed = f"less than velocity_end = {float(given['velocity_end']):g}"
            raise InputError("velocity_begin", given["velocity_begin"], allowed)

    def _condition(self, text: str) -> Condition:
        """A condition from its text: name=value, with commas between; the rest as in the table."""
        given = {name: self.parameters[name] for name in (*NUMBERS, *TEXTS, "learn")}
        text = text.strip() or "nominal"
        for part in text.split(",") if text != "nominal" else ():
            name, _, value = (word.strip() for word in part.partition("="))
            if name not in given or not value:
                allowed = "nominal, or NAME=VALUE with commas between; names: " + ", ".join(given)
                raise InputError("conditions", part.strip(), allowed, closest(name, given))
            given[name] = value
        numbers = {name: _number(name, given[name]) for name in NUMBERS}
        learns = str(given["learn"]).lower() in ("true", "1")
        sensor = Sensor(
            numbers["delay"], numbers["jitter"], numbers["missed"], int(self.parameters["seed"])
        )
        return Condition(
            text, numbers["axial_forcing"], numbers["restitution_error"], sensor,
            numbers["impulse"], str(given["start"]), str(given["target"]), learns,
            numbers["angular_forcing"], str(given["phase_lag"]),
        )  # fmt: skip

    @property
    def axes(self) -> Mapping[str, Axis]:
        """Strategies, conditions and the starts: centres of the pixels of the window."""
        given = self.parameters
        low, high = float(given["velocity_begin"]), float(given["velocity_end"])
        n, m = int(given["height"]), int(given["width"])
        return {
            "strategy": Axis(np.arange(len(self.strategies)), "1", "strategy"),
            "condition": Axis(np.arange(len(self.conditions)), "1", "condition"),
            "velocity": Axis(
                centres(low, high, n), "pi g/omega",
                "relative velocity before the first impact", "w_A",
            ),
            "forcing_phase": Axis(
                centres(0.0, math.tau, m), "rad", "forcing phase of the first impact",
                "τ_imp",
            ),
        }  # fmt: skip

    @property
    def fields(self) -> Mapping[str, Field]:
        """The verdict of each start, and what it took."""
        dims = ("strategy", "condition", "velocity", "forcing_phase")
        return {
            "verdict": Field(dims, "int8", "1", "how the run ended", fill=-1, flags=_FLAGS),
            "impacts": Field(dims, "int32", "1", "impacts until the orbit was reached", fill=0),
            "time": Field(dims, "float64", "2 pi/omega", "time until the orbit was reached"),
            "largest_offset": Field(dims, "float64", "A", "largest offset commanded"),
            "largest_acceleration": Field(
                dims, "float64", "A omega^2", "largest acceleration of the offset commanded"
            ),
            "commands": Field(dims, "int32", "1", "trajectories commanded", fill=0),
            "rotor_speed": Field(
                dims, "float64", "omega Phi", "mean angular velocity in the last ten periods"
            ),
        }

    @property
    def chunks(self) -> Mapping[str, int]:
        """A strategy and a condition at once, in parts of some thousand starts."""
        rows = max(1, 4000 // int(self.parameters["width"]))
        return {"strategy": 1, "condition": 1, "velocity": rows}

    def context(self) -> Arrays:
        """Points (forcing phase, velocity after) of the orbits that conditions name."""
        found: dict[str, NDArray[np.float64]] = {}
        for one in self.conditions:
            for name in {one.start, one.target} - {OWN, WINDOW, REST}:
                key = f"{one.axial_forcing!r} {name}"
                if key not in found:
                    found[key] = orbit_named(
                        name, one.axial_forcing, self.restitution, field="start or target",
                        others=(WINDOW, REST), lowest=float(self.parameters["velocity_begin"]),
                    )  # fmt: skip
        return dict(found)

    def believed(self, one: Condition) -> float:
        """The restitution that the controller believes in at the start."""
        return self.restitution * (1.0 + one.restitution_error)

    def orbit(self, one: Condition, name: str, context: Arrays) -> NDArray[np.float64]:
        """Points of an orbit that a condition names."""
        if name == OWN:
            return period_one_points(one.axial_forcing, self.restitution)
        return np.ascontiguousarray(context[f"{one.axial_forcing!r} {name}"], float)

    def phase_lag(self, one: Condition, context: Arrays) -> float:
        """θ of a condition, rad."""
        if one.phase_lag != BEST:
            return float(one.phase_lag)
        return best_phase_lag(self.orbit(one, one.target, context), one.axial_forcing)

    def compute(self, region: Region, context: Arrays, before: Arrays | None) -> Arrays:  # noqa: ARG002
        """Run the loops of one region."""
        from bouncing_disk_ros.juggling.kernels.loop_kernel import RESULTS, run_loops

        given = self.parameters
        strategy = self.strategies[region.slices["strategy"].start]
        one = self.conditions[region.slices["condition"].start]
        rows = region.slices["velocity"]
        w = self.axes["velocity"].values[rows].astype(float)
        tau = self.axes["forcing_phase"].values.astype(float)
        starts = self._starts(one, w, tau, context)
        limits = Limits(*(float(given[f"{name}_limit"]) for name in Limits.__dataclass_fields__))
        settings = controller_settings(
            strategy, one.axial_forcing, self.believed(one), limits,
            learns=one.learns, own_orbit=one.target == OWN,
        )  # fmt: skip
        plant = plant_settings(
            self.restitution, one.sensor, hears_velocity=strategy not in HEARS_TIMES_ONLY,
            deadline=float(given["deadline"]), impulse=one.impulse,
            phase_lag=self.phase_lag(one, context), angular_forcing=one.angular_forcing,
        )  # fmt: skip
        results = np.zeros((len(starts), RESULTS))
        run_loops(
            settings, self.orbit(one, one.target, context), plant, starts,
            float(given["tolerance"]), int(given["streak"]), one.sensor.seed,
            rows.start * len(tau), results, np.zeros((0, 2)),
        )  # fmt: skip
        results[:, 2] /= math.tau
        results[:, 3:5] /= one.axial_forcing
        shape = (1, 1, len(w), len(tau))
        return {name: results[:, i].reshape(shape) for i, name in enumerate(_RESULTS) if name}

    def _starts(
        self, one: Condition, w: NDArray[np.float64], tau: NDArray[np.float64], context: Arrays
    ) -> NDArray[np.float64]:
        """States (kind, instant, position, velocity) after a first impact, or at rest."""
        grid = np.zeros((len(w), len(tau), 4))
        sine, cosine = sines_and_cosines(tau)
        grid[:, :, 1], grid[:, :, 2] = tau, one.axial_forcing * sine
        grid[:, :, 3] = one.axial_forcing * cosine - self.restitution * w[:, None]
        starts = grid.reshape(-1, 4)
        if one.start == REST:
            starts[:, 0], starts[:, 3] = _REST, 0.0
        elif one.start != WINDOW:
            points = self.orbit(one, one.start, context)
            sine, _ = sines_and_cosines(points[:, 0])
            heights = one.axial_forcing * sine
            each = np.arange(len(starts)) % len(points)
            starts[:, 1:] = np.stack((points[:, 0], heights, points[:, 1]), axis=1)[each]
        return starts

    def finish(self, result: xr.Dataset, context: Arrays) -> xr.Dataset:  # noqa: ARG002
        """Part of the starts captured, lost and never captured, and medians, for each case."""
        over, left = ("velocity", "forcing_phase"), ("strategy", "condition")
        verdict, part = result["verdict"], "part of the starts that was"
        median = result["time"].where(verdict == 1).median(over)
        never, captured, lost = ((verdict == flag).mean(over).values for flag in _FLAGS)
        rows: dict[str, Row] = {
            "never": (left, never, "1", f"{part} never captured"),
            "captured": (left, captured, "1", f"{part} captured"),
            "lost": (left, lost, "1", f"{part} captured and lost again"),
            "median_time": (left, median.values, "2 pi/omega",
                            "median time until the orbit was reached"),
            "median_rotor_speed": (left, result["rotor_speed"].median(over).values, "omega Phi",
                                   "median over the starts of the rotor speed"),
            "offset_used": (left, result["largest_offset"].max(over).values, "A",
                            "largest offset of all runs"),
            "acceleration_used": (left, result["largest_acceleration"].max(over).values,
                                  "A omega^2", "largest acceleration of the offset of all runs"),
            "strategy_name": ("strategy", self.strategies, "1", "name of the strategy"),
            "condition_name": ("condition", [one.name for one in self.conditions], "1",
                               "text of the condition"),
        }  # fmt: skip
        return result.assign(variables(rows))


def _number(name: str, value: Value, other: str = "") -> float:
    low, high = RANGES[name]
    try:
        number = float(value)
    except ValueError:
        number = math.nan
    if not low <= number <= high:
        raise InputError(name, value, f"a number from {low:g} to {high:g}{other}")
    return number


RANGES: Mapping[str, tuple[float, float]] = {
    "axial_forcing": (1e-6, 1e3),
    "restitution_error": (-0.9, 0.9),
    "delay": (0.0, 10.0),
    "jitter": (0.0, 1.0),
    "missed": (0.0, 1.0),
    "impulse": (-10.0, 10.0),
    "angular_forcing": (1e-6, 1e6),
    "phase_lag": (-1e3, 1e3),
}
