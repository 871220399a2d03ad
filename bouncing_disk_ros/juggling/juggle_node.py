"""A controller's part in a lockstep: it answers each gate once it has heard all impacts before."""

from __future__ import annotations

import math
from array import array
from collections.abc import Mapping, Sequence
from typing import Any

from numpy.typing import NDArray
from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Float64, Header, String, UInt64MultiArray
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from bouncing_disk_ros.core.model import Disk, Motion
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.juggling.juggler import Juggler, OffsetTrajectory
from bouncing_disk_ros.juggling.loop_settings import Array, Limits, Sensor, check_strategy
from bouncing_disk_ros.juggling.loop_verdict import Outcome, Watch
from bouncing_disk_ros.juggling.own_controller import Setup, load_controller
from bouncing_disk_ros.juggling.simulated_loop import hear_row
from bouncing_disk_ros.juggling.target_orbit import OWN, best_phase_lag, orbit_named
from bouncing_disk_ros.juggling.watched_loop import WatchedLoop, phase_at_zero
from bouncing_disk_ros.maps.scales import axial_forcing_of
from bouncing_disk_ros.parameters import Spec
from bouncing_disk_ros.ros.conversions import ns_to_duration, ns_to_time
from bouncing_disk_ros.ros.from_messages import impacts_from_msg, msg_to_motion, time_to_ns
from bouncing_disk_ros.ros.node_tool import options
from bouncing_disk_ros.ros.numbered_subscription import WithInfo
from bouncing_disk_ros.ros.qos import profile_of
from bouncing_disk_ros.topics import LOCKSTEP_TOPICS, OFFSET_JOINTS, TOPICS
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
        self._out = node.create_publisher(
            UInt64MultiArray, f"{SIMULATOR}/proceed", profile_of(proceed)
        )
        node.create_subscription(
            UInt64MultiArray, f"{SIMULATOR}/gate", WithInfo(self._on_gate), profile_of(gate)
        )

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


# ------------------------------------------------------------------------------------------------
# The node of `juggle`: impacts in, offset trajectories out, and a status that is latched.


