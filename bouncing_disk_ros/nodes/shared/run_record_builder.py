"""What the topics of a simulator say, live or from a bag, kept as a `RunRecord`.

The messages are those of rclpy or objects with the same fields (`bag.Bag.decoded`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from bouncing_disk_ros import limits
from bouncing_disk_ros.analysis.recorded.impact_text import LossCounter
from bouncing_disk_ros.analysis.recorded.record_validation import (
    checked_motion,
    checked_number,
    checked_numbers,
    checked_rows,
)
from bouncing_disk_ros.analysis.recorded.run_record import Change, Health, RunRecord, State
from bouncing_disk_ros.core.model import Disk, Energy
from bouncing_disk_ros.errors import InputError, shown
from bouncing_disk_ros.ros.from_messages import (
    impacts_from_msg,
    msg_to_joints,
    msg_to_motion,
    msg_to_speed,
    time_to_ns,
)
from bouncing_disk_ros.run.input_records import Record, from_json
from bouncing_disk_ros.run.recorded_trajectories import RecordedTrajectories
from bouncing_disk_ros.run.time_map import TimeMap
from bouncing_disk_ros.units import NS

_SHOWN = 100
"""Letters of a text of another node that are shown, at most."""
_JOINTS = ("disk_axial", "platform_axial", "disk_rotation")
_REPORTED = (
    ("real time", "simulated time (s)"),
    ("real time", "lateness p50 (s)"),
    ("real time", "lateness p99 (s)"),
    ("real time", "lateness max (s)"),
    ("energy", "residual / throughput"),
)
"""Task and key of the fields of `Health` between its stamp and `running`."""


class RunRecordBuilder:
    """Takes messages by topic; times are simulated seconds.

    `namespace`: of the simulator; reports on /diagnostics of others are not taken.
    """

    def __init__(self, record: RunRecord, namespace: str = "/") -> None:
        self.record = record
        self.phase = ""
        self._prefix = namespace.strip("/")
        self._losses = LossCounter()
        self._trajectories = RecordedTrajectories(record.offsets)
        self._line: TimeMap | None = None  # between stamps and simulated time
        self._factor, self._clock_is_simulated = 1.0, False
        self.handlers: Mapping[str, Callable[[Any], None]] = {
            "disk/inputs": self._on_input,
            "platform/motion": self._on_motion,
            "platform/offset": self._on_offset,
            "disk/phase": self._on_phase,
            "disk/impacts": self._on_impacts,
            "disk/rotor_speed": self._on_speed,
            "joint_states": self._on_joints,
            "/diagnostics": self._on_diagnostics,
        }

    def _through(self, simulated_ns: int, ros_ns: int) -> TimeMap:
        return TimeMap(simulated_ns, 0, ros_ns, self._factor, self._clock_is_simulated)

    def _time(self, msg: Any) -> float:
        """Simulated time of a message's stamp, s."""
        assert self._line is not None
        return self._line.to_simulated(time_to_ns(msg.header.stamp)) / NS

    def _on_motion(self, msg: Any) -> None:
        for point in msg.points:
            if len(point.positions) != len(msg.joint_names):
                given = f"{len(point.positions)} positions"
                raise InputError("platform/motion", given, f"{len(msg.joint_names)}, as names")
            checked_numbers("platform/motion", point.positions)
        motion = checked_motion(msg_to_motion(msg))
        self._line = self._through(motion.begin_ns, time_to_ns(msg.header.stamp))
        if not self.record.motions or self.record.motions[-1] != motion:
            self.record.motions.append(motion)

    def _on_offset(self, _: Any) -> None:
        self._trajectories.note_offset()

    def _on_phase(self, msg: Any) -> None:
        self.phase = msg.data

    def _on_impacts(self, msg: Any) -> None:
        rows = checked_rows(impacts_from_msg(msg))
        if not len(rows):
            return
        self._losses.note(rows)
        self.record.lost = self._losses.lost
        self.record.chunks.append(rows)
        if not self.record.motions:  # else platform/motion says where simulated time stands
            last_ns = round(float(rows["time"][-1]) * NS)
            self._line = self._through(last_ns, time_to_ns(msg.header.stamp))

    def _on_speed(self, msg: Any) -> None:
        if self._line is not None:
            speed = checked_number("disk/rotor_speed", msg_to_speed(msg)[1])
            self.record.speeds.append((self._time(msg), speed))

    def _on_joints(self, msg: Any) -> None:
        joints = msg_to_joints(msg)
        if self._line is None or not set(_JOINTS) <= joints.keys():
            return
        disk, platform, rotation = (joints[name] for name in _JOINTS)
        values = disk[0], platform[0], rotation[1]
        checked_numbers("joint_states", values)
        self.record.states.append(State(self._time(msg), *values))

    # --- inputs -----------------------------------------------------------------------------------
    def _on_input(self, msg: Any) -> None:
        self.take_record(record_of(msg))

    def take_record(self, record: Record) -> None:
        """Take a checked record of disk/inputs."""
        kind, time = record["kind"], record["time_ns"] / NS
        self.record.inputs += kind not in ("snapshot", "pause")
        match kind:
            case "snapshot":
                self._take_values(record["parameters"])
                self._take_disk(time, record["parameters"])
                self._trajectories.take_snapshot(record)
            case "parameters":
                self._take_values(record["values"])
                if self._take_disk(time, record["disk"]):
                    self.record.changes.append(Change(time, kind, _shown(record["values"])))
            case "impulse":
                detail = f"{record['axial_impulse']:g} N·s, {record['angular_impulse']:g} N·m·s"
                self.record.changes.append(Change(record["at_ns"] / NS, "impulse", detail))
            case "trajectory":
                self._trajectories.take_trajectory(record)
            case "reset":
                self.record.changes.append(Change(time, kind))
                self._trajectories.take_reset(record["time_ns"])

    def _take_values(self, values: Mapping[str, Any]) -> None:
        self._factor = float(values.get("real_time_factor", self._factor))
        self._clock_is_simulated = bool(values.get("publish_clock", self._clock_is_simulated))

    def _take_disk(self, time: float, values: Mapping[str, Any]) -> bool:
        """Whether the disk is another one than before."""
        disk = Disk.of(values)
        if self.record.disks and self.record.disks[-1][1] == disk:
            return False
        self.record.disks.append((time, disk))
        self.record.disk = disk
        return True

    # --- diagnostics ------------------------------------------------------------------------------
    def _on_diagnostics(self, msg: Any) -> None:
        tasks, words = {}, ""
        for status in msg.status:
            node, _, task = status.name.partition(": ")
            if node.rpartition("/")[0] == self._prefix:
                tasks[task] = {value.key: value.value for value in status.values}
                words = status.message if task == "real time" else words
        health = _health(time_to_ns(msg.header.stamp) / NS, tasks, words)
        if health is not None:
            self.record.health.append(health)


