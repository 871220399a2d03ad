"""Random commands, right and wrong, leave a session alive, finite and replayable.

Two thousand, and a million in `make soak`; there a hundred thousand have offset trajectories. They
come as serialized messages to a session in this process.
"""

from __future__ import annotations

import math
import random
from array import array
from typing import Any, NamedTuple

import numpy as np
import pytest
from geometry_msgs.msg import WrenchStamped
from numpy.typing import NDArray
from rclpy.serialization import serialize_message
from std_msgs.msg import Float64
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from bouncing_disk_ros.core.model import IMPACT_DTYPE, join_rows
from bouncing_disk_ros.parameters import TABLE
from bouncing_disk_ros.ros.to_messages import ns_to_duration, ns_to_time
from bouncing_disk_ros.run import input_records as records_of
from bouncing_disk_ros.run.input_records import Record
from bouncing_disk_ros.run.session import EVENTS_AT_ONCE
from bouncing_disk_ros.run.time_map import FAR_NS
from bouncing_disk_ros.topics import MOTION_NAMES, OFFSET_JOINTS
from reference.cases import FIRST, examples
from support.commanded import WALL_NS, CommandedSession
from support.driven import replayed
from support.wrong_commands import OFFSETS, WRONG

FREQUENCIES = (1e-3, 1e6)
"""Range of the platform's frequency, Hz: one command may ask for any change within it."""
FORCINGS = (1e-3, 1e2)
"""Range of the axial forcing Γ; far above it the disk is seldom seen again."""
GRAVITY = 9.80665
MASS = 0.25
NS = 1_000_000_000
_JOINTS = ([OFFSET_JOINTS[0]], [OFFSET_JOINTS[1]], list(OFFSET_JOINTS), list(OFFSET_JOINTS[::-1]))


class Command(NamedTuple):
    """A message of a command topic."""

    topic: str
    data: bytes


def between(rng: random.Random, low: float, high: float) -> float:
    """A number, every order of magnitude as likely as another."""
    return math.exp(rng.uniform(math.log(low), math.log(high)))


