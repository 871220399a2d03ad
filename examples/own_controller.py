"""A controller of one's own for the node `juggle`: it pushes when the disk is late.

    python -m bouncing_disk_ros simulator --ros-args -p preset:=pizza_multiple_toss
    python -m bouncing_disk_ros juggle --ros-args -p controller:=examples/own_controller.py

(the second line in another terminal). Its test, test_own_controller.py, needs no ROS.

It holds the period-1 orbit where that is unstable: one pulse of velocity at the next impact, in
proportion to how late the last one was and to how fast the disk left.
"""

import math

from bouncing_disk_ros.juggling.juggler import HeardImpact, OffsetTrajectory, TrajectoryPoint
from bouncing_disk_ros.juggling.own_controller import Setup

LARGEST = 0.3
"""Largest velocity of a pulse, in units of πg/ω."""


class Pusher:
    """A pulse of velocity for deviations: both multipliers become 0 (docs/juggling.md)."""

    def __init__(self, setup: Setup) -> None:
        e = setup.disk.restitution
        self.omega = math.tau * setup.motion.frequency
        self.phase, self.speed = setup.phase, math.pi * setup.disk.gravity / self.omega
        forcing = setup.motion.axial_amplitude * self.omega / self.speed
        self.aim = math.acos((1.0 - e) / ((1.0 + e) * forcing))  # τ_imp of the period-1 orbit
        self.reach = reach = math.pi * (1.0 + e)  # rad that a unit of velocity delays an impact by
        self.late_gain = forcing * math.sin(self.aim) - 1.0 / (reach * (1.0 + e))
        self.fast_gain = self.late_gain * reach - e * e / (1.0 + e)

    def on_impact(self, impact: HeardImpact, now_ns: int) -> OffsetTrajectory | None:
        """A pulse at the next impact, predicted to be a period and a little later."""
        if impact.velocity is None or impact.rests:
            return None
        phase = self.phase + self.omega * impact.time
        late = math.remainder(phase - self.aim, math.tau)
        fast = impact.velocity / self.speed - 1.0
        if max(abs(late), abs(fast)) > 0.3 or max(abs(late), abs(fast)) < 1e-9:
            return None  # far off, or there
        push = max(-LARGEST, min(LARGEST, self.late_gain * late + self.fast_gain * fast))
        at = impact.time + (math.tau + self.reach * fast) / self.omega  # to first order
        before, after = (round((at + side / self.omega) * 1e9) for side in (-1.5, 1.5))
        if before <= now_ns:
            return None
        points = (
            TrajectoryPoint(before, 0.0, 0.0, 0.0),
            TrajectoryPoint(round(at * 1e9), 0.0, push * self.speed, 0.0),
            TrajectoryPoint(after, 0.0, 0.0, 0.0),
        )
        return OffsetTrajectory(now_ns, points)


def make_controller(setup: Setup) -> Pusher:
    """What `juggle` calls."""
    return Pusher(setup)
