"""The executable `juggling`: which starts each strategy captures, under which errors."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING

from bouncing_disk_ros.study.study_tool import StudyTool
from bouncing_disk_ros.study.study_view import StudyView

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from bouncing_disk_ros.juggling.compute import Juggling

_ABOUT = """Run closed loops from many starts: which ones each strategy of control brings onto the
period-1 orbit and keeps there, with a wrong restitution, delays, missed impacts and impulses."""
_EXAMPLE = """ros2 run bouncing_disk_ros juggling --ros-args \\
      -p strategies:='none deadbeat' -p conditions:='nominal; delay=0.5; missed=0.2'"""


def make_view() -> StudyView[Juggling]:
    """The study with its pictures."""
    from bouncing_disk_ros.juggling.compute import Juggling

    return StudyView(Juggling, _pictures, lines)


def _pictures(_: Juggling, result: xr.Dataset) -> Mapping[str, Figure]:
    from bouncing_disk_ros.juggling.picture import capture_maps, success_table

    return {"juggling": capture_maps(result), "juggling_table": success_table(result)}


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


TOOL = StudyTool("juggling", _ABOUT, _EXAMPLE, make_view)
main = TOOL.main


if __name__ == "__main__":
    sys.exit(main())
