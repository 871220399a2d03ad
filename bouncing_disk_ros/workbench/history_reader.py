"""What the topics of a simulator say, live or from a bag, put into a `RunHistory`."""

from __future__ import annotations

from typing import Any

import numpy as np

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.report.record_validation import checked_number, checked_numbers, checked_rows
from bouncing_disk_ros.report.run_record_builder import JOINTS, Parsed, TopicReader, new_values
from bouncing_disk_ros.units import NS
from bouncing_disk_ros.workbench.run_history import SAMPLE_DTYPE, RunHistory

_TURN = "platform_rotation"


class HistoryReader(TopicReader):
    """Leaves out what is no message of a simulator, with one notice for each topic."""

    topics = ("disk/inputs", "platform/motion", "disk/phase", "joint_states", "disk/impacts",
              "disk/rotor_speed")  # fmt: skip

    def __init__(self, history: RunHistory) -> None:
        super().__init__()
        self._history, self._factor = history, 1.0
        self._complained: set[str] = set()

    def _on_message(self, short: str, msg: Any, sent_ns: int = 0) -> None:
        try:
            super()._on_message(short, msg, sent_ns)
        except InputError as error:
            if short not in self._complained:
                self._complained.add(short)
                self._history.note(f"{short}: {error.line}", is_refusal=True)

    def take(self, short: str, parsed: Parsed) -> None:
        """Put what a message says into the history, if it is plausible; InputError: it is not."""
        stamp, value, line = parsed.stamp_ns, parsed.value, self._line
        match short:
            case "disk/inputs":
                self._take_values(new_values(value), parsed.sent_ns)
                self._history.add_record(value, 0 < parsed.sent_ns < self._anchor_sent_ns)
            case "platform/motion":
                self._take_anchor(value.begin_ns, parsed)
                self._history.add_motion(value)
            case "disk/phase":
                self._history.phase = str(value)[:20]
            case "disk/impacts" if len(value.rows):
                self._history.add_impacts(checked_rows(*value))
            case "disk/rotor_speed" if line is not None:
                speed = checked_number(short, value)
                self._history.add_speed(line.to_simulated(stamp) / NS, speed)
            case "joint_states" if line is not None and _TURN in value:
                disk, platform, rotation = (value[name] for name in JOINTS)
                numbers = disk[0], platform[0], rotation[0], value[_TURN][0], rotation[1]
                checked_numbers(short, numbers)
                row = (line.to_simulated(stamp) / NS, *numbers)
                self._history.add_samples(np.array([row], SAMPLE_DTYPE))
