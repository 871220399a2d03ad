"""The executable `bifurcation`: an attractor followed along a parameter (paper, Fig. 3)."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from bouncing_disk_ros.nodes.study_options import table_of
from bouncing_disk_ros.nodes.study_tool import Exhibit, StudyTool
from bouncing_disk_ros.parameters import Spec, Value

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from bouncing_disk_ros.study.bifurcation import Bifurcation

_ABOUT = """Follow an attractor along a parameter, upward or downward: each value starts from where
the one before ended. Period doublings are computed by continuation. Fig. 3 of the paper."""
_EXAMPLE = "ros2 run bouncing_disk_ros bifurcation --ros-args -p begin:=0.6 -p end:=0.45"

OPTIONS = table_of(
    Spec("along", "axial_forcing", "", "the parameter of the axis: axial_forcing, restitution, "
         "phase_lag or angular_forcing"),
    Spec("begin", 0.335, "", "first value of it", low=-1e6, high=1e6),
    Spec("end", 0.65, "", "last value of it; less than begin: the way down", low=-1e6, high=1e6),
    Spec("count", 1261, "", "number of values", low=1, high=10_000_000),
    Spec("axial_forcing", 0.45, "1", "axial forcing where it is not the axis", "Γ", low=0.0,
         high=1e3),
    Spec("restitution", 0.5, "1", "restitution where it is not the axis", "ε", low=0.0, high=1.0),
    Spec("phase_lag", 0.0, "rad", "phase lag where it is not the axis", "θ", low=-1e3, high=1e3),
    Spec("angular_forcing", 100.0, "1", "angular forcing where it is not the axis", "Γ_T",
         low=1e-9, high=1e12),
    Spec("initial_phase", 0.0, "rad", "forcing phase of the first impact, with initial_velocity",
         "τ", low=-1e3, high=1e3),
    Spec("initial_velocity", 0.0, "πg/ω", "w_A of the first impact; 0: start on the period-1 "
         "orbit", "w_A", low=-1e3, high=0.0),
    Spec("settling", 1000, "", "impacts left out at each value", low=0, high=100_000_000),
    Spec("measured", 2000, "", "impacts that means and exponent are over", low=1,
         high=100_000_000),
    Spec("kept", 300, "", "impacts kept at each value, the last ones measured", low=1,
         high=1_000_000),
    Spec("doublings", 5, "", "period doublings to compute by continuation; 0: none", low=0,
         high=12),
)  # fmt: skip


def exhibit() -> Exhibit:
    """The study with its picture."""
    from bouncing_disk_ros.study.bifurcation import Bifurcation

    studies: list[Bifurcation] = []

    def make(values: Mapping[str, Value]) -> Bifurcation:
        studies.append(Bifurcation(values))
        return studies[-1]

    return Exhibit(make, lambda result: _pictures(studies[-1], result), lines)


def _pictures(study: Bifurcation, result: xr.Dataset) -> Mapping[str, Figure]:
    from bouncing_disk_ros.plots.bifurcation_plot import bifurcation_figure
    from bouncing_disk_ros.study.bifurcation import branch_of

    branch, section = branch_of(result), study.section()
    return {"bifurcation": bifurcation_figure(branch, section, study.axis, study.doublings())}


def lines(result: xr.Dataset) -> list[str]:
    """Doublings with their ratios, the largest mean speed, where the exponent is above 0."""
    rows = []
    pairs = zip(result["doubling"].values, result["doubling_impacts"].values, strict=True)
    for value, impacts in pairs:
        rows.append(f"  period {int(impacts)} → {2 * int(impacts)} at {float(value):.10f}")
    ratios = ", ".join(f"{float(ratio):.4f}" for ratio in result["feigenbaum_ratio"].values)
    if ratios:
        rows.append(f"  ratios of their distances {ratios} (tend to 4.6692)")
    speed, value = result["mean_speed"].values, result["value"].values
    known = [i for i in range(len(speed)) if not math.isnan(speed[i])]
    if known:
        best = max(known, key=lambda i: float(speed[i]))
        rows.append(f"  largest mean speed {float(speed[best]):.4f} ωΦ at {float(value[best]):.6g}")
    chaotic = int((result["lyapunov_exponent"].values > 1e-3).sum())
    rows.append(f"  Lyapunov exponent above 0.001 at {chaotic} of {len(value)} values")
    return rows


TOOL = StudyTool("bifurcation", _ABOUT, _EXAMPLE, OPTIONS, exhibit)


def main(args: Sequence[str] | None = None) -> int:
    """Compute the diagram; exit code 0 done, 1 failed, 2 bad input, 130 interrupted."""
    return TOOL.main(args)


if __name__ == "__main__":
    sys.exit(main())
