"""What a flight of the next-collision map passes by."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import assume, given
from hypothesis import strategies as st

from bouncing_disk_ros.maps.axial_map import MAP_IMPACT, ORBIT_DELAY, ORBIT_KIND, axial_orbit
from bouncing_disk_ros.maps.orbit_kernels import clearance_of


@given(tau=st.floats(0, 6.28), w=st.floats(-6, -0.05), forcing=st.floats(0.33, 2.0))
def test_the_least_gap_is_that_of_a_fine_sampling(tau: float, w: float, forcing: float) -> None:
    restitution = 0.6
    out = np.zeros((1, 4))
    axial_orbit(tau, w, forcing, restitution, 1, out)
    assume(out[0, ORBIT_KIND] == MAP_IMPACT)
    d = out[0, ORBIT_DELAY]
    x = np.linspace(0.0, d, 4001)
    u = -restitution * w
    gap = u * x - x * x / math.tau - forcing * (np.sin(tau + x) - np.sin(tau) - x * math.cos(tau))
    inner = gap[1:-1]
    dips = inner[(inner < gap[:-2]) & (inner < gap[2:])]
    least = clearance_of(tau, w, d, forcing, restitution)[0]
    # a sample misses a minimum by at most half a step, and the gap is bent by at most Γ
    near = forcing * (0.5 * d / 4000) ** 2
    if len(dips):
        assert dips.min() - near - 1e-12 <= least <= dips.min() + 1e-12
    else:  # at most a dip flatter than the samples can see
        assert least > -1e-12
