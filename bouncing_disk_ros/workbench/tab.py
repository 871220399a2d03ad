"""What the panes in tabs beside that of the run have in common: threads compute their figures."""

from __future__ import annotations

import math
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, TypeVar

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.workbench.latest_work import LatestWork

Found = TypeVar("Found")


def on_next_tick(document: Any, callback: Callable[[], None]) -> None:
    """Let a Bokeh document's own thread call back, unless its page is gone."""
    session = document.session_context
    if session is None or not session.destroyed:
        document.add_next_tick_callback(callback)


class TabPane(ABC):
    """Asks for its figure once after any number of changes of ranges, width or parameters.

    Attribute `layout` is set by the pane, which begins to compute once a browser shows it. `plot`
    is the figure whose ranges are the window. All methods are for the thread of its document.
    """

    layout: Any

    def __init__(self, *works: LatestWork) -> None:
        """`works`: the threads that compute for it."""
        self._works = works
        self._asked = False
        self.plot: Any = None
        self._is_placed = False  # whether the window was asked for

    @abstractmethod
    def _ask(self) -> None:
        """Have what is in view computed at the parameters in force."""

    def parameters_changed(self) -> None:
        """Compute anew what depends on the parameters in force."""
        self._on_change("", None, None)

    @property
    def ends(self) -> tuple[float, ...]:
        """Ends of the axes of its figure, across and up; empty: it has none."""
        if self.plot is None:
            return ()
        across, up = self.plot.x_range, self.plot.y_range
        return across.start, across.end, up.start, up.end

    def show_window(self, ends: Sequence[float]) -> None:
        """Show what lies between these `ends`; InputError, and nothing changes, where it cannot."""
        axes = () if self.plot is None else (self.plot.x_range, self.plot.y_range)
        pairs = [tuple(ends[:2]), tuple(ends[2:])]
        bounds = [axis.bounds for axis in axes]
        fit = [low <= a < b <= high for (a, b), (low, high) in zip(pairs, bounds, strict=False)]
        if not axes or not all(fit):
            allowed = " and ".join(f"{low:.6g} to {high:.6g}" for low, high in bounds)
            raise InputError("address window", tuple(ends), allowed or "a tab with a map")
        self._is_placed = True
        for axis, (begin, end) in zip(axes, pairs, strict=True):
            axis.update(start=begin, end=end)

    def join(self) -> None:
        """Wait for the threads: for tests and measurements."""
        for work in self._works:
            work.join()

    def _watch(self, plot: Any) -> None:
        """Take notice of a figure's ranges, and of its width, which comes once it is shown."""
        self.plot = plot
        for axis in (plot.x_range, plot.y_range):
            axis.on_change("start", self._on_change)
            axis.on_change("end", self._on_change)
        plot.on_change("inner_width", self._on_change)

    def _on_change(self, _name: str, _old: object, _new: object) -> None:
        document = self.layout.document
        if document is not None and not self._asked:  # several changes make one view
            self._asked = True
            on_next_tick(document, self._ask_once)

    def _ask_once(self) -> None:
        self._asked = False
        self._ask()

    def _refine(
        self,
        sizes: Sequence[int],
        compute: Callable[[int], Found | None],
        show: Callable[[Found, float], None],
    ) -> None:
        """In a thread: compute a figure of each size, coarse ones first, and have it shown.

        `compute` gives None where it is obsolete; `show` is told how long it took, s.
        """
        begin = time.perf_counter()
        for size in sizes:
            if (found := compute(size)) is None:
                return
            self._deliver(partial(show, found, time.perf_counter() - begin))

    def _deliver(self, callback: Callable[[], None]) -> None:
        """From a thread: let the document's thread call back."""
        document = self.layout.document
        if document is not None:
            on_next_tick(document, callback)


def placed(value: float, half: float) -> str:
    """A place in a window that goes so far to each side: more digits the closer one looks."""
    text = f"{value:.{max(3, 3 - math.floor(math.log10(half)))}f}"
    return text.replace("-", "−")
