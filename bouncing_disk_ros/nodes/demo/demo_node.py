"""The node of `demo`: starts simulator, performer and recorder, prints what happens, and draws."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path

from rclpy.node import Node

from bouncing_disk_ros.command_line.child import Child
from bouncing_disk_ros.command_line.stop import Stop
from bouncing_disk_ros.core.model import Disk, MotionInForce
from bouncing_disk_ros.errors import ExitCode, FailedError
from bouncing_disk_ros.nodes.demo.demo_bag import report_bag
from bouncing_disk_ros.nodes.demo.demo_story import (
    OPENING,
    PRESET,
    change_text,
    picture_of,
    show_summary,
    start_values,
    verdict,
)
from bouncing_disk_ros.parameters import Spec
from bouncing_disk_ros.report.run_record import RunRecord
from bouncing_disk_ros.report.run_record_builder import RunRecordBuilder
from bouncing_disk_ros.report.run_summary import last_orbit
from bouncing_disk_ros.ros.node_tool import options, wait_for
from bouncing_disk_ros.ros.qos import subscription_to
from bouncing_disk_ros.run.presets import AT_REST
from bouncing_disk_ros.run.programmes import FIRST_TOSS
from bouncing_disk_ros.units import NS

START_SECONDS = 120.0
"""Patience with the start: the first one compiles the kernels."""
LAST_SECONDS = 0.5
"""For the messages that came while the simulator was ending."""
Children = tuple[Child, Child, Child]
"""Recorder, simulator, performer."""


class DemoNode(Node):
    """The demonstration; `children` are its processes, `folder` is that of the bag.

    It builds `record` from what arrives; times are simulated seconds.
    """

    def __init__(self, table: Mapping[str, Spec], children: Children, folder: Path) -> None:
        super().__init__("demo")
        self.record = RunRecord(Disk.of(start_values()))
        self._builder = RunRecordBuilder(self.record, self.get_namespace())
        for topic, callback in self._builder.handlers.items():
            subscription_to(self, topic, callback)
        chosen = options(self, table)
        self._duration, self._picture = float(chosen["duration"]), picture_of(chosen)
        self._recorder, self._simulator, self._performer = children
        self._folder = folder
        self._live = sys.stdout.isatty()
        self._shown_changes = 0
        self._last_status = 0.0
        self._orbit = ""

    @staticmethod
    @contextmanager
    def children(folder: Path) -> Iterator[Children]:
        """Recorder, simulator and performer, ended when the block is left, the recorder last."""
        start = [f"{name}:={str(value).lower()}" for name, value in AT_REST.items()]
        settings = [f"preset:={PRESET}", *start]
        arguments = [word for setting in settings for word in ("-p", setting)]
        with (
            Child("recorder", str(folder), "--ros-args", "-p", "status_period:=0.0") as recorder,
            Child("simulator", "--ros-args", *arguments) as simulator,
            Child(
                "perform", FIRST_TOSS, "--ros-args", "-p", f"timeout:={START_SECONDS}"
            ) as perform,
        ):
            yield recorder, simulator, perform

    def present(self, stop: Stop, export: str) -> int:
        """Run the whole demonstration; the exit code."""
        print(
            f"{OPENING}\nTo look or to interfere from a second terminal: {export}\n"
            "Starting the simulator (the first start on a machine compiles for 10 to 20 s) ...",
            flush=True,
        )
        started = wait_for(self, stop, lambda: self._is_over() or self.time > 0.0, START_SECONDS)
        self._check_children(started or stop.asked)
        self.create_timer(0.2, self._report_progress)
        wait_for(self, stop, self._is_over, self._duration + START_SECONDS)
        self._check_children(self._is_over() or stop.asked)
        self._status("\n")
        if stop.asked:
            raise KeyboardInterrupt
        return self._conclude(stop)

    @property
    def time(self) -> float:
        """Simulated time of the newest sample, s."""
        return self.record.states[-1].time if self.record.states else 0.0

    def _is_over(self) -> bool:
        ended = self._simulator.code is not None or self._recorder.code is not None
        broken = ended or self._performer.code not in (None, 0)
        begin = self._changes[0].begin_ns / NS if self._changes else math.inf
        return broken or self.time >= begin + self._duration

    @property
    def _changes(self) -> list[MotionInForce]:
        """The motions with another target than before: a fade, or what follows one not heard."""
        pairs = pairwise(self.record.motions)
        return [later for earlier, later in pairs if later.target != earlier.target]

    def _check_children(self, expected: bool) -> None:
        for child, unwell in (
            (self._recorder, self._recorder.code is not None),
            (self._simulator, self._simulator.code is not None),
            (self._performer, self._performer.code not in (None, 0)),
        ):
            if unwell:
                said = f"{child.name} ended with code {child.code}: {child.last_line}"
                raise FailedError(said)
        if not expected:
            raise FailedError(f"the simulator published nothing within {START_SECONDS:g} s")

    # --- while it runs ----------------------------------------------------------------------------
    def _report_progress(self) -> None:
        """News on lines of their own, and the status."""
        for motion in self._changes[self._shown_changes :]:
            self._news(motion.begin_ns / NS, change_text(motion, self.record.disk))
            self._shown_changes += 1
        orbit = last_orbit(self.record)
        if orbit.impacts and orbit.name != self._orbit:
            self._news(self.time, f"orbit found: {orbit.name}")
        self._orbit = orbit.name if orbit.impacts else ""
        interval = 0.2 if self._live else 2.0
        if time.monotonic() - self._last_status >= interval:
            self._last_status = time.monotonic()
            self._status("" if self._live else "\n")

    def _news(self, at: float, text: str) -> None:
        print(f"{self._clear}{at:6.2f} s  {text}", flush=True)

    @property
    def _clear(self) -> str:
        return "\r\x1b[2K" if self._live else ""

    def _status(self, end: str) -> None:
        speed = self.record.speeds[-1][1] if self.record.speeds else 0.0
        impacts = int(self.record.rows["count"].sum())
        print(
            f"{self._clear}{self.time:6.2f} s  {self._builder.phase:<8}  {impacts:4d} impacts  "
            f"rotor {speed:7.3f} rad/s  orbit {self._orbit or 'not settled'}",
            end=end,
            flush=True,
        )

    # --- at the end -------------------------------------------------------------------------------
    def _conclude(self, stop: Stop) -> int:
        self._simulator.end()  # the recorder after it, so that nothing is cut off
        wait_for(self, stop, lambda: False, LAST_SECONDS)
        self._recorder.end()
        summary = show_summary(self.record, self._picture)
        try:
            code = verdict(summary, self._duration)
        finally:
            report_bag(self._folder, stop)
        return ExitCode.INTERRUPTED if stop.asked else code
