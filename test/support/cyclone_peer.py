"""A participant of another make: Cyclone DDS listens to joint_states and commands the platform.

It knows nothing of ROS. Import it within a test, where cyclonedds is known to be installed.
"""

# no postponed annotations: cyclonedds reads them as types

from dataclasses import dataclass, field

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import float64, int32, sequence, uint32
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

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


class CyclonePeer:
    """Reads the positions of joints and writes the platform's angular amplitude."""

    def __init__(self, number: int) -> None:
        """Join the DDS domain `number` on this machine."""
        self._domain = Domain(number, LOCALHOST)  # in force while it is referred to
        participant = DomainParticipant(number)
        self._reader = DataReader(
            participant, Topic(participant, "rt/joint_states", JointState), qos=RELIABLE
        )
        self._writer = DataWriter(
            participant, Topic(participant, "rt/platform/angular_amplitude", Float64), qos=RELIABLE
        )

    def largest(self, joint: str) -> float:
        """Return the largest position of `joint` among the samples that have arrived."""
        samples = self._reader.take(N=200)
        return max((abs(s.position[s.name.index(joint)]) for s in samples), default=0.0)

    def command(self, angular_amplitude: float) -> None:
        """Publish an angular amplitude, rad."""
        self._writer.write(Float64(angular_amplitude))
