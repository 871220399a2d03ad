"""A subscriber of another make, without ROS: Cyclone DDS reads and commands the simulator."""

# no postponed annotations: cyclonedds reads them as types

import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import pytest

from support.processes import PATIENCE, Starter

pytestmark = pytest.mark.interop

pytest.importorskip("cyclonedds")

from cyclonedds.core import Policy, Qos  # noqa: E402
from cyclonedds.domain import Domain, DomainParticipant  # noqa: E402
from cyclonedds.idl import IdlStruct  # noqa: E402
from cyclonedds.idl.types import float64, int32, sequence, uint32  # noqa: E402
from cyclonedds.pub import DataWriter  # noqa: E402
from cyclonedds.sub import DataReader  # noqa: E402
from cyclonedds.topic import Topic  # noqa: E402
from cyclonedds.util import duration  # noqa: E402

#: only this machine, by unicast, as ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST has it
LOCALHOST = """<CycloneDDS><Domain>
<General><Interfaces><NetworkInterface name="lo" multicast="false"/></Interfaces>
<AllowMulticast>false</AllowMulticast></General>
<Discovery><ParticipantIndex>auto</ParticipantIndex>
<MaxAutoParticipantIndex>40</MaxAutoParticipantIndex>
<Peers><Peer Address="localhost"/></Peers></Discovery>
</Domain></CycloneDDS>"""

RELIABLE = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepLast(100))


@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):  # type: ignore[call-arg]
    sec: int32 = 0
    nanosec: uint32 = 0


@dataclass
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):  # type: ignore[call-arg]
    stamp: Time = field(default_factory=Time)
    frame_id: str = ""


@dataclass
class JointState(IdlStruct, typename="sensor_msgs::msg::dds_::JointState_"):  # type: ignore[call-arg]
    header: Header
    name: sequence[str]
    position: sequence[float64]
    velocity: sequence[float64]
    effort: sequence[float64]


@dataclass
class Float64(IdlStruct, typename="std_msgs::msg::dds_::Float64_"):  # type: ignore[call-arg]
    data: float64


@pytest.fixture
def participant(ros_domain: int) -> Iterator[Any]:
    """A participant of the tests' domain that knows nothing of ROS."""
    domain = Domain(ros_domain, LOCALHOST)
    yield DomainParticipant(ros_domain)
    del domain


def largest(reader: Any, joint: str) -> float:
    """Return the largest position of `joint` among the samples that have arrived."""
    samples = reader.take(N=200)
    return max((abs(s.position[s.name.index(joint)]) for s in samples), default=0.0)


def test_another_middleware_reads_and_commands_the_simulator(
    start: Starter, participant: Any
) -> None:
    node = start("simulator", "--ros-args", "-p", "preset:=pizza_single_toss")
    reader = DataReader(
        participant, Topic(participant, "rt/joint_states", JointState), qos=RELIABLE
    )
    writer = DataWriter(
        participant, Topic(participant, "rt/platform/angular_amplitude", Float64), qos=RELIABLE
    )
    deadline = time.monotonic() + PATIENCE
    asked = 7.5  # rad; no preset has it
    while not (largest(reader, "platform_rotation") > 0.9 * asked):
        assert node.running
        assert time.monotonic() < deadline, "the command did not change joint_states"
        writer.write(Float64(asked))
        time.sleep(0.05)  # the pace of the command, not a wait for its effect
