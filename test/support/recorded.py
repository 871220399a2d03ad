"""Bags of simulated runs without a process: what simulator and recorder would have written."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.serialization import serialize_message
from std_msgs.msg import String

from bouncing_disk_ros import bag, parameters
from bouncing_disk_ros.core.model import join_rows
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.ros import conversions
from bouncing_disk_ros.run.health import Health, Reading, Status
from bouncing_disk_ros.run.input_records import Record, to_json
from bouncing_disk_ros.run.presets import load_preset
from bouncing_disk_ros.run.session import Session
from bouncing_disk_ros.topics import TOPICS

NS = 1_000_000_000
START_NS = 1_700_000_000 * NS
TICK_NS = NS // 10
Act = Callable[[Session], None]


class RecordedRun:
    """One simulator; `to` writes what it publishes. Stamps are `start_ns` + simulated time."""

    def __init__(
        self, writer: bag.Writer, namespace: str = "", start_ns: int = START_NS, *,
        without: tuple[str, ...] = (), lose: tuple[int, ...] = (), preset: str = "",
        **values: Value,
    ) -> None:  # fmt: skip
        """`without`: topics left out; `lose`: messages of disk/impacts that do not arrive."""
        self._writer, self._namespace, self._start_ns = writer, namespace, start_ns
        self._without, self._lose = without, lose
        self._numbers: dict[str, int] = {}
        self._health = Health()
        self._records: list[Record] = []
        whole = parameters.complete({**(load_preset(preset) if preset else {}), **values})
        self.session = Session(whole, self._records.append, paused=True)
        self._motion_index = -1
        self._accepted()

    def run(self, seconds: float, acts: Mapping[float, Act] | None = None) -> RecordedRun:
        """Go on for some seconds; `acts` are done at their simulated times (multiples of 0.1 s)."""
        waiting = {round(at * NS): act for at, act in (acts or {}).items()}
        end = self.session.time_ns + round(seconds * NS)
        before = self.session.simulation.sample()
        while self.session.time_ns < end:
            while self.session.advance(self.session.time_ns // TICK_NS * TICK_NS + TICK_NS):
                pass
            now = self.session.time_ns
            rows = join_rows(self.session.take_rows())
            if len(rows):
                self._send("disk/impacts", conversions.impacts_to_msg(rows, self._stamp(now)))
            sample = self.session.simulation.sample()
            self._send(
                "joint_states",
                conversions.fill_joint_state(
                    conversions.new_joint_state(), sample, self._stamp(now)
                ),
            )
            speeds = before.mean_speeds(sample)
            self._send("disk/rotor_speed", conversions.speed_to_msg(speeds, self._stamp(now)))
            before = sample
            if now % NS == 0:
                self._report(now)
            if now in waiting:
                waiting[now](self.session)
                self._accepted()
                before = self.session.simulation.sample()
            self._show_motion()
        return self

    def _stamp(self, simulated_ns: int) -> int:
        return self._start_ns + simulated_ns

    def _accepted(self) -> None:
        for record in self._records:
            self._send("disk/inputs", String(data=to_json(record)))
        self._records.clear()
        self._show_motion()

    def _show_motion(self) -> None:
        simulation = self.session.simulation
        if simulation.motion_index != self._motion_index:
            self._motion_index = simulation.motion_index
            motion = simulation.motion_in_force
            stamp = self._stamp(motion.begin_ns)
            msg = conversions.motion_to_msg(motion, stamp)
            for point in msg.points:  # rclpy serialises empty arrays with stray bytes behind them
                point.velocities = point.accelerations = point.effort = [0.0]
            self._send("platform/motion", msg)

    def _report(self, now: int) -> None:
        reading = Reading(
            now, now, 0, self.session.simulation.rows_total, 0, self.session.accepted,
            self.session.simulation.energy(), "running", 1.0, 0,
        )  # fmt: skip
        ticks = {"ticks": 100.0, "p50": 1e-4, "p99": 1e-3, "max": 2e-3}
        name = f"{self._namespace}/bouncing_disk".lstrip("/")
        rows = [_status(name, row) for row in self._health.report(reading, ticks)]
        msg = DiagnosticArray(status=rows)
        msg.header.stamp = conversions.ns_to_time(self._stamp(now))
        self._send("/diagnostics", msg)

    def _send(self, topic: str, msg: Any) -> None:
        name = topic if topic.startswith("/") else f"{self._namespace}/{topic}"
        number = self._numbers[topic] = self._numbers.get(topic, 0) + 1
        if topic in self._without or (topic == "disk/impacts" and number in self._lose):
            return
        self._writer.add_topic(name, TOPICS[topic].type, [bag.OfferedQos()])
        at = self._stamp(self.session.time_ns)
        self._writer.write(name, serialize_message(msg), at + 1_000_000, at, number)


def _status(name: str, row: Status) -> DiagnosticStatus:
    values = [KeyValue(key=key, value=value) for key, value in row.values.items()]
    return DiagnosticStatus(
        level=bytes([row.level]), name=f"{name}: {row.task}", message=row.message, values=values
    )


def period_one_bag(folder: Path, seconds: float = 12.0, **options: Any) -> Path:
    """A bag of the period-1 orbit of the preset, Γ = 0.45; `seconds` whole."""
    with bag.Writer(folder, version="1.2.3") as writer:
        RecordedRun(writer, preset="pizza_multiple_toss", **options).run(seconds)
    return folder
