"""`figures`: what the command of a study draws, from its result alone."""

from __future__ import annotations

import importlib
import json
from typing import TYPE_CHECKING

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.executables import entry_point
from bouncing_disk_ros.study import named
from bouncing_disk_ros.study_tables import STUDY_TABLES

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from bouncing_disk_ros.study.study_tool import StudyTool


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
    if name not in STUDY_TABLES:
        given = f"{type(result).__name__} without the name of a study"
        raise InputError("result", given, "the dataset that a study gave")
    study = named(name, **identity["parameters"])
    tool: StudyTool = importlib.import_module(entry_point(name).split(":")[0]).TOOL
    return dict(tool.make_view().pictures(study, result))
