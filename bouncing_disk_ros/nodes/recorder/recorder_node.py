"""The recorder as a node: finds topics, writes their messages to a bag, reports losses."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from std_srvs.srv import Trigger

import bouncing_disk_ros
from bouncing_disk_ros import bag
from bouncing_disk_ros.bag.recording import Recording
from bouncing_disk_ros.command_line.stop import Stop
from bouncing_disk_ros.errors import ExitCode, InputError, cut
from bouncing_disk_ros.folders import user_path
from bouncing_disk_ros.limits import LOOKED_TOPICS
from bouncing_disk_ros.nodes.recorder.attachments import (
    YAML,
    RunParameters,
    own_parameters,
    preset_bytes,
    versions,
)
from bouncing_disk_ros.nodes.recorder.recorded_topic import (
    ReceptionTimes,
    RecordedTopic,
    is_snapshot,
    offered,
)
from bouncing_disk_ros.nodes.recorder.recorder_options import (
    MB,
    OPTIONS,
    Selection,
    check_size,
    default_folder,
    preset_files,
    writer_options,
)
from bouncing_disk_ros.nodes.recorder.recorder_status import RecorderStatus
from bouncing_disk_ros.ros.diagnostics_publisher import DiagnosticsPublisher
from bouncing_disk_ros.ros.node_tool import options
from bouncing_disk_ros.ros.requests import guard_services
from bouncing_disk_ros.run.throttled_log import ThrottledLog

LOOK_SECONDS = 0.2
"""How often the graph is looked at."""
SPIN_SECONDS = 0.1
"""The longest wait before a signal is looked at."""
SILENT_SECONDS = 3.0
"""After so long without a message a line says where it listens, and whether anybody publishes."""
LAST_SECONDS = 1.0
"""The longest time for what is still on the way when a signal comes: messages and answers."""


class Recorder(Node):
    """Records until `stop`; `output` wins over the parameter of that name."""

    def __init__(self, output: str = "", **kwargs: Any) -> None:
        super().__init__("recorder", **kwargs)
        self._values = options(self, OPTIONS)
        self._topics: dict[str, RecordedTopic] = {}
        self._refused: set[str] = set()
        self._heard = 0
        self._times = ReceptionTimes()
        self._paused = bool(self._values["start_paused"])
        self._presets = preset_files(self._values)
        for path in self._presets:
            preset_bytes(path)  # InputError
        self._selection = Selection(self._values, self.resolve_topic_name)
        folder = user_path(output or str(self._values["output"]) or default_folder())
        version = str(bouncing_disk_ros.__version__)
        choice = writer_options(self._values)
        self._mine = own_parameters(self.get_fully_qualified_name(), self._values)
        check_size(self._selection, len(self._mine) + len(versions(version)), choice)
        writer = bag.Writer(folder, choice, version=version)
        self._recording = Recording(writer, round(float(self._values["queue_size"]) * MB))
        self._status = RecorderStatus(self._recording, self._topics)
        self._refusals = ThrottledLog(self.get_logger().warning)
        self._diagnostics = DiagnosticsPublisher(self)
        try:
            self._set_up(version)
        except BaseException:
            self._recording.close()
            raise

    def _set_up(self, version: str) -> None:
        self._attach("versions.yaml", YAML, versions(version))
        self._attach("recorder.yaml", YAML, self._mine)
        for name, topic in self._selection.known.items():  # recorded from their first message on
            self._hear(name, topic.type)
        inputs = self.resolve_topic_name("disk/inputs")
        self._run_parameters = RunParameters(self, inputs, self._attach, self._presets)
        for service, action in (
            ("~/pause", self._pause), ("~/resume", self._resume), ("~/split", self._split)
        ):  # fmt: skip
            self.create_service(Trigger, service, _answering(action))
        guard_services(self, self._refuse)
        steady = Clock(clock_type=ClockType.STEADY_TIME)  # whatever becomes of /clock
        self.create_timer(LOOK_SECONDS, self._look, clock=steady)
        self.create_timer(1.0, self._report, clock=steady)
        self._explaining = self.create_timer(SILENT_SECONDS, self._explain_silence, clock=steady)
        if period := float(self._values["status_period"]):
            self.create_timer(period, self._show_status, clock=steady)
        state = "paused, " if self._paused else ""
        self.get_logger().info(f"{state}recording to {self._recording.writer.folder}")

    # --- topics -----------------------------------------------------------------------------------
    def _look(self) -> None:
        """Find new topics and publishers."""
        for name, kinds in self.get_topic_names_and_types():
            is_new = name not in self._topics and name not in self._refused
            is_new = is_new and len(self._topics) + len(self._refused) < LOOKED_TOPICS
            if is_new and self._selection.wants(name) and self.count_publishers(name):
                self._hear(name, kinds[0])
        for topic in list(self._topics.values()):
            infos = topic.follow()
            if infos and not topic.registered:
                self._register(topic, infos)
            if topic.registered:
                self._repeat(topic, len(infos))
        self._run_parameters.look()

    def _hear(self, name: str, kind: str) -> None:
        known = self._selection.known.get(name)
        try:
            is_ours = known is not None and known.type == kind
            topic = RecordedTopic(
                self, name, kind, self._put, qos=known.qos if known and is_ours else None,
                has_index=bool(known and known.name == "disk/impacts"), times=self._times,
            )  # fmt: skip
        except Exception as error:  # noqa: BLE001 (names and types may come from anyone)
            self._refused.add(name)
            self.get_logger().warning(f"{cut(name)} is not recorded: {cut(str(error), 300)}")
            return
        if known and known.name == "/diagnostics":
            topic.own = self._diagnostics.sent
        self._topics[name] = topic

    def _register(self, topic: RecordedTopic, infos: list[Any]) -> None:
        topic.registered = True
        qos = [offered(info) for info in infos]
        hashes = {str(info.topic_type_hash) for info in infos}
        announced = hashes.pop() if len(hashes) == 1 else ""
        type_hash = announced if announced.startswith("RIHS01_") else None
        writer = self._recording.writer
        self._recording.do(lambda: writer.add_topic(topic.name, topic.type, qos, type_hash))
        self._repeat(topic, len(infos))
        self.get_logger().info(f"subscribed to {topic.name} ({topic.type})")

    def _repeat(self, topic: RecordedTopic, publishers: int) -> None:
        """Have later files of the bag begin with what is latched on a topic."""
        depth = topic.latched_depth(publishers) if self._values["repeat_latched"] else 0
        if depth > topic.repeated:
            topic.repeated = depth
            known = self._selection.known.get(topic.name)
            begins = is_snapshot if known and known.name == "disk/inputs" else None
            writer = self._recording.writer
            self._recording.do(lambda: writer.repeat(topic.name, depth, begins))

    def _put(
        self, topic: RecordedTopic, data: bytes, received: int, sent: int, number: int
    ) -> bool | None:
        self._heard += 1
        if self._paused:
            return None
        if not topic.registered:
            self._register(topic, topic.publishers())
        return self._recording.put(topic.name, data, received, sent, number)

    def _attach(self, name: str, media_type: str, data: bytes) -> None:
        writer = self._recording.writer
        self._recording.do(lambda: writer.attach(name, media_type, data))

    # --- services ---------------------------------------------------------------------------------
    def _pause(self) -> str:
        self._paused = True
        return "paused"

    def _resume(self) -> str:
        if self._paused:
            self._paused = False
            for topic in self._topics.values():
                topic.restart()
        return "recording"

    def _split(self) -> str:
        self._recording.do(self._recording.writer.split)
        return "a new file was begun"

    # --- telling ----------------------------------------------------------------------------------
    def _refuse(self, error: InputError) -> None:
        """Count a request that cannot be satisfied, and log why."""
        self._status.refused += 1
        self._refusals.note_refusal(error)

    @property
    def _state(self) -> str:
        return "paused" if self._paused else "recording"

    def _explain_silence(self) -> None:
        """Say once why nothing may have come."""
        self._explaining.cancel()
        if not self._heard:
            known = any(topic.publishers() for topic in self._topics.values())
            why = "their publishers have sent nothing" if known else "no node publishes them"
            domain = f"ROS_DOMAIN_ID {self.context.get_domain_id()}"
            self.get_logger().info(f"waiting for the topics to record in {domain}: {why}")

    def _show_status(self) -> None:
        self._recording.note(self._status.losses())
        self.get_logger().info(self._status.line(self._state))

    def _report(self) -> None:
        self._refusals.flush()
        self._diagnostics.publish(self._status.report(self._state))

    # --- the run ----------------------------------------------------------------------------------
    def record(self, stop: Stop) -> int:
        """Record until a signal comes or nothing more can be written; the exit code.

        When the disk or an error ended it, that is reported at once; what is in the bag can be
        read.
        """
        try:
            self._spin(stop)
            self._run_parameters.warn_of_missing()
        finally:
            self._recording.note(self._status.losses())
            self._recording.close()
        error = self._recording.error
        if error is not None:
            print(f"recorder: {error}", file=sys.stderr, flush=True)
            self._report()
            self._diagnostics.publisher.wait_for_all_acked(Duration(seconds=LAST_SECONDS))
        print(self._status.summary(), flush=True)
        return ExitCode.DONE if error is None else ExitCode.FAILED

    def _spin(self, stop: Stop) -> None:
        """Run callbacks until the end, and then for what is still on the way.

        The events executor cannot give them the numbers of messages. One executor does both: an
        answer that it has taken waits in it for its callback.
        """
        executor = SingleThreadedExecutor(context=self.context)
        executor.add_node(self)
        try:
            while not (stop.asked or self._recording.error):
                executor.spin_once(timeout_sec=SPIN_SECONDS)
            heard, since = self._heard, time.monotonic()
            end = since + LAST_SECONDS
            while (now := time.monotonic()) < end and not self._recording.error:
                executor.spin_once(timeout_sec=SPIN_SECONDS)
                for topic in self._topics.values():  # that round may have been for a timer
                    topic.take_waiting()
                if heard != self._heard:
                    heard, since = self._heard, now
                elif now > since + SPIN_SECONDS and not self._run_parameters.is_answer_due:
                    break
        finally:
            executor.remove_node(self)
            executor.shutdown()


def _answering(action: Callable[[], str]) -> Callable[[Any, Any], Any]:
    def answer(_request: Any, response: Any) -> Any:
        response.message, response.success = action(), True
        return response

    return answer
