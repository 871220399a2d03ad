"""A controller that juggles a run of this process: what the node `juggle` does, without ROS."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from numpy.typing import NDArray

from bouncing_disk_ros.core.model import Disk, InitialState, Motion, MotionInForce
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.juggling.juggler import Juggler, OffsetTrajectory
from bouncing_disk_ros.juggling.loop_settings import (
    Limits,
    Sensor,
    check_strategy,
    period_one_points,
)
from bouncing_disk_ros.juggling.loop_verdict import Watch
from bouncing_disk_ros.juggling.own_controller import Setup
from bouncing_disk_ros.juggling.simulated_loop import hear_row, run_loop
from bouncing_disk_ros.juggling.watched_loop import WatchedLoop, phase_at_zero
from bouncing_disk_ros.maps.scales import axial_forcing_of
from bouncing_disk_ros.run.command_validation import Instant
from bouncing_disk_ros.run.session import Session
from bouncing_disk_ros.run.time_map import TimeMap
from bouncing_disk_ros.run.trajectory_validation import (
    TrajectoryPoint,
    TrajectoryRequest,
    schedule_trajectory,
    validate_trajectory,
)
from bouncing_disk_ros.topics import OFFSET_JOINTS

_SIMULATED = TimeMap(0, 0, 0, 1.0)
"""Stamps of this loop are simulated time."""


class LocalJuggling:
    """Hears motions and impacts of a session, and gives it offset trajectories.

    `options`: restitution and gravity (m/s², that of a preload included) as the controller believes
    them. Attribute `status`: how the loop stands, in the words of `juggle/status`. Raises
    InputError for a strategy that does not exist.
    """

    def __init__(self, strategy: str, options: Mapping[str, float]) -> None:
        check_strategy(strategy)
        _load()
        self._strategy = strategy
        self._believed = Disk(1.0, options["restitution"], 0.0, 1.0, 1.0, options["gravity"])
        self._sensor = Sensor()
        self._loop: WatchedLoop | None = None
        self._answers: list[OffsetTrajectory] = []
        self.status = f"{strategy}: waiting for a steady motion"

    def on_motion(self, motion: MotionInForce) -> None:
        """A motion of the platform is in force: begin anew, once it is steady."""
        self._loop = None
        if motion.begin_ns != motion.end_ns:
            self.status = f"{self._strategy}: waiting for a steady motion"
            return
        steady, disk = motion.target, self._believed
        setup = Setup(steady, disk, Limits(), phase_at_zero(motion))
        try:
            orbit = period_one_points(axial_forcing_of(steady, disk), disk.restitution)
            controller = Juggler(self._strategy, steady, disk, phase=setup.phase)
        except InputError as error:
            self.status = f"{self._strategy}: cannot juggle: {error.line}"
            return
        self._loop = WatchedLoop(controller, setup, Watch(orbit))
        self._say(self._loop)

    def _say(self, loop: WatchedLoop) -> None:
        self.status = f"{self._strategy}: {loop.watch.text}"

    def on_impacts(self, rows: NDArray[Any]) -> None:
        """Take in rows of impacts; what they ask for is sent by `answer`."""
        loop = self._loop
        if loop is None:
            return
        for row in rows:
            loop.note(row)
            heard = hear_row(row, self._sensor, loop.motion.frequency, 0, int(row["index"]))
            assert heard is not None, "this sensor misses none"
            known_ns, impact = heard
            if (answer := loop.controller.on_impact(impact, known_ns)) is not None:
                self._answers.append(answer)
        self._say(loop)

    def answer(self, session: Session) -> None:
        """Send what was answered; InputError where the session's limits forbid it."""
        answers, self._answers = self._answers, []
        for one in answers:
            request = _request(one)
            validate_trajectory(request)
            now = Instant(session.input_ns, _SIMULATED, 0)
            splice = schedule_trajectory(request, now, session.latest_offset, session.values)
            session.trajectory(splice)


def _load() -> None:
    """Load what is compiled, or compile it, also for an offset, before an impact is answered."""
    motion, disk = Motion(0.039, 0.0, 3.0, 0.0), Disk(1.0, 0.5, 0.0, 1.0, 1.0, 9.81)
    simulation = Simulation(motion, disk, InitialState())
    run_loop(simulation, Juggler("deadbeat", motion, disk), periods=3.0)


def _request(answer: OffsetTrajectory) -> TrajectoryRequest:
    """A trajectory as it is asked for on platform/joint_trajectory."""
    points = tuple(
        TrajectoryPoint(
            (point.position,), (point.velocity,), (point.acceleration,),
            after_ns=point.at_ns - answer.begin_ns,
        )
        for point in answer.points
    )  # fmt: skip
    return TrajectoryRequest((OFFSET_JOINTS[0],), points, answer.begin_ns)
