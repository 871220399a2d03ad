"""A pane of the page whose figure threads compute: what panes of maps have in common."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any

from bouncing_disk_ros.workbench.latest_work import LatestWork, on_next_tick


class ComputedPane(ABC):
    """Asks for its figure once after any number of changes of ranges, width or parameters.

    Attribute `layout` is set by the pane, which begins to compute once a browser shows it. All
    methods are for the thread of its document.
    """

    layout: Any

    def __init__(self, *works: LatestWork) -> None:
        """`works`: the threads that compute for it."""
        self._works = works
        self._asked = False

    @abstractmethod
    def _ask(self) -> None:
        """Have what is in view computed at the parameters in force."""

    def parameters_changed(self) -> None:
        """Compute anew what depends on the parameters in force."""
        self._on_change("", None, None)

    def join(self) -> None:
        """Wait for the threads: for tests and measurements."""
        for work in self._works:
            work.join()

    def _watch(self, plot: Any) -> None:
        """Take notice of a figure's ranges, and of its width, which comes once it is shown."""
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

    def _deliver(self, callback: Callable[[], None]) -> None:
        """From a thread: let the document's thread call back."""
        document = self.layout.document
        if document is not None:
            on_next_tick(document, callback)
