"""Studies by name, with the defaults of their table: for Python; nodes have their options."""

from __future__ import annotations

import importlib

from bouncing_disk_ros.errors import InputError, closest
from bouncing_disk_ros.parameters import listed_text
from bouncing_disk_ros.study.definition import Study
from bouncing_disk_ros.study_tables import LISTS, STUDY_TABLES, refuse_idle, refuse_not_taken

_MODULES = {
    "basin_shares": ("study.basin_shares.compute", "BasinShares"),
    "basins": ("study.basins.compute", "Basins"),
    "bifurcation": ("study.bifurcation.compute", "Bifurcation"),
    "curves": ("resilience_studies.curves.compute", "Curves"),
    "juggling": ("juggling.compute", "Juggling"),
    "manifolds": ("resilience_studies.manifolds.compute", "Manifolds"),
    "motor": ("motor_study.compute", "Motor"),
    "parameter_map": ("study.parameter_map.compute", "ParameterMap"),
    "resilience": ("resilience_studies.resilience.compute", "ResilienceStudy"),
    "toss_map": ("study.toss_map.compute", "TossMap"),
    "toss_paths": ("study.toss_paths.compute", "TossPaths"),
}
"""Study -> its module and class; loaded when asked for."""


def named(name: str, **given: object) -> Study:
    """The study called `name` with the parameters given and the defaults of docs/parameters.md.

    Numbers of NumPy are numbers; where a list of numbers is a text, a sequence is taken too.
    Raises InputError for an unknown name, or a value that cannot be used.

    >>> named("basins", axial_forcing=0.34, width=60, height=60)
    """
    if name not in STUDY_TABLES:
        raise InputError("study", name, ", ".join(STUDY_TABLES), closest(name, STUDY_TABLES))
    table = STUDY_TABLES[name]
    refuse_not_taken(name, given)
    for key in given:
        if key not in table:
            raise InputError("parameter", key, ", ".join(table), closest(key, table))
    given = {key: listed_text(one) if key in LISTS else one for key, one in given.items()}
    values = {key: spec.checked(given.get(key, spec.default)) for key, spec in table.items()}
    module = importlib.import_module(f"bouncing_disk_ros.{_MODULES[name][0]}")
    made: Study = getattr(module, _MODULES[name][1])(values)
    refuse_idle(name, values)
    return made
