"""Closed loops with the node `juggle`: nodes for tests; one loop, through ROS and without."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from sensor_msgs.msg import PointCloud2

from bouncing_disk_ros.core.model import Disk, InitialState, Motion, MotionInForce
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.juggling.juggle import OPTIONS
from bouncing_disk_ros.juggling.juggle_node import JuggleNode
from bouncing_disk_ros.juggling.juggler import Juggler
from bouncing_disk_ros.juggling.live_loop import LiveLoop, LoopOptions
from bouncing_disk_ros.juggling.loop_settings import Sensor, period_one_points
from bouncing_disk_ros.juggling.simulated_loop import run_loop
from bouncing_disk_ros.parameters import TABLE
from bouncing_disk_ros.ros.from_messages import impacts_from_msg
from bouncing_disk_ros.testing import SteppedSimulator
from support.ros import overrides_of

FREQUENCY, GRAVITY = 3.0, 9.81
REPORTED = float(TABLE["chatter_report_speed"].default)
DISK = Disk(0.5, 0.5, 0.3, 0.1, 0.1, GRAVITY)
Make = Callable[..., SteppedSimulator]


def motion_of(forcing: float) -> Motion:
    """A motion up and down with a Γ, for gravity GRAVITY."""
    return Motion(forcing * GRAVITY / (4.0 * math.pi * FREQUENCY**2), 0.0, FREQUENCY, 0.0)


def juggler_of(simulator: SteppedSimulator, **values: Any) -> JuggleNode:
    """The node, with some parameters, once it knows the motion of a simulator."""
    overrides = overrides_of({"gravity": GRAVITY, "lead": 0.0, **values})
    node = JuggleNode(OPTIONS, context=simulator.context, parameter_overrides=overrides)
    simulator.add_node(node)
    simulator.wait_for_subscriber("disk/impacts")
    simulator.spin_until(lambda: node.status != "waiting for platform/motion")
    return node


def watched(
    rows: Any, forcing: float, strategy: str, sensor: Sensor, *, error: float = 0.0,
    phase: float = 1.5 * math.pi,
) -> LiveLoop:  # fmt: skip
    """What a node that receives these rows one by one says; `error`: as in `run_both`."""
    believed = DISK._replace(restitution=DISK.restitution * (1.0 + error))
    loop = LiveLoop(LoopOptions(believed, sensor=sensor), strategy)
    motion = motion_of(forcing)
    loop.on_motion(MotionInForce(0, 0, motion, motion, 0, phase))
    for place in range(len(rows)):
        for _ in loop.on_impacts(rows[place : place + 1]):
            pass
    return loop


def run_both(
    make: Make, forcing: float, strategy: str, sensor: Sensor, *, periods: int = 20,
    start: InitialState | None = None, error: float = 0.0,
) -> tuple[Any, Any, str]:  # fmt: skip
    """Rows of the loop through ROS, the record of the loop in one process, the node's status.

    By default from rest. `error`: of the restitution that the controllers believe, a part of it.
    """
    motion, state = motion_of(forcing), start or InitialState()
    thrown: dict[str, Any] = {}
    if start is not None:
        thrown = {"initial_with_platform": False, "initial_axial_velocity": start.axial_velocity}
    simulator = make(
        **motion._asdict(), **DISK._asdict(), initial_forcing_phase=state.forcing_phase, **thrown
    )
    rows: list[Any] = []
    believed = DISK.restitution * (1.0 + error)
    node = juggler_of(
        simulator, strategy=strategy, delay=sensor.delay, jitter=sensor.jitter,
        missed=sensor.missed, seed=sensor.seed, restitution=believed,
    )  # fmt: skip
    node.create_subscription(
        PointCloud2, "disk/impacts", lambda cloud: rows.append(impacts_from_msg(cloud).copy()), 1000
    )
    simulator.run(periods / FREQUENCY)
    juggler = Juggler(strategy, motion, DISK, restitution=believed, phase=state.forcing_phase)
    simulation = Simulation(motion, DISK, state, chatter_report_speed=REPORTED)
    own = period_one_points(forcing, believed) if strategy == "none" else None  # it never learns
    record = run_loop(simulation, juggler, periods=periods, sensor=sensor, orbit=own)
    simulator.close_node(node)
    return np.concatenate(rows), record, node.status
