"""What one page shows of a run, frame by frame: only what is new since the frame before."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.workbench.actions import Action, Names, Sequel
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
            return Frame(
                end, clear, clear_section,
                self._new("samples", until, MOST_SAMPLES),
                self._new("points", until, MOST_POINTS),
                self._new("speeds", until, MOST_SAMPLES),
                pose, history.values_at(until),
            )  # fmt: skip

    def _new(self, name: str, until: float, most: int) -> NDArray[np.void]:
        rows: NDArray[np.void] = getattr(self._history, name).between(self._seen[name], until, most)
        if len(rows):
            self._seen[name] = float(rows["time"][-1])
        return rows


def numbers(values: Mapping[str, Value]) -> dict[str, float]:
    """The values that are numbers, as floats."""
    return {
        name: float(value)
        for name, value in values.items()
        if isinstance(value, (int, float)) and not isinstance(value, bool)
    }


# ------------------------------------------------------------------------------------------------
# The link of the pages to a run: what it is, whatever is behind it.


class RunLink(Protocol):
    """One for all pages. Its history fills by itself; `send` returns at once.

    What comes of an action is seen in the history: rows, or a notice with the node's own line.
    """

    history: RunHistory

    @property
    def names(self) -> Names:
        """How the simulator is called."""

    @property
    def source(self) -> str:
        """What is shown, in a few words: a simulator, a bag."""

    @property
    def is_recorded(self) -> bool:
        """Whether the run is over: it has a time slider and takes no commands."""

    def send(self, action: Action | Sequel) -> None:
        """Send an action, after those that were sent before."""

    def tick(self) -> None:
        """Called in the loop of the pages a few times a second."""

    def close(self) -> None:
        """End what was started."""
