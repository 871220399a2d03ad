"""The executable `bifurcation`: attractors along a parameter (paper, Fig. 3)."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING

from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.study.study_tool import StudyTool
from bouncing_disk_ros.study.study_view import StudyView

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from bouncing_disk_ros.study.bifurcation.compute import Bifurcation

_ABOUT = """Follow an attractor along a parameter, upward or downward: each value starts from the
last state of the one before. With starts:=24, so many starts are followed at each value instead:
that shows the attractors that coexist. Period doublings are computed by continuation. Fig. 3 of
the paper."""
_EXAMPLE = "ros2 run bouncing_disk_ros bifurcation --ros-args -p begin:=0.6 -p end:=0.45"

APART = 0.01
"""Mean speeds (ωΦ) further apart than this are not those of one orbit."""


def make_view() -> StudyView[Bifurcation]:
    """The study with its picture."""
    from bouncing_disk_ros.study.bifurcation.compute import Bifurcation

    return StudyView(Bifurcation, _pictures, lines, from_bag=_from_bag)


def _from_bag(values: Mapping[str, Value]) -> list[str]:
    from bouncing_disk_ros.maps.scales import MAP_PARAMETERS

    return [name for name in MAP_PARAMETERS if name != values["along"]]


def _pictures(study: Bifurcation, result: xr.Dataset) -> Mapping[str, Figure]:
    from bouncing_disk_ros.study.bifurcation.compute import branch_of
    from bouncing_disk_ros.study.bifurcation.picture import bifurcation_figure

    branch, section = branch_of(result), study.section()
    along = (study.axis, study.doublings)
    onset = float(result["contact_onset"]) if "contact_onset" in result else math.nan
    figure = bifurcation_figure(
        branch, section, *along, followed=study.sequential, onset=onset, marks=study.marks
    )
    return {"bifurcation": figure}


def lines(result: xr.Dataset) -> list[str]:
    """Doublings with their ratios, the largest mean speed, where the exponent is above 0."""
    rows = []
    pairs = zip(result["doubling"].values, result["doubling_impacts"].values, strict=True)
    for value, impacts in pairs:
        rows.append(f"  period {int(impacts)} → {2 * int(impacts)} at {float(value):.10f}")
    ratios = ", ".join(f"{float(ratio):.4f}" for ratio in result["feigenbaum_ratio"].values)
    if ratios:
        rows.append(f"  ratios of their distances {ratios} (tend to 4.6692)")
    rows += _first_doubling_lines(result)
    rows += _onset_lines(result)
    value = result["value"].values
    n = len(value)
    known = [
        (speed, i)
        for i, speeds in enumerate(result["mean_speed"].values.reshape(n, -1).tolist())
        for speed in speeds
        if not math.isnan(speed)
    ]
    if known:
        best, i = max(known, key=lambda pair: pair[0])
        rows.append(f"  largest mean speed {best:.4f} ωΦ at {float(value[i]):.6g}")
    chaotic = (result["lyapunov_exponent"].values > 1e-3).reshape(n, -1).any(axis=1).sum()
    rows.append(f"  Lyapunov exponent above 0.001 at {int(chaotic)} of {n} values")
    return rows + (_start_lines(result) if "start" in result.dims else [])


def _first_doubling_lines(result: xr.Dataset) -> list[str]:
    """Where the first doubling lies when Γ ends before it: the diagram shows none then."""
    from bouncing_disk_ros.maps.scales import stability_limit

    if result.attrs["parameter_along"] != "axial_forcing" or len(result["doubling"]):
        return []
    restitution = float(result.attrs["parameter_restitution"])
    first, last = stability_limit(restitution), float(result["value"].max())
    if not result.attrs["parameter_doublings"] or last >= first:
        return []
    here = f"at ε = {restitution:g} the first is at {first:.6g}, so let the axis end beyond it"
    return [f"  no period doubling up to {last:.6g}: {here}"]


def _onset_lines(result: xr.Dataset) -> list[str]:
    """Where what was followed came to contact for the first time."""
    if "contact_onset" not in result:
        return []
    onset, without = (float(result[f"contact_onset{end}"]) for end in ("", "_without"))
    chaotic = float(result["contact_onset_exponent"]) > 0.0
    what = "chaotic attractor (a crisis)" if chaotic else "attractor"
    return [f"  the {what} first comes to contact between {without:.7g} and {onset:.7g}"]


def _start_lines(result: xr.Dataset) -> list[str]:
    """How many starts end with contact, and whether the speed has settled there.

    All contact leads to one orbit, so what is left of the start is its speed.
    """
    contact, speed = result["contacts"] > 0.0, result["mean_speed"]
    some, every = (int(found.sum()) for found in (contact.any("start"), contact.all("start")))
    n = result.sizes["value"]
    rows = [f"  contact from some starts at {some} of {n} values, from all at {every}"]
    after = speed.where(contact)
    apart = int((after.max("start") - after.min("start") > APART).sum())
    if apart:
        why = "increase settling, unless the motion is chaotic or friction keeps several speeds"
        rows.append(f"  after contact the mean speed depends on the start at {apart} values: {why}")
    return rows


TOOL = StudyTool("bifurcation", _ABOUT, _EXAMPLE, make_view)
main = TOOL.main


if __name__ == "__main__":
    sys.exit(main())
