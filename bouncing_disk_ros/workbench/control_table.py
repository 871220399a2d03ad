"""The sliders of the page: which numbers they stand for, in which unit, and what they send."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from bouncing_disk_ros.core.model import Disk, Motion
from bouncing_disk_ros.maps.scales import axial_forcing_of
from bouncing_disk_ros.parameters import TABLE
from bouncing_disk_ros.sliders import slider_of
from bouncing_disk_ros.topics import MOTION_NAMES
from bouncing_disk_ros.workbench.actions import Action, Move, Set

FORCING = "axial_forcing"
"""The slider of Γ, which stands for the axial amplitude that gives it."""
STEPS = 500
_UNITS: Mapping[str, tuple[tuple[float, str], ...]] = {
    "m": ((1.0, "m"), (1e-3, "mm"), (1e-6, "µm"), (1e-9, "nm")),
    "rad": ((1.0, "rad"), (1e-3, "mrad"), (1e-6, "µrad")),
    "Hz": ((1e6, "MHz"), (1e3, "kHz"), (1.0, "Hz")),
    "N": ((1.0, "N"), (1e-3, "mN")),
    "N·m": ((1.0, "N·m"), (1e-3, "mN·m"), (1e-6, "µN·m")),
    "kg·m²": ((1.0, "kg·m²"), (1e-3, "g·m²"), (1e-7, "g·cm²"), (1e-9, "g·mm²")),
}
"""SI unit -> units that sliders show, from the largest; their sizes."""


@dataclass(frozen=True)
class Control:
    """A slider: the parameter or forcing of its name, with a short label."""

    name: str
    label: str

    @property
    def unit(self) -> str:
        """The SI unit; empty where there is none."""
        return "" if self.name == FORCING else TABLE[self.name].shown_unit

    def value(self, values: Mapping[str, float]) -> float:
        """What it stands at, in SI units."""
        return forcing_of(values) if self.name == FORCING else values[self.name]

    def limits(self, values: Mapping[str, float]) -> tuple[float, float]:
        """What its slider goes from and to at these parameters: room to more than double it."""
        value = self.value(values)
        spans: Mapping[str, tuple[float, float]] = {
            FORCING: (0.0, 1.0),
            "axial_amplitude": (0.0, 1e-3 * amplitude_of(1.0, values)),
            "angular_amplitude": (0.0, 1e-4),
            "frequency": (0.1 * value, 2.0 * value),
            "preload": (-0.5 * values["mass"] * values["gravity"], 4.0 * _weight(values)),
            "load_torque": (-1.2 * friction_torque(values), 1.2 * friction_torque(values)),
            "brake_torque": (0.0, 1.2 * friction_torque(values)),
            "load_inertia": (0.0, 10.0 * values["mass"] * values["gyration_radius"] ** 2),
        }
        low, high = spans.get(self.name) or slider_of(self.name, value) or (0.0, 1.0)
        return min(low, 2.0 * value), max(high, 2.0 * value)

    def action(self, given: float, values: Mapping[str, float]) -> Action:
        """What setting it to a number (SI) sends."""
        if self.name == FORCING:
            return Move({"axial_amplitude": amplitude_of(given, values)})
        if self.name in MOTION_NAMES:
            return Move({self.name: given})
        return Set({self.name: given})


MOTION_CONTROLS = (
    Control("axial_amplitude", "A"),
    Control(FORCING, "Γ"),
    Control("frequency", "f"),
    Control("angular_amplitude", "Φ"),
    Control("phase_lag", "θ"),
)
DISK_CONTROLS = (
    Control("restitution", "ε restitution"),
    Control("friction", "μ friction"),
    Control("preload", "P preload"),
    Control("load_torque", "load torque"),
    Control("brake_torque", "brake torque"),
    Control("load_inertia", "load inertia"),
)


def forcing_of(values: Mapping[str, float]) -> float:
    """Γ of parameters by name, 1."""
    motion = Motion(*(values[name] for name in MOTION_NAMES))
    return axial_forcing_of(motion, Disk(*(values[name] for name in Disk._fields)))


def amplitude_of(axial_forcing: float, values: Mapping[str, float]) -> float:
    """The axial amplitude, m, that has a forcing with the other parameters."""
    pull = values["gravity"] + values["preload"] / values["mass"]
    return axial_forcing * math.pi * pull / (math.tau * values["frequency"]) ** 2


def _weight(values: Mapping[str, float]) -> float:
    return values["mass"] * values["gravity"]


def friction_torque(values: Mapping[str, float]) -> float:
    """T* = μ a_e (m g + P): what friction can pass on in the mean, N·m; at least a little."""
    pull = max(_weight(values) + values["preload"], 0.0)
    return max(values["friction"] * values["friction_radius"] * pull, 1e-9)


def shown_unit(unit: str, largest: float) -> tuple[float, str]:
    """A unit for numbers up to a largest one: its size, its name."""
    known = _UNITS.get(unit, ((1.0, unit),))
    return next(((size, name) for size, name in known if largest >= 2.0 * size), known[-1])
