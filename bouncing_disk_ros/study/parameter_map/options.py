"""The executable `parameter_map`: attractors over two parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bouncing_disk_ros.parameters import Spec
from bouncing_disk_ros.study.command import main_of
from bouncing_disk_ros.study.definition import StudyDefinition
from bouncing_disk_ros.study.shared_options import map_options

if TYPE_CHECKING:
    import xarray as xr


_ABOUT = """Attractors over a plane of two of the parameters axial forcing, restitution, phase lag
and angular forcing: the period of the attractor that one start reaches, its largest Lyapunov
exponent and the mean speed of the disk."""
_EXAMPLE = "ros2 run bouncing_disk_ros parameter_map --ros-args -p x_count:=600 -p y_count:=400"

SETTLED = 0.01
"""A mean speed (ωΦ) that changes by more has not settled."""
_FUNCTION = """\
Period, Lyapunov exponent and mean speed over two parameters.

>>> parameter_map(x_axis="axial_forcing", y_axis="restitution", x_count=12, y_count=8)
"""
_SPECS = (
    Spec("x_axis", "axial_forcing", "", "the parameter of the horizontal axis: axial_forcing, "
         "restitution, phase_lag or angular_forcing"),
    Spec("x_begin", 0.3, "", "first value of it", low=-1e6, high=1e6, angle=True),
    Spec("x_end", 0.7, "", "last value of it", low=-1e6, high=1e6, angle=True),
    Spec("x_count", 300, "", "number of values", low=1, high=1_000_000),
    Spec("y_axis", "restitution", "", "the parameter of the vertical axis"),
    Spec("y_begin", 0.2, "", "first value of it", low=-1e6, high=1e6, angle=True),
    Spec("y_end", 0.8, "", "last value of it", low=-1e6, high=1e6, angle=True),
    Spec("y_count", 300, "", "number of values", low=1, high=1_000_000),
    *map_options("where it is not an axis"),
    Spec("start", "period-1", "", "where each point starts. period-1: beside the period-1 orbit, "
         "and as contact where there is none; contact: the disk lies on the platform; given: "
         "initial_phase and initial_velocity", words=("period-1", "contact", "given")),
    Spec("initial_phase", 0.0, "rad", "forcing phase of the first impact, with start:=given", "τ",
         low=-1e3, high=1e3),
    Spec("initial_velocity", 0.0, "πg/ω", "w_A of the first impact, with start:=given", "w_A",
         low=-1e3, high=0.0),
    Spec("settling", 10_000, "", "impacts left out at each point", low=0, high=100_000_000),
    Spec("measured", 2000, "", "impacts from which exponent, kind and speed are computed", low=256,
         high=100_000_000),
)  # fmt: skip


def lines(result: xr.Dataset) -> list[str]:
    """Shares of the kinds, the periods that occur, the largest speed and exponent."""
    from bouncing_disk_ros.study.printed_lines import kind_shares, largest

    kind, period = result["kind"], result["period"]
    rows = kind_shares(result)
    single = 100.0 * float(((kind == 2) & (period == 1)).mean())
    rows.append(f"  period 1     {single:7.3f} %")
    rare = 100.0 * float(((kind == 1) & (period == 0)).mean())
    if rare > 0.0:
        rows.append(f"  contact at {rare:.3f} % of the points is so rare that rounding decides "
                    "when it comes: its period is not known")  # fmt: skip
    rows += largest(result, "mean_speed", "mean speed", " ωΦ", ".4f")
    rows += largest(result, "lyapunov_exponent", "Lyapunov exponent", "", ".4f")
    moving = int(((abs(result["mean_speed_change"]) > SETTLED) & (kind != 3)).sum())
    if moving:
        why = "increase settling if the speed matters there"
        rows.append(f"  the mean speed still changes by more than {SETTLED:g} at {moving} points "
                    f"without chaos: {why}")  # fmt: skip
    return rows


DEFINITION = StudyDefinition(
    name="parameter_map",
    about=_ABOUT,
    example=_EXAMPLE,
    function=_FUNCTION,
    specs=_SPECS,
    study="bouncing_disk_ros.study.parameter_map.compute:ParameterMap",
    lines=lines,
    image="period",
    takes_run=True,
)
main = main_of(DEFINITION)
