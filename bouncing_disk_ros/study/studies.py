"""The studies by name: for Python; their executables have options."""

from __future__ import annotations

from typing import Any

from bouncing_disk_ros.errors import InputError, closest
from bouncing_disk_ros.executables import STUDIES, loaded, module_of
from bouncing_disk_ros.study.definition import Study
from bouncing_disk_ros.study.study_definition import StudyDefinition


def definition_of(name: str) -> StudyDefinition[Any]:
    """What the study called `name` is; InputError for another name."""
    if name not in STUDIES:
        raise InputError("study", name, ", ".join(STUDIES), closest(name, STUDIES))
    found: StudyDefinition[Any] = loaded(f"{module_of(name)}:DEFINITION")
    return found


def named(name: str, **given: object) -> Study:
    """The study called `name` with the parameters given and the defaults of docs/parameters.md.

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
    made: Study = definition.study()(values)
    definition.refuse_idle(values)
    return made
