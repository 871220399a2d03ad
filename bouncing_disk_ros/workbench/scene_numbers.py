"""The numbers of the scenes, each computed by the package from the scene's own parameters."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

import numpy as np
import xarray as xr

from bouncing_disk_ros.core.model import ImpactKind
from bouncing_disk_ros.maps.attractor_search import find_attractors
from bouncing_disk_ros.maps.attractors import Attractor, AttractorKind
from bouncing_disk_ros.maps.basin_measures import uncertainty_exponent
from bouncing_disk_ros.maps.best_lag import best_lag
from bouncing_disk_ros.maps.bifurcations import period_doublings
from bouncing_disk_ros.maps.next_collision import NextCollisionMap, spread_starts
from bouncing_disk_ros.maps.periodic_orbit import fixed_point
from bouncing_disk_ros.maps.scales import angular_forcing_of, axial_forcing_of
from bouncing_disk_ros.run.simulate import simulate
from bouncing_disk_ros.study.runner import study_function
from bouncing_disk_ros.workbench.actions import Perform
from bouncing_disk_ros.workbench.scene_table import SCENES, Scene

PIXELS = 300
"""Along each side of the maps of basins."""


def _keywords(scene: Scene) -> dict[str, Any]:
    """The scene's parameters as keywords of `simulate`."""
    return dict(scene.parameters)


def _map_of(scene: Scene) -> NextCollisionMap:
    motion, disk = scene.motion, scene.disk
    return NextCollisionMap(
        axial_forcing_of(motion, disk),
        disk.restitution,
        phase_lag=motion.phase_lag,
        angular_forcing=angular_forcing_of(motion, disk),
    )


def _attractor(section: NextCollisionMap, kind: AttractorKind) -> Attractor:
    """The first attractor of a kind that 400 starts lead to."""
    starts = [(one.forcing_phase, one.axial_impact_velocity) for one in spread_starts(400, -5.0)]
    found = find_attractors(section, starts).found
    return next(attractor for attractor in found if attractor.kind is kind)


def _lies_still(scene: Scene) -> float:
    """When the last chatter ends, s."""
    impacts = simulate(5.0, **_keywords(scene)).impacts
    return float(impacts["time"][impacts["kind"] == ImpactKind.CHATTER_TAIL][0])


def _settled_speed(scene: Scene) -> float:
    """The speed of the rotor after the programme, rad/s: over the last second, whole periods."""
    programme = next(action.programme for action in scene.after if isinstance(action, Perform))
    angles = simulate(
        30.0, sample_rate=10.0, programme=programme, **_keywords(scene)
    ).unwrapped_angle  # fmt: skip
    return float(angles[-1] - angles[-11]) / 1.0


def _best_lag(scene: Scene) -> float:
    section = _map_of(scene)
    return best_lag(_attractor(section, AttractorKind.PERIODIC), section).phase_lag


def _first_doubling(scene: Scene) -> float:
    section = _map_of(scene)
    orbit = fixed_point(section.axial_forcing, section.restitution)
    return period_doublings(orbit, "axial_forcing", limit=0.6, count=1)[0].value


def _exponent(scene: Scene) -> float:
    """The Lyapunov exponent for each impact of the chaotic attractor."""
    return math.log(_attractor(_map_of(scene), AttractorKind.CHAOTIC).multiplier)


def _basins_of(scene: Scene) -> xr.Dataset:
    section = _map_of(scene)
    return study_function("basins")(
        axial_forcing=section.axial_forcing, restitution=section.restitution, width=PIXELS,
        height=PIXELS, progress=False,
    )  # fmt: skip


def _share(scene: Scene) -> float:
    """The share of the starts of the map of basins that go to a periodic orbit."""
    found = _basins_of(scene)
    kinds = found["attractor_kind"].values
    return float(np.sum(found["fraction"].values[kinds == str(AttractorKind.PERIODIC)]))


def _uncertainty(scene: Scene) -> float:
    found = _basins_of(scene)
    return uncertainty_exponent(found["label"].values, periodic=True).exponent


def _stall_torque(scene: Scene) -> float:
    """Of the motor at the scene's preload, mN·m."""
    values = _keywords(scene)
    names = (
        "axial_amplitude", "angular_amplitude", "frequency", "phase_lag", "mass", "restitution",
        "friction", "friction_radius", "gyration_radius", "gravity",
    )  # fmt: skip
    preload = float(values["preload"])
    found = study_function("motor")(
        x_count=12, y_axis="preload", y_begin=preload, y_end=preload * (1 + 1e-6), y_count=2,
        progress=False, **{name: values[name] for name in names},
    )  # fmt: skip
    return 1e3 * float(found["stall_torque"].values[0])


_NUMBERS: Mapping[str, Callable[[Scene], float]] = {
    "rest_and_chatter": _lies_still,
    "first_toss": _settled_speed,
    "period_1": _best_lag,
    "doubling": _first_doubling,
    "chaos": _exponent,
    "coexisting_orbits": _share,
    "fractal_boundary": _uncertainty,
    "motor_under_load": _stall_torque,
}


@cache
def number_of(name: str) -> float:
    """The number to find in a scene, in its unit; computed once, for all pages, in some seconds."""
    return _NUMBERS[name](SCENES[name])
