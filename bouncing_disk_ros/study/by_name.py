"""Studies by name: their definitions, themselves with parameters, and figures of their results.

Imports nothing heavy: computation and pictures are loaded when they are asked for.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from bouncing_disk_ros.errors import InputError, closest
from bouncing_disk_ros.executables import STUDIES, loaded, module_of
from bouncing_disk_ros.study.definition import StudyDefinition

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from bouncing_disk_ros.study.computation import Study


def definition_of(name: str) -> StudyDefinition:
    """What the study called `name` is; InputError for another name."""
    if name not in STUDIES:
        raise InputError("study", name, ", ".join(STUDIES), closest(name, STUDIES))
    found: StudyDefinition = loaded(f"{module_of(name)}:DEFINITION")
    return found


def named(name: str, **given: object) -> Study:
    """Study called `name`, with the parameters given and the defaults of docs/parameters.md.

    Numbers of NumPy are numbers; where a list of numbers is a text, a sequence is taken too.
    Raises InputError for an unknown name, or a value that cannot be used.

    >>> named("basins", axial_forcing=0.34, width=60, height=60)
    """
    definition = definition_of(name)
    table = definition.options
    definition.refuse_not_taken(given)
    for key in given:
        if key not in table:
            raise InputError("parameter", key, ", ".join(table), closest(key, table))
    values = {key: spec.checked(given.get(key, spec.default)) for key, spec in table.items()}
    made = definition.make(values)
    definition.refuse_idle(values)
    return made


def figures(result: xr.Dataset) -> dict[str, Figure]:
    """Figures of a study's result by name, as the study's command stores them.

    As the last line of a notebook's cell they are shown. `result` comes from a study (`basins`,
    `bifurcation` ...) or from its result.nc; its attributes say which study it is. Raises
    InputError where they do not.

    >>> figures(bifurcation(restitution=0.3, begin=0.0, count=201))["bifurcation"].savefig("f.pdf")
    """
    identity = getattr(result, "attrs", {}).get("identity", {})
    if isinstance(identity, str):
        identity = json.loads(identity)  # from NetCDF
    name = str(identity.get("study", ""))
    if name not in STUDIES:
        given = f"{type(result).__name__} without the name of a study"
        raise InputError("result", given, "the dataset that a study gave")
    from bouncing_disk_ros.matplotlib_figures import Figures  # not for --help

    study = named(name, **identity["parameters"])
    return Figures(definition_of(name).pictures(study, result))
