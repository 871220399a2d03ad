"""The studies as functions: parameters in, dataset out.

Each takes the parameters of its table (docs/parameters.md) as keywords, and returns the result as
an `xarray.Dataset`. What all have in common is in `_ABOUT`, which ends each docstring.

>>> from bouncing_disk_ros import basins
>>> basins(axial_forcing=0.34, width=60, height=60)["fraction"]
"""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import Any

import xarray as xr

from bouncing_disk_ros.errors import FailedError
from bouncing_disk_ros.study.runner import run
from bouncing_disk_ros.study_tables import COMMON, STUDY_TABLES

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


def curves(
    path: Place = None, *, workers: int = 0, progress: bool | None = None, **parameters: object
) -> xr.Dataset:
    """Folds, doublings, grazes and onset of contact of orbits in the plane of Γ and ε.

    >>> curves(axial_forcing=0.45, axial_forcing_count=40, restitution_count=40)["curve_kind"]
    """
    return _run("curves", path, workers, progress, parameters)


def manifolds(
    path: Place = None, *, workers: int = 0, progress: bool | None = None, **parameters: object
) -> xr.Dataset:
    """Saddles between basins of attraction with their manifolds, over the basins.

    >>> manifolds(axial_forcing=0.34, width=100, height=100)["saddle_share"]
    """
    return _run("manifolds", path, workers, progress, parameters)


def resilience(
    path: Place = None, *, workers: int = 0, progress: bool | None = None, **parameters: object
) -> xr.Dataset:
    """Fatal impulses and timing errors, times and shares of each attractor over a parameter.

    >>> resilience(begin=0.34, end=0.48, count=8, samples=50)["line_least_fatal_impulse"]
    """
    return _run("resilience", path, workers, progress, parameters)


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
    >>> dict(zip(result["attractor_name"].values.tolist(), result["fraction"].values.tolist()))
    """
    return _run("basins", path, workers, progress, parameters)


def basin_shares(
    path: Place = None, *, workers: int = 0, progress: bool | None = None, **parameters: object
) -> xr.Dataset:
    """Shares of the basins over a parameter, with the best phase lag.

    >>> basin_shares(along="restitution", begin=0.2, end=0.8, count=13, samples=50)["fraction"]
    """
    return _run("basin_shares", path, workers, progress, parameters)


def juggling(
    path: Place = None, *, workers: int = 0, progress: bool | None = None, **parameters: object
) -> xr.Dataset:
    """Which starts each strategy of control brings onto an orbit, under which errors.

    >>> juggling(strategies="none deadbeat", conditions="nominal; delay=0.25")["captured"]
    """
    return _run("juggling", path, workers, progress, parameters)


_ABOUT = """
`path`: the folder of a store that keeps the result; the same call goes on from it. `workers`:
threads that compute, 0 for one on each core. `progress`: whether a bar shows on stderr; None where
it is a terminal or a notebook. Raises InputError for what cannot be used. `preset` and `bag` are
of the command alone. Parameters, with their defaults:
"""


def _parameter_lines(name: str) -> list[str]:
    specs = (spec for spec in STUDY_TABLES[name].values() if spec.name not in COMMON)
    return [
        f"- `{spec.name}` ({f'{spec.default!r} {spec.shown_unit}'.rstrip()}): {spec.description}"
        for spec in specs
    ]


for _study in (
    toss_paths, toss_map, bifurcation, parameter_map, curves, motor, basins, manifolds,
    basin_shares, resilience, juggling,
):  # fmt: skip
    _text = "\n".join([*_ABOUT.splitlines(), "", *_parameter_lines(_study.__name__), ""])
    _study.__doc__ = f"{inspect.cleandoc(_study.__doc__ or '')}\n{_text}"
