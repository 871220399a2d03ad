"""The node of `workbench`: finds or starts a simulator, links it to the page, serves the page."""

from __future__ import annotations

import threading
import time
from collections.abc import Mapping

from rclpy.node import Node

from bouncing_disk_ros.command_line.child import Child
from bouncing_disk_ros.command_line.stop import Stop
from bouncing_disk_ros.parameters import Spec
from bouncing_disk_ros.ros.node_tool import options
from bouncing_disk_ros.ros.spin import spin_until
from bouncing_disk_ros.run.presets import load_preset
from bouncing_disk_ros.workbench.ros_link import RosLink

DEFAULT_NAME = "bouncing_disk"
SEARCH_SECONDS = 2.5
"""A simulator that runs says so every second; discovery may take as long."""
LONG_ENOUGH = 10.0
"""A simulator started here that ends is started again if it ran for so many seconds."""


class WorkbenchNode(Node):
    """Serves the page of a live run."""

    def __init__(self, table: Mapping[str, Spec]) -> None:
        super().__init__("workbench")
        self._chosen = options(self, table)
        load_preset(str(self._chosen["preset"]))  # a wrong name is said here, not by the child

    def serve(self, stop: Stop) -> int:
        """Serve until a signal; the exit code."""
        from bouncing_disk_ros.workbench.page_server import serve

        ended = threading.Event()
        link = RosLink(self, DEFAULT_NAME)
        spinner = threading.Thread(
            target=spin_until, args=(self, ended.is_set), name="workbench topics", daemon=True
        )
        spinner.start()
        keeper = SimulatorKeeper(link, self.get_namespace(), str(self._chosen["preset"]))
        try:
            if self._chosen["start_simulator"]:
                return serve(self._chosen, link, stop, keeper.tick)
            return serve(self._chosen, link, stop)
        finally:
            link.close()
            keeper.close()
            ended.set()
            spinner.join()


class SimulatorKeeper:
    """Starts a simulator where none is heard of, and again where it ended; ends it at the end.

    A simulator that it did not start is never replaced, also where that simulator falls silent:
    subscribers would take two simulators on the same topics for one run.
    """

    def __init__(self, link: RosLink, namespace: str, preset: str) -> None:
        self._link = link
        self._arguments = ["--ros-args", "-r", f"__ns:={namespace}", "-p", f"preset:={preset}"]
        self._child: Child | None = None
        self._since = time.monotonic()
        self._has_started = self._given_up = False

    def tick(self) -> None:
        """Look after it; called a few times a second by the main thread."""
        if self._child is not None:
            self._look_after(self._child)
        elif self._link.is_alive and not self._has_started:
            self._given_up = True
        elif self._is_missing:
            self._since, self._has_started = time.monotonic(), True
            self._child = Child("simulator", *self._arguments)

    @property
    def _is_missing(self) -> bool:
        waited = time.monotonic() - self._since > SEARCH_SECONDS
        return waited and not self._link.is_alive and not self._given_up

    def _look_after(self, child: Child) -> None:
        if child.code is None:
            if not self._link.is_alive:
                self._link.history.state = "a simulator starts (the first time it compiles) …"
            return
        line = f"the simulator ended with code {child.code}: {child.last_line}"
        self._link.history.note(line, is_refusal=True)
        self._given_up = time.monotonic() - self._since < LONG_ENOUGH
        self._child, self._since = None, time.monotonic()

    def close(self) -> None:
        """End the simulator that was started."""
        if self._child is not None:
            self._child.end()
