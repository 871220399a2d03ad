"""The executable `basin_shares`: shares of basins, best phase lag and speed over a parameter."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from bouncing_disk_ros.parameters import Spec
from bouncing_disk_ros.study.command import main_of
from bouncing_disk_ros.study.definition import StudyDefinition
from bouncing_disk_ros.study.shared_options import map_options

if TYPE_CHECKING:
    import xarray as xr


_ABOUT = """Share of the plane of starts that goes to each attractor, over a parameter (how easy a
multiple toss is), with the best phase lag and its mean speed."""
_EXAMPLE = "ros2 run bouncing_disk_ros basin_shares --ros-args -p along:=restitution -p end:=0.9"


MOST_NAMED = 8
"""Values that one line names."""
_FUNCTION = """\
Shares of the basins over a parameter, with the best phase lag.

>>> basin_shares(along="restitution", begin=0.4, end=0.6, count=3, samples=24)["fraction"]
"""
_SPECS = (
    Spec("along", "axial_forcing", "", "the parameter of the axis: axial_forcing, restitution or "
         "angular_forcing"),
    Spec("begin", 0.30, "", "first value of it", low=0.0, high=1e6),
    Spec("end", 0.60, "", "last value of it", low=0.0, high=1e6),
    Spec("count", 121, "", "number of values", low=1, high=1_000_000),
    *map_options("where it is not the axis", "axial_forcing", "restitution", "angular_forcing"),
    Spec("samples", 200, "", "starts along each side of the window", low=2, high=100_000),
    Spec("velocity_begin", -5.0, "πg/ω", "window of starts: τ from 0 to 2π, w_A from this to 0",
         low=-1e3, high=0.0),
)  # fmt: skip


def lines(result: xr.Dataset) -> list[str]:
    """Where the period-1 orbit and the other periodic ones have most."""
    from bouncing_disk_ros.study.printed_lines import at_value

    names = [name.strip() for name in str(result["kind"].attrs["long_name"]).split(",")]
    rows = []
    for i, name in enumerate(names):
        share = result["fraction"].values[:, i]
        if share.max() > 0.0:
            at = int(share.argmax())
            value, lag = (float(result[key].values[at]) for key in ("value", "best_phase_lag"))
            known = "" if math.isnan(lag) else f", best phase lag there {lag / math.pi:.4f}π"
            where = at_value(result["value"], value, ".5g")
            rows.append(f"  {name:16} at most {100 * share.max():.3f} %, at {where}{known}")
    return rows + _missed_lines(result)


def _missed_lines(result: xr.Dataset) -> list[str]:
    """Attractors with basins too small for the grid of the search."""
    values = result["value"].values[result["missed"].values > 0]
    if not len(values):
        return []
    some = ", ".join(f"{value:.5g}" for value in values[:MOST_NAMED])
    more = ", …" if len(values) > MOST_NAMED else ""
    what = "  the search missed attractors with small basins; starts without a label led to them"
    return [f"{what}: at {some}{more}"]


DEFINITION = StudyDefinition(
    name="basin_shares",
    about=_ABOUT,
    example=_EXAMPLE,
    function=_FUNCTION,
    specs=_SPECS,
    study="bouncing_disk_ros.study.basin_shares.compute:BasinShares",
    lines=lines,
    takes_run=True,
)
main = main_of(DEFINITION)
