"""The scenes of the workbench: small experiments for a lesson, each with a number to find."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from bouncing_disk_ros import parameters
from bouncing_disk_ros.core.model import Disk, Motion
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.run.presets import AT_REST, load_preset
from bouncing_disk_ros.run.programmes import FIRST_TOSS
from bouncing_disk_ros.units import number_text
from bouncing_disk_ros.workbench.actions import RUN_NAMES, Action, Perform, new_run
from bouncing_disk_ros.workbench.strobe import strobe_rate

PIZZA, MOTOR = "pizza_multiple_toss", "swum"
RATE = 100.0
"""Samples a second of joint_states."""


@dataclass(frozen=True)
class Scene:
    """One experiment, by its name; `unit` is that of its number.

    `axial_forcing`: Γ instead of an amplitude. `scene_numbers` computes the number.
    """

    name: str
    title: str
    text: str  # two sentences
    find: str  # what to find
    unit: str
    preset: str = PIZZA
    values: Mapping[str, Value] = field(default_factory=dict)
    axial_forcing: float | None = None
    after: tuple[Action, ...] = ()  # when the run has begun

    @property
    def parameters(self) -> dict[str, Value]:
        """All parameters of the run's start."""
        whole = parameters.complete({**load_preset(self.preset), **self.values})
        if self.axial_forcing is not None:
            whole["axial_amplitude"] = parameters.amplitude_of(self.axial_forcing, whole)
        frequency = float(whole["frequency"])
        whole["state_rate"] = strobe_rate(frequency, RATE)
        return {name: whole[name] for name in RUN_NAMES}

    @property
    def motion(self) -> Motion:
        """The motion of the platform at the start."""
        return Motion.of(self.parameters)

    @property
    def disk(self) -> Disk:
        """The disk and its loads."""
        return Disk.of(self.parameters)

    def actions(self, own: Mapping[str, Value]) -> list[Action]:
        """What sets it up as a run of its own; `own`: the parameters that the node has."""
        return [*new_run(self.parameters, own), *self.after]


_SCENES = (
    Scene(
        "rest_and_chatter", "Rest and chatter",
        "The platform stands still and a disk falls on it from 200 mm. It bounces ever faster and "
        "lower: infinitely many impacts in a finite time, and then it lies still.",
        "after how many seconds it lies still, and how this depends on the restitution ε", "s",
        values={**AT_REST, "initial_height": 0.2},
    ),
    Scene(
        "first_toss", "First toss",
        "From rest, the motion that turns a pizza best only makes it chatter. One helical toss "
        "first (watch the path after 3 s) brings it into the orbit with one impact in each period.",
        "the speed at which the rotor settles", "rad/s",
        values=AT_REST,
        after=(Perform(FIRST_TOSS),),
    ),
    Scene(
        "period_1", "Period 1",
        "One impact in each period, always at the same phase: one point on the section, and a "
        "closed form for the speed, dashed. The phase lag θ is 0 here, and that is not the best.",
        "the phase lag θ that turns the disk fastest", "rad",
        values={"phase_lag": 0.0},
    ),
    Scene(
        "doubling", "Doubling",
        "Raise Γ slowly: at one value the point on the section becomes two, then four. The orbit "
        "of one impact still exists beyond (the cross), but it is unstable.",
        "the Γ of the first doubling", "",
        axial_forcing=0.47,
    ),
    Scene(
        "chaos", "Chaos",
        "Beyond all doublings the impacts never repeat, and the points of the section draw a "
        "strange attractor. Two starts that differ by little part exponentially.",
        "by how much an error grows: the Lyapunov exponent for each impact", "",
        axial_forcing=0.56,
    ),
    Scene(
        "coexisting_orbits", "Coexisting orbits",
        "With the same motion of the platform the disk either bounces in period 1 or chatters: its "
        "start decides. Give it impulses, or look at the tab with the basins.",
        "the share of starts that end in period 1", "",
        axial_forcing=0.34,
        values={"phase_lag": 0.0},
    ),
    Scene(
        "fractal_boundary", "Fractal boundary",
        "The border between the basins is no line: zoom into it, and there is always more of it. "
        "So the start must be known much better to foretell a little more.",
        "the exponent α: an error d of the start leaves a share of about d^α open", "",
        axial_forcing=0.48,
    ),
    Scene(
        "motor_under_load", "Motor under load",
        "The same physics at 40 kHz and 1 µm turns an ultrasonic motor; you see it by strobe. "
        "Raise the load torque: the speed falls, until friction cannot hold the load any more.",
        "the stall torque", "mN·m",
        preset=MOTOR,
    ),
)  # fmt: skip
SCENES: Mapping[str, Scene] = {scene.name: scene for scene in _SCENES}


def shown_number(value: float, unit: str) -> str:
    """A number found, as the page writes it."""
    return f"{number_text(value)} {unit}".rstrip() if math.isfinite(value) else "none"
