"""Figures of results, each from the folder of its subject, loaded when first used.

>>> from bouncing_disk_ros import basins, plots
>>> plots.basins_picture(basins(axial_forcing=0.34, width=200, height=200)).savefig("basins.pdf")
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bouncing_disk_ros.figure_style import save_picture
    from bouncing_disk_ros.report.run_picture import run_picture
    from bouncing_disk_ros.resilience_studies.curves.picture import curves_picture
    from bouncing_disk_ros.resilience_studies.manifolds.picture import manifolds_picture
    from bouncing_disk_ros.resilience_studies.resilience.picture import (
        impulse_picture,
        resilience_picture,
    )
    from bouncing_disk_ros.study.basin_shares.picture import basin_shares_picture
    from bouncing_disk_ros.study.basins.picture import basins_picture, start_speeds_picture
    from bouncing_disk_ros.study.bifurcation.picture import bifurcation_figure
    from bouncing_disk_ros.study.parameter_map.picture import (
        mean_speed_picture,
        parameter_map_picture,
    )
    from bouncing_disk_ros.study.toss_map.picture import maps_figure
    from bouncing_disk_ros.study.toss_paths.picture import paths_figure, trajectories_figure

_PUBLIC = {
    "study.basins.picture": "basins_picture start_speeds_picture",
    "study.basin_shares.picture": "basin_shares_picture",
    "study.bifurcation.picture": "bifurcation_figure",
    "resilience_studies.curves.picture": "curves_picture",
    "resilience_studies.manifolds.picture": "manifolds_picture",
    "study.parameter_map.picture": "mean_speed_picture parameter_map_picture",
    "resilience_studies.resilience.picture": "impulse_picture resilience_picture",
    "figure_style": "save_picture",
    "report.run_picture": "run_picture",
    "study.toss_map.picture": "maps_figure",
    "study.toss_paths.picture": "paths_figure trajectories_figure",
}
_HOMES = {name: module for module, names in _PUBLIC.items() for name in names.split()}
__all__ = [
    "basin_shares_picture", "basins_picture", "bifurcation_figure", "curves_picture",
    "impulse_picture", "manifolds_picture", "maps_figure", "mean_speed_picture",
    "parameter_map_picture", "paths_figure", "resilience_picture", "run_picture", "save_picture",
    "start_speeds_picture", "trajectories_figure",
]  # fmt: skip


def __getattr__(name: str) -> object:
    """Load what draws when it is first used (PEP 562)."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value: object = getattr(importlib.import_module(f"bouncing_disk_ros.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """List what draws, loaded or not."""
    return sorted({*__all__, *(name for name in globals() if name.startswith("__"))})
