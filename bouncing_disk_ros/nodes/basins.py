"""The executable `basins`: basins of attraction in the plane (τ_imp, w_A) (paper, Fig. 4)."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

from bouncing_disk_ros.nodes.study_options import table_of
from bouncing_disk_ros.nodes.study_tool import Exhibit, StudyTool
from bouncing_disk_ros.parameters import Spec

if TYPE_CHECKING:
    import xarray as xr

_ABOUT = """Label each start (forcing phase and relative velocity at a first impact) by the
attractor that it goes to; the attractors are found, not given. Fig. 4 of the paper."""
_EXAMPLE = "ros2 run bouncing_disk_ros basins --ros-args -p axial_forcing:=0.55 -p width:=2000"

OPTIONS = table_of(
    Spec("axial_forcing", 0.45, "1", "axial forcing Γ = Aω²/(πg)", "Γ", low=0.0, high=1e3),
    Spec("restitution", 0.5, "1", "coefficient of restitution", "ε", low=0.0, high=1.0),
    Spec("width", 1000, "", "pixels along the forcing phase", low=1, high=1_000_000),
    Spec("height", 1000, "", "pixels along the velocity", low=1, high=1_000_000),
    Spec("phase_begin", 0.0, "rad", "window: least forcing phase", low=-100.0, high=100.0),
    Spec("phase_end", math.tau, "rad", "window: largest forcing phase", low=-100.0, high=100.0),
    Spec("velocity_begin", -5.0, "πg/ω", "window: least relative velocity", low=-1e3, high=0.0),
    Spec("velocity_end", 0.0, "πg/ω", "window: largest relative velocity", low=-1e3, high=0.0),
    Spec("velocity", "before", "", "which velocity the window shows: w_A before the first impact, "
         "or −u after it, u = −ε w_A: before or after"),
    Spec("tolerance", 1e-4, "", "distance (rad and πg/ω) at which an orbit counts as on an "
         "attractor", low=1e-12, high=0.1),
    Spec("cap", 0, "", "impacts after which a start is unresolved; 0: enough for the slowest "
         "attractor", low=0, high=10_000_000),
)  # fmt: skip


def exhibit() -> Exhibit:
    """The study with its pictures."""
    from bouncing_disk_ros.plots.basins_plot import basins_picture
    from bouncing_disk_ros.study.basins import Basins

    return Exhibit(
        Basins,
        lambda result: {"basins": basins_picture(result)},
        lines,
        lambda result: result["label"].values,
    )


def lines(result: xr.Dataset) -> list[str]:
    """The attractors with their shares, and the boundary."""
    rows = [
        f"  {name!s:24} {100 * float(part):8.3f} ± {100 * float(error):.3f} %"
        for name, part, error in zip(
            result["attractor_name"].values,
            result["fraction"].values,
            result["fraction_uncertainty"].values,
            strict=True,
        )
    ]
    rows.append(f"  {'unresolved':24} {100 * float(result['unresolved_fraction']):8.3f} %")
    if "box_dimension" in result and math.isnan(float(result["box_dimension"])):
        rows.append("  no boundary within the window, or too little of it")
    elif "box_dimension" in result:
        entropy = float(result["boundary_basin_entropy"])
        rows.append(
            f"  basin entropy {float(result['basin_entropy']):.4f}, at the boundary {entropy:.4f} "
            "(above ln 2 = 0.6931: surely fractal)"
        )
        rows.append(
            f"  uncertainty exponent {float(result['uncertainty_exponent']):.3f} ± "
            f"{float(result['uncertainty_exponent_error']):.3f}, box dimension "
            f"{float(result['box_dimension']):.3f} ± {float(result['box_dimension_error']):.3f} "
            "(both 1: a smooth line)"
        )
    return rows


TOOL = StudyTool("basins", _ABOUT, _EXAMPLE, OPTIONS, exhibit)


def main(args: Sequence[str] | None = None) -> int:
    """Compute basins; exit code 0 done, 1 failed, 2 bad input, 130 interrupted."""
    return TOOL.main(args)


if __name__ == "__main__":
    sys.exit(main())
