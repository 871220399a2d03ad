"""Ranges of sliders, where what a parameter may be is too wide for one.

`slider_of` is for tools that know a parameter alone, `page_spans` for the page, which knows all.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from bouncing_disk_ros.parameters import AXIAL_FORCING, TABLE, Value, amplitude_of

_SLIDERS = {
    "axial_amplitude": (0.0, 0.1), "angular_amplitude": (0.0, math.pi), "frequency": (0.1, 20.0),
    "phase_lag": (-math.pi, math.pi), "mass": (0.01, 2.0), "friction": (0.0, 2.0),
    "friction_radius": (0.01, 0.5), "gyration_radius": (0.01, 0.5), "gravity": (0.0, 20.0),
    "preload": (-2.0, 10.0), "load_torque": (-0.1, 0.1), "brake_torque": (0.0, 0.1),
    "load_inertia": (0.0, 0.01), "initial_height": (0.0, 1.0),
    "initial_axial_velocity": (-5.0, 5.0), "initial_angular_velocity": (-50.0, 50.0),
    "initial_angle": (-math.pi, math.pi), "initial_forcing_phase": (0.0, math.tau),
    "real_time_factor": (0.0, 2.0), "state_rate": (1.0, 1000.0), "rotor_speed_rate": (0.1, 100.0),
    "crossfade_duration": (0.0, 5.0), "command_tolerance": (0.0, 1.0),
    "chatter_report_speed": (0.0, 0.1), "offset_limit": (0.0, 1.0),
    "offset_speed_limit": (0.0, 10.0), "offset_acceleration_limit": (0.0, 100.0),
    "step_periods": (1, 100), "step_nanoseconds": (1, 1_000_000_000),
    "lockstep_timeout": (0.1, 10.0), "snapshot_period": (0.1, 60.0),
}  # fmt: skip


def slider_of(name: str, value: Value) -> tuple[float, float] | None:
    """The range that a slider of a parameter shows at a value; None: what is allowed fits one.

    The value lies in it, and twice the value.
    """
    if name not in _SLIDERS or isinstance(value, (bool, str)):
        return None
    spec, (low, high) = TABLE[name], _SLIDERS[name]
    low, high = min(low, value, 2 * value), max(high, value, 2 * value)
    least, most = spec.bounds
    return max(low, least), min(high, most)


def page_spans(values: Mapping[str, float]) -> dict[str, tuple[float, float]]:
    """The ranges of sliders that depend on the other parameters: Γ, platform, preload and loads."""
    weight = values["mass"] * values["gravity"]
    pull = max(weight + values["preload"], 0.0)
    # T* = μ a_e (m g + P): what friction can pass on in the mean, N·m; at least a little
    torque = max(values["friction"] * values["friction_radius"] * pull, 1e-9)
    reach = max(amplitude_of(1.0, values), 1e-9)  # as Γ; the arc goes as far
    return {
        AXIAL_FORCING.name: (0.0, 1.0),
        "axial_amplitude": (0.0, reach),
        "angular_amplitude": (0.0, reach / values["friction_radius"]),
        "frequency": (0.1 * values["frequency"], 2.0 * values["frequency"]),
        "preload": (-0.5 * weight, 4.0 * weight),
        "load_torque": (-1.2 * torque, 1.2 * torque),
        "brake_torque": (0.0, 1.2 * torque),
        "load_inertia": (0.0, 10.0 * values["mass"] * values["gyration_radius"] ** 2),
    }
