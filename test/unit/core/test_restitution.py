"""The law of restitution: once for scalars, once for lanes, equal to the bit."""

from __future__ import annotations

import numpy as np

from bouncing_disk_ros.core import restitution
from bouncing_disk_ros.maps.lanes import lane_basics
from support.kernels import Kernels

law = Kernels(restitution)


def test_scalars_lanes_and_arrays_rebound_alike() -> None:
    rng = np.random.default_rng(3)
    w = -np.concatenate([10.0 ** rng.uniform(-300.0, 5.0, 500), [5e-324, 1.0, 1e300]])
    for epsilon in (0.0, 0.5, 1.0, float(rng.uniform()), 1.0 - 1e-6):
        of_array = restitution.rebounded(w, epsilon)
        assert [law.rebound(one, epsilon) for one in w] == of_array.tolist()
        assert [lane_basics.rebound(one, epsilon) for one in w] == of_array.tolist()


def test_impulse_and_loss_are_those_of_the_law() -> None:
    """u − w and 1 − u²/w², each of both sides rounded three times at most."""
    rng = np.random.default_rng(4)
    for w, epsilon in zip(
        -(10.0 ** rng.uniform(-9.0, 3.0, 200)), rng.uniform(size=200), strict=True
    ):
        u = law.rebound(w, epsilon)
        assert abs(law.axial_push(w, epsilon) - (u - w)) <= 6.0 * 2.0**-53 * (u - w)
        assert abs(law.lost_part(w, epsilon) - (1.0 - (u / w) ** 2)) <= 6.0 * 2.0**-53
