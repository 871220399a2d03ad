"""What the topics of a simulator say, live or from a bag, put into a `RunHistory`."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.ros.from_messages import (
    impacts_from_msg,
    msg_to_joints,
    msg_to_motion,
    msg_to_speed,
    time_to_ns,
)
from bouncing_disk_ros.run.input_records import from_json
from bouncing_disk_ros.run.time_map import TimeMap
from bouncing_disk_ros.units import NS
from bouncing_disk_ros.workbench.run_history import SAMPLE_DTYPE, RunHistory

_JOINTS = ("disk_axial", "platform_axial", "disk_rotation", "platform_rotation")


class TopicReader:
    """Takes messages by topic; `handlers` has the callbacks.

    What is no message of a simulator of this package is left out, with one notice for each topic.
    """

    def __init__(self, history: RunHistory) -> None:
        self._history = history
        self._line: TimeMap | None = None  # between stamps and simulated time
        self._factor, self._clock_is_simulated = 1.0, False
        self._complained: set[str] = set()
        self.handlers: Mapping[str, Callable[[Any], None]] = {
            name: self._guarded(name, handler)
            for name, handler in (
                ("disk/inputs", self._on_input),
                ("platform/motion", self._on_motion),
                ("disk/phase", self._on_phase),
                ("joint_states", self._on_joints),
                ("disk/impacts", self._on_impacts),
                ("disk/rotor_speed", self._on_speed),
            )
        }

    def _guarded(self, name: str, handler: Callable[[Any], None]) -> Callable[[Any], None]:
        def take(msg: Any) -> None:
            try:
                handler(msg)
            except InputError as error:
                if name not in self._complained:
                    self._complained.add(name)
                    self._history.note(f"{name}: {error.line}", is_refusal=True)

        return take

    def _time(self, msg: Any) -> float:
        assert self._line is not None
        return self._line.to_simulated(time_to_ns(msg.header.stamp)) / NS

    def _on_motion(self, msg: Any) -> None:
        motion = msg_to_motion(msg)
        stamp = time_to_ns(msg.header.stamp)
        self._line = TimeMap(motion.begin_ns, 0, stamp, self._factor, self._clock_is_simulated)
        self._history.add_motion(motion)

    def _on_phase(self, msg: Any) -> None:
        self._history.phase = str(msg.data)[:20]

    def _on_joints(self, msg: Any) -> None:
        if self._line is None:
            return
        joints = msg_to_joints(msg)
        if not joints.keys() >= set(_JOINTS):
            return
        disk, platform, rotation, turn = (joints[name] for name in _JOINTS)
        row = (self._time(msg), disk[0], platform[0], rotation[0], turn[0], rotation[1])
        if all(map(math.isfinite, row)):
            self._history.add_samples(np.array([row], SAMPLE_DTYPE))

    def _on_impacts(self, msg: Any) -> None:
        rows = impacts_from_msg(msg)
        if len(rows):
            self._history.add_impacts(rows)

    def _on_speed(self, msg: Any) -> None:
        speed = msg_to_speed(msg)[1]
        if self._line is not None and math.isfinite(speed):
            self._history.add_speed(self._time(msg), speed)

    def _on_input(self, msg: Any) -> None:
        record = from_json(msg.data)
        if record["kind"] in ("snapshot", "parameters"):
            named = "parameters" if record["kind"] == "snapshot" else "values"
            self._take_values(record[named])
        self._history.add_record(record)

    def _take_values(self, values: Mapping[str, Any]) -> None:
        self._factor = float(values.get("real_time_factor", self._factor))
        self._clock_is_simulated = bool(values.get("publish_clock", self._clock_is_simulated))
