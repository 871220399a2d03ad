"""Random future splices on runs that move: nothing dropped before them, positions never jump."""

from __future__ import annotations

import numpy as np

from support.offset_runs import SECOND, knots, points, random_run


def check_future_splice(seed: int) -> None:
    """Splice random points into a random run at a random later instant; AssertionError if wrong.

    Over a splice the platform moves by what its speeds allow in 1 ns, to rounding.
    """
    rng = np.random.default_rng(seed)
    run = random_run(seed)
    sim = run.start()
    frequency = run.motion.frequency
    sim.advance(int(rng.uniform(0.0, 1.0) / frequency * SECOND))
    at = sim.time_ns + 1 + int(rng.uniform(0.0, 1.5) / frequency * SECOND)
    before = sim.offset
    scale = 0.3 * 9.81 / frequency**2
    sim.trajectory(at, knots(points(rng, at, scale, frequency)))
    for ns in rng.integers(sim.time_ns, at + 1, 5).tolist():
        assert sim.offset.axial.segment_at(ns).at(ns) == before.axial.segment_at(ns).at(ns), seed
    assert sim.offset.angular == before.angular, seed
    found = []
    for ns in (at - 1, at, at + 1):
        sim.advance(ns)
        found.append(sim.sample())
    speed = 1e-9 * max(abs(one.platform_velocity) for one in found)
    size = max(abs(one.platform_position) for one in found)
    room = 1.01 * speed + 1e-15 * size + 1e-17
    assert abs(found[1].platform_position - found[0].platform_position) <= room, seed
    assert abs(found[2].platform_position - found[1].platform_position) <= room, seed
