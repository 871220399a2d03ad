"""The 21 reference cases: what is simulated, from which start, under which inputs, for how long.

Every number is a float64 and is meant exactly. All cases have f = 1 Hz, so that a step of 1 ms is
fair, and begin at the forcing phase 0, where the platform passes its middle height on its way up.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

GRAVITY = 9.81
"""m/s²."""
_USUAL: Mapping[str, float | bool] = MappingProxyType({
    "mass": 1.0, "restitution": 0.5, "friction": 0.0, "friction_radius": 0.1,
    "gyration_radius": 0.1, "gravity": GRAVITY, "preload": 0.0, "load_torque": 0.0,
    "axial_amplitude": 0.0, "angular_amplitude": 0.0, "frequency": 1.0, "phase_lag": 0.0,
    "initial_height": 0.0, "initial_with_platform": False, "initial_axial_velocity": 0.0,
    "initial_angular_velocity": 0.0, "initial_angle": 0.0, "initial_forcing_phase": 0.0,
})  # fmt: skip


class Case(NamedTuple):
    """One reference case: parameters of `simulate`, inputs and duration (SI units)."""

    number: int
    name: str
    tests: str  # what a simulator must do right
    duration: float  # s
    parameters: Mapping[str, float | bool]
    impulses: tuple[tuple[float, float, float], ...] = ()  # s, N·s, N·m·s
    programme: tuple[tuple[float, Mapping[str, float]], ...] = ()
    trajectory: tuple[tuple[float, Mapping[str, Any]], ...] = ()

    @property
    def file_stem(self) -> str:
        """The name of its files without their ending."""
        return f"case_{self.number:02d}_{self.name}"

    def keywords(self) -> dict[str, Any]:
        """What `simulate` takes besides the duration."""
        inputs = {"impulses": self.impulses, "programme": self.programme}
        given = {name: value for name, value in inputs.items() if value}
        if self.trajectory:
            given["trajectory"] = self.trajectory
        return {**self.parameters, **given}


def amplitude(axial_forcing: float) -> float:
    """The amplitude of a forcing Γ at 1 Hz, m."""
    return axial_forcing * math.pi * GRAVITY / (2.0 * math.pi) ** 2


def _table() -> tuple[Case, ...]:
    rows: list[tuple[str, str, float, dict[str, float | bool], dict[str, Any]]] = [
        ("plastic_drop", "restitution 0: one impact, then rest", 2.0,
         {"restitution": 0.0, "initial_height": 1.0}, {}),
        ("drop", "restitution 0.75 of a drop on a table", 3.0,
         {"restitution": 0.75, "initial_height": 1.0}, {}),
        ("elastic_drop", "restitution 1: no energy is lost or gained", 20.0,
         {"restitution": 1.0, "initial_height": 1.0}, {}),
        ("end_of_bounces", "the end of infinitely many bounces, then rest", 10.0,
         {"restitution": 0.9, "initial_height": 1.0}, {}),
        ("moving_table", "a table in steady motion: restitution acts on the relative speed", 3.0,
         {"restitution": 0.75, "initial_height": 1.0},
         {"trajectory": ((16.0, {"platform_axial": 4.0}),)}),
        ("accelerated_table", "a table with the steady acceleration 2 m/s²: g + 2 m/s² counts", 2.5,
         {"restitution": 0.75, "initial_height": 1.0},
         {"trajectory": ((4.0, {"platform_axial": (16.0, 8.0)}),)}),
        ("period_1", "impacts that approach period 1, at forcing 0.45", 15.5,
         {"axial_amplitude": amplitude(0.45), "initial_height": 0.75,
          "initial_axial_velocity": -3.75}, {}),
        ("period_2", "impacts that approach period 2, at forcing 0.5", 15.5,
         {"axial_amplitude": amplitude(0.5), "initial_height": 0.75,
          "initial_axial_velocity": -3.75}, {}),
        ("chaos", "impacts of a chaotic motion, at forcing 0.55", 15.5,
         {"axial_amplitude": amplitude(0.55), "initial_height": 0.75,
          "initial_axial_velocity": -3.75}, {}),
        ("short_chatter", "separation, infinitely many impacts, contact, each period", 3.0,
         {"axial_amplitude": amplitude(0.3245), "initial_with_platform": True}, {}),
        ("long_chatter", "separation, a long chatter, contact, each period", 3.0,
         {"axial_amplitude": amplitude(0.36), "initial_with_platform": True}, {}),
        ("near_miss", "a flight that misses the crest by a thousandth of the amplitude", 2.0,
         {"axial_amplitude": amplitude(2.0), "initial_height": 1.001 * amplitude(2.0)
          - GRAVITY / 32.0, "initial_axial_velocity": GRAVITY / 4.0}, {}),
        ("near_touch", "the same flight lower by two thousandths: a weak impact at the crest", 2.0,
         {"axial_amplitude": amplitude(2.0), "initial_height": 0.999 * amplitude(2.0)
          - GRAVITY / 32.0, "initial_axial_velocity": GRAVITY / 4.0}, {}),
        ("slipping_impacts", "impacts that slip, for both signs of the slip", 3.0,
         {"restitution": 0.75, "initial_height": 1.0, "friction": 0.02, "angular_amplitude": 2.0},
         {}),
        ("sticking_impacts", "impacts that stick, for both signs of the slip", 3.0,
         {"restitution": 0.75, "initial_height": 1.0, "friction": 5.0, "angular_amplitude": 1.0,
          "initial_angular_velocity": 3.0}, {}),
        ("sliding_to_rest", "sliding in contact until the disk rests", 2.0,
         {"friction": 0.1, "initial_with_platform": True, "initial_angular_velocity": 7.0}, {}),
        ("turning_table", "from sticking to slipping and back on a table that turns", 3.0,
         {"friction": 0.1, "initial_with_platform": True, "angular_amplitude": 0.5}, {}),
        ("preload", "a force presses the disk on the table, in flight too", 3.0,
         {"restitution": 0.75, "initial_height": 1.0, "preload": 4.0}, {}),
        ("impulses", "an impulse in flight, and two in contact", 6.0,
         {"initial_with_platform": True},
         {"impulses": ((0.5, 3.0, 0.0), (0.75, 1.5, 0.0), (5.0, -2.0, 0.0))}),
        ("change_of_motion", "the platform's motion changes in one second", 6.0,
         {"axial_amplitude": amplitude(0.45), "initial_height": 0.75,
          "initial_axial_velocity": -3.75},
         {"programme": ((3.0, {"axial_amplitude": 0.2, "frequency": 1.5}),)}),
        ("load_torque", "a load torque turns the disk in flight; impacts drive it", 4.0,
         {"axial_amplitude": amplitude(0.45), "initial_height": 0.75, "friction": 0.05,
          "initial_axial_velocity": -3.75, "angular_amplitude": 1.0, "load_torque": 0.01}, {}),
    ]  # fmt: skip
    return tuple(
        Case(number, name, tests, duration, MappingProxyType({**_USUAL, **given}), **inputs)
        for number, (name, tests, duration, given, inputs) in enumerate(rows, start=1)
    )


CASES = _table()
