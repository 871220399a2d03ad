"""What inputs cost the simulator's loop: refused ones, and the dearest valid ones."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
from rcl_interfaces.srv import GetParameters
from rclpy.serialization import serialize_message
from std_msgs.msg import Float64
from std_srvs.srv import SetBool, Trigger
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from bench.processor import work
from bench.table import Aim, Row, row
from bouncing_disk_ros.core.offset import QUINTIC, Knot, Lane, OffsetState
from bouncing_disk_ros.core.offset_extremes import newest_extremes
from bouncing_disk_ros.limits import COMMAND_BYTES, COMMAND_POINTS
from bouncing_disk_ros.run.work_turns import WorkTurns
from bouncing_disk_ros.testing import SteppedSimulator
from bouncing_disk_ros.topics import MOTION_NAMES, OFFSET_JOINTS, TOPICS
from bouncing_disk_ros.units import NS
from support.controllers import GateController
from support.processes import Starter
from support.ros_peer import Peer
from support.wrong_commands import NAN, old, trajectory, wrench

CALLS = 2000
ROUNDS = 15
SECONDS = 5  # reports of /diagnostics, one a second
MOST = 20.0  # µs


def long_programme(count: int) -> JointTrajectory:
    """Points of all four names, of which only the last is wrong."""
    msg = JointTrajectory(joint_names=list(MOTION_NAMES))
    for second in range(count):
        point = JointTrajectoryPoint(positions=[0.1] * 4)
        point.time_from_start.sec = second
        msg.points.append(point)
    msg.points[-1].positions[0] = NAN
    return msg


CASES: list[tuple[str, str, Any, float | None]] = [
    ("a value that is NaN", "platform/frequency", Float64(data=NAN), MOST),
    ("a point with NaN", "platform/command", trajectory(["frequency"], ([NAN], 0)), MOST),
    ("an unknown name", "platform/command", trajectory(["amplitude"], ([1.0], 0)), MOST),
    ("a name of 90 kB", "platform/command", trajectory(["x" * 90_000], ([1.0], 0)), MOST),
    ("a name of 1 MB", "platform/command", trajectory(["x" * 10**6], ([1.0], 0)), MOST),
    ("a stamp that is too old", "platform/command", old(trajectory(["frequency"], ([1.0], 0))),
     MOST),
    ("an impulse that is NaN", "disk/impulse", wrench("z", NAN), MOST),
    ("bytes that are no message", "platform/command", b"\x00\x01\x00\x00" + b"\xff" * 60, MOST),
    ("more bytes than the limit", "platform/command", bytes(COMMAND_BYTES + 1), MOST),
    ("the last of 10 points with NaN", "platform/command", long_programme(10), None),
    (f"the last of {COMMAND_POINTS} points with NaN", "platform/command",
     long_programme(COMMAND_POINTS), None),
]  # fmt: skip


def quintics(points: int, names: list[str]) -> JointTrajectory:
    """A trajectory of random quintics, no two alike."""
    rng = np.random.default_rng(1)
    msg = JointTrajectory(joint_names=names)
    for number in range(points):
        values = (1e-3 * rng.normal(size=(3, len(names)))).tolist()
        point = JointTrajectoryPoint(
            positions=values[0], velocities=values[1], accelerations=values[2]
        )
        point.time_from_start.sec = number + 1
        msg.points.append(point)
    return msg


def measure_extremes() -> list[Row]:
    """Time to find the extremes of the longest trajectory that may be sent."""
    lane = Lane().spliced(0, [
        Knot((number + 1) * NS, OffsetState(point.positions[0], point.velocities[0],
                                            point.accelerations[0]), QUINTIC)
        for number, point in enumerate(quintics(COMMAND_POINTS, [OFFSET_JOINTS[0]]).points)
    ])  # fmt: skip
    newest_extremes(lane)
    found = []
    for _ in range(ROUNDS):
        begin = time.thread_time()
        newest_extremes(lane)
        found.append((time.thread_time() - begin) * 1e3)
    what = f"extremes of {COMMAND_POINTS} quintics"
    return [row("inputs", what, "ms", found, Aim(at_most=work(1.0)))]


DEAR_TRAJECTORIES = {
    "450 knots of both joints": quintics(450, [*OFFSET_JOINTS]),
    f"{COMMAND_POINTS} knots": quintics(COMMAND_POINTS, [OFFSET_JOINTS[0]]),
}
SERVICES: list[tuple[type[Any], str, Any]] = [
    (SetBool, "pause", SetBool.Request(data=False)),
    (GetParameters, "get_parameters", GetParameters.Request(names=["preset"])),
    (Trigger, "step", Trigger.Request()),
]


def answers_of(peer: Peer) -> list[float]:
    """ms until each service answers, called one after the other."""
    waits = []
    for kind, name, request in SERVICES:
        begin = time.monotonic()
        peer.call(kind, name, request)
        waits.append((time.monotonic() - begin) * 1e3)
    return waits


def measure_answers(start: Starter) -> list[Row]:
    """Time until services answer while a hundred of the dearest trajectories wait.

    Asked by a node that hears and sends nothing else, so that its own work does not count.
    """
    peer, asker, rows = Peer(), Peer(without=tuple(TOPICS)), []
    process = start("simulator", "--ros-args", "-p", "preset:=pizza_multiple_toss")
    try:
        publisher = peer.publisher("platform/joint_trajectory")
        answers_of(asker)  # the clients are matched
        for name, message in DEAR_TRAJECTORIES.items():
            waits = []
            publisher.publish(message)
            peer.next_diagnostics()
            for _ in range(SECONDS):
                for _ in range(100):
                    publisher.publish(message)
                waits += answers_of(asker)
                peer.next_diagnostics()
            what = f"an answer behind 100 messages of {name}"
            rows.append(row("inputs", what, "ms", waits, Aim(at_most=200.0)))
    finally:
        asker.close()
        peer.close()
    assert process.end() == 0, process.output
    return rows


def measure_gate_answers(start: Starter) -> list[Row]:
    """Time until services answer while a hundred of them act at a gate."""
    peer, rows = Peer(), []
    options = ("lockstep:=tick", "lockstep_controllers:='1'", "real_time_factor:=0.0")
    process = start("simulator", "--ros-args", *(x for one in options for x in ("-p", one)))
    controller = GateController(1, context=peer.context)
    try:
        peer.add(controller)
        peer.spin_until(lambda: controller.gates > 3)
        answers_of(peer)
        for name, message in DEAR_TRAJECTORIES.items():
            controller.silent = True
            for _ in range(100):
                controller.send(message)
            controller.silent = False
            released, waits = controller.gates + 1, []
            while controller.gates <= released:
                waits += answers_of(peer)
            what = f"an answer while 100 inputs of {name} act at a gate"
            rows.append(row("inputs", what, "ms", waits, Aim(at_most=200.0)))
    finally:
        controller.destroy_node()
        peer.close()
    assert process.end() == 0, process.output
    return rows


def per_call(take: Callable[[bytes, dict[str, Any]], None], data: bytes, calls: int) -> list[float]:
    """µs of the processor for one call, in rounds."""
    found, number = [], 0
    for _ in range(ROUNDS):
        infos = [{"publication_sequence_number": number + i} for i in range(calls)]
        number += calls
        begin = time.thread_time()
        for info in infos:
            take(data, info)
        found.append((time.thread_time() - begin) / calls * 1e6)
    return found


def measure_cost() -> list[Row]:
    """From the middleware's take to the counted refusal, in the node itself."""
    simulator = SteppedSimulator(start_paused=False)
    try:
        simulator.node.commands.turns = WorkTurns(lambda: None, spent=lambda: 0)
        handlers = {
            one.topic: one.on_message for one in simulator.node.commands.subscriptions.values()
        }
        rows = []
        for name, topic, msg, most in CASES:
            data = msg if isinstance(msg, bytes) else bytes(serialize_message(msg))
            found = per_call(handlers[topic], data, CALLS if most else CALLS // 100)
            aim = Aim(at_most=work(most)) if most else None
            rows.append(row("refusals", name, "µs", found, aim))
        return rows
    finally:
        simulator.close()


def measure(start: Starter) -> list[Row]:
    """What refusals and long inputs cost, and how long services wait behind them."""
    rows = measure_cost() + measure_extremes()
    return rows + measure_answers(start) + measure_gate_answers(start)
