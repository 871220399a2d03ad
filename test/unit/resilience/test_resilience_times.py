"""Times until an attractor is reached, where starts come to contact before."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bouncing_disk_ros.maps.attractors import AttractorKind
from bouncing_disk_ros.maps.next_collision import NextCollisionMap
from bouncing_disk_ros.maps.start_window import (
    IN_CONTACT,
    label_window,
    window_starts,
)
from support.studied import Start, on_orbit_since, seen


@pytest.mark.parametrize(("axial_forcing", "restitution"), [(1.2213212501882051, 0.0), (0.7, 0.3)])
def test_contact_on_the_way_to_an_orbit_takes_its_time(
    axial_forcing: float, restitution: float
) -> None:
    window = label_window(
        NextCollisionMap(axial_forcing, restitution), window_starts(4, -4.0), -4.0
    )
    after = window.known.found[window.known.after_contact]
    assert after.kind is AttractorKind.PERIODIC
    points = np.stack((after.forcing_phases, after.velocities), axis=1)
    held = np.flatnonzero(window.labels.label == IN_CONTACT)
    assert len(held)
    starts = window_starts(4, -4.0)
    given = {"axial_forcing": axial_forcing, "restitution": restitution}
    for i in held[:4]:
        time = float(window.labels.time[i])
        start = Start(float(starts.tau[i]), float(starts.w[i]))
        run = seen(given, start, math.ceil(time / math.tau) + 40)
        reached = run.times[on_orbit_since(run, points, 1e-4) + 7]
        assert time == pytest.approx(reached, abs=1e-3)
