"""Public names of `plots`, for type checkers and for `PublicNames`."""

from .matplotlib_figures import save_picture as save_picture
from .orbit_studies.curves.picture import curves_picture as curves_picture
from .orbit_studies.manifolds.picture import manifolds_picture as manifolds_picture
from .orbit_studies.resilience.picture import impulse_picture as impulse_picture
from .orbit_studies.resilience.picture import resilience_picture as resilience_picture
from .report.run_picture import run_picture as run_picture
from .study.basin_shares.picture import basin_shares_picture as basin_shares_picture
from .study.basins.picture import basins_picture as basins_picture
from .study.basins.picture import start_speeds_picture as start_speeds_picture
from .study.bifurcation.picture import bifurcation_figure as bifurcation_figure
from .study.parameter_map.picture import mean_speed_picture as mean_speed_picture
from .study.parameter_map.picture import parameter_map_picture as parameter_map_picture
from .study.toss_map.picture import maps_figure as maps_figure
from .study.toss_paths.picture import paths_figure as paths_figure
from .study.toss_paths.picture import trajectories_figure as trajectories_figure

__all__: list[str]
