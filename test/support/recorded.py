"""Bags of simulated runs without a process: what simulator and recorder would have written."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from numpy.typing import NDArray
from rclpy.serialization import serialize_message
from std_msgs.msg import String

from bouncing_disk_ros import bag, parameters
from bouncing_disk_ros.core.model import Disk, join_rows
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.report.run_record import RunRecord, State
from bouncing_disk_ros.ros import to_messages
from bouncing_disk_ros.run.health import Health, Reading, Status
from bouncing_disk_ros.run.input_records import Record, to_json
from bouncing_disk_ros.run.presets import load_preset
from bouncing_disk_ros.run.session import Session
from bouncing_disk_ros.run.simulate import Result
from bouncing_disk_ros.run.time_map import TimeMap
from bouncing_disk_ros.topics import TOPICS

NS = 1_000_000_000
START_NS = 1_700_000_000 * NS
TICK_NS = NS // 10
Act = Callable[[Session], None]
Rows = NDArray[np.void]
LATCHED = {"disk/inputs": 1000, "platform/motion": 1, "platform/offset": 1}
"""Topics that a late recorder is given, and how many messages of them."""


class Sent(NamedTuple):
    """A message as it was published."""

    topic: str
    data: bytes
    at_ns: int
    number: int


class RecordedRun:
    """One simulator; `to` writes what it publishes. Stamps are those of its clocks."""

    def __init__(
        self, writer: bag.Writer, namespace: str = "", start_ns: int = START_NS, *,
        without: tuple[str, ...] = (), lose: tuple[int, ...] = (), preset: str = "",
        begin: float = 0.0, end: float = math.inf, numbered: bool = True, **values: Value,
    ) -> None:  # fmt: skip
        """`without`: topics left out; `lose`: messages of disk/impacts that do not arrive.

        The recorder subscribes at `begin` (simulated s), when it is given what is latched, and
        leaves at `end`. `numbered`: whether it writes the numbers of the messages.
        """
        self._writer, self._namespace = writer, namespace
        self._without, self._lose, self._is_numbered = without, lose, numbered
        self._begin_ns, self._end_ns = round(begin * NS), end * NS
        self._latched: dict[str, deque[Sent]] = {}
        self._numbers: dict[str, int] = {}
        self._health = Health()
        self._records: list[Record] = []
        self.records: list[Record] = []  # all, in order
        self.rows: list[Rows] = []  # all
        whole = parameters.complete({**(load_preset(preset) if preset else {}), **values})
        self.session = Session(whole, self._records.append, paused=True)
        self._times = TimeMap(0, 0, start_ns, float(whole["real_time_factor"]))
        self._motion_index = self._offset_index = -1
        self._accepted()

    def run(
        self, seconds: float, acts: Mapping[float, Act] | None = None, slice_ticks: int = 1
    ) -> RecordedRun:
        """Go on for some seconds; `acts` are done at their simulated times (multiples of 0.1 s).

        Impacts and the motion in force are published at the end of a slice of some ticks of 0.1 s
        (a long step has long ones), or before an input.
        """
        waiting = {round(at * NS): act for at, act in (acts or {}).items()}
        end = self.session.time_ns + round(seconds * NS)
        before = self.session.simulation.sample()
        tick = 0
        while self.session.time_ns < end:
            while self.session.advance(self.session.time_ns // TICK_NS * TICK_NS + TICK_NS):
                pass
            now, tick = self.session.time_ns, tick + 1
            is_end = tick % slice_ticks == 0 or now in waiting or now >= end
            if is_end:
                self._flush()
            sample = self.session.simulation.sample()
            state = to_messages.fill_joint_state(
                to_messages.new_joint_state(), sample, self._stamp(now)
            )
            self._send("joint_states", state)
            speeds = before.mean_speeds(sample)
            self._send("disk/rotor_speed", to_messages.speed_to_msg(speeds, self._stamp(now)))
            before = sample
            if is_end and now % NS == 0:
                self._report(now)
            if now in waiting:
                waiting[now](self.session)
                self._accepted()
                before = self.session.simulation.sample()
            if is_end:
                self._show_motion()
        return self

    def rest(self, wall_ns: int) -> None:
        """Pause for some time of the wall clock, and go on."""
        self.session.set_paused(True)
        self._accepted()
        self._times = replace(self._times, ros_ns=self._times.ros_ns + wall_ns)
        self.session.set_paused(False)
        self._motion_index = -1  # each new line is published
        self._accepted()

    def _flush(self) -> None:
        rows = join_rows(self.session.take_rows())
        if len(rows):
            self.rows.append(rows)
            stamp = self._stamp(round(float(rows["time"][-1]) * NS))
            self._send("disk/impacts", to_messages.impacts_to_msg(rows, stamp))

    def _stamp(self, simulated_ns: int) -> int:
        return self._times.to_ros(simulated_ns)

    def _accepted(self) -> None:
        for record in self._records:
            self._send("disk/inputs", String(data=to_json(record)))
        factor = float(self.session.values["real_time_factor"])
        if factor != self._times.factor:
            now = self.session.time_ns
            self._times = TimeMap(now, 0, self._stamp(now), factor)
            self._motion_index = -1
        self.records += self._records
        self._records.clear()
        self._show_motion()

    def _show_motion(self) -> None:
        simulation = self.session.simulation
        if simulation.motion_index != self._motion_index:
            self._motion_index = simulation.motion_index
            motion = simulation.motion_in_force
            msg = to_messages.motion_to_msg(motion, self._stamp(motion.begin_ns))
            self._send_trajectory("platform/motion", msg)
        if simulation.offset_index != max(self._offset_index, 0):
            self._offset_index = simulation.offset_index
            stamp = self._stamp(simulation.offset_begin_ns)
            self._send_trajectory("platform/offset", to_messages.offset_to_msg(simulation, stamp))

    def _send_trajectory(self, topic: str, msg: Any) -> None:
        for point in msg.points:  # rclpy serialises empty arrays with stray bytes behind them
            for name in ("velocities", "accelerations", "effort"):
                if not len(getattr(point, name)):
                    setattr(point, name, [0.0])
        self._send(topic, msg)

    def _report(self, now: int) -> None:
        reading = Reading(
            self._stamp(now), now, 0, self.session.simulation.rows_total, 0, self.session.accepted,
            self.session.simulation.energy(), "running", self._times.factor, 0,
        )  # fmt: skip
        ticks = {"ticks": 100.0, "p50": 1e-4, "p99": 1e-3, "max": 2e-3}
        name = f"{self._namespace}/bouncing_disk".lstrip("/")
        rows = [_status(name, row) for row in self._health.report(reading, ticks)]
        msg = DiagnosticArray(status=rows)
        msg.header.stamp = to_messages.ns_to_time(self._stamp(now))
        self._send("/diagnostics", msg)

    def _send(self, topic: str, msg: Any) -> None:
        number = self._numbers[topic] = self._numbers.get(topic, 0) + 1
        if topic in self._without or (topic == "disk/impacts" and number in self._lose):
            return
        now = self.session.time_ns
        sent = Sent(topic, serialize_message(msg), self._stamp(now), number)
        if now < self._begin_ns:
            if topic in LATCHED:
                self._latched.setdefault(topic, deque(maxlen=LATCHED[topic])).append(sent)
            return
        for one in [one for kept in self._latched.values() for one in kept]:
            self._write(one, self._stamp(self._begin_ns))
        self._latched.clear()
        if now <= self._end_ns:
            self._write(sent, sent.at_ns)

    def _write(self, sent: Sent, received_ns: int) -> None:
        topic, data, at, number = sent
        name = topic if topic.startswith("/") else f"{self._namespace}/{topic}"
        self._writer.add_topic(name, TOPICS[topic].type, [bag.OfferedQos()])
        shown = number if self._is_numbered else 0
        self._writer.write(name, data, received_ns + 1_000_000, at, shown)


def listened(result: Result) -> RunRecord:
    """What a listener keeps of a simulated run: its disk, impacts, samples and speeds."""
    record = RunRecord(Disk.of(result.parameters))
    record.impacts.append(result.impacts)
    for sample in result.samples:
        time = float(sample["time_ns"]) / NS
        names = ("axial_position", "platform_position", "angular_velocity")
        record.states.append(State(time, *(float(sample[name]) for name in names)))
        record.speeds.append((time, float(sample["angular_velocity"])))
    return record


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
