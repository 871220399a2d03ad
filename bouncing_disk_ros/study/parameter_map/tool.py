"""The executable `parameter_map`: attractors over two parameters."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING

from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.study.plane_lines import kind_shares, largest
from bouncing_disk_ros.study.study_tool import StudyTool
from bouncing_disk_ros.study.study_view import StudyView

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from bouncing_disk_ros.study.parameter_map.compute import ParameterMap

_ABOUT = """Attractors over a plane of two of the parameters axial forcing, restitution, phase lag
and angular forcing: the period of the attractor that one start reaches, its largest Lyapunov
exponent and the mean speed of the disk."""
_EXAMPLE = "ros2 run bouncing_disk_ros parameter_map --ros-args -p x_count:=600 -p y_count:=400"

SETTLED = 0.01
"""A mean speed (ωΦ) that changes by more has not settled."""


def make_view() -> StudyView[ParameterMap]:
    """The study with its pictures."""
    from bouncing_disk_ros.study.parameter_map.compute import ParameterMap

    return StudyView(
        ParameterMap,
        _pictures,
        lines,
        from_bag=_from_bag,
        image="period",
    )


def _from_bag(values: Mapping[str, Value]) -> list[str]:
    from bouncing_disk_ros.maps.scales import MAP_PARAMETERS

    return [name for name in MAP_PARAMETERS if name not in (values["x_axis"], values["y_axis"])]


def _pictures(_: ParameterMap, result: xr.Dataset) -> Mapping[str, Figure]:
    from bouncing_disk_ros.study.parameter_map.picture import (
        mean_speed_picture,
        parameter_map_picture,
    )

    return {
        "parameter_map": parameter_map_picture(result),
        "mean_speed": mean_speed_picture(result),
    }


def lines(result: xr.Dataset) -> list[str]:
    """Shares of the kinds, the periods that occur, the largest speed and exponent."""
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


TOOL = StudyTool("parameter_map", _ABOUT, _EXAMPLE, make_view)
main = TOOL.main


if __name__ == "__main__":
    sys.exit(main())
