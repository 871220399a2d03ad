"""The node of `perform`: one programme, from the first match to the last motion in force."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from rcl_interfaces.srv import GetParameters
from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python
from std_msgs.msg import String
from trajectory_msgs.msg import JointTrajectory

from bouncing_disk_ros.command_line.stop import Stop
from bouncing_disk_ros.core.model import Disk, Motion, MotionInForce
from bouncing_disk_ros.errors import ExitCode, FailedError, InputError
from bouncing_disk_ros.maps.period_one import refuse_unsettled
from bouncing_disk_ros.parameters import TABLE, Spec, Value
from bouncing_disk_ros.ros.from_messages import msg_to_motion, time_to_ns
from bouncing_disk_ros.ros.node_tool import options, publishing_nodes, wait_for
from bouncing_disk_ros.ros.qos import publisher_of, subscription_to
from bouncing_disk_ros.ros.to_messages import trajectory_to_msg
from bouncing_disk_ros.run.command_validation import ProgrammeRequest
from bouncing_disk_ros.run.gates import Lockstep
from bouncing_disk_ros.run.programmes import FIRST_TOSS, load_programme, requests_of, start_of
from bouncing_disk_ros.run.time_map import TimeMap, nanoseconds
from bouncing_disk_ros.units import NS

ASKED = ("real_time_factor", "crossfade_duration", "publish_clock", "lockstep", *Disk._fields)
"""Parameters of the simulator: when a stamp acts, and which disk a programme is for."""
PATIENCE = 5.0
"""Seconds by which a simulator may be late before it counts as not obeying."""


def answered(values: Sequence[Any]) -> list[Value] | None:
    """The values of ASKED in an answer that a node has given; None where they cannot be."""
    try:
        given = [parameter_value_to_python(value) for value in values]
        return [TABLE[name].checked(one) for name, one in zip(ASKED, given, strict=True)]
    except (RuntimeError, ValueError):  # an unknown type; a wrong value, another number of them
        return None


def cancelling(topic: str) -> str:
    """The command line that cancels the motions of a programme that have not begun."""
    return f"ros2 topic pub --once {topic} trajectory_msgs/msg/JointTrajectory '{{}}'"


class Performer(Node):
    """Publishes one programme. `programme` wins over the option of that name when not empty."""

    def __init__(self, table: Mapping[str, Spec], programme: str = "") -> None:
        super().__init__("perform")
        values = options(self, table)
        self.programme = load_programme(programme or str(values["programme"]))
        self._lead, self._timeout = float(values["lead"]), float(values["timeout"])
        self._publisher = publisher_of(self, "platform/command")
        self._offsets = publisher_of(self, "platform/joint_trajectory")
        self._motion: MotionInForce | None = None
        self._stamp_ns = 0  # of the beginning of that motion, ROS time
        self._phase = ""
        subscription_to(self, "platform/motion", self._on_motion)
        subscription_to(self, "disk/phase", self._on_phase)

    def _on_motion(self, msg: JointTrajectory) -> None:
        try:
            self._motion, self._stamp_ns = msg_to_motion(msg), time_to_ns(msg.header.stamp)
        except InputError as error:  # of another node: that of the simulator will come
            self.get_logger().warning(error.line, once=True)

    def _on_phase(self, msg: String) -> None:
        self._phase = msg.data

    def perform(self, stop: Stop) -> int:
        """Do it all; the exit code. Raises FailedError when the simulator does not take part."""
        self._find(stop)
        if stop.asked:
            return ExitCode.INTERRUPTED
        settings = self._settings(stop)
        factor = float(settings["real_time_factor"])
        self._refuse_unsuitable(settings)
        if stop.asked:
            return ExitCode.INTERRUPTED
        target, end_ns, seconds = self._publish(settings)
        done, waited = self._wait(stop, lambda: self._in_force(target, end_ns), seconds, factor)
        if not done and not stop.asked:
            raise FailedError(
                f"{self.programme.name} is not in force {waited:.1f} s after it was sent: refused "
                "(see the simulator's log and /diagnostics), replaced by another command, or paused"
            )
        if done:
            print(f"{self.programme.name}: in force", flush=True)
            return ExitCode.DONE
        topic = self._publisher.topic_name
        print(
            f"perform: interrupted; the simulator goes on with {self.programme.name}. A programme "
            f"without points cancels what has not begun: {cancelling(topic)}",
            file=sys.stderr,
            flush=True,
        )
        return ExitCode.INTERRUPTED

    def _wait(
        self, stop: Stop, condition: Callable[[], bool], seconds: float, factor: float
    ) -> tuple[bool, float]:
        """Whether a condition holds after so many seconds, and how many were waited.

        A run that was slowed down meanwhile gets more of them. `factor`: real_time_factor at first.
        """
        waited = 0.0
        while True:
            timeout = seconds + PATIENCE / min(factor, 1.0)
            done = wait_for(self, stop, condition, timeout - waited)
            waited = timeout
            now = factor if done or stop.asked else float(self._settings(stop)["real_time_factor"])
            if not 0.0 < now < factor:
                return done, waited
            seconds, factor = seconds * factor / now, now

    def _find(self, stop: Stop) -> None:
        """Wait for a simulator that listens and shows its motion."""
        topic = self._publisher.topic_name

        def ready() -> bool:
            heard = self._motion is not None and self._phase and self.get_clock().now().nanoseconds
            listeners = [self._publisher]
            listeners += [self._offsets] if self.programme.trajectory is not None else []
            return bool(heard and all(one.get_subscription_count() for one in listeners))

        if wait_for(self, stop, ready, self._timeout) or stop.asked:
            return
        if self._publisher.get_subscription_count():
            if not self.get_clock().now().nanoseconds:
                raise FailedError(
                    "no time on /clock, which use_sim_time needs: leave it out, unless the "
                    "simulator publishes /clock (publish_clock)"
                )
            raise FailedError(
                f"{topic} has a subscriber, but platform/motion is not published: is the "
                "simulator configured and active?"
            )
        raise FailedError(
            f"{topic} has no subscriber after {self._timeout:g} s: is the simulator running, in "
            f"this ROS_DOMAIN_ID ({self.context.get_domain_id()}) and this namespace?"
        )

    def _settings(self, stop: Stop) -> dict[str, Value]:
        """What the simulator says about its time and disk; real time when it does not answer."""
        assumed = (1.0, 0.0, self._is_on_clock(), Lockstep.OFF)
        settings: dict[str, Value] = dict(zip(ASKED, assumed, strict=False))
        wait_for(self, stop, self._simulator, PATIENCE)
        name = self._simulator() or "the simulator"
        if name.startswith("/") and not stop.asked:
            answer = self._parameters_of(name, stop)
            if answer is not None:
                return dict(zip(ASKED, answer, strict=True))
        if not stop.asked:
            self.get_logger().warning(f"{name} does not give its parameters: assuming real time")
        return settings

    def _is_on_clock(self) -> bool:
        return bool(self.get_parameter("use_sim_time").value)

    def _simulator(self) -> str:
        """Full name of the node that publishes platform/motion; empty until it is known."""
        return next(iter(publishing_nodes(self, "platform/motion")), "")

    def _parameters_of(self, name: str, stop: Stop) -> list[Value] | None:
        """The values of the parameters ASKED of a node; None when it does not answer."""
        client = self.create_client(GetParameters, f"{name}/get_parameters")
        if not wait_for(self, stop, client.service_is_ready, PATIENCE):
            return None
        future = client.call_async(GetParameters.Request(names=list(ASKED)))
        if not wait_for(self, stop, future.done, PATIENCE):
            return None
        return answered(future.result().values)

    def _refuse_unsuitable(self, settings: Mapping[str, Value]) -> None:
        """Situations in which no stamp could be right, or nothing would move."""
        if settings["lockstep"] != Lockstep.OFF:
            raise FailedError(
                "the simulator is in lockstep: it would wait for a controller that announces the "
                "programme; let one of them send it, or set lockstep to off"
            )
        if float(settings["real_time_factor"]) == 0.0:
            raise FailedError(
                "the simulator runs as fast as it can: set its real_time_factor to 1, or use "
                "simulate(programme=...) of the library"
            )
        if settings["publish_clock"] and not self._is_on_clock():
            raise FailedError(
                "the simulator publishes /clock: add --ros-args -p use_sim_time:=true"
            )
        if self._is_on_clock() and not settings["publish_clock"]:
            raise FailedError(
                "another node publishes /clock, not the simulator, whose stamps are wall time: "
                "leave out use_sim_time, or start the simulator with publish_clock"
            )
        if self._phase == "paused":
            raise FailedError("the simulator is paused: resume it first (service ~/pause, false)")
        if self.programme.name == FIRST_TOSS and set(Disk._fields) <= settings.keys():
            assert self._motion is not None
            last = self.programme.targets(self._motion.target)[-1][1]
            refuse_unsettled(FIRST_TOSS, last, Disk.of(settings))

    def _publish(self, settings: Mapping[str, Value]) -> tuple[Motion, int, float]:
        """Publish; the last motion, when it is reached (simulated ns), and in how many seconds."""
        assert self._motion is not None
        factor = float(settings["real_time_factor"])
        line = TimeMap(
            self._motion.begin_ns, 0, self._stamp_ns, factor, bool(settings["publish_clock"])
        )
        now_ns = self.get_clock().now().nanoseconds
        earliest = line.to_simulated(now_ns) + nanoseconds(self._lead * factor)
        fade_ns = nanoseconds(float(settings["crossfade_duration"]))
        self.programme = self.programme.fitted(self._motion.target)
        start_ns = start_of(self.programme, self._motion, earliest, fade_ns)
        for request in requests_of(self.programme, self._motion.target, start_ns, line):
            if isinstance(request, ProgrammeRequest):
                self._publisher.publish(trajectory_to_msg(request))
            else:
                self._offsets.publish(trajectory_to_msg(request))
        after_ns, target = self.programme.targets(self._motion.target)[-1]
        end_ns = start_ns + after_ns
        wait = (start_ns - line.to_simulated(now_ns)) / NS / factor
        seconds = wait + after_ns / NS / factor
        print(
            f"{self.programme.name}: {self.programme.description}\n"
            f"sent: {len(self.programme.request.points)} motion(s), starts in {wait:.2f} s, takes "
            f"{after_ns / NS / factor:.2f} s",
            flush=True,
        )
        return target, end_ns, seconds

    def _in_force(self, target: Motion, end_ns: int) -> bool:
        """Whether the platform moves steadily with the last motion, reached when it should be."""
        motion = self._motion
        if motion is None or motion.begin_ns != motion.end_ns or motion.end_ns < end_ns - NS // 100:
            return False
        pairs = zip(motion.target, target, strict=True)
        return all(math.isclose(a, b, rel_tol=1e-12, abs_tol=1e-12) for a, b in pairs)