def record_of(msg: Any) -> Record:
    """The checked record of a message of disk/inputs."""
    return from_json(msg.data)


def _health(stamp: float, tasks: Mapping[str, Mapping[str, str]], words: str) -> Health | None:
    """The report that tasks of /diagnostics are; None: of another node, or not running yet."""
    try:
        clock, energy, inputs = tasks["real time"], tasks["energy"], tasks.get("inputs", {})
        reported = [float(tasks[task][key]) for task, key in _REPORTED]
        ledger = [_joules(energy, name) for name in Energy._fields]
        behind = float(clock.get("behind (s)", "nan"))
        counts = int(clock.get("samples skipped", 0)), int(inputs.get("refused", 0))
    except (KeyError, ValueError):
        return None
    sized = [value for value in (*reported, *ledger, behind) if not math.isnan(value)]
    if any(abs(value) > limits.LARGEST for value in sized):
        return None
    asked = clock.get("real_time_factor asked", "")[:_SHOWN]
    simulated, p50, p99, largest, residual = reported
    return Health(
        stamp, simulated, p50, p99, largest, residual, words.startswith("running"), behind,
        *counts, asked if asked.isprintable() else "?", Energy(*ledger),
    )  # fmt: skip


def _joules(energy: Mapping[str, str], name: str) -> float:
    """An entry of the energy ledger; version 0.1.0 called one otherwise, and had no brake."""
    before = "work_kicks (J)" if name == "work_impulses" else ""
    absent = "0" if name == "loss_brake" else "nan"
    return float(energy.get(f"{name} (J)", energy.get(before, absent)))


def _shown(values: Mapping[str, Any]) -> str:
    return ", ".join(f"{name} {shown(value)}" for name, value in values.items())
