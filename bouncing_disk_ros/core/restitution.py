"""Restitution: u = −ε w along the axis, its impulse and loss; friction in an impact (rule 7).

What one impact does is said here once: for numbers and arrays (`rebounded`), for kernels
(`rebound`, `axial_push`, `lost_part`) and for lanes (`lanes.lane_basics.rebound`, compiled from
`rebounded`). `resolve_event` resolves an impact by it. Formulas for many impacts need an ε that is
the same in all of them, and change with the law by hand:

- sums over a chatter: `chatter.chatter_duration`, `tail_push`, `chatter_sums`, `chatter_rotation`,
  `chatter_scale`, `chatter_friction`, `braked_chatter`, `brake.stopped_tail` and
  `resolve_event._end_chatter_rotation`;
- derivatives of the map: `axial_map.turned_tangent`, `periodic_orbit` (determinant ε²ⁿ),
  `next_collision.NextCollisionMap.jacobian`;
- the map backwards: `axial_iteration.previous_impact`, `basins.compute.before_impact`;
- period-1 orbits: `existence_limit`, `impact_velocity` and `stability_limit` of
  `maps.period_one`, from which all others take them;
- the greatest speed: `settled_speed.largest_change`, `manifold_growth.no_return`;
- friction in lanes: `attractor_lanes` keeps (1 + ε)/Γ_T of a lane;
- equations of orbits and controllers: `orbit_studies.orbit_equations`, `fatal_changes`,
  `report.stability`, `juggling.kernels.toss_planner` and `strategies`, `juggling.target_orbit`,
  `juggling.compute`;
- proofs: `proof`, which shares nothing with the core.
"""

from __future__ import annotations

from typing import Any

from bouncing_disk_ros.core.compilation import kernel


def rebounded(w: Any, restitution: Any) -> Any:
    """Relative speed just after an impact that comes with w < 0; numbers or arrays."""
    return -restitution * w


rebound = kernel(rebounded)


@kernel
def axial_push(w: float, restitution: float) -> float:
    """Axial impulse over m of an impact that comes with w < 0: u − w, rounded twice."""
    return (1.0 + restitution) * -w


@kernel
def lost_part(_w: float, restitution: float) -> float:
    """Part of the axial energy m w²/2, relative to the platform, that an impact takes."""
    return 1.0 - restitution * restitution


@kernel
def friction_change(slip: float, most: float) -> float:
    """Change of α̇: takes away slip up to its limit `most` ≥ 0."""
    if slip > most:
        return -most
    if slip < -most:
        return most
    return -slip


@kernel
def speed_after(omega: float, platform: float, most: float) -> float:
    """α̇ after an impact whose friction changes it by at most `most` towards the platform's β̇."""
    slip = omega - platform
    return platform if abs(slip) <= most else omega + friction_change(slip, most)
