"""Studies by name, with the defaults of their table: for Python; nodes have their options."""

from __future__ import annotations

import importlib

from bouncing_disk_ros.errors import InputError, closest
from bouncing_disk_ros.parameters import listed_text
from bouncing_disk_ros.study.definition import Study
from bouncing_disk_ros.study_tables import LISTS, STUDY_TABLES, refuse_idle, refuse_not_taken

_MODULES = {
    "basin_shares": ("basin_shares_study", "BasinShares"),
    "basins": ("basin_study", "Basins"),
    "bifurcation": ("bifurcation_study", "Bifurcation"),
    "curves": ("curves_study", "Curves"),
    "juggling": ("juggling_study", "Juggling"),
    "manifolds": ("manifolds_study", "Manifolds"),
    "motor": ("motor_study", "Motor"),
    "parameter_map": ("parameter_map_study", "ParameterMap"),
    "resilience": ("resilience_study", "ResilienceStudy"),
    "toss_map": ("toss_map_study", "TossMap"),
    "toss_paths": ("toss_paths_study", "TossPaths"),
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
    module = importlib.import_module(f"bouncing_disk_ros.study.{_MODULES[name][0]}")
    made: Study = getattr(module, _MODULES[name][1])(values)
    refuse_idle(name, values)
    return made
