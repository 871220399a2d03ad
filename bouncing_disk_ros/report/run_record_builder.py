"""What the topics of a simulator say, live or from a bag, kept as a `RunRecord`.

The messages are those of rclpy or objects with the same fields (`bag.Bag.decoded`).
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, NamedTuple

from bouncing_disk_ros import limits
from bouncing_disk_ros.core.model import Disk, Energy, MotionInForce
from bouncing_disk_ros.errors import shown
from bouncing_disk_ros.report.record_validation import (
    Rows,
    checked_motion,
    checked_number,
    checked_numbers,
    checked_rows,
)
from bouncing_disk_ros.report.run_record import Change, HealthReport, RunRecord, State
from bouncing_disk_ros.ros.from_messages import (
    impacts_from_msg,
    lacking_fields,
    msg_to_joints,
    msg_to_motion,
    msg_to_speed,
    time_to_ns,
)
from bouncing_disk_ros.run.input_records import Record, from_json
from bouncing_disk_ros.run.recorded_schedule import RecordedSchedule
from bouncing_disk_ros.run.time_map import TimeMap
from bouncing_disk_ros.running_numbers import Gaps
from bouncing_disk_ros.units import NS

_SHOWN = 100
"""Letters of a text of another node that are shown, at most."""
JOINTS = ("disk_axial", "platform_axial", "disk_rotation")
"""Those that a record needs."""
_IMPULSE = ("at_ns", "axial_impulse", "angular_impulse")
_REPORTED = (
    ("real time", "simulated time (s)"),
    ("real time", "lateness p50 (s)"),
    ("real time", "lateness p99 (s)"),
    ("real time", "lateness max (s)"),
    ("energy", "residual / throughput"),
)
"""Task and key of the fields of `HealthReport` between its stamp and `running`."""


class Count(NamedTuple):
    """What never falls within a run: its values at the beginning and the end of a message."""

    first: float
    last: float
    rises: bool = False  # and is never the same twice

    def follows_not(self, before: float) -> bool:
        """Whether it has fallen since a value of the message before."""
        return self.first < before or (self.rises and self.first == before)

    def is_next(self, before: float) -> bool:
        """Whether it is an index that goes on where the message before ended."""
        return self.rises and self.first == before + 1.0


class Impacts(NamedTuple):
    """Rows of disk/impacts, and the fields that their message lacks."""

    rows: Rows
    lacking: tuple[str, ...]


class Parsed(NamedTuple):
    """A message of a simulator whose layout fits: its stamp, what it says, and when it was sent."""

    stamp_ns: int
    value: Any
    sent_ns: int = 0  # by the clock of its sender; 0: not known


def parse(short: str, msg: Any, prefix: str = "") -> Parsed | None:
    """A message of a topic of a simulator; None: it is of another node. InputError: of nobody's.

    Only the layout is looked at: whether the values are plausible is checked where they count.
    `prefix`: the namespace whose reports on /diagnostics are meant, without slashes.
    """
    value: Any = None
    match short:
        case "disk/inputs":
            return Parsed(0, from_json(msg.data))
        case "disk/phase":
            return Parsed(0, msg.data)
        case "platform/offset":
            return Parsed(0, None)
        case "platform/motion":
            value = msg_to_motion(msg)
        case "disk/impacts":
            value = Impacts(impacts_from_msg(msg), lacking_fields(msg))
        case "disk/rotor_speed":
            value = msg_to_speed(msg)[1]
        case "joint_states":
            value = msg_to_joints(msg) if set(JOINTS) <= set(msg.name) else None
        case "/diagnostics":
            value = _health_of(msg, prefix)
    return None if value is None else Parsed(time_to_ns(msg.header.stamp), value)


def new_values(record: Record) -> Mapping[str, Any]:
    """The parameters that a record of disk/inputs gives: all of them, those that were set, none."""
    found: Mapping[str, Any] = record.get("parameters") or record.get("values") or {}
    return found


class TopicReader(ABC):
    """Takes the messages of a simulator by topic, live or from a bag.

    `namespace`: of the simulator; reports on /diagnostics of others are not taken.
    """

    topics: tuple[str, ...]

    def __init__(self, namespace: str = "/") -> None:
        self._prefix = namespace.strip("/")
        self._line: TimeMap | None = None  # between stamps and simulated time; None: not known
        self._factor: float | None = None  # None: not known
        self._anchor: tuple[int, int] | None = None  # simulated ns and stamp of platform/motion
        self._anchor_sent_ns = 0
        self._clock_is_simulated = False

    @property
    def handlers(self) -> dict[str, Callable[..., None]]:
        """What takes a message of each topic and, if it is known, when it was sent (ns)."""
        return {short: partial(self._on_message, short) for short in self.topics}

    def _on_message(self, short: str, msg: Any, sent_ns: int = 0) -> None:
        if (parsed := self.parse(short, msg)) is not None:
            self.take(short, parsed._replace(sent_ns=sent_ns))

    def parse(self, short: str, msg: Any) -> Parsed | None:
        """`parse` for this simulator."""
        return parse(short, msg, self._prefix)

    @abstractmethod
    def take(self, short: str, parsed: Parsed) -> None:
        """Take what a message says, if it is plausible; InputError: it is not."""

    def _take_anchor(self, simulated_ns: int, parsed: Parsed) -> None:
        """Take the line through the beginning of a motion."""
        self._anchor, self._anchor_sent_ns = (simulated_ns, parsed.stamp_ns), parsed.sent_ns
        self._line = self._through(*self._anchor, self._factor)

    def _take_values(self, values: Mapping[str, Any], sent_ns: int) -> None:
        """Take parameters; the motion that was published after them may have come before them."""
        before = self._factor, self._clock_is_simulated
        if "real_time_factor" in values:
            self._factor = float(values["real_time_factor"])
        self._clock_is_simulated = bool(values.get("publish_clock", self._clock_is_simulated))
        is_other = before != (self._factor, self._clock_is_simulated)
        if is_other and self._anchor is not None and sent_ns <= self._anchor_sent_ns:
            self._line = self._through(*self._anchor, self._factor)

    def _through(self, simulated_ns: int, ros_ns: int, factor: float | None) -> TimeMap | None:
        """The line through a point; None where the factor is not known."""
        if factor is None:
            return None
        return TimeMap(simulated_ns, 0, ros_ns, factor, self._clock_is_simulated)


class RunRecordBuilder(TopicReader):
    """Builds a record of what it takes; times are simulated seconds.

    Without disk/inputs the impacts show the real-time factor.
    """

    def __init__(self, record: RunRecord, namespace: str = "/") -> None:
        super().__init__(namespace)
        self.record = record
        self.phase = ""
        self._index_gaps = Gaps()
        self._schedule = RecordedSchedule(record.motions, record.offsets)
        self._index, self._last = -1, 0.0  # of the newest record of inputs, and its time
        self._heard: MotionInForce | None = None  # the newest on platform/motion
        self._takers: Mapping[str, Callable[[Parsed], None]] = {
            "disk/inputs": self._take_record,
            "platform/motion": self._take_motion,
            "platform/offset": lambda _: self._schedule.note_offset(),
            "disk/phase": self._take_phase,
            "disk/impacts": self._take_impacts,
            "disk/rotor_speed": self._take_speed,
            "joint_states": self._take_joints,
            "/diagnostics": self._take_health,
        }
        self.topics = tuple(self._takers)

    def take(self, short: str, parsed: Parsed) -> None:
        """Take what a message says, if it is plausible; InputError: it is not."""
        self._takers[short](parsed)

    def counts(self, short: str, parsed: Parsed, *, is_numbered: bool) -> list[Count]:
        """What of a message never falls within a run."""
        value = parsed.value
        match short:
            case "disk/inputs":
                index, time = value["index"], value["time_ns"]
                return [Count(index, index, rises=True), Count(time, time)]
            case "disk/impacts" if len(value.rows):
                first, last = value.rows[0], value.rows[-1]
                return [
                    Count(float(first["index"]), float(last["index"]), rises=True),
                    Count(float(first["time"]), float(last["time"])),
                ]
            case "platform/motion":
                # the same motion comes again with a new line of stamps; another one begins later
                alone = not is_numbered and self._index < 0 and value != self._heard
                return [Count(value.begin_ns, value.begin_ns, rises=alone)]
            case "/diagnostics":
                return [Count(value.simulated, value.simulated)]
        return []

    def _through(self, simulated_ns: int, ros_ns: int, factor: float | None) -> TimeMap | None:
        line = super()._through(simulated_ns, ros_ns, factor)
        if line is not None:
            self.record.rounding = max(self.record.rounding, line.slope / NS)
        return line

    def _time(self, stamp_ns: int) -> float | None:
        """Simulated time of a stamp, s; None where no line is known."""
        if self._line is None:
            self.record.untimed += 1
            return None
        now = self._line.to_simulated(stamp_ns)
        self._schedule.reach(now)
        return now / NS

    def _take_motion(self, parsed: Parsed) -> None:
        motion: MotionInForce = checked_motion(parsed.value)
        self._heard = motion
        self._take_anchor(motion.begin_ns, parsed)
        self._schedule.reach(motion.begin_ns)
        motions = self.record.motions
        if not self.record.known and (not motions or motions[-1] != motion):
            motions.append(motion)  # else disk/inputs has all of them

    def _take_phase(self, parsed: Parsed) -> None:
        self.phase = parsed.value

    def _take_impacts(self, parsed: Parsed) -> None:
        lacking = parsed.value.lacking
        rows = checked_rows(parsed.value.rows, lacking)
        if not len(rows):
            return
        first, last = (int(index) for index in rows["index"][[0, -1]])
        self._index_gaps.take(first, last, len(rows))
        self.record.lost = self._index_gaps.lost
        self.record.lacking = lacking or self.record.lacking
        self.record.impacts.append(rows)
        self._tie(round(float(rows["time"][-1]) * NS), parsed.stamp_ns)

    def _tie(self, last_ns: int, stamp_ns: int) -> None:
        """What the last impact of a message and its stamp say of the line between both times.

        Each change of the line shows on platform/motion. Without it the impacts give the line, and
        without disk/inputs they give the factor.
        """
        self._schedule.reach(last_ns)
        if self._anchor is None:
            self._line = self._through(last_ns, stamp_ns, self._factor)
        elif self._factor is None and (passed := stamp_ns - self._anchor[1]) > 0:
            self._line = self._through(last_ns, stamp_ns, (last_ns - self._anchor[0]) / passed)

    def _take_speed(self, parsed: Parsed) -> None:
        if (time := self._time(parsed.stamp_ns)) is not None:
            speed = checked_number("disk/rotor_speed", parsed.value)
            self.record.speeds.append((time, speed))

    def _take_joints(self, parsed: Parsed) -> None:
        if (time := self._time(parsed.stamp_ns)) is None:
            return
        disk, platform, rotation = (parsed.value[name] for name in JOINTS)
        values = disk[0], platform[0], rotation[1], rotation[0]
        checked_numbers("joint_states", values)
        self.record.states.append(State(time, *values))

    # --- inputs -----------------------------------------------------------------------------------
    def _take_record(self, parsed: Parsed) -> None:
        record: Record = parsed.value
        kind, time = record["kind"], record["time_ns"] / NS
        self._take_values(new_values(record), parsed.sent_ns)
        if self._index >= 0 and record["index"] > self._index + 1:
            self._forget()
        self._index = record["index"]
        self.record.inputs += kind not in ("snapshot", "pause")
        self._schedule.reach(record["time_ns"])
        match kind:
            case "snapshot":
                self._take_snapshot(time, record)
            case "motion":
                self._schedule.take_motion(record)
            case "parameters":
                self._take_parameters(time, record)
            case "impulse":
                self._take_impulse(*(record[name] for name in _IMPULSE))
            case "trajectory":
                self._schedule.take_trajectory(record)
            case "pause":
                self._break_line(time)
            case "reset":
                self._take_reset(time, record)
        self._last = time

    def _forget(self) -> None:
        """Records are missing: nothing is known up to the next snapshot."""
        if self._schedule.is_known:
            self.record.known[-1] = self.record.known[-1][0], self._last
        self._schedule.forget(round(self._last * NS))

    def _take_snapshot(self, time: float, record: Record) -> None:
        self._take_disk(time, record["parameters"])
        was_known = self._schedule.is_known
        for impulse in self._schedule.take_snapshot(record):
            self._take_impulse(*impulse)
        if not was_known:
            self.record.known.append((time, math.inf))

    def _take_parameters(self, time: float, record: Record) -> None:
        if "real_time_factor" in record["values"]:
            self._break_line(time)
        if self._take_disk(time, record["disk"]):
            self.record.changes.append(Change(time, "parameters", _shown(record["values"])))

    def _break_line(self, time: float) -> None:
        """Stamps and simulated time part: platform/motion or the next impact shows the new line."""
        self.record.clock_set.append(time)
        if self._anchor is None:
            self._line = None

    def _take_impulse(self, at_ns: int, axial: float, angular: float) -> None:
        detail = f"{axial:g} N·s, {angular:g} N·m·s"
        self.record.changes.append(Change(at_ns / NS, "impulse", detail))

    def _take_reset(self, time: float, record: Record) -> None:
        """Take a reset: impulses that lie ahead never act."""
        acted = [one for one in self.record.changes if one.time <= time]
        self.record.changes[:] = [*acted, Change(time, "reset")]
        self._schedule.take_reset(record)

    def _take_disk(self, time: float, values: Mapping[str, Any]) -> bool:
        """Whether the disk is another one than before."""
        disk = Disk.of(values)
        if self.record.disks and self.record.disks[-1][1] == disk:
            return False
        self.record.disks.append((time, disk))
        self.record.disk = disk
        return True

    # --- diagnostics ------------------------------------------------------------------------------
    def _take_health(self, parsed: Parsed) -> None:
        self._schedule.reach(round(parsed.value.simulated * NS))
        self.record.health.append(parsed.value)


def _health_of(msg: Any, prefix: str) -> HealthReport | None:
    """The report of the simulator in a message; None: there is none."""
    tasks, words = {}, ""
    for status in msg.status:
        node, _, task = status.name.partition(": ")
        if node.rpartition("/")[0] == prefix:
            tasks[task] = {value.key: value.value for value in status.values}
            words = status.message if task == "real time" else words
    return _health(time_to_ns(msg.header.stamp) / NS, tasks, words)


def _health(
    stamp: float, tasks: Mapping[str, Mapping[str, str]], words: str
) -> HealthReport | None:
    """The report that tasks of /diagnostics are; None: of another node, or not running yet."""
    try:
        clock, energy, inputs = tasks["real time"], tasks["energy"], tasks.get("inputs", {})
        reported = [float(tasks[task][key]) for task, key in _REPORTED]
        ledger = [_joules(energy, name) for name in Energy._fields]
        behind = float(clock.get("behind (s)", "nan"))
        counts = int(clock.get("samples skipped", 0)), int(inputs.get("refused", 0))
        rows = int(tasks.get("impacts", {}).get("rows", -1))
    except (KeyError, ValueError):
        return None
    sized = [value for value in (*reported, *ledger, behind) if not math.isnan(value)]
    if any(abs(value) > limits.LARGEST for value in sized):
        return None
    asked = clock.get("real_time_factor asked", "")[:_SHOWN]
    simulated, p50, p99, largest, residual = reported
    return HealthReport(
        stamp, simulated, p50, p99, largest, residual, words.startswith("running"), behind,
        *counts, asked if asked.isprintable() else "?", Energy(*ledger), rows,
    )  # fmt: skip


def _joules(energy: Mapping[str, str], name: str) -> float:
    """An entry of the energy ledger."""
    return float(energy.get(f"{name} (J)", "nan"))


def _shown(values: Mapping[str, Any]) -> str:
    return ", ".join(f"{name} {shown(value)}" for name, value in values.items())
