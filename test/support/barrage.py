"""A barrage of random commands on a simulator over DDS, in batches that its queues can hold."""

from __future__ import annotations

import random
from typing import Any

import numpy as np
from geometry_msgs.msg import WrenchStamped
from std_msgs.msg import Float64
from std_srvs.srv import SetBool, Trigger
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from bouncing_disk_ros.run.input_records import Record
from bouncing_disk_ros.topics import MOTION_NAMES, TOPICS, Direction
from support.random_commands import Command, RandomCommands, packed
from support.random_trajectories import TOPIC, RandomTrajectories
from support.ros_peer import Peer
from support.storms import all_finite

BATCH = 60
"""Commands on the way at once: with a marker on each topic fewer than its queue holds (100)."""
FAST: dict[str, Any] = {"crossfade_duration": 0.01, "state_rate": 10.0, "real_time_factor": 20.0}
"""Parameters of a simulator on which many motions act in little time."""
COMMAND_TOPICS = [
    name
    for name, topic in TOPICS.items()
    if topic.direction is Direction.IN and name != "~/proceed"
]
TRAJECTORIES = 0.2
"""Part of the commands that are offset trajectories."""
_MARKS = {"axial_amplitude": 1e-5, "angular_amplitude": 0.1, "frequency": 20.0, "phase_lag": 2.0}
_STEP = 1e-6  # of the values from one mark to the next, relative
_SOON = 1_000_000  # ns until an offset is reached


class Barrage:
    """Commands through a peer, which hears what becomes of them."""

    def __init__(self, peer: Peer, seed: int) -> None:
        self._peer = peer
        self._rng = random.Random(seed)
        # a listener in Python keeps up with these, and a disk so thrown soon returns
        self._draw = RandomCommands(self._rng, frequencies=(10.0, 1e3))
        self._trajectories = RandomTrajectories(self._rng)
        self.sent = 0
        self._marks = 0

    def send(self, commands: int) -> None:
        """Send random commands, half of them wrong; returns when the simulator has taken each."""
        for k in range(commands):
            now_ns = self._peer.now_ns()
            command = self._drawn(now_ns)
            if command.data:  # of a publisher that sends an empty one Fast DDS delivers no more
                self._publish(command)
            if k % BATCH == BATCH - 1 or k == commands - 1:
                self._mark()
                if self._rng.random() < 0.5:
                    self._peer.call(Trigger, "reset")

    def _drawn(self, now_ns: int) -> Command:
        """A random command, valid or wrong."""
        valid = self._rng.random() < 0.5
        draw: RandomTrajectories | RandomCommands = self._draw
        if self._rng.random() < TRAJECTORIES:
            draw = self._trajectories
        return draw.valid(now_ns) if valid else draw.wrong(now_ns)

    def _publish(self, command: Command) -> None:
        self._peer.publisher(command.topic).publish(command.data)
        self.sent += 1

    def _mark(self) -> None:
        """On each topic a command that the record shows, and wait for it: each keeps its order."""
        self._marks += 1
        grown = 1.0 + self._marks * _STEP
        seen = len(self._peer.records)
        for topic in COMMAND_TOPICS:
            self._publish(marker(topic, grown))

        def taken() -> bool:
            new = self._peer.records[seen:]
            return all(any(shows(one, topic, grown) for one in new) for topic in COMMAND_TOPICS)

        self._peer.spin_until(taken)


def marker(topic: str, grown: float) -> Command:
    """A command that is accepted and easily found in the record."""
    if topic == "disk/impulse":
        impulse = WrenchStamped()
        impulse.wrench.torque.z = grown * _STEP
        return Command(topic, packed(impulse))
    if topic == "platform/command":
        point = JointTrajectoryPoint(positions=[grown])
        return Command(topic, packed(JointTrajectory(joint_names=["phase_lag"], points=[point])))
    if topic == TOPIC:
        point = JointTrajectoryPoint(positions=[grown * _STEP])
        point.time_from_start.nanosec = _SOON
        msg = JointTrajectory(joint_names=["platform_rotation"], points=[point])
        return Command(topic, packed(msg))
    return Command(topic, packed(Float64(data=_MARKS[topic.split("/")[1]] * grown)))


def shows(record: Record, topic: str, grown: float) -> bool:
    """Whether a record is that of a marker."""
    if topic == "disk/impulse":
        return bool(record["kind"] == "impulse" and record["angular_impulse"] == grown * _STEP)
    if topic == TOPIC:
        joints = record["joints"] if record["kind"] == "trajectory" else {}
        return any(row[2] == grown * _STEP for row in joints.get("platform_rotation", ()))
    if record["kind"] != "motion" or len(record["points"]) != 1:
        return False
    values = dict(zip(MOTION_NAMES, record["points"][0][1], strict=True))
    if topic == "platform/command":
        return bool(values["phase_lag"] == grown)
    name = topic.split("/")[1]
    return bool(values[name] == _MARKS[name] * grown)


def withstand(peer: Peer, seed: int, commands: int) -> str:
    """Send a running simulator that many commands; what it came to, in words.

    AssertionError, with the seed, unless every command was taken, every number is finite, and the
    record replays to the very rows that were heard.
    """
    print(f"seed {seed}")
    peer.settle()
    peer.spin_until(lambda: peer.records)
    barrage = Barrage(peer, seed)
    barrage.send(commands)
    peer.call(SetBool, "pause", SetBool.Request(data=True))
    peer.spin_until(lambda: peer.records[-1].get("paused"))
    rows = peer.check_replay()
    assert all_finite(rows)
    for state in peer.heard["joint_states"]:
        assert np.isfinite([*state.position, *state.velocity, *state.effort]).all()
    peer.next_diagnostics()
    values = peer.diagnostic("inputs")[2]
    accepted, refused = int(values["accepted"]), int(values["refused"])
    assert accepted == sum(record["kind"] != "snapshot" for record in peer.records)
    commanded = {"motion", "impulse", "trajectory"}
    of_commands = sum(record["kind"] in commanded for record in peer.records)
    assert of_commands + refused == barrage.sent
    assert values["commands lost on the way"] == "0"
    assert min(accepted, refused) > commands // 10
    assert len(rows) > commands // 100
    assert {record["kind"] for record in peer.records} >= commanded
    return f"{accepted} accepted, {refused} refused, {len(rows)} rows heard and replayed"
