"""Figures of results. Imported last: nothing else needs matplotlib.

What draws a result of a study is listed here and loaded when first used; a notebook shows it.

>>> from bouncing_disk_ros import basins, plots
>>> plots.basins_picture(basins(axial_forcing=0.34, width=200, height=200)).savefig("basins.pdf")
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bouncing_disk_ros.plots.basin_plot import basins_picture
    from bouncing_disk_ros.plots.basin_shares_plot import basin_shares_picture
    from bouncing_disk_ros.plots.bifurcation_plot import bifurcation_figure
    from bouncing_disk_ros.plots.curves_plot import curves_picture
    from bouncing_disk_ros.plots.manifolds_plot import manifolds_picture
    from bouncing_disk_ros.plots.parameter_map_plot import mean_speed_picture, parameter_map_picture
    from bouncing_disk_ros.plots.resilience_plot import impulse_picture, resilience_picture
    from bouncing_disk_ros.plots.run_plot import run_picture, save_picture
    from bouncing_disk_ros.plots.start_speeds_plot import start_speeds_picture
    from bouncing_disk_ros.plots.toss_map_plot import maps_figure
    from bouncing_disk_ros.plots.toss_plot import paths_figure, trajectories_figure

_PUBLIC = {
    "basin_plot": "basins_picture",
    "basin_shares_plot": "basin_shares_picture",
    "bifurcation_plot": "bifurcation_figure",
    "curves_plot": "curves_picture",
    "manifolds_plot": "manifolds_picture",
    "parameter_map_plot": "mean_speed_picture parameter_map_picture",
    "resilience_plot": "impulse_picture resilience_picture",
    "run_plot": "run_picture save_picture",
    "start_speeds_plot": "start_speeds_picture",
    "toss_map_plot": "maps_figure",
    "toss_plot": "paths_figure trajectories_figure",
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
    value: object = getattr(importlib.import_module(f"{__name__}.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """List what draws, loaded or not."""
    return sorted({*__all__, *(name for name in globals() if name.startswith("__"))})
