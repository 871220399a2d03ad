"""A result with all that says what it is: attributes on each variable, axes by their parameters."""

from __future__ import annotations

import xarray as xr

from bouncing_disk_ros.study.definition import Study
from bouncing_disk_ros.study.store import DONE

_SPEED, _VELOCITY = "omega Phi", "pi g/omega"
ADDED: dict[str, tuple[str, str]] = {
    "attractor_name": ("1", "name of the attractor"),
    "attractor_kind": ("1", "kind of the attractor"),
    "attractor_period": ("1", "impacts in one repetition of the attractor, 0: none"),
    "attractor_cycles": ("1", "periods of the platform in one repetition, 0: none"),
    "multiplier": ("1", "largest modulus of the Floquet multipliers of the attractor"),
    "fraction": ("1", "share of the window that goes to the attractor"),
    "fraction_uncertainty": ("1", "standard error of the share"),
    "unresolved_fraction": ("1", "share of the window that is unresolved"),
    "point_attractor": ("1", "attractor that the point belongs to"),
    "point_forcing_phase": ("rad", "forcing phase of the point"),
    "point_velocity": (_VELOCITY, "relative velocity of the point, as on the axis velocity"),
    "basin_entropy": ("1", "basin entropy, mean over squares of 5 × 5 pixels"),
    "boundary_basin_entropy": ("1", "basin entropy of the squares that hold several labels"),
    "uncertainty_exponent": ("1", "uncertainty exponent of the boundary"),
    "uncertainty_exponent_error": ("1", "standard error of the uncertainty exponent"),
    "box_dimension": ("1", "box dimension of the boundary"),
    "box_dimension_error": ("1", "standard error of the box dimension"),
    "boundary_distance": ("pixel", "distance that the boundary was measured at"),
    "uncertain_fraction": ("1", "share of pixels with another label at the distance"),
    "missed_attractor_name": ("1", "attractors the search missed; unresolved starts lead to them"),
    "contact_onset": ("1", "value of the parameter where contact was first seen"),
    "contact_onset_without": ("1", "last value of the parameter before it, without contact"),
    "contact_onset_exponent": ("1", "Lyapunov exponent at the last value without contact"),
    "no_load_speed": ("rad/s", "mean speed without load"),
    "stall_torque": ("N·m", "load torque at which the mean speed is 0"),
    "best_efficiency": ("1", "largest efficiency along x"),
    "best_load_torque": ("N·m", "load torque of the largest efficiency"),
    "doubling": ("1", "value of the parameter at a period doubling"),
    "doubling_impacts": ("1", "impacts in one repetition below the doubling"),
    "feigenbaum_ratio": ("1", "ratio of the distances of successive doublings"),
    "extreme_measure": ("1", "what is largest there"),
    "extreme_phase_lag": ("rad", "phase lag of the extreme"),
    "extreme_amplitude_angle": ("rad", "amplitude angle of the extreme"),
    "extreme_airborne_speed": ("rad/s", "airborne speed at the extreme"),
    "extreme_speed_ratio": ("1", "speed ratio at the extreme"),
    "extreme_efficiency": ("1", "efficiency at the extreme"),
    "never": ("1", "part of the starts that was never captured"),
    "captured": ("1", "part of the starts that was captured"),
    "lost": ("1", "part of the starts that was captured and lost again"),
    "median_time": ("2 pi/omega", "median time until the orbit was reached"),
    "offset_used": ("A", "largest offset of all runs"),
    "acceleration_used": ("A omega^2", "largest acceleration of the offset of all runs"),
    "strategy_name": ("1", "name of the strategy"),
    "condition_name": ("1", "text of the condition"),
    DONE: ("1", "whether the part is computed"),
}
"""Variables that studies derive from the whole result -> their unit and what they are."""
COORDINATES = ("attractor_name", "attractor_kind", "attractor_period", "attractor_cycles")


def described(study: Study, result: xr.Dataset) -> xr.Dataset:
    """The result with a unit and a name of each variable, and its axis by its parameter's name.

    An axis `value` along a parameter can be used by that name too: `result["restitution"]`,
    `result.sel(restitution=0.4, method="nearest")`.
    """
    result = result.copy()
    for name, variable in result.variables.items():
        units, long_name = ADDED.get(str(name), ("1", str(name).replace("_", " ")))
        own = {"units": units, "long_name": long_name}
        variable.attrs = {**own, **variable.attrs}
    result = result.set_coords([name for name in COORDINATES if name in result])
    along = str(study.parameters.get("along", ""))
    if along and "value" in result.coords and along not in result.variables:
        values = result["value"]
        result = result.assign_coords({along: ("value", values.values, values.attrs)})
        result = result.set_xindex(along)
    return result
