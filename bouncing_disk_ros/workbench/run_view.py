"""What one page shows of a run, frame by frame: only what is new since the frame before."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.workbench.run_history import RunHistory

PATH_SECONDS = 4.0
"""So much of the path is shown, in seconds of simulated time."""
SPEED_SECONDS = 30.0
MOST_SAMPLES = 2000
"""Rows sent in one frame, at most: after a pause the newest of what has gathered."""
MOST_POINTS = 2000


class Frame(NamedTuple):
    """What to add to the figures, and what to forget before."""

    time: float  # s, simulated
    clear: bool  # path and speeds begin anew
    clear_section: bool
    samples: NDArray[np.void]
    points: NDArray[np.void]
    speeds: NDArray[np.void]
    sample_gaps: NDArray[np.intp]  # rows before which samples are missing
    speed_gaps: NDArray[np.intp]
    pose: np.void | None  # the newest sample
    values: dict[str, Value]  # the parameters in force

    @property
    def is_empty(self) -> bool:
        """Whether nothing has to be drawn."""
        rows = len(self.samples) + len(self.points) + len(self.speeds)
        return rows == 0 and not self.clear and not self.clear_section


class RunView:
    """Reads a history for one page. `path_seconds`: how much of the path is shown."""

    def __init__(self, history: RunHistory, path_seconds: float = PATH_SECONDS) -> None:
        self._history, self.path_seconds = history, path_seconds
        self._epoch = -1
        self._seen = {"samples": -math.inf, "points": -math.inf, "speeds": -math.inf}
        self._until = -math.inf
        self._section_since = -math.inf

    def restart(self) -> None:
        """Let the next frame begin anew."""
        self._epoch = -1

    def frame(self, until: float = math.inf) -> Frame:
        """What is new up to a time; a time before that of the last frame begins anew."""
        history = self._history
        with history.lock:
            clear = history.epoch != self._epoch or until < self._until
            self._epoch, self._until = history.epoch, until
            end = min(until, history.latest)
            if clear:
                self._seen = {
                    "samples": end - self.path_seconds,
                    "points": -math.inf,
                    "speeds": end - SPEED_SECONDS,
                }
            since = history.changes.since(until)
            clear_section = clear or since != self._section_since
            if clear_section:
                self._section_since = since
                self._seen["points"] = math.nextafter(since, -math.inf)  # an impact at once counts
            pose = history.samples.last(until)
            seen = dict(self._seen) if not clear else {}
            samples = self._new("samples", until, MOST_SAMPLES)
            points = self._new("points", until, MOST_POINTS)
            speeds = self._new("speeds", until, MOST_SAMPLES)
            return Frame(
                end, clear, clear_section, samples, points, speeds,
                history.gaps(samples["time"], seen.get("samples"), "state_rate"),
                history.gaps(speeds["time"], seen.get("speeds"), "rotor_speed_rate"),
                pose, history.values_at(until),
            )  # fmt: skip

    def _new(self, name: str, until: float, most: int) -> NDArray[np.void]:
        rows: NDArray[np.void] = getattr(self._history, name).between(self._seen[name], until, most)
        if len(rows):
            self._seen[name] = float(rows["time"][-1])
        return rows
