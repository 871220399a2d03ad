"""The link of the pages to a run: what it is, whatever is behind it."""

from __future__ import annotations

from typing import Protocol

from bouncing_disk_ros.workbench.actions import Action, Names, Sequel
from bouncing_disk_ros.workbench.run_history import RunHistory


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
