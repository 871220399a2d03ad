"""The executable `curves`: folds, doublings, grazes and onset of contact over Γ and ε."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bouncing_disk_ros.errors import counted
from bouncing_disk_ros.orbit_studies import NO_ROTATION
from bouncing_disk_ros.parameters import Spec
from bouncing_disk_ros.study.command import main_of
from bouncing_disk_ros.study.definition import StudyDefinition

if TYPE_CHECKING:
    import xarray as xr


_ABOUT = """Over the plane of axial forcing and restitution: the curves on which the orbits that are
attractors at one point of it fold, double their period, graze the platform or lose contact, with
the points where two of these meet; behind them what a disk settles on."""
_EXAMPLE = "ros2 run bouncing_disk_ros curves --ros-args -p axial_forcing:=0.34 -p doublings:=3"
_NOT_TAKEN = ("phase_lag", "angular_forcing", "x_axis", "y_axis", "along")
_FUNCTION = """\
Folds, doublings, grazes and onset of contact of orbits in the plane of Γ and ε.

>>> curves(axial_forcing_count=8, restitution_count=6, doublings=0, largest_step=0.05)["curve_kind"]
"""
_SPECS = (
    Spec("axial_forcing", 0.45, "1", "the attractors at this axial forcing ...", "Γ", low=0.0,
         high=1e3),
    Spec("restitution", 0.5, "1", "... and this restitution are the orbits whose curves are drawn",
         "ε", low=0.0, high=1.0),
    Spec("doublings", 2, "", "how many times the orbits that these double into along the forcing "
         "are followed too", low=0, high=6),
    Spec("largest_step", 0.01, "", "largest distance between points of a curve, in Γ, ε and the "
         "phases of the impacts (rad) together", low=1e-5, high=0.1),
    Spec("axial_forcing_begin", 0.3, "1", "window: least axial forcing", low=0.0, high=1e3),
    Spec("axial_forcing_end", 0.8, "1", "window: largest axial forcing", low=0.0, high=1e3),
    Spec("axial_forcing_count", 240, "", "points of the map behind the curves along it", low=1,
         high=1_000_000),
    Spec("restitution_begin", 0.2, "1", "window: least restitution", low=0.0, high=1.0),
    Spec("restitution_end", 0.8, "1", "window: largest restitution", low=0.0, high=0.999),
    Spec("restitution_count", 180, "", "points of the map along it", low=1, high=1_000_000),
    Spec("settling", 2000, "", "impacts left out at each point of the map", low=0,
         high=100_000_000),
    Spec("measured", 512, "", "impacts that its kinds are found from", low=256, high=100_000_000),
)  # fmt: skip


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
    return rows or ["  no curves: no attractor at this point has one within the window"]


def curve_name(result: xr.Dataset, i: int) -> str:
    """What a curve is of."""
    kind, n, k = (result[f"curve_{name}"].values[i] for name in ("kind", "impacts", "cycles"))
    orbit = f" of {counted(n, 'impact')}" if n else ""  # none: of the orbit from contact
    return f"{kind}{orbit} in {counted(k, 'period')}"


DEFINITION = StudyDefinition(
    name="curves",
    about=_ABOUT,
    example=_EXAMPLE,
    function=_FUNCTION,
    specs=_SPECS,
    study="bouncing_disk_ros.orbit_studies.curves.compute:Curves",
    lines=lines,
    image="period",
    takes_run=True,
    not_taken=dict.fromkeys(_NOT_TAKEN, NO_ROTATION),
)
main = main_of(DEFINITION)
