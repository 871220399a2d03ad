"""The executable `juggling`: which starts each strategy captures, under which errors."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from bouncing_disk_ros.parameters import AXIAL_FORCING, Spec, Value
from bouncing_disk_ros.study.command import main_of
from bouncing_disk_ros.study.definition import Idle, StudyDefinition
from bouncing_disk_ros.study.shared_options import RESTITUTION

if TYPE_CHECKING:
    import xarray as xr


_ABOUT = """Run closed loops from many starts: which ones each strategy of control brings onto the
period-1 orbit and keeps there, with a wrong restitution, delays, missed impacts and impulses."""
_EXAMPLE = """ros2 run bouncing_disk_ros juggling --ros-args \\
      -p strategies:='none deadbeat' -p conditions:='nominal; delay=0.5; missed=0.2'"""
_FUNCTION = """\
Which starts each strategy of control brings onto an orbit, under which errors.

>>> juggling(strategies="none deadbeat", conditions="nominal; delay=0.25")["captured"]
"""
_SPECS = (
    Spec("strategies", "none impact_time deadbeat", "", "strategies to be compared: any of none, "
         "impact_time, deadbeat, small"),
    Spec("conditions", "nominal", "", "cases to be compared, with ; between: nominal, or "
         "NAME=VALUE with commas between; names: axial_forcing, restitution_error, delay, jitter, "
         "missed, impulse, angular_forcing, start, target, phase_lag, learn"),
    replace(AXIAL_FORCING, low=1e-6),
    replace(RESTITUTION, low=1e-6),  # at 0 an impact ends in contact, as rest does
    Spec("width", 60, "", "starts along the forcing phase", low=1, high=100_000),
    Spec("height", 60, "", "starts along the velocity", low=1, high=100_000),
    Spec("velocity_begin", -5.0, "πg/ω", "window of starts: τ from 0 to 2π, w_A from this",
         low=-1e3, high=0.0),
    Spec("velocity_end", 0.0, "πg/ω", "window of starts: largest relative velocity", low=-1e3,
         high=0.0),
    Spec("start", "window", "", "where the runs start. window: after the impacts of the window; "
         "rest: the disk lies on the platform; period-1, or another attractor by its name: on it"),
    Spec("target", "period-1", "", "the orbit to be reached: period-1, stable or not, or another "
         "periodic attractor by its name"),
    Spec("position_limit", 0.3, "A", "largest offset, of the platform's amplitude", low=1e-6,
         high=1e3),
    Spec("acceleration_limit", 2.0, "Aω²", "largest acceleration of the offset", low=1e-3,
         high=1e6),
    Spec("small_limit", 0.02, "A", "largest offset of the strategy small", low=1e-9, high=1e3),
    Spec("restitution_error", 0.0, "1", "error of the restitution that the controller believes, "
         "in parts of the true one", low=-0.9, high=0.9),
    Spec("learn", True, "", "whether the controller corrects its restitution by the impacts"),
    Spec("delay", 0.0, "2π/ω", "time from an impact until the controller knows it, in periods",
         low=0.0, high=10.0),
    Spec("jitter", 0.0, "2π/ω", "largest error of the instant that it is told, in periods",
         low=0.0, high=1.0),
    Spec("missed", 0.0, "1", "part of the impacts that it never receives", low=0.0, high=1.0),
    Spec("impulse", 0.0, "πg/ω", "change of the disk's velocity by an impulse in the tenth period, "
         "which the controller is not told", low=-10.0, high=10.0),
    Spec("angular_forcing", 10.0, "1", "angular forcing: an impact changes the rotor speed by at "
         "most (1 + ε)|w_A|/Γ_T", "Γ_T", low=1e-6, high=1e6),
    Spec("phase_lag", "best", "rad", "phase lag: a number, or best: θ = −τ_imp on period-1, on "
         "another target the best one where each impact removes all slip", "θ"),
    Spec("deadline", 50.0, "2π/ω", "end of each run, in periods", low=1.0, high=1e6),
    Spec("tolerance", 0.05, "", "distance (rad and πg/ω) at which an impact counts as on the orbit",
         low=1e-12, high=1.0),
    Spec("streak", 5, "", "impacts on the orbit, up to the end, that count as captured", low=1,
         high=10_000),
    Spec("seed", 1, "", "of impulses, jitter and misses", low=0, high=2**31 - 1),
)  # fmt: skip


def _idle(values: Mapping[str, Value]) -> Iterator[Idle]:
    if "small" not in str(values["strategies"]).replace(",", " ").split():
        yield "small_limit", "none without small", "Add small to strategies."
    starts, targets = (_of_conditions(values, name) for name in ("start", "target"))
    if "window" not in starts:
        yield "velocity_end", "none without start:=window", "The runs begin elsewhere."
        if starts <= {"rest", "period-1"} and targets == {"period-1"}:
            hint = "The runs begin elsewhere, and no attractor is searched for."
            yield "velocity_begin", "none without start:=window", hint


def _of_conditions(values: Mapping[str, Value], name: str) -> set[str]:
    """The values that a text has in the conditions."""
    found = set()
    for condition in str(values["conditions"]).split(";"):
        pairs = (part.partition("=") for part in condition.split(","))
        given = {key.strip(): value.strip() for key, _, value in pairs}
        found.add(given.get(name, str(values[name])))
    return found


def lines(result: xr.Dataset) -> list[str]:
    """Captured, lost and never captured, and what it took, for each case."""
    rows = []
    for i, condition in enumerate(result["condition_name"].values):
        rows.append(f"  {condition}:")
        for j, strategy in enumerate(result["strategy_name"].values):
            one = result.isel(condition=i, strategy=j)
            parts = (f"{name} {100 * float(one[name]):7.3f} %" for name in ("captured", "lost"))
            took = float(one["median_time"])
            text = f"    {strategy!s:12} {', '.join(parts)}"
            if took == took:
                text += f", in {took:.3g} periods (median)"
                text += f", rotor speed {float(one['median_rotor_speed']):.4g} ωΦ"
            rows.append(f"{text}, offset up to {float(one['offset_used']):.3g} A")
    return rows


DEFINITION = StudyDefinition(
    name="juggling",
    about=_ABOUT,
    example=_EXAMPLE,
    function=_FUNCTION,
    specs=_SPECS,
    study="bouncing_disk_ros.juggling.compute:Juggling",
    lines=lines,
    idle=_idle,
)
main = main_of(DEFINITION)
