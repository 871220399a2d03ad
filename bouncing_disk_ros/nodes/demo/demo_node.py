"""The node of `demo`: starts simulator, performer and recorder, prints what happens, and draws."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from bouncing_disk_ros import parameters
from bouncing_disk_ros.analysis.recorded.run_summary import (
    Summary,
    last_orbit,
    lines,
    summary_of,
)
from bouncing_disk_ros.analysis.scales import axial_forcing_of
from bouncing_disk_ros.core.model import Disk, MotionInForce
from bouncing_disk_ros.errors import ExitCode, FailedError, InputError
from bouncing_disk_ros.nodes.demo.child import Child
from bouncing_disk_ros.nodes.demo.demo_bag import report_bag
from bouncing_disk_ros.nodes.demo.watcher import DemoWatcher
from bouncing_disk_ros.nodes.shared.node_tool import options, wait_for
from bouncing_disk_ros.parameters import Spec
from bouncing_disk_ros.ros.stop import Stop
from bouncing_disk_ros.run.presets import load_preset
from bouncing_disk_ros.units import NS

PRESET = "pizza_multiple_toss"
PROGRAMME = "first_toss_to_period_1"
AT_REST = {
    "axial_amplitude": 0.0,
    "angular_amplitude": 0.0,
    "initial_with_platform": True,
    "initial_axial_velocity": 0.0,
    "initial_forcing_phase": parameters.DEFAULTS["initial_forcing_phase"],
}
"""The preset starts on its orbit; the story starts at rest, at the lowest point."""
START_SECONDS = 120.0
"""Patience with the start: the first one compiles the kernels."""
SETTLING_SECONDS = 12.0
"""So long after the programme's beginning the orbit must have been found."""
LAST_SECONDS = 0.5
"""For the messages that came while the simulator was ending."""
Children = tuple[Child, Child, Child]
"""Recorder, simulator, performer."""
FORMATS = (".png", ".pdf", ".svg")


