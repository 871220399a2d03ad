"""A loop that juggles a run as it goes on: motions and impacts in, trajectories of the offset out.

The node `juggle` brings it messages, the page without ROS the rows of its own run.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator
from typing import Any, NamedTuple

from numpy.typing import NDArray

from bouncing_disk_ros.core.model import Disk, Motion, MotionInForce
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.juggling.juggler import Controller, Juggler, OffsetTrajectory
from bouncing_disk_ros.juggling.loop_settings import Array, Limits, Sensor, check_strategy
from bouncing_disk_ros.juggling.loop_verdict import Outcome, Watch
from bouncing_disk_ros.juggling.own_controller import Setup, file_of, load_controller
from bouncing_disk_ros.juggling.simulated_loop import hear_row, heard_of
from bouncing_disk_ros.juggling.target_orbit import (
    OWN,
    best_phase_lag,
    mean_rotor_speed,
    orbit_named,
)
from bouncing_disk_ros.maps.period_one import stability_limit
from bouncing_disk_ros.maps.scales import axial_forcing_of, velocity_scale
from bouncing_disk_ros.run.command_validation import PointRequest
from bouncing_disk_ros.run.trajectory_validation import TrajectoryRequest
from bouncing_disk_ros.topics import OFFSET_JOINTS
from bouncing_disk_ros.units import NS

_MEASURED = 11
"""Impacts over which the rotor speed is measured."""
_PHASE_OFF = 1e-6
"""Forcing phases nearer than this (rad) belong to one motion."""
_LAG_OFF = 1e-3
"""Phase lags nearer than this (rad) to the best one are left alone: 1 − cos of it is 5e-7."""


def phase_at_zero(heard: MotionInForce) -> float:
    """Forcing phase that the target of a motion has at simulated time 0, rad."""
    return heard.forcing_phase - math.tau * heard.target.frequency * heard.begin_ns / NS


class WatchedLoop:
    """What is known of a loop while one motion up and down lasts: orbit, verdict and rotation."""

    def __init__(self, controller: Controller, setup: Setup, watch: Watch) -> None:
        self.controller, self.setup, self.watch = controller, setup, watch
        self.motion = setup.motion
        self.phase_lag = setup.motion.phase_lag  # as last commanded, or in force
        self.axial_forcing = axial_forcing_of(setup.motion, setup.disk)
        self._scale = velocity_scale(setup.motion, setup.disk)
        self._turns = False  # whether a cross-fade changes the rotation only
        self._times: deque[float] = deque(maxlen=_MEASURED)
        self._speeds: deque[float] = deque(maxlen=_MEASURED)

    def goes_on(self, heard: MotionInForce, phase: float) -> bool:
        """Whether a motion that begins moves the platform up and down as before."""
        begin, end = heard.start, heard.target
        fades = heard.begin_ns != heard.end_ns
        same = all(_axial(one) == _axial(self.motion) for one in (begin, end))
        near = abs(math.remainder(phase - self.setup.phase, math.tau)) < _PHASE_OFF
        if not (same and near and (fades or self._turns)):
            return False
        self._turns, self.motion, self.phase_lag = fades, end, end.phase_lag
        return True

    def note(self, row: Any) -> None:
        """An impact: what it says of the orbit and of the rotation."""
        if isinstance(self.controller, Juggler):
            self.watch.orbit = self.controller.orbit
        velocity = float(row["axial_velocity"]) / self._scale
        self.watch.note(float(row["forcing_phase"]), velocity, rests=heard_of(row).rests)
        self._times.append(float(row["time"]))
        self._speeds.append(float(row["angular_velocity"]))

    @property
    def top_speed(self) -> float:
        """Largest angular velocity of the platform, rad/s."""
        return math.tau * self.motion.frequency * self.motion.angular_amplitude

    @property
    def rotor_speed(self) -> float:
        """Mean angular velocity over the last flights, rad/s; nan: not known."""
        return mean_rotor_speed(list(self._times), list(self._speeds))


def _axial(motion: Motion) -> tuple[float, float]:
    return motion.axial_amplitude, motion.frequency


class LoopOptions(NamedTuple):
    """What a loop is told, as by options of `juggle`; of the disk, what is believed."""

    disk: Disk
    limits: Limits = Limits()
    sensor: Sensor = Sensor()
    controller: str = ""
    learns: bool = True
    lead_ns: int = 0  # from an impact until an answer to it can act
    tolerance: float = 0.05
    streak: int = 5


def request_of(answer: OffsetTrajectory, stamp_ns: int, factor: float = 1.0) -> TrajectoryRequest:
    """An answer as it is asked for on platform/joint_trajectory.

    `factor`: simulated over ROS time.
    """
    points = tuple(
        PointRequest(
            (p.position,), round((p.at_ns - answer.begin_ns) / factor), (p.velocity,),
            (p.acceleration,),
        )
        for p in answer.points
    )  # fmt: skip
    return TrajectoryRequest((OFFSET_JOINTS[0],), points, stamp_ns)


class LiveLoop:
    """Follows the motions of a platform and answers impacts.

    `text`, and `more` that changes often: how it stands. Raises InputError for a strategy that
    does not exist, and for a target that it does not aim at.
    """

    def __init__(self, options: LoopOptions, strategy: str, target: str = OWN) -> None:
        self.options, self.strategy, self.target = options, strategy, target
        self._check(strategy, target)
        if options.controller:
            file_of(options.controller)
        self.loop: WatchedLoop | None = None
        self.text, self.more = "waiting for platform/motion", ""

    @property
    def status(self) -> str:
        """How the loop stands, one line."""
        return self.text + self.more

    def _check(self, strategy: str, target: str) -> None:
        check_strategy(strategy)
        if target != OWN and (self.options.controller or strategy in ("none", "small")):
            why = "Only impact_time and deadbeat aim at other orbits."
            raise InputError("target", target, OWN, why)

    # --- motions
    def on_motion(self, motion: MotionInForce) -> None:
        """A motion is in force: go on where it moves the platform up and down as before.

        Else begin anew, once it is steady.
        """
        try:
            phase = phase_at_zero(motion)
            if self.loop is not None and self.loop.goes_on(motion, phase):
                return
            self.loop = None
            if motion.begin_ns != motion.end_ns:  # a cross-fade: the steady motion comes next
                self.text, self.more = "waiting for a steady motion", ""
            else:
                self.loop = self._begun(Setup(motion.target, self.options.disk,
                                              self.options.limits, phase))  # fmt: skip
                self._tell(self.loop)
        except InputError as error:
            self.fail(error)

    def fail(self, error: InputError) -> None:
        """Wait for a motion that suits."""
        self.loop = None
        self.text, self.more = f"cannot juggle: {error.line}", ""

    def _begun(self, setup: Setup) -> WatchedLoop:
        orbit = self._orbit(self.target, setup)
        file = self.options.controller
        controller = (
            load_controller(file, setup) if file
            else self._controller(self.strategy, setup, orbit, self.target)
        )  # fmt: skip
        return WatchedLoop(controller, setup, self._watch(orbit))

    def _orbit(self, target: str, setup: Setup) -> Array:
        return orbit_named(
            target, axial_forcing_of(setup.motion, setup.disk), setup.disk.restitution
        )

    def _watch(self, orbit: Array) -> Watch:
        return Watch(orbit, self.options.tolerance, self.options.streak)

    def _controller(self, strategy: str, setup: Setup, orbit: Array, target: str) -> Juggler:
        return Juggler(
            strategy, setup.motion, setup.disk, limits=setup.limits, phase=setup.phase,
            learns=self.options.learns, orbit=None if target == OWN else orbit,
        )  # fmt: skip

    # --- impacts
    def on_impacts(self, rows: NDArray[Any]) -> Iterator[OffsetTrajectory]:
        """Take in rows of impacts; the trajectories that answer them, each to be sent at once."""
        loop = self.loop
        if loop is None:
            return
        for row in rows:
            loop.note(row)
            frequency = loop.setup.motion.frequency
            heard = hear_row(row, self.options.sensor, frequency, 0, int(row["index"]))
            if heard is None:
                continue
            known_ns, impact = heard
            answer = loop.controller.on_impact(impact, known_ns + self.options.lead_ns)
            if answer is not None:
                yield answer
        self._tell(loop)

    def _tell(self, loop: WatchedLoop) -> None:
        aim = "" if self.target == OWN else f" to {self.target}"
        name = f"{self.options.controller or self.strategy}{aim}"
        self.text, self.more = f"{name}: {loop.watch.text}", self._why(loop)
        if self._turns(loop):
            speed = loop.rotor_speed / loop.top_speed
            self.more = f", rotor speed {speed:.2f} ωΦ" if speed == speed else ""

    def _why(self, loop: WatchedLoop) -> str:
        """Why the orbit is not held; empty: it is."""
        reason = loop.watch.reason
        limit = stability_limit(self.options.disk.restitution)
        is_open = self.strategy == "none" and not self.options.controller
        if reason and is_open and loop.axial_forcing > limit:
            reason = (
                "the open loop does nothing, and period 1 is unstable above "
                f"Γ = {limit:.3g}: Γ is {loop.axial_forcing:.3g}"
            )
        return reason and f": {reason}"

    @staticmethod
    def _turns(loop: WatchedLoop) -> bool:
        return loop.watch.verdict.outcome is Outcome.CAPTURED and loop.top_speed > 0.0

    def new_phase_lag(self) -> float | None:
        """The phase lag to be commanded: the largest rotor speed on the orbit that is held.

        None where that is in force, or nothing is held that turns.
        """
        loop = self.loop
        if loop is None or not self._turns(loop) or self.strategy == "none":
            return None
        lag = best_phase_lag(loop.watch.orbit, loop.axial_forcing)
        if abs(math.remainder(lag - loop.phase_lag, math.tau)) <= _LAG_OFF:
            return None
        loop.phase_lag = lag
        return lag

    # --- changes
    def change(self, strategy: str, target: str) -> None:
        """Go on with another strategy, to another orbit; what was heard and commanded stays.

        InputError, and nothing changes, for what cannot be aimed at.
        """
        if strategy != self.strategy and self.options.controller:
            raise InputError("strategy", strategy, "none with a controller of your own")
        self._check(strategy, target)
        if self.loop is not None:
            self._switch(self.loop, strategy, target)
        self.strategy, self.target = strategy, target
        if self.loop is not None:
            self._tell(self.loop)

    def _switch(self, loop: WatchedLoop, strategy: str, target: str) -> None:
        if target != self.target:
            orbit = self._orbit(target, loop.setup)
            loop.watch = self._watch(orbit)
            if isinstance(loop.controller, Juggler):
                loop.controller.aim_at(None if target == OWN else orbit)
        if strategy != self.strategy and isinstance(loop.controller, Juggler):
            old = loop.controller
            loop.controller = self._controller(strategy, loop.setup, old.orbit, target)
            loop.controller.take_over(old)