_LAG_OFF = 1e-3
"""Phase lags nearer than this (rad) to the best one are left alone: 1 − cos of it is 5e-7."""
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class JuggleNode(Node):
    """Answers impacts as a controller of `juggling` says. Attributes: `status`, `sent`."""

    def __init__(self, table: Mapping[str, Spec], **settings: Any) -> None:
        super().__init__("juggle", **settings)
        values = options(self, table)
        self._values = values
        self._strategy, self._file = str(values["strategy"]), str(values["controller"])
        self._target = str(values["target"])
        self._check(self._strategy, self._target)
        delay, jitter, missed = (float(values[name]) for name in ("delay", "jitter", "missed"))
        self._sensor = Sensor(delay, jitter, missed, int(values["seed"]))
        self.sent = 0
        self.status = ""
        self._loop: WatchedLoop | None = None
        topic = TOPICS["platform/joint_trajectory"]
        self._out = self.create_publisher(JointTrajectory, topic.name, profile_of(topic))
        topic = TOPICS["platform/phase_lag"]
        self._lag_out = self.create_publisher(Float64, topic.name, profile_of(topic))
        self._status = self.create_publisher(String, "~/status", LATCHED)
        number = int(values["lockstep_number"])
        outputs = (self._out, self._lag_out)
        self._gates = GateAnswers(self, number, outputs) if number else None
        for name, kind, callback in (
            ("platform/motion", JointTrajectory, self._on_motion),
            ("disk/impacts", PointCloud2, self._on_impacts),
        ):
            self.create_subscription(kind, name, callback, profile_of(TOPICS[name]))
        self.add_on_set_parameters_callback(self._on_change)
        self._say("waiting for platform/motion")

    def _say(self, text: str, more: str = "") -> None:
        """A new status: latched; a line in the log where it is not only `more` that is new."""
        if text + more != self.status:
            if not self.status.startswith(text):
                self.get_logger().info(text)
            self.status = text + more
            self._status.publish(String(data=self.status))

    # --- the target -------------------------------------------------------------------------------
    def _check(self, strategy: str, target: str) -> None:
        """Refuse a strategy that there is not, and a target that it does not aim at."""
        check_strategy(strategy)
        if target != OWN and (self._file or strategy in ("none", "small")):
            why = "Only impact_time and deadbeat aim at other orbits."
            raise InputError("target", target, OWN, why)

    def _orbit(self, target: str, motion: Motion, disk: Disk) -> Array:
        return orbit_named(target, axial_forcing_of(motion, disk), disk.restitution)

    def _on_change(self, changes: Sequence[Parameter]) -> SetParametersResult:
        """Switch to another target or strategy; the other options are read-only."""
        new = {change.name: str(change.value) for change in changes}
        strategy = new.get("strategy", self._strategy)
        target = new.get("target", self._target)
        try:
            if strategy != self._strategy and self._file:
                raise InputError("strategy", strategy, "none with a controller of your own")
            self._check(strategy, target)
            if self._loop is not None:
                self._switch(self._loop, strategy, target)
        except InputError as error:
            return SetParametersResult(successful=False, reason=error.line)
        self._strategy, self._target = strategy, target
        if self._loop is not None:
            self._report(self._loop)
        return SetParametersResult(successful=True)

    def _switch(self, loop: WatchedLoop, strategy: str, target: str) -> None:
        """Go on with another strategy, to another orbit; what was heard and commanded stays."""
        if target != self._target:
            orbit = self._orbit(target, loop.setup.motion, loop.setup.disk)
            loop.watch = self._new_watch(orbit)
            if isinstance(loop.controller, Juggler):
                loop.controller.aim_at(None if target == OWN else orbit)
        if strategy != self._strategy and isinstance(loop.controller, Juggler):
            old = loop.controller
            loop.controller = self._controller(strategy, loop.setup, old.orbit, target)
            loop.controller.take_over(old)

    def _name(self) -> str:
        aim = "" if self._target == OWN else f" to {self._target}"
        return f"{self._file or self._strategy}{aim}"

    def _new_watch(self, orbit: Array) -> Watch:
        return Watch(orbit, float(self._values["tolerance"]), int(self._values["streak"]))

    # --- what is heard ----------------------------------------------------------------------------
    def _on_motion(self, msg: JointTrajectory) -> None:
        try:
            motion = msg_to_motion(msg)
            phase = phase_at_zero(motion)
            if self._loop is not None and self._loop.goes_on(motion, phase):
                return
            self._loop = None
            if motion.begin_ns != motion.end_ns:  # a cross-fade: the steady motion comes next
                self._say("waiting for a steady motion")
            else:
                self._begin(motion.target, phase)
        except InputError as error:
            self._loop = None
            self._say(f"cannot juggle: {error.line}")
        if self._gates is not None:
            self._gates.begin()

    def _begin(self, motion: Motion, phase: float) -> None:
        """Start anew under a steady motion."""
        values = self._values
        restitution, gravity = float(values["restitution"]), float(values["gravity"])
        disk = Disk(1.0, restitution, 0.0, 1.0, 1.0, gravity)
        limits = Limits(*(float(values[f"{name}_limit"]) for name in Limits.__dataclass_fields__))
        setup = Setup(motion, disk, limits, phase)
        orbit = self._orbit(self._target, motion, disk)
        self._loop = WatchedLoop(
            load_controller(self._file, setup) if self._file
            else self._controller(self._strategy, setup, orbit, self._target),
            setup, self._new_watch(orbit),
        )  # fmt: skip
        self._say(f"{self._name()}: not captured")

    def _controller(self, strategy: str, setup: Setup, orbit: Array, target: str) -> Juggler:
        return Juggler(
            strategy, setup.motion, setup.disk, limits=setup.limits, phase=setup.phase,
            learns=bool(self._values["learn"]), orbit=None if target == OWN else orbit,
        )  # fmt: skip

    def _on_impacts(self, cloud: PointCloud2) -> None:
        try:
            rows = impacts_from_msg(cloud)
        except InputError as error:
            self.get_logger().warning(error.line, once=True)
            return
        if self._loop is not None:
            for row in self._to_be_answered(rows):
                self._on_row(self._loop, row, cloud, round(float(rows["time"][-1]) * NS))
            self._report(self._loop)
        if self._gates is not None:
            self._gates.heard(int(rows["index"][-1]) + 1)

    def _to_be_answered(self, rows: NDArray[Any]) -> NDArray[Any]:
        """In lockstep, rows from the first gate that was heard on."""
        if self._gates is None:
            return rows
        first = self._gates.first_row
        return rows[:0] if first is None else rows[rows["index"] >= first]

    def _on_row(self, loop: WatchedLoop, row: Any, cloud: PointCloud2, last_ns: int) -> None:
        loop.note(row)
        heard = hear_row(row, self._sensor, loop.setup.motion.frequency, 0, int(row["index"]))
        if heard is None:
            return
        known_ns, impact = heard
        lead_ns = round(float(self._values["lead"]) * NS)
        answer = loop.controller.on_impact(impact, known_ns + lead_ns)
        if answer is not None:
            factor = float(self._values["real_time_factor"]) or 1.0
            late_ns = round((answer.begin_ns - last_ns) / factor)
            self._send(answer, time_to_ns(cloud.header.stamp) + late_ns, factor)

    def _report(self, loop: WatchedLoop) -> None:
        """Say how it stands; once captured, the rotor speed too, and see to the phase lag."""
        text, more = f"{self._name()}: {loop.watch.text}", ""
        top = math.tau * loop.motion.frequency * loop.motion.angular_amplitude
        if loop.watch.verdict.outcome is Outcome.CAPTURED and top > 0.0:
            speed = loop.rotor_speed / top
            more = f", rotor speed {speed:.2f} ωΦ" if speed == speed else ""
            if self._values["set_phase_lag"] and self._strategy != "none":
                self._turn_fastest(loop)
        self._say(text, more)

    def _turn_fastest(self, loop: WatchedLoop) -> None:
        """Command the phase lag with the largest rotor speed on the orbit, where it is another."""
        lag = best_phase_lag(loop.orbit, loop.axial_forcing)
        if abs(math.remainder(lag - loop.phase_lag, math.tau)) > _LAG_OFF:
            loop.phase_lag = lag
            self._lag_out.publish(Float64(data=lag))
            self._count()

    # --- what is commanded ------------------------------------------------------------------------
    def _send(self, answer: OffsetTrajectory, stamp_ns: int, factor: float) -> None:
        points = [
            JointTrajectoryPoint(
                positions=array("d", [point.position]),
                velocities=array("d", [point.velocity]),
                accelerations=array("d", [point.acceleration]),
                time_from_start=ns_to_duration(round((point.at_ns - answer.begin_ns) / factor)),
            )
            for point in answer.points
        ]
        header = Header(stamp=ns_to_time(stamp_ns))
        names = [OFFSET_JOINTS[0]]
        self._out.publish(JointTrajectory(header=header, joint_names=names, points=points))
        self.sent += 1
        self._count()

    def _count(self) -> None:
        if self._gates is not None:
            self._gates.sent()
