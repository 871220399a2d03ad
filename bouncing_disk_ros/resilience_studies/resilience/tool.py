"""The executable `resilience`: how easy attractors are to reach and how hard to lose."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.study.study_tool import StudyTool
from bouncing_disk_ros.study.study_view import StudyView

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from bouncing_disk_ros.resilience_studies.resilience.compute import ResilienceStudy

_ABOUT = """How easy each attractor is to reach and how hard to lose, over axial forcing or
restitution: the smallest impulse and the smallest error in time after which it is not reached
again, how fast it is reached, and its share of the starts."""
_EXAMPLE = "ros2 run bouncing_disk_ros resilience --ros-args -p begin:=0.34 -p end:=0.48"
_NAMED = 5
"""Attractors that lines tell of, those that are there for longest."""


def make_view() -> StudyView[ResilienceStudy]:
    """The study with its pictures."""
    from bouncing_disk_ros.resilience_studies.resilience.compute import ResilienceStudy

    return StudyView(ResilienceStudy, _pictures, lines, from_bag=_from_bag)


def _from_bag(values: Mapping[str, Value]) -> list[str]:
    own = ("axial_forcing", "restitution", "mass", "frequency", "gravity")
    return [name for name in own if name != values["along"]]


def _pictures(_: ResilienceStudy, result: xr.Dataset) -> Mapping[str, Figure]:
    from bouncing_disk_ros.resilience_studies.resilience.picture import (
        impulse_picture,
        resilience_picture,
    )

    return {"resilience": resilience_picture(result), "fatal_impulse": impulse_picture(result)}


def lines(result: xr.Dataset) -> list[str]:
    """Of each kind of attractor, where its share is largest and where it is hardest to lose."""
    from bouncing_disk_ros.resilience_studies.resilience.picture import impulse_unit, time_unit

    units = {
        "least_fatal_impulse": ("impulse", impulse_unit(result), "N·s"),
        "fatal_timing_error": ("timing error", 1e3 * time_unit(result), "ms"),
    }
    stretches = _stretches(result)
    share = result["line_share"].values
    rows = []
    for name, line, places in stretches[:_NAMED]:
        x = result["value"].values[places]
        k = int(np.argmax(share[line, places]))
        error = 100.0 * float(result["line_share_uncertainty"].values[line, places][k])
        rows.append(f"  {name}, from {x[0]:.5g} to {x[-1]:.5g}")
        rows.append(f"    easiest to reach at {x[k]:.5g}: by {100 * share[line, places][k]:.3f} ± "
                    f"{error:.3f} % of the starts")  # fmt: skip
        for field, (what, unit, si) in units.items():
            least = result[f"line_{field}"].values[line, places].min(axis=-1)
            rows.append(f"    {_hardest_to_lose(what, x, least, unit, si)}")
    return rows + _warnings(result, len(stretches))


def _hardest_to_lose(what: str, x: np.ndarray, least: np.ndarray, unit: float, si: str) -> str:
    """Where the least fatal one is largest: where none is, before all others."""
    safe = x[np.isposinf(least)]
    if safe.size:
        span = f"{safe[0]:.5g}" + (f" to {safe[-1]:.5g}" if safe.size > 1 else "")
        where = f", at {safe.size} of {x.size} values: {span}" if safe.size < x.size else ""
        return f"no {what} is fatal, of those looked at{where}"
    if np.isnan(least).all():
        return f"which {what} is fatal is not known"
    at = int(np.nanargmax(least))
    article = "a" if what.startswith("t") else "an"
    return (
        f"hardest to lose by {article} {what} at {x[at]:.5g}: {least[at]:.5g}, "
        f"{least[at] * unit:.5g} {si}"
    )


def _stretches(result: xr.Dataset) -> list[tuple[str, int, np.ndarray]]:
    """Name, line and places along the axis of each kind of attractor, the longest first."""
    from bouncing_disk_ros.study.attractor_lines import attractor_name

    found: dict[tuple[str, int], list[int]] = {}
    fields = [result[f"line_{name}"].values for name in ("kind", "impacts", "cycles")]
    for line, k in np.argwhere(fields[0] >= 0):
        about = [int(field[line, k]) for field in fields]
        periodic = about[1] > 0
        name = attractor_name(*(about if periodic else (about[0], 0, 0)))
        found.setdefault((name, int(line)), []).append(int(k))
    share = result["line_share"].values
    rows = [(name, line, np.array(places)) for (name, line), places in found.items()]
    return sorted(rows, key=lambda row: (-len(row[2]), -float(share[row[1], row[2]].max())))


def _warnings(result: xr.Dataset, count: int) -> list[str]:
    """What was left out."""
    rows = [f"  and {count - _NAMED} others at fewer values"] if count > _NAMED else []
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