class DemoNode(DemoWatcher):
    """The demonstration; `children` are its processes, `folder` is that of the bag."""

    def __init__(self, table: Mapping[str, Spec], children: Children, folder: Path) -> None:
        values = parameters.complete(load_preset(PRESET))
        super().__init__("demo", Disk(*(float(values[name]) for name in Disk._fields)))
        chosen = options(self, table)
        self._duration, self._picture = float(chosen["duration"]), Path(str(chosen["picture"]))
        if self._picture.suffix not in FORMATS:
            raise InputError(
                "picture", str(self._picture), "a file ending in " + ", ".join(FORMATS)
            )
        self._recorder, self._simulator, self._performer = children
        self._folder = folder
        self._live = sys.stdout.isatty()
        self._shown_motions = 0
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
            Child("perform", PROGRAMME, "--ros-args", "-p", f"timeout:={START_SECONDS}") as perform,
        ):
            yield recorder, simulator, perform

    def present(self, stop: Stop, export: str) -> int:
        """The whole show; the exit code."""
        print(
            f"A disk at rest on its platform (preset {PRESET}). Programme: {PROGRAMME}.\n"
            f"To look or to interfere from a second terminal: {export}\n"
            "Starting the simulator (the first start on a machine compiles for about 20 s) ...",
            flush=True,
        )
        started = wait_for(self, stop, lambda: self._is_over() or self.time > 0.0, START_SECONDS)
        self._check_children(started or stop.asked)
        self.create_timer(0.2, self._report_progress)
        wait_for(self, stop, self._is_over, self._duration + START_SECONDS)
        self._check_children(self._is_over() or stop.asked)
        self._status("\n")
        if stop.asked:
            print("demo: interrupted", flush=True)
            return ExitCode.INTERRUPTED
        return self._conclude(stop)

    def _is_over(self) -> bool:
        ended = self._simulator.code is not None or self._recorder.code is not None
        broken = ended or self._performer.code not in (None, 0)
        fades = (motion for motion in self.record.motions if motion.begin_ns < motion.end_ns)
        begin = next((motion.begin_ns / NS for motion in fades), math.inf)
        return broken or self.time >= begin + self._duration

    def _check_children(self, expected: bool) -> None:
        for child, unwell in (
            (self._recorder, self._recorder.code is not None),
            (self._simulator, self._simulator.code is not None),
            (self._performer, self._performer.code not in (None, 0)),
        ):
            if unwell:
                said = child.log.strip().splitlines() or ["it said nothing"]
                raise FailedError(f"{child.name} ended with code {child.code}: {said[-1]}")
        if not expected:
            raise FailedError(f"the simulator shows nothing within {START_SECONDS:g} s")

    # --- while it runs ----------------------------------------------------------------------------
    def _report_progress(self) -> None:
        """News on lines of their own, and the status."""
        for motion in self.record.motions[self._shown_motions :]:
            if motion.begin_ns < motion.end_ns:
                self._news(motion.begin_ns / NS, self._change(motion))
        self._shown_motions = len(self.record.motions)
        orbit = last_orbit(self.record)
        if orbit.impacts and orbit.name != self._orbit:
            self._news(self.time, f"orbit found: {orbit.name}")
        self._orbit = orbit.name if orbit.impacts else ""
        interval = 0.2 if self._live else 2.0
        if time.monotonic() - self._last_status >= interval:
            self._last_status = time.monotonic()
            self._status("" if self._live else "\n")

    def _change(self, motion: MotionInForce) -> str:
        target = motion.target
        if target.axial_amplitude == 0.0:
            return "the platform is brought to rest"
        axial_forcing = axial_forcing_of(target, self.record.disk)
        shape = "helical" if target.phase_lag == 0.0 else "semi-elliptical"
        return (
            f"the platform changes to a {shape} motion: A {1e3 * target.axial_amplitude:.1f} mm, "
            f"Φ {target.angular_amplitude:.3f} rad, θ {target.phase_lag:.3f} rad, "
            f"Γ {axial_forcing:.3f}"
        )

    def _news(self, at: float, text: str) -> None:
        print(f"{self._clear}{at:6.2f} s  {text}", flush=True)

    @property
    def _clear(self) -> str:
        return "\r\x1b[2K" if self._live else ""

    def _status(self, end: str) -> None:
        speed = self.record.speeds[-1][1] if self.record.speeds else 0.0
        impacts = sum(int(chunk["count"].sum()) for chunk in self.record.chunks)
        print(
            f"{self._clear}{self.time:6.2f} s  {self.phase:<8}  {impacts:4d} impacts  "
            f"rotor {speed:7.3f} rad/s  orbit {self._orbit or 'not settled'}",
            end=end,
            flush=True,
        )

    # --- at the end -------------------------------------------------------------------------------
    def _conclude(self, stop: Stop) -> int:
        from bouncing_disk_ros.plots.run_plot import run_picture, save_picture

        self._simulator.end()  # the recorder after it, so that nothing is cut off
        wait_for(self, stop, lambda: False, LAST_SECONDS)
        self._recorder.end()
        summary = summary_of(self.record)
        print("\nSummary\n" + "\n".join(lines(summary)), flush=True)
        title = "From rest to the period-1 orbit: a helical toss, then the semi-elliptical motion"
        try:
            save_picture(run_picture(self.record, title), self._picture)
        except OSError as error:
            raise FailedError(f"picture {self._picture} cannot be written: {error}") from None
        print(f"Picture: {self._picture}", flush=True)
        try:
            code = self._verdict(summary)
        finally:
            report_bag(self._folder, stop)
        return ExitCode.INTERRUPTED if stop.asked else code

    def _verdict(self, summary: Summary) -> int:
        """Say whether the orbit is the one that the programme is for."""
        if summary.orbit.is_period_one:
            print("Verified: the orbit found is period-1.", flush=True)
            return ExitCode.DONE
        found = f"the orbit found is {summary.orbit.name}, not period-1"
        if summary.inputs > 1:
            others = summary.inputs - 1
            print(f"Not verified: {found}; others gave {others} input(s).", flush=True)
            return ExitCode.DONE
        if self._duration < SETTLING_SECONDS and not summary.orbit.impacts:
            print(f"Not verified: {found}; {self._duration:g} s are too short to tell.", flush=True)
            return ExitCode.DONE
        raise FailedError(found)