class RandomCommands:
    """Draws commands; `now_ns` of ROS time goes into stamps. `wild`: up to the table's bounds."""

    def __init__(self, rng: random.Random, *, wild: bool = False) -> None:
        self.rng, self._wild = rng, wild

    def motion(self) -> dict[str, float]:
        """Some of the four values, together a motion that can be followed."""
        rng = self.rng
        if self._wild:
            values = {name: self._in_table(name) for name in MOTION_NAMES}
        else:
            frequency = between(rng, *FREQUENCIES)
            scale = math.pi * GRAVITY / (math.tau * frequency) ** 2
            values = {
                "axial_amplitude": rng.choice([0.0, scale * between(rng, *FORCINGS)]),
                "angular_amplitude": rng.choice([0.0, between(rng, 1e-6, 10.0)]),
                "frequency": frequency,
                "phase_lag": rng.uniform(-1e3, 1e3),
            }
        order = rng.sample(list(values), 4)
        return {name: values[name] for name in order}

    def _in_table(self, name: str) -> float:
        row = TABLE[name]
        low, high = float(row.low or 0.0), float(row.high or 0.0)
        ends = [low, high, float(row.default), math.nextafter(low, high), math.nextafter(high, low)]
        return self.rng.choice([*ends, between(self.rng, 1e-6, high)])

    def programme(self, now_ns: int) -> JointTrajectory:
        """A programme of some points, now or at a stamp."""
        rng = self.rng
        msg = JointTrajectory(joint_names=list(self.motion()))
        after = 0
        for _ in range(rng.choice([0, 1, 1, 1, 2, 5, 20])):
            values = self.motion()
            positions = array("d", [values[name] for name in msg.joint_names])
            point = JointTrajectoryPoint(positions=positions)
            point.time_from_start = ns_to_duration(after)
            after += 1 + round(between(rng, 1.0, 1e8))
            msg.points.append(point)
        if rng.random() < 0.5:
            msg.header.stamp = ns_to_time(now_ns + rng.randrange(NS))
        return msg

    def value(self) -> Command:
        """One value that does not depend on the others."""
        if self._wild:
            name = self.rng.choice(MOTION_NAMES)
            return Command(f"platform/{name}", packed(Float64(data=self._in_table(name))))
        name = self.rng.choice(["angular_amplitude", "phase_lag"])
        data = packed(Float64(data=self.motion()[name]))
        return Command(f"platform/{name}", data)

    def impulse(self, now_ns: int) -> WrenchStamped:
        """An impulse that changes the disk's speeds by up to 10 m/s and 1000 rad/s."""
        rng = self.rng
        msg = WrenchStamped()
        largest = 1e12 if self._wild else 10.0 * MASS
        msg.wrench.force.z = rng.choice([0.0, rng.choice([-1, 1]) * between(rng, 1e-9, largest)])
        msg.wrench.torque.z = rng.choice([0.0, rng.uniform(-2.0, 2.0)])
        if rng.random() < 0.3:
            msg.header.stamp = ns_to_time(now_ns + rng.randrange(NS // 10))
        return msg

    def valid(self, now_ns: int) -> Command:
        """A valid command."""
        kind = self.rng.randrange(5)
        if kind < 2:
            return Command("platform/command", packed(self.programme(now_ns)))
        if kind == 2:
            return self.value()
        return Command("disk/impulse", packed(self.impulse(now_ns)))

    def trajectory(self, now_ns: int) -> JointTrajectory:
        """Lines, cubics or quintics of one joint or both, now or at a stamp; some cancel."""
        rng = self.rng
        msg = JointTrajectory(joint_names=list(rng.choice(_JOINTS)))
        stated, after, rate = rng.randrange(1, 4), 0, between(rng, 1.0, 1e3)
        for _ in range(rng.choice([0, 1, 1, 2, 5, 20])):
            point = JointTrajectoryPoint(positions=self._values(msg, 0.1 / rate))
            if stated > 1:
                point.velocities = self._values(msg, 0.1)
            if stated > 2:
                point.accelerations = self._values(msg, 0.1 * rate)
            after += 1000 + round(between(rng, 0.01, 1.0) / rate * NS)
            point.time_from_start = ns_to_duration(after)
            msg.points.append(point)
        if rng.random() < 0.5:
            msg.header.stamp = ns_to_time(now_ns + rng.randrange(NS // 10))
        return msg

    def _values(self, msg: JointTrajectory, scale: float) -> array[float]:
        return array("d", [self.rng.gauss(0.0, scale) for _ in msg.joint_names])


def packed(msg: Any) -> bytes:
    return bytes(serialize_message(msg))


def wrong(rng: random.Random, right: Command) -> Command:
    """One of the table, or the right one with bytes replaced, which may be right, or cut off."""
    match rng.randrange(3):
        case 0:
            topic, msg, _ = rng.choice(WRONG)
            return Command(topic, packed(msg))
        case 1:
            return Command(right.topic, flipped(rng, right.data))
        case _:
            return Command(right.topic, right.data[: rng.randrange(len(right.data))])


def flipped(rng: random.Random, data: bytes) -> bytes:
    """Some bytes of it replaced."""
    changed = bytearray(data)
    for _ in range(rng.choice([1, 1, 3, 10])):
        changed[rng.randrange(len(changed))] = rng.choice(
            [0, 1, 0x7F, 0x80, 0xFF, rng.randrange(256)]
        )
    return bytes(changed)


COMMANDS = 1000
"""Commands of one storm: each begins with a new session, so that memory does not grow."""


class Storm(NamedTuple):
    """What a storm came to."""

    accepted: int
    refused: int
    rows: NDArray[np.void]
    records: list[Record]
    end_ns: int


def storm(seed: int, commands: int = COMMANDS, *, offsets: bool = False) -> Storm:
    """A session under random commands, half of them wrong; every other seed to the table's ends.

    `offsets`: half of the commands are offset trajectories.

    AssertionError, with the seed, where a number is not finite, the ledger does not close or the
    run has ended.
    """
    rng = random.Random(seed)
    draw = RandomCommands(rng, wild=seed % 2 == 1 and not offsets)
    commanded = CommandedSession(
        restitution=rng.choice([0.0, 0.5, 0.9, 1.0]), crossfade_duration=rng.choice([0.0, 1e-3])
    )
    session = commanded.session
    accepted = 0
    for _ in range(commands):
        now_ns = WALL_NS + session.time_ns
        if offsets and rng.random() < 0.5:
            command = Command(OFFSETS, packed(draw.trajectory(now_ns)))
        else:
            command = draw.valid(now_ns)
        if rng.random() < 0.5:
            command = wrong(rng, command)
        accepted += commanded.take(*command)
        if session.resolve_waiting():
            ahead = round(between(rng, 1.0, 1e8))
            session.advance(min(session.time_ns + ahead, FAR_NS), EVENTS_AT_ONCE)
        session.checked_energy()
        assert not session.fault, f"seed {seed}: {session.fault}"
        assert all(map(np.isfinite, session.simulation.sample())), f"seed {seed}"
        if rng.random() < 0.05:
            session.reset()
    while not session.resolve_waiting():  # what waits goes on record when it acts
        pass
    rows = join_rows(session.take_rows())
    assert all_finite(rows), f"seed {seed}"
    lines = [records_of.to_json(record) for record in commanded.records]
    records = [records_of.from_json(line) for line in lines]
    return Storm(accepted, commanded.refused, rows, records, session.time_ns)


def all_finite(rows: NDArray[np.void]) -> bool:
    """Whether every number of the rows is finite."""
    return all(bool(np.isfinite(rows[name]).all()) for name in IMPACT_DTYPE.names or ())


def check_storm(seed: int, commands: int = COMMANDS, *, offsets: bool = False) -> Storm:
    """A storm that replays bit by bit, and in which commands were both accepted and refused."""
    found = storm(seed, commands, offsets=offsets)
    again = replayed(found.records, found.end_ns)[0]
    assert again.tobytes() == found.rows.tobytes(), f"seed {seed}: the replay differs"
    assert found.accepted > commands // 10, f"seed {seed}"
    assert found.refused > commands // 10, f"seed {seed}"
    return found


# even: within the limits of every day; odd: to all ends
@pytest.mark.parametrize("seed", range(FIRST, FIRST + examples(2, 1_000)))
def test_a_session_outlives_a_storm_and_its_record_replays(seed: int) -> None:
    assert len(check_storm(seed).rows) > 0


@pytest.mark.parametrize("seed", range(FIRST + 7, FIRST + 7 + examples(1, 100)))
def test_a_session_withstands_random_trajectories(seed: int) -> None:
    commands = examples(300, COMMANDS)
    found = check_storm(seed, commands, offsets=True)
    assert sum(record["kind"] == "trajectory" for record in found.records) > commands // 10
