"""The executable `manifolds`: saddles on the boundaries of basins, with both their manifolds."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from bouncing_disk_ros.errors import counted
from bouncing_disk_ros.orbit_studies import NO_ROTATION
from bouncing_disk_ros.parameters import Spec
from bouncing_disk_ros.study.basins.options import DEFINITION as BASINS
from bouncing_disk_ros.study.basins.options import lines as basin_lines
from bouncing_disk_ros.study.command import main_of
from bouncing_disk_ros.study.definition import StudyDefinition

if TYPE_CHECKING:
    import xarray as xr


_ABOUT = """The saddles on the boundaries between basins of attraction, found by edge tracking, with
their stable and unstable manifolds, cut at grazes; behind them the basins."""
_ERRORS = 4.0
"""Standard errors of a share of starts that an enclosed area may differ from it."""
_EXAMPLE = "ros2 run bouncing_disk_ros manifolds --ros-args -p axial_forcing:=0.34"
_NOT_TAKEN = ("phase_lag", "angular_forcing")
_FUNCTION = """\
Saddles between basins of attraction with their manifolds, over the basins.

>>> manifolds(axial_forcing=0.34, width=100, height=100)["saddle_share"]
"""
_WITH_ROTATION = ("angular_velocities", *_NOT_TAKEN)
_SPECS = (
    *(replace(spec, default={"width": 500, "height": 500}.get(spec.name, spec.default))
      for spec in BASINS.specs if spec.name not in _WITH_ROTATION),
    Spec("pairs", 6, "", "pairs of starts of each two basins that edge tracking begins with", low=1,
         high=10_000),
    Spec("distance", 0.01, "", "largest distance of neighbouring points of a manifold (rad and "
         "πg/ω)", low=1e-6, high=1.0),
    Spec("angle", 0.1, "rad", "largest angle by which a manifold turns between points that are not "
         "very near", low=1e-4, high=3.0),
    Spec("repetitions", 40.0, "", "how often the map over one repetition of the saddle is applied, "
         "at most", low=1.0, high=1000.0),
    Spec("points", 50_000, "", "points of one branch, at most", low=100, high=10_000_000),
)  # fmt: skip


def lines(result: xr.Dataset) -> list[str]:
    """Shares of the basins; the saddles, with what their stable manifolds enclose."""
    rows = basin_lines(result)
    pairs, lost = (int(count) for count in result["edge_pairs"].values)
    if pairs == 0:
        return [*rows, "  no boundary in this window: all starts on its grid have one end"]
    for i in range(result.sizes.get("saddle", 0)):
        n, k = (int(result[f"saddle_{name}"].values[i]) for name in ("impacts", "cycles"))
        own = int((result["saddle_point_saddle"].values == i).argmax())
        tau = float(result["saddle_point_forcing_phase"].values[own])
        w = float(result["saddle_point_velocity"].values[own])
        size = float(result["saddle_multiplier"].values[i])
        row = f"  saddle of {counted(n, 'impact')} in {counted(k, 'period')}: "
        row += f"τ = {tau:.6f}, w_A = {w:.6f}, "
        row += f"multiplier {size:.6f}"
        rows.append(row + _enclosed_text(result, i))
    if lost:
        rows.append(f"  {lost} of {pairs} pairs of starts ended on no saddle: the boundary is "
                    "fractal, or was lost at a graze")  # fmt: skip
    return rows


def _enclosed_text(result: xr.Dataset, i: int) -> str:
    """What the stable manifold of a saddle encloses, and whether the starts agree."""
    share = float(result["saddle_share"].values[i])
    if "saddle_open" not in result:  # of an older version
        return ""
    if math.isnan(share):
        why = str(result["saddle_open"].values[i])
        return f"; what its stable manifold encloses is not known: {why}"
    row = f"; its stable manifold encloses {100 * share:.5f} % of the window"
    basin = int(result["saddle_basin"].values[i])
    counted_share, error = (
        float(result[name].values[basin]) for name in ("fraction", "fraction_uncertainty")
    )
    slack = _ERRORS * error + 1.0 / result["label"].size
    unresolved = float((result["label"] < 0).mean())  # any of these may be in the basin
    if not counted_share - slack <= share <= counted_share + unresolved + slack:
        name = result["attractor_name"].values[basin]
        row += f", but {100 * counted_share:.3f} ± {100 * error:.3f} % of the starts go to {name}"
        row += ": this is not the whole boundary of its basin"
    return row


DEFINITION = StudyDefinition(
    name="manifolds",
    about=_ABOUT,
    example=_EXAMPLE,
    function=_FUNCTION,
    specs=_SPECS,
    study="bouncing_disk_ros.orbit_studies.manifolds.compute:Manifolds",
    lines=lines,
    image="label",
    takes_run=True,
    not_taken=dict.fromkeys(_NOT_TAKEN, NO_ROTATION),
)
main = main_of(DEFINITION)
