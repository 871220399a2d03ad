"""`figures`: what the command of a study draws, from its result alone."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.executables import STUDIES
from bouncing_disk_ros.study.studies import definition_of, named

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


def figures(result: xr.Dataset) -> dict[str, Figure]:
    """Figures of a study's result by name: those that the study's command stores.

    `result` comes from a study (`basins`, `bifurcation` ...) or from its result.nc; its attributes
    say which study it is. Raises InputError where they do not.

    >>> figures(bifurcation(restitution=0.3, begin=0.0, count=201))["bifurcation"].savefig("f.pdf")
    """
    identity = getattr(result, "attrs", {}).get("identity", {})
    if isinstance(identity, str):
        identity = json.loads(identity)  # from NetCDF
    name = str(identity.get("study", ""))
    if name not in STUDIES:
        given = f"{type(result).__name__} without the name of a study"
        raise InputError("result", given, "the dataset that a study gave")
    study = named(name, **identity["parameters"])
    return dict(definition_of(name).pictures(study, result))
