"""The first toss of config/programmes lands in the period-1 orbit, and forgives what it says."""

from __future__ import annotations

import itertools
import math

import numpy as np

from bouncing_disk_ros import parameters
from bouncing_disk_ros.core.model import Disk, InitialState, Motion
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.report.orbit import orbit_of
from bouncing_disk_ros.run.presets import load_preset
from bouncing_disk_ros.run.programmes import load_programme
from support.checks import there

NS = 1e9
PERIODS_TO_SETTLE = 30
FREQUENCY = 3.0
DISK = Disk.of(parameters.complete(load_preset("pizza_multiple_toss")))
PROGRAMME = load_programme("first_toss_to_period_1")


def lands(first: float = 0.0, second: float = 0.0, part: float = 1.0) -> bool:
    """Whether it ends in period 1 with errors (s) of its two times and a part of its amplitude."""
    # the rest before the toss does not matter
    tossed, changed = PROGRAMME.targets(Motion(0.0, 0.0, FREQUENCY, 0.0))[1:]
    toss = tossed[1]._replace(axial_amplitude=part * tossed[1].axial_amplitude)
    align = there(PROGRAMME.align)
    phase = align.forcing_phase - math.tau * FREQUENCY * align.after_ns / NS
    rest = toss._replace(axial_amplitude=0.0, angular_amplitude=0.0)
    simulation = Simulation(rest, DISK, InitialState(forcing_phase=phase % math.tau))
    change_ns = round(changed[0] + second * NS)
    simulation.command([(round(tossed[0] + first * NS), toss), (change_ns, changed[1])])
    rows, _ = simulation.advance(change_ns + round(PERIODS_TO_SETTLE / FREQUENCY * NS))
    return orbit_of(rows).is_period_one


def test_any_two_errors_up_to_a_tenth_of_a_second_are_forgiven() -> None:
    """The file promises 0.105 s; at 0.12 s some fail (0.108 s on a grid of 0.65 ms)."""
    rng = np.random.default_rng(20090219)
    assert all(lands(*errors) for errors in rng.uniform(-0.105, 0.105, (100, 2)))
    assert not all(lands(*errors) for errors in itertools.product((-0.12, 0.12), repeat=2))


def test_amplitude_errors_forgiven() -> None:
    """From 10 % too small to 29 % too large (measured at 0.5 %: −10.5 % and +29.5 %)."""
    for percent in range(-10, 30):
        assert lands(part=1.0 + percent / 100.0), percent
