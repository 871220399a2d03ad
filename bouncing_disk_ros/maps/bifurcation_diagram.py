"""Bifurcation diagrams of the next-collision map: an attractor followed along one parameter.

Fig. 3 of Liu, Friend, Yeo, "The behavior of bouncing disks and pizza tossing" (EPL 2009): each
value starts from the last state of the one before, so that the way up and the way down differ where
attractors live side by side. Dimensionless, as in `next_collision`.
"""

from __future__ import annotations

import math
from dataclasses import astuple, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.errors import InputError, closest
from bouncing_disk_ros.maps.attractors import contact_is_forgotten
from bouncing_disk_ros.maps.axial_map import MAP_CONTACT, ORBIT_KIND, ORBIT_TAU, ORBIT_W
from bouncing_disk_ros.maps.next_collision import Array, MapState, NextCollisionMap
from bouncing_disk_ros.maps.periodic_orbit import fixed_point
from bouncing_disk_ros.maps.rotation_map import (
    CONTACT_COUNT,
    LYAPUNOV,
    MEAN_PER_IMPACT,
    MEAN_PER_TIME,
    MEASURED,
    ORBIT_SPEED,
    ORBIT_TURNED,
    measure_attractor,
)

AXES = ("axial_forcing", "restitution", "phase_lag", "angular_forcing")
"""The parameters that a diagram can run along: the fields of NextCollisionMap."""
SETTLING, MEASURED_IMPACTS, KEPT = 1000, 2000, 300
_BESIDE = 1e-6
LEAST_TOGETHER, ROWS_TOGETHER = 1024, 1_000_000
"""So many trajectories, or so many kept impacts of theirs, are in work space at a time."""
STATE = 5
"""Numbers in the state of a branch: τ, w_A, α̇ and the vector that shows how changes grow."""


class Branch(NamedTuple):
    """What was found at n values of a parameter, from m starts each (m = 1 when following).

    nan stands where the disk came to rest on the platform for good. Speeds are nan, too, where
    contact was measured and roundings decide how it goes on from one contact to the next.
    """

    values: Array  # (n,) of the parameter
    forcing_phase: Array  # (n, m, kept) τ of the last impacts, rad
    axial_impact_velocity: Array  # (n, m, kept) w_A/(πg/ω)
    angular_velocity: Array  # (n, m, kept) α̇/(ωΦ) just before
    contact: NDArray[np.bool_]  # (n, m, kept) whether the disk was in contact before
    mean_speed: Array  # (n, m) mean of α̇/(ωΦ) in time, over the impacts measured
    mean_speed_per_impact: Array  # (n, m) the mean of α̇/(ωΦ) at the impacts
    lyapunov_exponent: Array  # (n, m) of the axial part, per impact; −inf with contact
    contacts: Array  # (n, m) phases of contact per impact
    ends: Array  # (n, m, 5) the last state, from which another chunk goes on

    @property
    def end(self) -> Array:
        """(m, 5) the state after the last value."""
        return self.ends[-1]


def begin(section: NextCollisionMap, start: MapState | None = None) -> Array:
    """(1, 5) the state to start a branch from; default: the period-1 orbit at these parameters.

    Where that is unstable, a state 1e-6 rad beside it: on it rounding may stay for ever. Raises
    InputError for a start out of range, or where there is no period-1 orbit.
    """
    if start is None:
        orbit = fixed_point(*astuple(section))
        start = orbit.state
        if not orbit.stable:
            start = start._replace(forcing_phase=start.forcing_phase + _BESIDE)
    return np.array([[*section.checked(start), 1.0, 0.0]])


def follow(
    section: NextCollisionMap,
    axis: str,
    values: Array,
    before: Array | None = None,
    *,
    settling: int = SETTLING,
    measured: int = MEASURED_IMPACTS,
    kept: int = KEPT,
) -> Branch:
    """Follow an attractor along a parameter: each value starts where the one before ended.

    `axis` is one of AXES, `values` (n,) are taken in their order (falling: the way down), the other
    parameters are those of `section`. `before` is the `end` of the chunk before, or what `begin`
    gives (default: the period-1 orbit at the first value). Chunks in a row give the same bits as
    one call. At each value `settling` impacts are left out, `measured` give the means, and the last
    `kept` of these are returned. Raises InputError.
    """
    sections = sections_along(section, axis, values)
    _check_counts(settling, measured, kept)
    state = begin(sections[0]) if before is None else np.array(before, dtype=float)
    branch = _empty(values, len(state), kept)
    rows = np.empty((len(state), kept, ORBIT_TURNED + 1))
    results = np.empty((len(state), MEASURED + 1))
    for i, here in enumerate(sections):
        for one in zip(state, rows, results, strict=True):
            if not measure_attractor(one[0], *astuple(here), settling, measured, *one[1:]):
                one[1].fill(math.nan)
        _fill(branch, slice(i * len(state), (i + 1) * len(state)), rows, results, state)
    _leave_out_unknown_speeds(branch, sections, measured)
    return branch


