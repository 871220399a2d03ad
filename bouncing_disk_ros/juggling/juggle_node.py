"""The node of `juggle`: impacts in, offset trajectories out, and a status that is latched.

Before its class `JuggleNode` its part in a lockstep, `GateAnswers`: it answers each gate once
it has received all impacts before.
"""

from __future__ import annotations

from array import array
from collections.abc import Mapping, Sequence
from typing import Any

from numpy.typing import NDArray
from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Float64, String, UInt64MultiArray
from trajectory_msgs.msg import JointTrajectory

from bouncing_disk_ros.core.model import Disk
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.juggling.live_loop import LiveLoop, LoopOptions, request_of
from bouncing_disk_ros.juggling.loop_settings import Limits, Sensor
from bouncing_disk_ros.parameters import Spec, Value
from bouncing_disk_ros.ros.from_messages import impacts_from_msg, msg_to_motion, time_to_ns
from bouncing_disk_ros.ros.node_tool import options
from bouncing_disk_ros.ros.numbered_subscription import WithInfo
from bouncing_disk_ros.ros.qos import publisher_of, subscription_to
from bouncing_disk_ros.ros.to_messages import trajectory_to_msg
from bouncing_disk_ros.topics import JUGGLE_STATUS, LOCKSTEP_TOPICS
from bouncing_disk_ros.units import NS

SIMULATOR = "bouncing_disk"
"""Name of the simulator's node: `bouncing_disk/gate` can be remapped."""


class GateAnswers:
    """Answers the gates of a simulator.

    Call `begin` once, `sent` after each input and `heard` after the impacts of a message. Rows
    below `first_row` came before the first gate that was heard: they are not to be answered, or it
    would depend on who was started first.
    """

    def __init__(self, node: Node, number: int, outputs: Sequence[Publisher]) -> None:
        """`outputs` publish the controller's inputs."""
        self._number, self._inputs = number, 0
        self._outputs = outputs
        self.first_row: int | None = None  # None: no gate was heard yet
        self._rows = 0
        self._is_ready = False
        self._gate, self._gate_rows, self._message = -1, 0, 0
        self._answered: UInt64MultiArray | None = None  # to the gate heard last
        gate, proceed = (LOCKSTEP_TOPICS[f"~/{name}"] for name in ("gate", "proceed"))
        self._out = publisher_of(node, proceed, f"{SIMULATOR}/proceed")
        subscription_to(node, gate, WithInfo(self._on_gate), f"{SIMULATOR}/gate")

    def begin(self) -> None:
        """The controller knows what it needs from the start: gates may be answered."""
        self._is_ready = True
        self._answer()

    def sent(self) -> None:
        """Count an input that has been published."""
        self._inputs += 1

    def heard(self, rows: int) -> None:
        """Impacts up to so many rows of the run have been answered."""
        self._rows = rows
        if self._answered is None:
            self._answer()

    def _on_gate(self, msg: UInt64MultiArray, info: Mapping[str, Any]) -> None:
        gate, _, rows = msg.data
        message = info["publication_sequence_number"]
        is_anew = message is not None and message <= self._message
        if self.first_row is None or is_anew or gate < self._gate:
            self.first_row = self._rows = rows  # a run that has begun before, or anew
            self._inputs, self._answered = 0, None
        self._message = message or 0
        if gate != self._gate:
            self._answered = None
        self._gate, self._gate_rows = gate, rows
        self._answer()

    def _answer(self) -> None:
        """Answer the gate; one that comes again gets the same answer.

        Without a subscriber yet, what is sent would be lost: the gate will come again.
        """
        if not self._is_ready or self.first_row is None or self._rows < self._gate_rows:
            return
        if not all(one.get_subscription_count() for one in (self._out, *self._outputs)):
            return
        if self._answered is None:
            data = array("Q", (self._number, self._gate, self._inputs))
            self._answered, self._inputs = UInt64MultiArray(data=data), 0
        self._out.publish(self._answered)


