"""A result with all that says what it is: attributes on each variable, axes by their parameters."""

from __future__ import annotations

import xarray as xr

from bouncing_disk_ros.study.definition import Study
from bouncing_disk_ros.study.store import DONE

_SPEED, _VELOCITY = "omega Phi", "pi g/omega"
_PERIOD, _IMPULSE = "2 pi/omega", "m pi g/omega"
LINES = (
    ("kind", "1", "kind of attractor"),
    ("impacts", "1", "impacts in one repetition"),
    ("cycles", "1", "periods in one repetition"),
    ("multiplier", "1", "largest multiplier in magnitude"),
    ("share", "1", "share of the window"),
    ("share_uncertainty", "1", "standard error of the share"),
    ("share_without_contact", "1", "share that reaches it without contact before"),
    ("share_in_time", "1", "share on it after so many periods"),
    ("convergence_time", _PERIOD, "time constant near it"),
    ("median_time", _PERIOD, "median time to reach it"),
    ("slow_time", _PERIOD, "time within which 95 % reach it"),
    ("fatal_impulse", _IMPULSE, "smallest fatal impulse"),
    ("least_fatal_impulse", _IMPULSE, "smallest fatal impulse at any instant"),
    ("fatal_timing_error", "rad", "smallest fatal timing error"),
)
"""Fields over lines of attractors: what follows line_, unit, what they are."""
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
    "no_load_speed": ("rad/s", "no-load speed"),
    "stall_torque": ("N·m", "stall torque"),
    "best_efficiency": ("1", "largest efficiency"),
    "best_load_torque": ("N·m", "load torque of the largest efficiency"),
    "best_brake_torque": ("N·m", "brake torque of the largest efficiency"),
    "best_speed": ("rad/s", "largest mean speed, with its sign"),
    "best_phase_lag": ("rad", "phase lag of the largest mean speed"),
    "doubling": ("1", "value of the parameter at a period doubling"),
    "doubling_impacts": ("1", "impacts in one repetition below the doubling"),
    "feigenbaum_ratio": ("1", "ratio of the distances of successive doublings"),
    "extreme_measure": ("1", "what is largest there"),
    "extreme_phase_lag": ("rad", "phase lag of the extreme"),
    "extreme_amplitude_angle": ("rad", "amplitude angle of the extreme"),
    "extreme_airborne_speed": ("rad/s", "airborne speed at the extreme"),
    "extreme_speed_ratio": ("1", "speed ratio at the extreme"),
    "extreme_efficiency": ("1", "efficiency at the extreme"),
    **{
        f"curve_{name}": ("1", text)
        for name, text in (
            ("kind", "what happens to the orbit on the curve"),
            ("impacts", "impacts in one repetition of the orbit; 0: an orbit with contact"),
            ("cycles", "periods of the platform in one repetition"),
        )
    },
    "point_curve": ("1", "index of the curve of a point"),
    "point_axial_forcing": ("1", "axial forcing of a point of a curve"),
    "point_restitution": ("1", "restitution of a point of a curve"),
    "point_admissible": ("1", "1: the orbit is a motion of a disk, 0: a flight is cut short"),
    "lost_orbits": ("1", "orbits that could not be followed"),
    "special_curve": ("1", "index of the curve of a special point"),
    "special_kind": ("1", "what a special point is"),
    "special_axial_forcing": ("1", "axial forcing of a special point"),
    "special_restitution": ("1", "restitution of a special point"),
    "saddle_impacts": ("1", "impacts of the saddle in one repetition"),
    "saddle_cycles": ("1", "periods of the platform in one repetition"),
    "saddle_multiplier": ("1", "multiplier outside of the unit circle"),
    "saddle_share": ("1", "share of the window enclosed by its stable manifold; nan: not known"),
    "saddle_basin": ("1", "index of the attractor whose basin that is; −1: not known"),
    "saddle_open": ("1", "why the share is not known; empty: it is"),
    "saddle_point_saddle": ("1", "index of the saddle of a point"),
    "saddle_point_forcing_phase": ("rad", "forcing phase of its impacts"),
    "saddle_point_velocity": (_VELOCITY, "w_A of its impacts"),
    "piece_saddle": ("1", "index of the saddle of a piece of a manifold"),
    "piece_stability": ("1", "0: stable manifold, 1: unstable manifold"),
    "manifold_piece": ("1", "index of the piece of a point; cuts lie between pieces"),
    "manifold_forcing_phase": ("rad", "forcing phase along a piece, not wrapped"),
    "manifold_velocity": (_VELOCITY, "w_A along a piece"),
    "edge_pairs": ("1", "pairs that edge tracking began with; those without a saddle"),
    "line_name": ("1", "name of the attractor, first and last"),
    **{f"line_{name}": (unit, f"of each line: {text}") for name, unit, text in LINES},
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
