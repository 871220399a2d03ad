"""The executable `toss_map`: single tosses over phase lag and amplitude angle (paper, Fig. 2)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from bouncing_disk_ros.parameters import Spec
from bouncing_disk_ros.study.command import main_of
from bouncing_disk_ros.study.definition import StudyDefinition
from bouncing_disk_ros.study.shared_options import TOSS_OPTIONS

if TYPE_CHECKING:
    import xarray as xr


_ABOUT = """Airborne speed, speed ratio and efficiency of single tosses over phase lag and amplitude
angle, with the extremal points found on the exact function. Fig. 2 of the paper."""
_EXAMPLE = "ros2 run bouncing_disk_ros toss_map --ros-args -p friction:=0.3"
_FUNCTION = """\
Speed, speed ratio and efficiency of single tosses (paper, Fig. 2).

Over phase lag and amplitude angle.

>>> toss_map(phase_lag_count=181, amplitude_angle_count=91)["airborne_speed"].max()
"""
_SPECS = (
    *TOSS_OPTIONS,
    Spec("phase_lag_begin", -math.pi, "rad", "least phase lag", "θ", low=-1e3, high=1e3),
    Spec("phase_lag_end", math.pi, "rad", "largest phase lag", "θ", low=-1e3, high=1e3),
    Spec("phase_lag_count", 721, "", "number of phase lags", low=1, high=1_000_000),
    Spec("amplitude_angle_begin", 0.0, "rad", "least amplitude angle", "φ_L", low=0.0,
         high=math.pi / 2),
    Spec("amplitude_angle_end", math.pi / 2, "rad", "largest amplitude angle", "φ_L", low=0.0,
         high=math.pi / 2),
    Spec("amplitude_angle_count", 361, "", "number of amplitude angles", low=1, high=1_000_000),
    Spec("initial_angular_velocity", 0.0, "rad/s", "angular velocity of the disk at the start, "
         "absolute", "α̇", low=-1e6, high=1e6),
    Spec("initial_forcing_phase", 1.5 * math.pi, "rad", "forcing phase at the start; 3π/2: the "
         "lowest point", "τ", low=-1e3, high=1e3),
    Spec("trajectory_lags", "0 0.5pi", "rad", "phase lags of the tosses drawn in time (Fig. 2d)",
         numbers=True),
    Spec("trajectory_angle", math.pi / 4, "rad", "amplitude angle of these", "φ_L", low=0.0,
         high=math.pi / 2),
)  # fmt: skip


def lines(result: xr.Dataset) -> list[str]:
    """The extremal points."""
    from bouncing_disk_ros.maps.single_toss import TOSS_STAYS  # loads kernels

    found = []
    for i in range(result.sizes["extreme"]):
        one = {name: result[f"extreme_{name}"].values[i] for name in (
            "measure", "phase_lag", "amplitude_angle", "airborne_speed", "speed_ratio",
            "efficiency")}  # fmt: skip
        found.append(
            f"  largest {str(one['measure']).replace('_', ' '):15} at θ = "
            f"{float(one['phase_lag']) / math.pi:.4f}π, φ_L = "
            f"{float(one['amplitude_angle']) / math.pi:.4f}π: "
            f"α̇_f = {abs(float(one['airborne_speed'])):.3f} rad/s, "
            f"ν = {abs(float(one['speed_ratio'])):.4f}, η = {float(one['efficiency']):.4f}"
        )
    if not found and (result["code"] == TOSS_STAYS).all():
        return ["  the disk never leaves the platform: axial forcing at most 1/π"]
    return found


DEFINITION = StudyDefinition(
    name="toss_map",
    about=_ABOUT,
    example=_EXAMPLE,
    function=_FUNCTION,
    specs=_SPECS,
    study="bouncing_disk_ros.study.toss_map.compute:TossMap",
    lines=lines,
    image="airborne_speed",
)
main = main_of(DEFINITION)
