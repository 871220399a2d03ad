"""The studies as functions: parameters in, dataset out.

Each takes the parameters of its table (docs/parameters.md) as keywords, and returns the result as
an `xarray.Dataset`. `path`: the folder of a store that the result is kept in, or goes on from; None
keeps nothing. `workers`: threads that compute, 0 for one on each core. `progress`: whether a bar
shows on stderr; None where it is a terminal or a notebook. Raises InputError for what cannot be
used.

>>> from bouncing_disk_ros import basins
>>> basins(axial_forcing=0.34, width=60, height=60)["fraction"]
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import xarray as xr

from bouncing_disk_ros.errors import FailedError
from bouncing_disk_ros.study.runner import run

Place = str | Path | None


def _run(
    name: str, path: Place, workers: int, progress: bool | None, given: dict[str, Any]
) -> xr.Dataset:
    found = run(name, path, workers=workers, progress=progress, **given)
    if found is None:
        raise FailedError(f"{name} was stopped")  # nobody asks it to
    return found


def toss_paths(
    path: Place = None, *, workers: int = 0, progress: bool | None = None, **parameters: object
) -> xr.Dataset:
    """Paths of the tossing hand for pairs of phase lag and amplitude angle (paper, Fig. 1).

    >>> toss_paths(phase_lags=[0.0, -0.785], amplitude_angles=[0.785, 0.785])["arc"]
    """
    return _run("toss_paths", path, workers, progress, parameters)


def toss_map(
    path: Place = None, *, workers: int = 0, progress: bool | None = None, **parameters: object
) -> xr.Dataset:
    """Speed, speed ratio and efficiency of single tosses (paper, Fig. 2).

    Over phase lag and amplitude angle.

    >>> toss_map(phase_lag_count=181, amplitude_angle_count=91)["airborne_speed"].max()
    """
    return _run("toss_map", path, workers, progress, parameters)


def bifurcation(
    path: Place = None, *, workers: int = 0, progress: bool | None = None, **parameters: object
) -> xr.Dataset:
    """Attractors along a parameter: impacts, mean speed, Lyapunov exponent (paper, Fig. 3).

    >>> bifurcation(begin=0.45, end=0.6, count=101, restitution=0.3)["mean_speed"]
    """
    return _run("bifurcation", path, workers, progress, parameters)


def parameter_map(
    path: Place = None, *, workers: int = 0, progress: bool | None = None, **parameters: object
) -> xr.Dataset:
    """Period, Lyapunov exponent and mean speed over two parameters.

    >>> parameter_map(x_axis="axial_forcing", y_axis="restitution", x_count=40, y_count=40)
    """
    return _run("parameter_map", path, workers, progress, parameters)


def motor(
    path: Place = None, *, workers: int = 0, progress: bool | None = None, **parameters: object
) -> xr.Dataset:
    """Speed, torque, efficiency and stall of an ultrasonic motor over two of its parameters.

    >>> motor(x_axis="load_torque", y_axis="preload", x_count=40, y_count=10)["stall_torque"]
    """
    return _run("motor", path, workers, progress, parameters)


def basins(
    path: Place = None, *, workers: int = 0, progress: bool | None = None, **parameters: object
) -> xr.Dataset:
    """The attractor that each start goes to: basins of attraction (paper, Fig. 4).

    >>> result = basins(axial_forcing=0.34, width=60, height=60)
    >>> dict(zip(result["attractor_name"].values, result["fraction"].values))
    """
    return _run("basins", path, workers, progress, parameters)


def basin_shares(
    path: Place = None, *, workers: int = 0, progress: bool | None = None, **parameters: object
) -> xr.Dataset:
    """Shares of the basins over a parameter, with the best phase lag.

    >>> basin_shares(along="restitution", begin=0.2, end=0.8, count=13, samples=50)["fraction"]
    """
    return _run("basin_shares", path, workers, progress, parameters)
