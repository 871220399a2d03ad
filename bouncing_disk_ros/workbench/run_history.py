"""What is known of a run, shared by all pages: samples, impacts, speeds, motions, parameters.

One writer (a thread that hears the topics, a simulation of its own, a bag) and any number of
readers; each call holds the lock for some microseconds. Times are simulated seconds.
"""

from __future__ import annotations

import bisect
import math
import threading
import time
from collections import deque
from collections.abc import Mapping
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros import parameters
from bouncing_disk_ros.bounded import Newest, NewestRows
from bouncing_disk_ros.core.model import Motion, MotionInForce
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.report.section import single_impacts
from bouncing_disk_ros.topics import MOTION_NAMES
from bouncing_disk_ros.units import NS

_SAMPLE_FIELDS = (
    "time", "disk_position", "platform_position", "disk_angle", "platform_angle",
    "angular_velocity",
)  # fmt: skip
SAMPLE_DTYPE = np.dtype([(name, "f8") for name in _SAMPLE_FIELDS])
"""A message of joint_states: m and rad, unwrapped; rad/s."""
POINT_DTYPE = np.dtype([("time", "f8"), ("forcing_phase", "f8"), ("velocity", "f8")])
"""An impact as a point of the section: τ in rad, w_A in m/s."""
SPEED_DTYPE = np.dtype([("time", "f8"), ("speed", "f8")])
"""A message of disk/rotor_speed, rad/s."""
KEPT_SAMPLES = 20_000
KEPT_POINTS = 20_000
KEPT_SPEEDS = 20_000
KEPT_NOTICES = 50
KEPT_CHANGES = 1000
T = TypeVar("T")


class Notice(NamedTuple):
    """One line for the reader of the page."""

    number: int  # runs on
    at: str  # time of day
    text: str
    is_refusal: bool = False  # and nothing has settled it


class Timeline(Generic[T]):
    """Items with the times from which they hold, in order; at least the newest KEPT_CHANGES."""

    def __init__(self) -> None:
        self.times = Newest[float](KEPT_CHANGES)
        self.items = Newest[T](KEPT_CHANGES)

    def add(self, time: float, item: T) -> None:
        """Add an item that holds from a time on, not before that of the last one."""
        self.times.append(time)
        self.items.append(item)

    def at(self, time: float) -> T | None:
        """What holds at a time; the first item where that lies before all."""
        if not self.items:
            return None
        return self.items[max(0, bisect.bisect_right(self.times, time) - 1)]

    def since(self, time: float) -> float:
        """From when on that holds, s; -inf where nothing does."""
        place = bisect.bisect_right(self.times, time)
        return self.times[place - 1] if place else -math.inf


