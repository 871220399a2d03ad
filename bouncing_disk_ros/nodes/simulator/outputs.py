"""The topics of one run that a simulator's node publishes."""

from __future__ import annotations

import time
from collections.abc import Mapping
from contextlib import suppress
from typing import Any

from numpy.typing import NDArray
from rclpy.duration import Duration
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.publisher import Publisher
from rosgraph_msgs.msg import Clock
from std_msgs.msg import String

from bouncing_disk_ros.core.model import Sample
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.nodes.simulator.clocks import ClockOwnership
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.ros import to_messages
from bouncing_disk_ros.ros.qos import publisher_of
from bouncing_disk_ros.ros.transforms import Frames, TransformPublisher
from bouncing_disk_ros.run.input_records import Record, to_json
from bouncing_disk_ros.run.session import Session
from bouncing_disk_ros.run.time_map import TimeMap
from bouncing_disk_ros.topics import MAX_ROWS
from bouncing_disk_ros.units import NS

LAST_SECONDS = 4.0
"""Longest wait for subscribers at the end. Fast DDS looks every 3 s for what did not arrive."""


def second_clock() -> InputError:
    """The refusal to be the second publisher of /clock."""
    hint = "Start it without publish_clock, or in another ROS_DOMAIN_ID."
    return InputError("publish_clock", True, "false: /clock has a publisher", hint)


def clock_publishers(node: Node) -> frozenset[bytes]:
    """The identities of the publishers of /clock in the graph."""
    found = node.get_publishers_info_by_topic("/clock")
    return frozenset(bytes(info.endpoint_gid) for info in found)


