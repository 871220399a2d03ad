"""The executable `resilience`: how easy attractors are to reach and how hard to lose."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from bouncing_disk_ros.nodes.studies.study_tool import StudyTool
from bouncing_disk_ros.nodes.studies.study_view import StudyView
from bouncing_disk_ros.parameters import Value

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from bouncing_disk_ros.study.resilience_study import ResilienceStudy

_ABOUT = """How easy each attractor is to reach and how hard to lose, over axial forcing or
restitution: the smallest impulse and the smallest error in time after which it is not reached
again, how fast it is reached, and its share of the starts."""
_EXAMPLE = "ros2 run bouncing_disk_ros resilience --ros-args -p begin:=0.34 -p end:=0.48"
_NAMED = 5
"""Attractors that lines tell of, those with the largest shares."""


def make_view() -> StudyView[ResilienceStudy]:
    """The study with its pictures."""
    from bouncing_disk_ros.study.resilience_study import ResilienceStudy

    return StudyView(ResilienceStudy, _pictures, lines, from_bag=_from_bag)


def _from_bag(values: Mapping[str, Value]) -> list[str]:
    own = ("axial_forcing", "restitution", "mass", "frequency", "gravity")
    return [name for name in own if name != values["along"]]


def _pictures(_: ResilienceStudy, result: xr.Dataset) -> Mapping[str, Figure]:
    from bouncing_disk_ros.plots.resilience_plot import impulse_picture, resilience_picture

    return {"resilience": resilience_picture(result), "fatal_impulse": impulse_picture(result)}


def lines(result: xr.Dataset) -> list[str]:
    """Of each attractor, where its share is largest and where it is hardest to lose."""
    from bouncing_disk_ros.plots.resilience_plot import impulse_unit, time_unit

    x, names = result["value"].values, result["line_name"].values
    rows = []
    largest = np.nanmax(result["line_share"].values, axis=1) if len(names) else np.empty(0)
    for i in np.argsort(-largest, kind="stable")[:_NAMED]:
        rows.append(f"  {names[i]}")
        share = result["line_share"].values[i]
        k = int(np.nanargmax(share))
        error = 100.0 * float(result["line_share_uncertainty"].values[i, k])
        rows.append(f"    easiest to reach at {x[k]:.5g}: {100 * share[k]:.3f} ± {error:.3f} % of "
                    "the starts")  # fmt: skip
        for name, what, unit, si in (
            ("least_fatal_impulse", "impulse", impulse_unit(result), "N·s"),
            ("fatal_timing_error", "timing error", 1e3 * time_unit(result), "ms"),
        ):
            least = result[f"line_{name}"].values[i].min(axis=-1)
            known = np.isfinite(least)
            if known.any():
                at = int(np.argmax(np.where(known, least, -1.0)))
                rows.append(f"    hardest to lose by an {what} at {x[at]:.5g}: from {least[at]:.5g}"
                            f" on it may be fatal, {least[at] * unit:.5g} {si}".replace(
                                "an timing", "a timing"))  # fmt: skip
    return rows + _warnings(result)


def _warnings(result: xr.Dataset) -> list[str]:
    """What was left out."""
    rows = []
    more = len(result["line_name"]) - _NAMED
    if more > 0:
        rows.append(f"  and {more} attractors with smaller shares")
    left = int((result["left_out"] > 0).sum())
    if left:
        rows.append(f"  attractors were left out at {left} values: most_attractors:=... keeps them")
    unresolved = float(result["unresolved"].max())
    if unresolved > 0.0:
        rows.append(f"  up to {100 * unresolved:.3f} % of the starts are unresolved")
    return rows


TOOL = StudyTool("resilience", _ABOUT, _EXAMPLE, make_view)
main = TOOL.main


if __name__ == "__main__":
    sys.exit(main())
