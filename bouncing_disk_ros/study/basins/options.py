"""The executable `basins`: basins of attraction in the plane (τ_imp, w_A) (paper, Fig. 4)."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from bouncing_disk_ros.parameters import AXIAL_FORCING, Spec, Value
from bouncing_disk_ros.study.command import main_of
from bouncing_disk_ros.study.definition import Idle, StudyDefinition
from bouncing_disk_ros.study.shared_options import RESTITUTION

if TYPE_CHECKING:
    import xarray as xr


_ABOUT = """Label each start (forcing phase and relative velocity at a first impact) by the
attractor that it goes to; the attractors are searched first. Fig. 4 of the paper."""
_EXAMPLE = "ros2 run bouncing_disk_ros basins --ros-args -p axial_forcing:=0.55 -p width:=2000"
_FUNCTION = """\
The attractor that each start goes to: basins of attraction (paper, Fig. 4).

>>> result = basins(axial_forcing=0.34, width=60, height=60)
>>> dict(zip(result["attractor_name"].values.tolist(), result["fraction"].values.tolist()))
"""
_SPECS = (
    AXIAL_FORCING,
    RESTITUTION,
    Spec("width", 1000, "", "pixels along the forcing phase", low=1, high=1_000_000),
    Spec("height", 1000, "", "pixels along the velocity", low=1, high=1_000_000),
    Spec("phase_begin", 0.0, "rad", "window: least forcing phase", low=-100.0, high=100.0),
    Spec("phase_end", math.tau, "rad", "window: largest forcing phase", low=-100.0, high=100.0),
    Spec("velocity_begin", -5.0, "πg/ω", "window: least relative velocity", low=-1e3, high=0.0),
    Spec("velocity_end", 0.0, "πg/ω", "window: largest relative velocity", low=-1e3, high=0.0),
    Spec("velocity", "before", "", "which velocity the window shows: before (w_A, before the first "
         "impact) or after (−u, u = −ε w_A, after it)", words=("before", "after")),
    Spec("tolerance", 1e-4, "", "distance (rad and πg/ω) at which an orbit counts as on an "
         "attractor", low=1e-12, high=0.1),
    Spec("cap", 0, "", "impacts after which a start is unresolved; 0: enough for the slowest "
         "attractor", low=0, high=10_000_000),
    Spec("angular_velocities", "", "ωΦ", "initial angular velocities of the disk, separated by "
         "blanks: also compute the mean speed that each start reaches", "α̇/(ωΦ)",
         numbers=True),
    Spec("phase_lag", 0.0, "rad", "phase lag, with angular_velocities", "θ", low=-1e3, high=1e3),
    Spec("angular_forcing", 100.0, "1", "angular forcing, with angular_velocities", "Γ_T",
         low=1e-9, high=1e12),
)  # fmt: skip


def _idle(values: Mapping[str, Value]) -> Iterator[Idle]:
    if not str(values["angular_velocities"]).strip():
        for name in ("phase_lag", "angular_forcing"):
            yield name, "none without angular_velocities", "The basins themselves do not need it."


def lines(result: xr.Dataset) -> list[str]:
    """The attractors with their shares, and the boundary."""
    rows = [
        f"  {name!s:24} {100 * float(part):8.3f} ± {100 * float(error):.3f} %"
        for name, part, error in zip(
            result["attractor_name"].values,
            result["fraction"].values,
            result["fraction_uncertainty"].values,
            strict=True,
        )
    ]
    rows.append(f"  {'unresolved':24} {100 * float(result['unresolved_fraction']):8.3f} %")
    if "missed_attractor_name" in result:
        names = ", ".join(map(str, result["missed_attractor_name"].values))
        rows.append(f"  unresolved starts lead to attractors that the search missed: {names}")
    if "box_dimension" in result and math.isnan(float(result["box_dimension"])):
        rows.append("  no boundary in the window, or too short a one")
    elif "box_dimension" in result:
        entropy = float(result["boundary_basin_entropy"])
        rows.append(
            f"  basin entropy {float(result['basin_entropy']):.4f}, at the boundary {entropy:.4f} "
            "(only a value above ln 2 = 0.6931 would prove it fractal)"
        )
        alpha, box = (
            (float(result[name]), float(result[f"{name}_error"]))
            for name in ("uncertainty_exponent", "box_dimension")
        )
        rows.append(
            f"  dimension of the boundary: 2 − uncertainty exponent {2.0 - alpha[0]:.3f} ± "
            f"{alpha[1]:.3f}, by boxes {box[0]:.3f} ± {box[1]:.3f} (95 %; 1: a smooth line)"
        )
        rows.append(f"  {scales(result)}; it may differ at smaller distances")
    return rows + _period_one_lines(result) + _speed_lines(result)


def _period_one_lines(result: xr.Dataset) -> list[str]:
    """From which forcing on there are period-1 orbits, where the window's has none."""
    from bouncing_disk_ros.maps.period_one import existence_limit

    forcing, restitution = (
        float(result.attrs[f"parameter_{name}"]) for name in ("axial_forcing", "restitution")
    )
    first = existence_limit(restitution)
    if forcing >= first:
        return []
    return [f"  no period-1 orbit: at ε = {restitution:g} they begin at Γ = {first:.6g}"]


def scales(result: xr.Dataset) -> str:
    """The distances that the dimension of the boundary was measured at."""
    pixels = result["boundary_distance"].values
    ends = int(pixels.min()), int(pixels.max())
    steps = [
        abs(float(result[name].values[-1] - result[name].values[0])) / (result.sizes[name] - 1)
        for name in ("forcing_phase", "velocity")
    ]
    phase, velocity = (" to ".join(f"{step * end:.2g}" for end in ends) for step in steps)
    return f"at {ends[0]} to {ends[1]} pixels: {phase} rad, {velocity} πg/ω"


def _speed_lines(result: xr.Dataset) -> list[str]:
    """What the starts of each slice end with."""
    if "mean_speed" not in result:
        return []
    rows = []
    for one, field in zip(result["angular_velocity"].values, result["mean_speed"], strict=True):
        speeds = field.values  # of one slice, for all may be larger than memory
        known = speeds[speeds == speeds]  # without nan: at rest
        text = "all come to rest"
        if known.size:
            text = f"{known.mean():+.4f} on average, {known.min():+.4f} to {known.max():+.4f}"
        rows.append(f"  from α̇ = {one:+g} ωΦ: mean speed {text} ωΦ" if known.size else
                    f"  from α̇ = {one:+g} ωΦ: {text}")  # fmt: skip
    return rows


DEFINITION = StudyDefinition(
    name="basins",
    about=_ABOUT,
    example=_EXAMPLE,
    function=_FUNCTION,
    specs=_SPECS,
    study="bouncing_disk_ros.study.basins.compute:Basins",
    lines=lines,
    image="label",
    takes_run=True,
    idle=_idle,
)
main = main_of(DEFINITION)
