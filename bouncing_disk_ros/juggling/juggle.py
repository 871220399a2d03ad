"""The executable `juggle`: keep a multiple toss going by moving the platform."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

from bouncing_disk_ros.command_line.start import Start
from bouncing_disk_ros.parameters import DEFAULTS, Spec

_ABOUT = """Hear disk/impacts and move the platform by platform/joint_trajectory so that the disk
comes onto the period-1 orbit and stays there. Ctrl-C ends it."""
_EXAMPLE = "ros2 run bouncing_disk_ros juggle --ros-args -p strategy:=deadbeat -p restitution:=0.5"

_SPECS = (
    Spec("strategy", "deadbeat", "", "none (open loop), impact_time, deadbeat or small: see "
         "docs/juggling.md; may be changed while it runs"),
    Spec("controller", "", "", "a Python file with a controller of your own, instead of a "
         "strategy: a function make_controller(setup)"),
    Spec("target", "period-1", "", "the orbit to be reached: period-1, stable or not, or another "
         "periodic attractor, such as \"period-2 in 1 cycle\"; may be changed while it runs"),
    Spec("set_phase_lag", True, "", "once captured, command the phase lag that turns the disk "
         "fastest, θ = −τ_imp on period-1, where the platform turns; never with strategy none"),
    Spec("restitution", 0.5, "1", "coefficient of restitution as the controller believes it", "ε",
         low=1e-6, high=0.999999),
    Spec("learn", True, "", "correct the restitution by what is heard"),
    Spec("gravity", DEFAULTS["gravity"], "m/s²", "acceleration that pulls the disk down, that of a "
         "preload included", "g", low=1e-9, high=1e9),
    Spec("position_limit", 0.3, "A", "largest offset, in parts of the platform's amplitude",
         low=1e-6, high=1e3),
    Spec("acceleration_limit", 2.0, "Aω²", "largest acceleration of the offset", low=1e-3,
         high=1e6),
    Spec("small_limit", 0.02, "A", "largest offset of the strategy small", low=1e-9, high=1e3),
    Spec("lead", 0.02, "s", "simulated time from an impact until an answer to it can act: longer "
         "than messages take; 0 where simulated time waits (lockstep)", low=0.0, high=1e3),
    Spec("lockstep_number", 0, "", "number of this controller in the simulator's "
         "lockstep_controllers, whose gates it answers; 0: no lockstep", low=0, high=2**31 - 1),
    Spec("delay", 0.0, "2π/ω", "besides: a delay, in periods, to try it out", low=0.0, high=10.0),
    Spec("jitter", 0.0, "2π/ω", "largest error of the instants, in periods, to try it out",
         low=0.0, high=1.0),
    Spec("missed", 0.0, "1", "part of the impacts that is left unheard, to try it out", low=0.0,
         high=1.0),
    Spec("seed", 1, "", "of jitter and misses", low=0, high=2**31 - 1),
    Spec("real_time_factor", 1.0, "", "that of the simulator; 0: as fast as it can", low=0.0,
         high=1e6),
    Spec("tolerance", 0.05, "", "distance (rad and πg/ω) at which an impact counts as on the orbit",
         low=1e-12, high=1.0),
    Spec("streak", 5, "", "impacts on the orbit in a row that count as captured", low=1,
         high=10_000),
)  # fmt: skip
CHANGEABLE = ("strategy", "target")
"""Options that may be changed while it runs."""
OPTIONS = {spec.name: replace(spec, read_only=spec.name not in CHANGEABLE) for spec in _SPECS}


def main(args: Sequence[str] | None = None) -> int:
    """Juggle until a signal; exit code 0 interrupted, 2 bad input."""
    start = Start("juggle", _ABOUT, OPTIONS, _EXAMPLE, args)
    start.parse()
    with start.stop.loading():
        from bouncing_disk_ros.juggling.juggle_node import JuggleNode
        from bouncing_disk_ros.ros.spin import run_node, spin

    return run_node(start, partial(JuggleNode, OPTIONS), spin)
