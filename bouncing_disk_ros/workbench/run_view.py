"""What one page shows of a run, frame by frame: only what is new, and only as fast as it draws."""

from __future__ import annotations

import math
from collections import deque
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
MOST_AHEAD = 3
"""Frames that may be on their way."""
PATIENCE = 1.0
"""Seconds after which a frame goes out though nothing was acknowledged: the word may be lost.
Doubled each time, up to LONGEST."""
LONGEST = 64.0


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


class FlowControl:
    """Counts the frames on their way to one page. Times of the clock in s, `end`s of the axis.

    Bokeh's browser side tells the end of an axis that follows the data once it has drawn them: that
    is the acknowledgement. A page that draws slowly, or lies in a hidden tab and draws nothing,
    gets fewer frames instead of a queue that grows.
    """

    def __init__(self) -> None:
        self.sent = 0
        self.drawn = 0
        self._ahead: deque[float] = deque()
        self._last = -LONGEST
        self._patience = PATIENCE

    def may_send(self, now: float) -> bool:
        """Whether the page has room for another frame."""
        if len(self._ahead) < MOST_AHEAD:
            return True
        return now - self._last >= self._patience

    def note_sent(self, now: float, end: float) -> None:
        """A frame has gone out that moves the axis to an end."""
        if len(self._ahead) >= MOST_AHEAD:
            self._ahead.popleft()
            self._patience = min(2.0 * self._patience, LONGEST)
        self._ahead.append(end)
        self._last = now
        self.sent += 1

    def note_drawn(self, end: float) -> None:
        """The page has drawn an axis up to an end."""
        self._patience = PATIENCE
        while self._ahead and (self._ahead[0] <= end + 1e-9 or self._ahead[-1] < end):
            self._ahead.popleft()
            self.drawn += 1

    def restart(self) -> None:
        """The axis begins anew: nothing is on its way."""
        self._ahead.clear()
