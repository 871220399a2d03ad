"""Two simulators with the same inputs, one of which is asked for nonsense too."""

from __future__ import annotations

import random
import re
from array import array
from typing import Any

import numpy as np
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from numpy.typing import NDArray
from rcl_interfaces.srv import SetParameters
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from bouncing_disk_ros.run.input_records import Record
from bouncing_disk_ros.topics import MOTION_NAMES
from support import requests
from support.commanded import WALL_NS, CommandedSession
from support.random_commands import Command, RandomCommands, packed
from support.replayed import replayed
from support.ros_peer import Peer
from support.wrong_commands import WRONG, wrench

NAMES = ("calm", "disturbed")
PERIODS = 100
"""Of one `~/step`: a fraction of the time after which it would go on in the ticks."""
NONSENSE = 5
"""Wrong commands before each step."""
END = r"(?:until|now at) (\d+\.\d{9}) s(?:;| of simulated time$)"
"""Where a step ends, in its answer."""
ASKED = ["describe_parameters", "get_parameters", "get_parameter_types", "list_parameters",
         "get_type_description"]  # fmt: skip


PAUSED: dict[str, Any] = {"crossfade_duration": 0.01, "start_paused": True, "step_periods": PERIODS}
"""Parameters of a simulator that stands but for `~/step`."""


def wrong_commands(rng: random.Random, count: int) -> list[Command]:
    """Commands that a session refuses, whatever the time."""
    draw, found = RandomCommands(rng), [Command(topic, packed(msg)) for topic, msg, _ in WRONG]
    while len(found) < count:
        command = draw.wrong(WALL_NS)  # with a stamp: long past for a simulator of today
        if not CommandedSession().take(*command):
            found.append(command)
    return found


def right_command(rng: random.Random) -> Command:
    """A command that acts at once: a motion that keeps the disk bouncing, or an impulse."""
    if rng.random() < 0.3:
        return Command("disk/impulse", packed(wrench("z", rng.uniform(-0.02, 0.02))))
    frequency = rng.uniform(5.0, 100.0)
    amplitude = rng.uniform(0.35, 1.5) * np.pi * 9.81 / (2 * np.pi * frequency) ** 2
    values = array("d", [amplitude, rng.uniform(0.0, 1.0), frequency, rng.uniform(-3.0, 3.0)])
    points = [JointTrajectoryPoint(positions=values)]
    return Command(
        "platform/command", packed(JointTrajectory(joint_names=MOTION_NAMES, points=points))
    )


class Twin:
    """One of them, paused, through a peer in its namespace."""

    def __init__(self, peer: Peer) -> None:
        self.peer = peer
        self.time_ns = 0

    def take(self, command: Command) -> None:
        """Send a right command and wait until it is on record."""
        before = len(self._inputs)
        self.peer.publisher(command.topic).publish(command.data)
        self.peer.spin_until(lambda: len(self._inputs) > before)

    @property
    def _inputs(self) -> list[Record]:
        return [record for record in self.peer.records if record["kind"] != "snapshot"]

    def step(self) -> None:
        """Simulate PERIODS periods, to their end."""
        answer = self.peer.call(Trigger, "step")
        assert answer.success, answer.message
        seconds = re.search(
            r"(?:until|now at) (\d+\.\d{9}) s(?:;| of simulated time$)", answer.message
        )
        assert seconds, answer.message
        self.time_ns = int(seconds[1].replace(".", ""))
        if "under way" in answer.message:  # on a slow machine
            self.peer.spin_until(self._stands)

    def _stands(self) -> bool:
        return "stepping" not in self.diagnostic("real time")[0]

    def diagnostic(self, task: str) -> tuple[str, dict[str, str]]:
        """Message and values of a task, of now."""
        self.peer.next_diagnostics()
        node = self.peer.node.get_namespace().strip("/") + "/bouncing_disk"
        return self.peer.diagnostic(task, node)[1:]

    def disturb(self, rng: random.Random, commands: list[Command]) -> None:
        """Send wrong commands, and ask for what is refused or changes nothing."""
        for command in rng.sample(commands, NONSENSE):
            self.peer.publisher(command.topic).publish(command.data)
        name = rng.choice(ASKED)
        kind, make = requests.OF_SIMULATOR[name]
        self.peer.call(kind, name, make(rng))
        number = rng.choice([Transition.TRANSITION_ACTIVATE, Transition.TRANSITION_CLEANUP, 77])
        change = ChangeState.Request(transition=Transition(id=number))
        assert not self.peer.call(ChangeState, "change_state", change).success
        asked = requests.parameters(rng)
        for parameter in asked:
            parameter.value.type = 99
        request = SetParameters.Request(parameters=asked)
        results = self.peer.call(SetParameters, "set_parameters", request).results
        assert not any(result.successful for result in results)

    def heard_until(self, index: float) -> NDArray[np.void]:
        """All rows heard, once that with this index is among them."""
        self.peer.spin_until(lambda: self.peer.rows["index"][-1] == index)
        return self.peer.rows


def compare(calm: Twin, disturbed: Twin, seed: int, rows: int) -> dict[str, str]:
    """Drive both until so many rows; AssertionError where one bit of record or rows differs."""
    print(f"seed {seed}")
    rng, nonsense = random.Random(seed), random.Random(seed + 1)
    commands = wrong_commands(nonsense, 200)
    twins = (calm, disturbed)
    for twin in twins:
        twin.peer.settle()
        twin.peer.spin_until(lambda: twin.peer.records)  # noqa: B023
    heard = 0
    while heard < rows:
        command = right_command(rng)
        disturbed.disturb(nonsense, commands)
        for twin in twins:
            twin.take(command)
        disturbed.disturb(nonsense, commands)
        for twin in twins:
            twin.step()
        assert calm.time_ns == disturbed.time_ns
        heard = sum(msg.width for msg in calm.peer.heard["disk/impacts"])
    assert calm.peer.records == disturbed.peer.records
    again = replayed(calm.peer.records, calm.time_ns)[0]
    for twin in twins:
        found = twin.heard_until(again["index"][-1])
        assert len(found) >= rows
        assert found.tobytes() == again[-len(found) :].tobytes()
    return disturbed.diagnostic("inputs")[1]
