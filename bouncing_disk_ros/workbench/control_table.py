"""The sliders of the page: which numbers they stand for, in which unit, and what they send."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from bouncing_disk_ros.analysis.scales import axial_forcing_of
from bouncing_disk_ros.core.model import Disk, Motion
from bouncing_disk_ros.parameters import TABLE, slider_of
from bouncing_disk_ros.topics import MOTION_NAMES
from bouncing_disk_ros.workbench.actions import Action, Move, Set

FORCING = "axial_forcing"
"""The slider of Γ, which stands for the axial amplitude that gives it."""
STEPS = 500
_PREFIXES = ((1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))
_PREFIXED = ("m", "Hz", "N", "N·m", "kg·m²", "m/s²", "N·s", "N·m·s")
_LARGE = ((1e3, "k"), (1e6, "M"))


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

    def limits(self, value: float) -> tuple[float, float]:
        """What its slider goes from and to at a value."""
        if self.name == FORCING:
            return 0.0, max(1.0, 2.0 * value)
        if self.name == "axial_amplitude" and value > 0.0:
            return 0.0, max(2.5 * value, 1e-9)
        if self.name == "frequency":
            return 0.1 * value, 2.0 * value
        spec = TABLE[self.name]
        low, high = slider_of(self.name, value) or (spec.low or 0.0, spec.high or 1.0)
        return low, high

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


def shown_unit(unit: str, largest: float) -> tuple[float, str]:
    """A unit with a prefix for numbers up to a largest one: its size, its name."""
    if unit not in _PREFIXED or unit == "kg·m²" or largest <= 0.0:
        return 1.0, unit
    for size, prefix in reversed(_LARGE):
        if largest >= 2.0 * size:
            return size, prefix + unit
    for size, prefix in _PREFIXES:
        if largest >= 2.0 * size:
            return size, prefix + unit
    return _PREFIXES[-1][0], _PREFIXES[-1][1] + unit
