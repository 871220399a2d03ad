"""The executable `toss_paths`: paths of the hand for several motions (paper, Fig. 1)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from bouncing_disk_ros.parameters import Spec
from bouncing_disk_ros.study.command import main_of
from bouncing_disk_ros.study.definition import StudyDefinition
from bouncing_disk_ros.study.shared_options import TOSS_OPTIONS

if TYPE_CHECKING:
    import xarray as xr


_ABOUT = """Draw the closed paths of the tossing hand for pairs of phase lag and amplitude angle.
Fig. 1 of the paper."""
_EXAMPLE = """ros2 run bouncing_disk_ros toss_paths --ros-args -p phase_lags:='0 -0.25pi' \\
      -p amplitude_angles:='0.25pi 0.25pi'"""
_FUNCTION = """\
Paths of the tossing hand for pairs of phase lag and amplitude angle (paper, Fig. 1).

>>> toss_paths(phase_lags=[0.0, -0.785], amplitude_angles=[0.785, 0.785])["arc"]
"""
_SPECS = (
    *TOSS_OPTIONS,
    Spec("phase_lags", "-0.5pi -0.25pi 0 -0.25pi -0.25pi -0.25pi", "rad",
         "phase lag of each path, separated by blanks; 0.25pi is π/4", "θ", numbers=True),
    Spec("amplitude_angles", "0.25pi 0.25pi 0.25pi 0.125pi 0.25pi 0.375pi", "rad",
         "amplitude angle of each path, one for each phase lag", "φ_L", numbers=True),
    Spec("points", 721, "", "points of each path", low=16, high=1_000_000),
)  # fmt: skip


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


DEFINITION = StudyDefinition(
    name="toss_paths",
    about=_ABOUT,
    example=_EXAMPLE,
    function=_FUNCTION,
    specs=_SPECS,
    study="bouncing_disk_ros.study.toss_paths.compute:TossPaths",
    lines=lines,
)
main = main_of(DEFINITION)
