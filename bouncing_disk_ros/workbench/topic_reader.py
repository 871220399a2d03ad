"""What the topics of a simulator say, live or from a bag, put into a `RunHistory`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.report.record_validation import checked_number, checked_numbers, checked_rows
from bouncing_disk_ros.report.run_record_builder import Parsed, parse
from bouncing_disk_ros.run.time_map import TimeMap
from bouncing_disk_ros.units import NS
from bouncing_disk_ros.workbench.run_history import SAMPLE_DTYPE, RunHistory

_TOPICS = ("disk/inputs", "platform/motion", "disk/phase", "joint_states", "disk/impacts",
           "disk/rotor_speed")  # fmt: skip
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
            name: partial(self._on_message, name) for name in _TOPICS
        }

    def _on_message(self, name: str, msg: Any) -> None:
        try:
            if (parsed := parse(name, msg)) is not None:
                self._take(name, parsed)
        except InputError as error:
            if name not in self._complained:
                self._complained.add(name)
                self._history.note(f"{name}: {error.line}", is_refusal=True)

    def _take(self, name: str, parsed: Parsed) -> None:
        stamp, value, line = parsed.stamp_ns, parsed.value, self._line
        match name:
            case "disk/inputs":
                self._take_values(value.get("parameters") or value.get("values") or {})
                self._history.add_record(value)
            case "platform/motion":
                clock = self._clock_is_simulated
                self._line = TimeMap(value.begin_ns, 0, stamp, self._factor, clock)
                self._history.add_motion(value)
            case "disk/phase":
                self._history.phase = str(value)[:20]
            case "disk/impacts" if len(value.rows):
                self._history.add_impacts(checked_rows(*value))
            case "disk/rotor_speed" if line is not None:
                speed = checked_number(name, value)
                self._history.add_speed(line.to_simulated(stamp) / NS, speed)
            case "joint_states" if line is not None and value.keys() >= set(_JOINTS):
                disk, platform, rotation, turn = (value[name] for name in _JOINTS)
                numbers = disk[0], platform[0], rotation[0], turn[0], rotation[1]
                checked_numbers(name, numbers)
                row = (line.to_simulated(stamp) / NS, *numbers)
                self._history.add_samples(np.array([row], SAMPLE_DTYPE))

    def _take_values(self, values: Mapping[str, Any]) -> None:
        self._factor = float(values.get("real_time_factor", self._factor))
        self._clock_is_simulated = bool(values.get("publish_clock", self._clock_is_simulated))
