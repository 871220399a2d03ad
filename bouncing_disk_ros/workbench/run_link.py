"""The link of the pages to a run: what a simulator, a run without ROS and a bag have in common."""

from __future__ import annotations

from abc import ABC, abstractmethod

from bouncing_disk_ros.workbench.actions import Action, Names
from bouncing_disk_ros.workbench.run_history import RunHistory


class RunLink(ABC):
    """One for all pages. Its history fills by itself; `send` returns at once.

    What comes of an action is seen in the history: rows, or a notice with the node's own line.
    """

    history: RunHistory
    names = Names()
    """How the simulator is called."""
    source = ""
    """What is shown, in a few words: a simulator, a bag."""
    is_recorded = False
    """Whether the run is over: it has a time slider and takes no commands."""

    @abstractmethod
    def send(self, *actions: Action) -> None:
        """Send actions, each after the answer to the one before."""

    def tick(self) -> None:  # noqa: B027 (most have nothing to look after)
        """Called in the loop of the pages a few times a second."""

    def close(self) -> None:  # noqa: B027
        """End what was started."""
