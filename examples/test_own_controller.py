"""The test of own_controller.py: `pytest examples/test_own_controller.py`; it needs no ROS.

Γ = 0.55: the period-1 orbit is unstable there, and the open loop leaves it.
"""

import math
from pathlib import Path

from bouncing_disk_ros.core.model import Disk, InitialState, Motion
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.juggling.juggler import Controller
from bouncing_disk_ros.juggling.loop_settings import Limits, period_one_points
from bouncing_disk_ros.juggling.loop_verdict import Outcome
from bouncing_disk_ros.juggling.own_controller import Setup, load_controller
from bouncing_disk_ros.juggling.simulated_loop import run_loop

FORCING, FREQUENCY, GRAVITY = 0.55, 3.0, 9.81
OMEGA = math.tau * FREQUENCY
MOTION = Motion(FORCING * math.pi * GRAVITY / OMEGA**2, 0.0, FREQUENCY, 0.0)
DISK = Disk(0.5, 0.5, 0.3, 0.1, 0.1, GRAVITY)


def outcome_of(controller: Controller | None) -> Outcome:
    """From an impact 0.02 rad late on, for 50 periods."""
    phase = float(period_one_points(FORCING, DISK.restitution)[0, 0]) + 0.02
    start = InitialState(axial_velocity=math.pi * GRAVITY / OMEGA, forcing_phase=phase)
    return run_loop(Simulation(MOTION, DISK, start), controller, periods=50).verdict.outcome


def test_the_pusher_holds_an_unstable_orbit() -> None:
    """With it the orbit is held for 50 periods, without it lost."""
    phase = float(period_one_points(FORCING, DISK.restitution)[0, 0]) + 0.02
    setup = Setup(MOTION, DISK, Limits(), phase)
    file = Path(__file__).with_name("own_controller.py")
    assert outcome_of(load_controller(file, setup)) is Outcome.CAPTURED
    assert outcome_of(None) is not Outcome.CAPTURED