class RunHistory:
    """The newest rows of a run and what was in force when. The module says who may call it.

    `epoch` grows when a new run begins, whose times start again.
    """

    def __init__(self, keep: int = KEPT_SAMPLES) -> None:
        self.lock = threading.RLock()
        self.epoch = 0
        self.phase = ""
        self.state = ""  # what the writer is doing, one line
        self.juggling = ""  # how a loop that juggles stands, one line; "": none runs
        self.impacts_seen = 0
        self.notices: deque[Notice] = deque(maxlen=KEPT_NOTICES)
        self._notice_count = 0
        self._index = -1  # of the newest record of inputs
        self.samples = NewestRows(SAMPLE_DTYPE, keep)
        self.points = NewestRows(POINT_DTYPE, max(keep, KEPT_POINTS))
        self.speeds = NewestRows(SPEED_DTYPE, max(keep, KEPT_SPEEDS))
        self._begin()

    def _begin(self) -> None:
        self.motions: Timeline[MotionInForce] = Timeline()
        self.values: Timeline[dict[str, Value]] = Timeline()
        self.first_values: dict[str, Value] = {}  # those that the run began with
        self.changes: Timeline[str] = Timeline()  # what the section begins anew at
        self.impacts_seen = 0

    # --- the writer
    def new_run(self, has_motion: bool = False) -> None:
        """A run that begins at time 0: what was before is forgotten.

        `has_motion`: its motion was received before its first record. A motion that begins at time
        0 is taken for its motion too.
        """
        with self.lock:
            motion = self.motions.at(math.inf)
            self._forget_rows()
            self._begin()
            self.settle()
            if motion is not None and (has_motion or motion.begin_ns == 0):
                self.add_motion(motion)

    def _forget_rows(self) -> None:
        for rows in (self.samples, self.points, self.speeds):
            rows.clear()
        self.epoch += 1

    def add_samples(self, rows: NDArray[np.void]) -> None:
        """Add rows of SAMPLE_DTYPE; where time falls, all rows before are forgotten."""
        with self.lock:
            held = self.samples.rows
            if len(held) and rows["time"][0] < held["time"][-1] - 1e-9:
                self._forget_rows()
            self.samples.append(rows)

    def add_impacts(self, rows: NDArray[np.void]) -> None:
        """Add rows of IMPACT_DTYPE; those that stand for one impact each are points."""
        single = rows[single_impacts(rows)]
        points = np.zeros(len(single), POINT_DTYPE)
        points["time"], points["forcing_phase"] = single["time"], single["forcing_phase"]
        points["velocity"] = single["axial_impact_velocity"]
        with self.lock:
            held = self.points.rows
            if len(held) and len(points) and points["time"][0] < held["time"][-1]:
                self._forget_rows()
            self.impacts_seen += int(rows["count"].sum())
            self.points.append(points)

    def add_speed(self, time: float, speed: float) -> None:
        """Add a mean speed of the rotor, rad/s, over the interval before a time."""
        with self.lock:
            self.speeds.append(np.array([(time, speed)], SPEED_DTYPE))

    def add_motion(self, motion: MotionInForce) -> None:
        """A motion of the platform is in force from its beginning on."""
        with self.lock:
            if self.motions.items and self.motions.items[-1] == motion:
                return
            self.motions.add(motion.begin_ns / NS, motion)
            self._change(motion.begin_ns / NS, "motion")

    def add_values(self, time: float, values: Mapping[str, Value]) -> None:
        """Parameters have these values from a time on; the others stay."""
        with self.lock:
            before = self.values.items[-1] if self.values.items else dict(parameters.DEFAULTS)
            if any(before.get(name) != value for name, value in values.items()):
                self._change(time, "parameters")
            self.values.add(time, {**before, **values})
            self.first_values = self.first_values or self.values.items[0]

    def add_record(self, record: Mapping[str, Any], motion_is_newer: bool = False) -> None:
        """Take a checked record of disk/inputs: the first of a run begins a new one.

        `motion_is_newer`: the newest motion was sent after it.
        """
        time = record["time_ns"] / NS
        with self.lock:
            if record["index"] <= self._index:
                self.new_run(motion_is_newer)
            self._index = record["index"]
            match record["kind"]:
                case "snapshot":
                    self.add_values(time, record["parameters"])
                case "parameters":
                    self.add_values(time, record["values"])
                case "reset":
                    self._change(time, "reset")

    def _change(self, time: float, what: str) -> None:
        last = self.changes.times[-1] if self.changes.times else -math.inf
        self.changes.add(max(time, last), what)

    def note(self, text: str, *, is_refusal: bool = False) -> None:
        """Add a line for the reader of the page; the same line is held once, with its last time.

        A node writes a refusal to its log and answers with it.
        """
        with self.lock:
            for held in [one for one in self.notices if one.text == text]:
                self.notices.remove(held)
            self._notice_count += 1
            at = time.strftime("%H:%M:%S")
            self.notices.append(Notice(self._notice_count, at, text, is_refusal))

    def settle(self, about: str = "") -> None:
        """Lines that begin so are refusals no longer: things are well again, or have gone on."""
        with self.lock:
            held = tuple(self.notices)
            self.notices.clear()
            for one in held:
                settled = one.is_refusal and one.text.startswith(about)
                self.notices.append(one._replace(is_refusal=False) if settled else one)

    # --- readers
    @property
    def latest(self) -> float:
        """Simulated time of the newest sample, s; 0 where there is none."""
        with self.lock:
            rows = self.samples.rows
            return float(rows["time"][-1]) if len(rows) else 0.0

    def motion_at(self, time: float = math.inf) -> Motion | None:
        """What the platform moves to, or with, at a time; None where it is not known."""
        with self.lock:
            motion = self.motions.at(time)
            return None if motion is None else motion.target

    def values_at(self, time: float = math.inf) -> dict[str, Value]:
        """The parameters at a time, those of the motion as it is in force."""
        with self.lock:
            values = dict(self.values.at(time) or parameters.DEFAULTS)
            motion = self.motion_at(time)
        if motion is not None:
            values |= dict(zip(MOTION_NAMES, motion, strict=True))
        return values

    def own_values(self) -> dict[str, Any]:
        """The parameters of the node, those of the motion as they act at a reset."""
        with self.lock:
            return dict(self.values.at(math.inf) or parameters.DEFAULTS)

    def gaps(self, times: NDArray[np.float64], before: float | None, rate: str) -> NDArray[np.intp]:
        """Which of some rows (times in s) come more than an interval after the one before them.

        `before`: the time of the row before them, None: there is none. `rate`: the parameter that
        says how many there are in a second. Where it changes, the longer interval counts; where it
        is not known, none is missing.
        """
        if not len(times) or not self.values.items:
            return np.empty(0, np.intp)
        ends = np.concatenate([[times[0] if before is None else before], times])
        places = np.searchsorted(self.values.times, ends, side="right") - 1
        items = self.values.items
        intervals = np.array([1.0 / float(items[max(0, place)][rate]) for place in places])
        allowed = np.maximum(intervals[1:], intervals[:-1])
        return np.flatnonzero(np.diff(ends) > 1.5 * allowed)

    def notices_after(self, number: int) -> list[Notice]:
        """The lines since one with a number."""
        with self.lock:
            return [notice for notice in self.notices if notice.number > number]


def numbers(values: Mapping[str, Value]) -> dict[str, float]:
    """The values that are numbers, as floats."""
    return {
        name: float(value)
        for name, value in values.items()
        if isinstance(value, (int, float)) and not isinstance(value, bool)
    }
