"""The demonstration where there is no ROS: the same story simulated in this process, no bag."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from numpy.typing import NDArray

from bouncing_disk_ros.command_line.start import option_values
from bouncing_disk_ros.core.model import Disk, Sample
from bouncing_disk_ros.nodes.demo.demo_story import (
    OPENING,
    change_text,
    picture_of,
    show_summary,
    start_values,
    verdict,
)
from bouncing_disk_ros.parameters import Spec, Value
from bouncing_disk_ros.report.run_record import RunRecord, State
from bouncing_disk_ros.run.loop import Loop
from bouncing_disk_ros.run.programmes import FIRST_TOSS, load_programme, start_of
from bouncing_disk_ros.run.session import Session
from bouncing_disk_ros.units import NS

PIECE_NS = NS // 10


def present_without_ros(table: Mapping[str, Spec], given: Mapping[str, object]) -> int:
    """Simulate the story, show it, draw it; the exit code. `given`: its options."""
    chosen = option_values(given, table)
    picture, duration = picture_of(chosen), float(chosen["duration"])
    print(
        f"{OPENING}\nWithout ROS: simulated in this process at once, and not recorded.", flush=True
    )
    story = _Story(start_values())
    story.run(round(duration * NS))
    for motion in story.record.motions:
        if motion.begin_ns < motion.end_ns:
            print(f"{motion.begin_ns / NS:6.2f} s  {change_text(motion, story.record.disk)}")
    return verdict(show_summary(story.record, picture), duration)


class _Story:
    """Runs the programme and keeps what happens, as a record of a run."""

    def __init__(self, values: Mapping[str, Value]) -> None:
        self.record = RunRecord(Disk.of(values))
        self.record.disks.append((0.0, self.record.disk))
        self._session = Session(values, lambda _: None)
        self._shown = -1  # index of the last motion kept
        self._loop = Loop(self._session, self)

    def run(self, duration_ns: int) -> None:
        """Perform the programme and simulate for so long from its beginning."""
        programme = load_programme(FIRST_TOSS)
        begin_ns = start_of(programme, self._session.simulation.motion_in_force, 0)
        targets = programme.targets(self._session.latest_target)
        self._session.command([(begin_ns + at_ns, motion) for at_ns, motion in targets])
        self.record.inputs = 1
        self._loop.resolve_waiting()
        until_ns = 0
        while until_ns < begin_ns + duration_ns:  # in pieces short enough to have every sample
            until_ns += PIECE_NS
            while not self._loop.slice(until_ns):
                pass
        self._note_motion()

    def sample(self, sample: Sample) -> None:
        """Keep a state, and the motion if it is a new one."""
        self._note_motion()
        time = sample.time_ns / NS
        self.record.states.append(
            State(time, sample.axial_position, sample.platform_position, sample.angular_velocity)
        )

    def speed(self, first: Sample, second: Sample) -> None:
        """Keep the mean speed between two samples."""
        self.record.speeds.append((second.time_ns / NS, first.mean_speeds(second)[1]))

    def impacts(self, rows: NDArray[Any]) -> None:
        """Keep rows of impacts."""
        self.record.chunks.append(rows)

    def _note_motion(self) -> None:
        simulation = self._session.simulation
        if simulation.motion_index != self._shown:
            self._shown = simulation.motion_index
            self.record.motions.append(simulation.motion_in_force)