class Outputs:
    """Publishers of one run; `times`, set by the run, gives the stamps, parameters the frames."""

    def __init__(self, node: Node, values: Mapping[str, Value]) -> None:
        self._node = node
        self._publishers: list[Publisher] = []
        self._joint_states = self._publisher("joint_states")
        self._impacts = self._publisher("disk/impacts")
        self._speed = self._publisher("disk/rotor_speed")
        self._inputs = self._publisher("disk/inputs")
        self._phase = self._publisher("disk/phase")
        self._motion = self._publisher("platform/motion")
        self._offset = self._publisher("platform/offset")
        self._clock: Publisher | None = None
        self.clock_ownership: ClockOwnership | None = None
        if values["publish_clock"]:
            self._take_clock()
        self._clock_ns = 0
        self._frames = Frames.of(values)
        self._transforms = TransformPublisher(node, values) if values["publish_tf"] else None
        self._publishers += self._transforms.publishers if self._transforms else []
        self._joint_state = to_messages.new_joint_state()
        self._shown_phase = ""
        self._phase_is_new = False
        self._shown_motion = -1
        self._shown_offset = 0

    def _publisher(self, name: str) -> Publisher:
        publisher = publisher_of(self._node, name)
        self._publishers.append(publisher)
        return publisher

    def clock_is_lost(self) -> bool:
        """Whether another publisher of /clock is to stay in this one's place."""
        owner = self.clock_ownership
        return owner is not None and owner.is_lost(
            clock_publishers(self._node), time.monotonic_ns()
        )

    def _take_clock(self) -> None:
        """Publish /clock; its publisher is the one that is new in the graph.

        Where another one has come at this very moment, again.
        """
        before = clock_publishers(self._node)
        self._clock = self._publisher("/clock")
        found = clock_publishers(self._node) - before
        if len(found) > 1:
            self._node.destroy_publisher(self._publishers.pop())
            self._take_clock()
        elif found:
            self.clock_ownership = ClockOwnership(min(found), time.monotonic_ns())

    @property
    def times(self) -> TimeMap:
        """The line between simulated time and stamps in force."""
        return self._times

    @times.setter
    def times(self, times: TimeMap) -> None:
        """With a new line the motion is published again: its stamp and simulated_time lie on it."""
        self._times, self._shown_motion = times, -1

    def deliver(self) -> None:
        """Wait until all subscribers have the inputs and the impacts, or LAST_SECONDS have passed.

        What the middleware would send again is lost once its publisher is gone, and nobody could
        tell: without the last inputs a replay differs.
        """
        end = time.monotonic() + LAST_SECONDS
        cannot_wait = rclpy_implementation.RCLError, rclpy_implementation.InvalidHandle
        with suppress(*cannot_wait):  # some middleware; a node that is destroyed twice
            for publisher in (self._inputs, self._impacts):
                publisher.wait_for_all_acked(Duration(seconds=max(end - time.monotonic(), 0.0)))

    def destroy(self) -> None:
        """Take the topics away (with what was latched on them)."""
        self.deliver()
        for publisher in self._publishers:
            self._node.destroy_publisher(publisher)
        self._publishers = []

    def record(self, record: Record) -> None:
        """One record of disk/inputs."""
        self._inputs.publish(String(data=to_json(record)))

    def sample(self, sample: Sample) -> None:
        """One message of joint_states."""
        stamp = self._stamp(sample.time_ns)
        self._joint_states.publish(to_messages.fill_joint_state(self._joint_state, sample, stamp))
        if self._transforms is not None:
            self._transforms.publish(sample, stamp)
        self._show_phase(sample.phase.name.lower())
        self._phase_is_new = True

    def speed(self, first: Sample, second: Sample) -> None:
        """One message of disk/rotor_speed."""
        speeds = first.mean_speeds(second)
        stamp = self._stamp(second.time_ns)
        self._speed.publish(to_messages.speed_to_msg(speeds, stamp, self._frames.world))

    def impacts(self, rows: NDArray[Any]) -> None:
        """Messages of disk/impacts, at most MAX_ROWS rows each, stamped with their last row."""
        for first in range(0, len(rows), MAX_ROWS):
            some = rows[first : first + MAX_ROWS]
            stamp = self._stamp(round(float(some["time"][-1]) * NS))
            self._impacts.publish(to_messages.impacts_to_msg(some, stamp, self._frames.impacts))

    def state(self, session: Session, running: bool) -> None:
        """What is published when it changed (motion, phase), and the clock."""
        simulation = session.simulation
        self._show_clock(self._times.to_ros(session.time_ns))
        if simulation.motion_index != self._shown_motion:
            self._shown_motion = simulation.motion_index
            motion = simulation.motion_in_force
            stamp = self._times.to_ros(motion.begin_ns)
            self._motion.publish(to_messages.motion_to_msg(motion, stamp, self._frames.world))
        if simulation.offset_index != self._shown_offset:
            self._shown_offset = simulation.offset_index
            stamp = self._times.to_ros(simulation.offset_begin_ns)
            self._offset.publish(to_messages.offset_to_msg(simulation, stamp, self._frames.world))
        if not running:
            self._show_phase("paused")
        elif not self._phase_is_new:  # no sample since the last call
            self._show_phase(simulation.sample().phase.name.lower())
        self._phase_is_new = False

    def _stamp(self, simulated_ns: int) -> int:
        """The stamp of a message; /clock goes before it, so that none lies in its future."""
        stamp = self._times.to_ros(simulated_ns)
        if stamp > self._clock_ns:
            self._show_clock(stamp)
        return stamp

    def _show_clock(self, now_ns: int) -> None:
        if self._clock is None:
            return
        owner = self.clock_ownership
        if owner is not None and owner.is_young(time.monotonic_ns()):
            self.clock_is_lost()  # who was started together is to be heard of before each message
        if owner is None or not owner.is_silent:
            self._clock_ns = now_ns
            self._clock.publish(Clock(clock=to_messages.ns_to_time(now_ns)))

    def _show_phase(self, phase: str) -> None:
        if phase != self._shown_phase:
            self._shown_phase = phase
            self._phase.publish(String(data=phase))

    def ended(self, fault: str) -> None:
        """The run cannot go on."""
        self._node.get_logger().error(f"the run has ended: {fault}")

    @property
    def other_publishers(self) -> int:
        """How many other publishers platform/motion has."""
        return max(0, self._node.count_publishers(self._motion.topic_name) - 1)