def from_starts(
    section: NextCollisionMap,
    axis: str,
    values: Array,
    starts: list[MapState],
    *,
    settling: int = SETTLING,
    measured: int = MEASURED_IMPACTS,
    kept: int = KEPT,
) -> Branch:
    """The attractors that the same starts reach at each value; arguments as in `follow`.

    All trajectories are iterated together in lanes (`maps.lanes.attractor_lanes`): a trajectory has
    the same bits with any other values and starts, but roundings other than those of `follow`. In
    chaos these grow: such trajectories agree in their means alone, to the precision of the impacts
    measured.
    """
    from bouncing_disk_ros.maps.lanes.attractor_lanes import (
        measure_attractors,  # loads kernels
    )

    sections = sections_along(section, axis, values)
    _check_counts(settling, measured, kept)
    if not starts:
        raise InputError("starts", "none", "at least one start")
    states = np.concatenate([begin(here, start) for here in sections for start in starts])
    parameters = np.repeat([astuple(here) for here in sections], len(starts), axis=0)
    branch = _empty(values, len(starts), kept)
    size = max(LEAST_TOGETHER, ROWS_TOGETHER // kept)
    for first in range(0, len(states), size):
        part = slice(first, first + size)
        rows = np.empty((len(states[part]), kept, ORBIT_TURNED + 1))
        results = np.empty((len(rows), MEASURED + 1))
        given = (parameters[part], settling, measured)
        measure_attractors(states[part], *given, rows, results)
        _fill(branch, part, rows, results, states[part])
    _leave_out_unknown_speeds(branch, sections, measured)
    return branch


def _leave_out_unknown_speeds(
    branch: Branch, sections: list[NextCollisionMap], measured: int
) -> None:
    """Put nan for the speeds of trajectories with contact that is forgotten before the next."""
    for i, here in enumerate(sections):
        touches = branch.contacts[i] > 0.0
        if touches.any() and contact_is_forgotten(*here.axial_parameters, measured):
            branch.mean_speed[i, touches] = math.nan
            branch.mean_speed_per_impact[i, touches] = math.nan


def sections_along(section: NextCollisionMap, axis: str, values: Array) -> list[NextCollisionMap]:
    """The maps at each value of a parameter. Raises InputError."""
    if axis not in AXES:
        raise InputError("axis", axis, "one of " + ", ".join(AXES), closest(axis, AXES))
    if len(values) == 0:
        raise InputError("values", "none", "at least one value")
    return [replace(section, **{axis: float(value)}) for value in values]


def _check_counts(settling: int, measured: int, kept: int) -> None:
    if settling < 0:
        raise InputError("settling", settling, "a whole number >= 0")
    if not 1 <= kept <= measured:
        raise InputError("kept", kept, f"from 1 to the number of impacts measured, {measured}")


def _empty(values: Array, starts: int, kept: int) -> Branch:
    shape = (len(values), starts)

    def unknown(*more: int) -> Array:
        return np.full((*shape, *more), math.nan)

    return Branch(
        values=np.array(values, dtype=float),
        forcing_phase=unknown(kept),
        axial_impact_velocity=unknown(kept),
        angular_velocity=unknown(kept),
        contact=np.zeros((*shape, kept), bool),
        mean_speed=unknown(),
        mean_speed_per_impact=unknown(),
        lyapunov_exponent=unknown(),
        contacts=unknown(),
        ends=unknown(STATE),
    )


def _fill(branch: Branch, part: slice, rows: Array, results: Array, states: Array) -> None:
    """Write trajectories into a branch; `part`: their places, those of a value in a row."""

    def put(name: str, found: NDArray[np.generic]) -> None:
        whole = getattr(branch, name)
        whole.reshape(-1, *whole.shape[2:])[part] = found

    put("forcing_phase", rows[..., ORBIT_TAU])
    put("axial_impact_velocity", rows[..., ORBIT_W])
    put("angular_velocity", rows[..., ORBIT_SPEED])
    put("contact", rows[..., ORBIT_KIND] == MAP_CONTACT)
    put("mean_speed", results[:, MEAN_PER_TIME])
    put("mean_speed_per_impact", results[:, MEAN_PER_IMPACT])
    put("lyapunov_exponent", results[:, LYAPUNOV])
    put("contacts", results[:, CONTACT_COUNT] / results[:, MEASURED])
    put("ends", states)
