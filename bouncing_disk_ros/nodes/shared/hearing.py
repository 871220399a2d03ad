"""What the topics of a simulator say, live or from a bag, kept as a `RunRecord`.

The messages are those of rclpy or objects with the same fields (`bag.Bag.decoded`).
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Mapping
from typing import Any

from bouncing_disk_ros.analysis.recorded.impact_text import LossCounter
from bouncing_disk_ros.analysis.recorded.run_record import Change, Health, RunRecord, State
from bouncing_disk_ros.core.model import Disk, Energy
from bouncing_disk_ros.ros.conversions import (
    impacts_from_msg,
    msg_to_joints,
    msg_to_motion,
    msg_to_speed,
    time_to_ns,
)
from bouncing_disk_ros.run.clock import NS, TimeMap
from bouncing_disk_ros.run.records import from_json

_REPORTED = (
    ("real time", "simulated time (s)"),
    ("real time", "lateness p50 (s)"),
    ("real time", "lateness p99 (s)"),
    ("real time", "lateness max (s)"),
    ("energy", "residual / throughput"),
)
"""Task and key of the fields of `Health` between its stamp and `running`."""


class Hearing:
    """Takes messages by topic; times are simulated seconds.

    `namespace`: of the simulator; reports on /diagnostics of others are not taken.
    """

    def __init__(self, record: RunRecord, namespace: str = "/") -> None:
        self.record = record
        self.phase = ""
        self._prefix = namespace.strip("/")
        self._losses = LossCounter()
        self._line: TimeMap | None = None  # between stamps and simulated time
        self._factor, self._clock_is_simulated = 1.0, False
        self.takers: Mapping[str, Callable[[Any], None]] = {
            "disk/inputs": self._on_input,
            "platform/motion": self._on_motion,
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
        motion = msg_to_motion(msg)
        self._line = self._through(motion.begin_ns, time_to_ns(msg.header.stamp))
        if not self.record.motions or self.record.motions[-1] != motion:
            self.record.motions.append(motion)

    def _on_phase(self, msg: Any) -> None:
        self.phase = msg.data

    def _on_impacts(self, msg: Any) -> None:
        rows = impacts_from_msg(msg)
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
            self.record.speeds.append((self._time(msg), msg_to_speed(msg)[1]))

    def _on_joints(self, msg: Any) -> None:
        joints = msg_to_joints(msg)
        if self._line is None or not {"disk_axial", "disk_rotation"} <= joints.keys():
            return
        self.record.states.append(
            State(
                self._time(msg),
                joints["disk_axial"][0],
                joints["platform_axial"][0],
                joints["disk_rotation"][1],
            )
        )

    # --- inputs -----------------------------------------------------------------------------------
    def _on_input(self, msg: Any) -> None:
        record = from_json(msg.data)
        kind, time = record["kind"], record["time_ns"] / NS
        self.record.inputs += kind not in ("snapshot", "pause")
        match kind:
            case "snapshot":
                self._take_values(record["parameters"])
                self._take_disk(time, record["parameters"])
            case "parameters":
                self._take_values(record["values"])
                if self._take_disk(time, record["disk"]):
                    self.record.changes.append(Change(time, kind, _shown(record["values"])))
            case "impulse":
                detail = f"{record['axial_impulse']:g} N·s, {record['angular_impulse']:g} N·m·s"
                self.record.changes.append(Change(record["at_ns"] / NS, "kick", detail))
            case "reset":
                self.record.changes.append(Change(time, kind))

    def _take_values(self, values: Mapping[str, Any]) -> None:
        self._factor = float(values.get("real_time_factor", self._factor))
        self._clock_is_simulated = bool(values.get("publish_clock", self._clock_is_simulated))

    def _take_disk(self, time: float, values: Mapping[str, Any]) -> bool:
        """Whether the disk is another one than before."""
        disk = Disk(*(float(values[name]) for name in Disk._fields))
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
        with contextlib.suppress(KeyError, ValueError):  # of another node, or not running yet
            self.record.health.append(_health(msg, tasks, words))


def _health(msg: Any, tasks: Mapping[str, Mapping[str, str]], words: str) -> Health:
    """The report of a simulator; KeyError or ValueError where it is none."""
    simulated, p50, p99, most, residual = (float(tasks[task][key]) for task, key in _REPORTED)
    clock, energy = tasks["real time"], tasks["energy"]
    return Health(
        time_to_ns(msg.header.stamp) / NS,
        simulated,
        p50,
        p99,
        most,
        residual,
        running=words.startswith("running"),
        behind=float(clock.get("behind (s)", "nan")),
        skipped=int(clock.get("samples skipped", 0)),
        refused=int(tasks.get("inputs", {}).get("refused", 0)),
        asked=clock.get("real_time_factor asked", ""),
        energy=Energy(*(float(energy.get(f"{n} (J)", "nan")) for n in Energy._fields)),
    )


def _shown(values: Mapping[str, Any]) -> str:
    return ", ".join(f"{name} {value}" for name, value in values.items())
