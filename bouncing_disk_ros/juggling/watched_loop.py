"""A closed loop as it is watched from its impacts: by the node `juggle` and by the workbench."""

from __future__ import annotations

import math
from collections import deque
from typing import Any

from bouncing_disk_ros.core.model import Motion, MotionInForce
from bouncing_disk_ros.juggling.juggler import Controller, Juggler
from bouncing_disk_ros.juggling.loop_settings import Array
from bouncing_disk_ros.juggling.loop_verdict import Watch
from bouncing_disk_ros.juggling.own_controller import Setup
from bouncing_disk_ros.juggling.simulated_loop import heard_of
from bouncing_disk_ros.juggling.target_orbit import mean_rotor_speed
from bouncing_disk_ros.maps.scales import axial_forcing_of, velocity_scale
from bouncing_disk_ros.units import NS

_MEASURED = 11
"""Impacts over which the rotor speed is measured."""
_PHASE_OFF = 1e-6
"""Forcing phases nearer than this (rad) belong to one motion."""


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

    @property
    def orbit(self) -> Array:
        """The orbit aimed at, as corrected by what was heard."""
        return self.watch.orbit

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
    def rotor_speed(self) -> float:
        """Mean angular velocity over the last flights, rad/s; nan: not known."""
        return mean_rotor_speed(list(self._times), list(self._speeds))


def _axial(motion: Motion) -> tuple[float, float]:
    return motion.axial_amplitude, motion.frequency
