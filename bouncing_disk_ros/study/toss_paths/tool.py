"""The executable `toss_paths`: paths of the hand for several motions (paper, Fig. 1)."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING

from bouncing_disk_ros.study.study_tool import StudyTool
from bouncing_disk_ros.study.study_view import StudyView

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from bouncing_disk_ros.study.toss_paths.compute import TossPaths

_ABOUT = """Draw the closed paths of the tossing hand for pairs of phase lag and amplitude angle.
Fig. 1 of the paper."""
_EXAMPLE = """ros2 run bouncing_disk_ros toss_paths --ros-args -p phase_lags:='0 -0.25pi' \\
      -p amplitude_angles:='0.25pi 0.25pi'"""


def make_view() -> StudyView[TossPaths]:
    """The study with its picture."""
    from bouncing_disk_ros.study.toss_paths.compute import TossPaths

    return StudyView(TossPaths, _pictures, lines)


def _pictures(_: TossPaths, result: xr.Dataset) -> Mapping[str, Figure]:
    from bouncing_disk_ros.maps.toss_path import TossPaths
    from bouncing_disk_ros.study.toss_paths.picture import paths_figure, toss_title

    paths = TossPaths(**{name: result[name].values for name in TossPaths._fields})
    pairs = zip(result["phase_lag"].values, result["amplitude_angle"].values, strict=True)
    titles = [toss_title(float(lag), float(angle)) for lag, angle in pairs]
    return {"toss_paths": paths_figure(paths, titles)}


def lines(result: xr.Dataset) -> list[str]:
    """Where the disk leaves, for each path."""
    rows = []
    for i in range(result.sizes["path"]):
        lag, angle, leaves = (
            float(result[name].values[i])
            for name in ("phase_lag", "amplitude_angle", "separation_phase")
        )
        where = "the disk never leaves" if math.isnan(leaves) else f"τ_sep = {leaves:.4f} rad"
        rows.append(f"  θ = {lag / math.pi:+.4f}π, φ_L = {angle / math.pi:.4f}π: {where}")
    return rows


TOOL = StudyTool("toss_paths", _ABOUT, _EXAMPLE, make_view)
main = TOOL.main


if __name__ == "__main__":
    sys.exit(main())
