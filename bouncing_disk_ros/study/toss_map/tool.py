"""The executable `toss_map`: single tosses over phase lag and amplitude angle (paper, Fig. 2)."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING

from bouncing_disk_ros.angles import angles_of
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.study.study_tool import StudyTool
from bouncing_disk_ros.study.study_view import StudyView

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from bouncing_disk_ros.study.toss_map.compute import TossMap

_ABOUT = """Airborne speed, speed ratio and efficiency of single tosses over phase lag and amplitude
angle, with the extremal points found on the exact function. Fig. 2 of the paper."""
_EXAMPLE = "ros2 run bouncing_disk_ros toss_map --ros-args -p friction:=0.3"


def make_view() -> StudyView[TossMap]:
    """The study with its pictures."""
    from bouncing_disk_ros.study.toss_map.compute import TossMap

    def make(values: Mapping[str, Value]) -> TossMap:
        study = TossMap(values)
        _lags(study)  # refused at once, not after the work
        return study

    return StudyView(make, _pictures, lines, image="airborne_speed")


def _lags(study: TossMap) -> list[float]:
    return angles_of("trajectory_lags", str(study.parameters["trajectory_lags"]))


def _pictures(study: TossMap, result: xr.Dataset) -> Mapping[str, Figure]:
    from bouncing_disk_ros.maps.toss_path import toss_trajectory
    from bouncing_disk_ros.maps.tosses import Toss
    from bouncing_disk_ros.study.toss_map.picture import maps_figure
    from bouncing_disk_ros.study.toss_paths.picture import toss_title, trajectories_figure

    held = {name: result[name].values for name in Toss._fields if name in result}
    tosses = Toss(**{name: held.get(name, held["delay"]) for name in Toss._fields})
    lag, angle = result["phase_lag"].values, result["amplitude_angle"].values
    given = study.parameters
    lags, at = _lags(study), float(given["trajectory_angle"])
    runs = [
        toss_trajectory(
            one, at, study.setting,
            angular_velocity=float(given["initial_angular_velocity"]),
            forcing_phase=float(given["initial_forcing_phase"]),
        )
        for one in lags
    ]  # fmt: skip
    return {
        "toss_map": maps_figure(lag, angle, tosses, study.extremes, study.ridge()),
        "trajectories": trajectories_figure(runs, [toss_title(one, at) for one in lags]),
    }


def lines(result: xr.Dataset) -> list[str]:
    """The extremal points."""
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
    return found


TOOL = StudyTool("toss_map", _ABOUT, _EXAMPLE, make_view)
main = TOOL.main


if __name__ == "__main__":
    sys.exit(main())
