"""No impact leaves an absorbing region, and there is none where there cannot be one."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bouncing_disk_ros.maps.absorbing_region import absorbing_regions
from bouncing_disk_ros.maps.attractor_search import window_attractors
from bouncing_disk_ros.maps.attractors import AttractorKind, Attractors
from bouncing_disk_ros.maps.lanes.axial_lanes import iterate_axial
from bouncing_disk_ros.maps.next_collision import NextCollisionMap


def found_attractors(axial_forcing: float) -> Attractors:
    centres = (np.arange(24) + 0.5) / 24
    section = NextCollisionMap(axial_forcing, 0.5)
    return window_attractors(section, math.tau * centres, -5.0 * (1.0 - centres))


def drawn(region_of: object, count: int) -> tuple[np.ndarray, np.ndarray]:
    draw = np.random.default_rng(55)
    tau, w = draw.uniform(0.0, math.tau, count), draw.uniform(-2.5, 0.0, count)
    inside = region_of.hold(tau, w)  # type: ignore[attr-defined]
    return tau[inside], w[inside]


@pytest.mark.parametrize("axial_forcing", [0.5526])
def test_impacts_stay_in_it(axial_forcing: float) -> None:
    section = NextCollisionMap(axial_forcing, 0.5)
    attractors = found_attractors(axial_forcing)
    ((label, region),) = absorbing_regions(section, attractors).items()
    assert attractors.found[label].kind is AttractorKind.CHAOTIC
    tau, w = drawn(region, 200_000)
    assert len(tau) > 500
    counts = np.zeros((len(tau), 2), np.int64)
    platform = np.full(len(tau), axial_forcing), np.full(len(tau), 0.5)
    for impacts in (*[1] * 50, 200, 1000):
        iterate_axial(tau, w, *platform, impacts, counts)
        assert region.hold(tau, w).all()
    assert not counts.any()


def test_it_holds_its_attractor_and_no_other_one() -> None:
    attractors = found_attractors(0.55)
    ((label, region),) = absorbing_regions(NextCollisionMap(0.55, 0.5), attractors).items()
    for place, one in enumerate(attractors.found):
        held = region.hold(one.forcing_phases, one.velocities)
        assert held.all() if place == label else not held.any()


def test_what_is_not_known_is_not_in_it() -> None:
    attractors = found_attractors(0.55)
    ((_, region),) = absorbing_regions(NextCollisionMap(0.55, 0.5), attractors).items()
    states = np.array([[math.nan, -1.0], [1.0, math.nan], [1.0, -1e6]]).T
    assert not region.hold(*states).any()


@pytest.mark.parametrize(
    "axial_forcing",
    [
        0.45,  # no chaos
        0.8,  # the attractor reaches impacts that are hardly any
        0.545,  # period 6 lies within the region
    ],
)
def test_where_there_is_none(axial_forcing: float) -> None:
    attractors = found_attractors(axial_forcing)
    assert absorbing_regions(NextCollisionMap(axial_forcing, 0.5), attractors) == {}