def loop_options(values: Mapping[str, Value]) -> LoopOptions:
    """What a loop is told by the options of the node."""
    numbers = {name: float(value) for name, value in values.items() if type(value) in (int, float)}
    return LoopOptions(
        disk=Disk(1.0, numbers["restitution"], 0.0, 1.0, 1.0, numbers["gravity"]),
        limits=Limits(*(numbers[f"{name}_limit"] for name in Limits.__dataclass_fields__)),
        sensor=Sensor(numbers["delay"], numbers["jitter"], numbers["missed"], int(values["seed"])),
        controller=str(values["controller"]),
        learns=bool(values["learn"]),
        lead_ns=round(numbers["lead"] * NS),
        tolerance=numbers["tolerance"],
        streak=int(values["streak"]),
    )


class JuggleNode(Node):
    """Answers impacts as a controller of `juggling` says. Attributes: `status`, `sent`."""

    def __init__(self, table: Mapping[str, Spec], **settings: Any) -> None:
        super().__init__("juggle", **settings)
        values = options(self, table)
        self._values = values
        self._loop = LiveLoop(loop_options(values), str(values["strategy"]), str(values["target"]))
        self.sent = 0
        self.status = ""
        self._out = publisher_of(self, "platform/joint_trajectory")
        self._lag_out = publisher_of(self, "platform/phase_lag")
        self._status = publisher_of(self, JUGGLE_STATUS)
        number = int(values["lockstep_number"])
        outputs = (self._out, self._lag_out)
        self._gates = GateAnswers(self, number, outputs) if number else None
        subscription_to(self, "platform/motion", self._on_motion)
        subscription_to(self, "disk/impacts", self._on_impacts)
        self.add_on_set_parameters_callback(self._on_change)
        self._report()

    def _report(self) -> None:
        """Latch a new status; a line in the log where it is not only `more` that is new."""
        text = self._loop.text
        if self._loop.status != self.status:
            if not self.status.startswith(text):
                self.get_logger().info(text)
            self.status = self._loop.status
            self._status.publish(String(data=self.status))

    def _on_change(self, changes: Sequence[Parameter]) -> SetParametersResult:
        """Switch to another target or strategy; the other options are read-only."""
        loop, new = self._loop, {change.name: str(change.value) for change in changes}
        try:
            loop.change(new.get("strategy", loop.strategy), new.get("target", loop.target))
        except InputError as error:
            return SetParametersResult(successful=False, reason=error.line)
        self._turn_and_report()
        return SetParametersResult(successful=True)

    # --- what is heard ----------------------------------------------------------------------------
    def _on_motion(self, msg: JointTrajectory) -> None:
        try:
            self._loop.on_motion(msg_to_motion(msg))
        except InputError as error:
            self._loop.fail(error)
        self._report()
        if self._gates is not None:
            self._gates.begin()

    def _on_impacts(self, cloud: PointCloud2) -> None:
        try:
            rows = impacts_from_msg(cloud)
        except InputError as error:
            self.get_logger().warning(error.line, once=True)
            return
        if not len(rows):
            return
        factor, last_ns = float(self._values["real_time_factor"]) or 1.0, rows["time"][-1] * NS
        for answer in self._loop.on_impacts(self._to_be_answered(rows)):
            late_ns = round((answer.begin_ns - round(last_ns)) / factor)
            stamp_ns = time_to_ns(cloud.header.stamp) + late_ns
            self._out.publish(trajectory_to_msg(request_of(answer, stamp_ns, factor)))
            self.sent += 1
            self._count()
        self._turn_and_report()
        if self._gates is not None:
            self._gates.heard(int(rows["index"][-1]) + 1)

    def _to_be_answered(self, rows: NDArray[Any]) -> NDArray[Any]:
        """In lockstep, rows from the first gate that was heard on."""
        if self._gates is None:
            return rows
        first = self._gates.first_row
        return rows[:0] if first is None else rows[rows["index"] >= first]

    def _turn_and_report(self) -> None:
        """Once captured see to the phase lag; say how it stands."""
        if self._values["set_phase_lag"] and (lag := self._loop.new_phase_lag()) is not None:
            self._lag_out.publish(Float64(data=lag))
            self._count()
        self._report()

    def _count(self) -> None:
        if self._gates is not None:
            self._gates.sent()
