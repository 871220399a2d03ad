"""A loop that juggles a run of the page's own process: that of `run_loop`, and its status."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from bouncing_disk_ros import parameters
from bouncing_disk_ros.core.model import InitialState, MotionInForce
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.juggling.juggler import Juggler
from bouncing_disk_ros.juggling.loop_verdict import Outcome
from bouncing_disk_ros.juggling.simulated_loop import run_loop
from bouncing_disk_ros.run.loop import Loop
from bouncing_disk_ros.run.session import Session
from bouncing_disk_ros.workbench.local_juggling import LocalJuggling
from support.checks import refused
from support.juggle_loops import DISK, FREQUENCY, GRAVITY, REPORTED, motion_of

PERIODS = 20
BELIEVED = {"restitution": 0.5, "gravity": GRAVITY}


class Juggled:
    """A session from rest with a loop that juggles it; `rows` of impacts."""

    def __init__(self, forcing: float, strategy: str, **values: Any) -> None:
        motion = motion_of(forcing)._asdict()
        whole = parameters.complete(
            {**motion, "gravity": GRAVITY, "restitution": 0.5, "mass": 0.5, **values}
        )
        self.session = Session(whole, lambda _record: None)
        self.juggling = LocalJuggling(strategy, BELIEVED)
        self.rows: list[NDArray[Any]] = []
        self._loop = Loop(self.session, self)
        self.juggling.on_motion(self.session.simulation.motion_in_force)

    def sample(self, sample: Any) -> None:
        """Nothing is kept of samples."""

    def speed(self, first: Any, second: Any) -> None:
        """Nor of speeds."""

    def impacts(self, rows: NDArray[Any]) -> None:
        self.rows.append(rows.copy())
        self.juggling.hear(rows)

    def run(self, periods: float) -> None:
        end = round(periods / FREQUENCY * 1e9)
        while not self._loop.slice(end, to_impact=True):
            self.juggling.answer(self.session)


def test_its_impacts_are_those_of_the_loop_in_one_process(warm_kernels: None) -> None:
    """To the bit."""
    forcing, strategy = 0.60, "impact_time"
    juggled = Juggled(forcing, strategy)
    juggled.run(PERIODS)
    motion = motion_of(forcing)
    simulation = Simulation(motion, DISK, InitialState(), chatter_report_speed=REPORTED)
    expected = run_loop(simulation, Juggler(strategy, motion, DISK), periods=PERIODS)
    rows = np.concatenate(juggled.rows)
    assert expected.verdict.outcome is Outcome.CAPTURED
    impacts = expected.verdict.impacts
    assert juggled.juggling.status == f"{strategy}: captured after {impacts} impacts"
    np.testing.assert_array_equal(rows["time"], expected.rows["time"])
    np.testing.assert_array_equal(rows["axial_velocity"], expected.rows["axial_velocity"])


def test_a_motion_that_fades_or_has_no_orbit_is_named(warm_kernels: None) -> None:
    juggled = Juggled(0.45, "deadbeat")
    steady, slow = motion_of(0.45), motion_of(0.2)
    juggled.juggling.on_motion(MotionInForce(0, 10, steady, slow, 0, 0.0))
    assert juggled.juggling.status == "waiting for a steady motion"
    juggled.juggling.on_motion(MotionInForce(10, 10, slow, slow, 0, 0.0))
    assert "cannot juggle: axial_forcing: got 0.2" in juggled.juggling.status
    assert "There is no period-1 orbit" in juggled.juggling.status


@pytest.mark.parametrize(
    ("forcing", "strategy", "periods", "reason"),
    [
        (0.6, "none", 0.0, "the open loop does nothing, and period 1 is unstable above Γ = 0.486"),
        (0.45, "none", 0.0, "no impact was heard yet"),
        (0.45, "none", 3.0, "the last impact is .* rad and .* πg/ω from the orbit"),
    ],
)  # fmt: skip
def test_it_says_why_it_does_not_capture(
    warm_kernels: None, forcing: float, strategy: str, periods: float, reason: str
) -> None:
    juggled = Juggled(forcing, strategy)
    juggled.run(periods)
    assert re.search(f"(not captured|cannot juggle): .*{reason}", juggled.juggling.status)


def test_an_answer_beyond_a_limit_is_refused_as_the_node_does(warm_kernels: None) -> None:
    juggled = Juggled(0.45, "deadbeat", offset_limit=1e-9)
    refused(r"platform/joint_trajectory .*\(offset_limit\)", juggled.run, PERIODS)
