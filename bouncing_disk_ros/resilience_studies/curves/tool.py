"""The executable `curves`: folds, doublings, grazes and onset of contact over Γ and ε."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING

from bouncing_disk_ros.errors import counted
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.study.study_tool import StudyTool
from bouncing_disk_ros.study.study_view import StudyView

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from bouncing_disk_ros.resilience_studies.curves.compute import Curves

_ABOUT = """Over the plane of axial forcing and restitution: the curves on which the orbits that are
attractors at one point of it fold, double their period, graze the platform or lose contact, with
the points where two of these meet; behind them what a disk settles on."""
_EXAMPLE = "ros2 run bouncing_disk_ros curves --ros-args -p axial_forcing:=0.34 -p doublings:=3"


def make_view() -> StudyView[Curves]:
    """The study with its picture."""
    from bouncing_disk_ros.resilience_studies.curves.compute import Curves

    return StudyView(Curves, _pictures, lines, from_bag=_from_bag, image="period")


def _from_bag(_: Mapping[str, Value]) -> list[str]:
    return ["axial_forcing", "restitution"]


def _pictures(_: Curves, result: xr.Dataset) -> Mapping[str, Figure]:
    from bouncing_disk_ros.resilience_studies.curves.picture import curves_picture

    return {"curves": curves_picture(result)}


def lines(result: xr.Dataset) -> list[str]:
    """Each curve with its ends, each special point with its place."""
    rows = []
    for i in range(result.sizes.get("curve", 0)):
        own = result["point_curve"].values == i
        x, y = (result[f"point_{n}"].values[own] for n in ("axial_forcing", "restitution"))
        ends = [f"({x[k]:.6f}, {y[k]:.6f})" for k in (0, -1)]
        rows.append(f"  {curve_name(result, i):36} from Γ, ε = {ends[0]} to {ends[1]}")
        special = result["special_curve"].values == i
        for k in special.nonzero()[0]:
            x1, y1 = (
                float(result[f"special_{name}"].values[k])
                for name in ("axial_forcing", "restitution")
            )
            rows.append(f"    {result['special_kind'].values[k]} at ({x1:.9f}, {y1:.9f})")
    lost = int(result["lost_orbits"]) if "lost_orbits" in result else 0
    if lost:
        rows.append(f"  {lost} orbits could not be followed; the curves found are kept")
    return rows or ["  no curves: no attractor at this point is periodic or holds contact"]


def curve_name(result: xr.Dataset, i: int) -> str:
    """What a curve is of."""
    kind, n, k = (result[f"curve_{name}"].values[i] for name in ("kind", "impacts", "cycles"))
    orbit = f" of {counted(n, 'impact')}" if n else ""  # none: of the orbit from contact
    return f"{kind}{orbit} in {counted(k, 'period')}"


TOOL = StudyTool("curves", _ABOUT, _EXAMPLE, make_view)
main = TOOL.main


if __name__ == "__main__":
    sys.exit(main())
