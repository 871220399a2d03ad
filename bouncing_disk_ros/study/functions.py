"""The studies as functions: parameters in, dataset out.

Each takes the parameters of its table (docs/parameters.md) as keywords, and returns the result as
an `xarray.Dataset`. What all have in common is in `_ABOUT`, which ends each docstring.

>>> from bouncing_disk_ros import basins
>>> basins(axial_forcing=0.34, width=60, height=60)["fraction"]
"""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

import xarray as xr

from bouncing_disk_ros.errors import FailedError
from bouncing_disk_ros.executables import STUDIES
from bouncing_disk_ros.study.runner import run
from bouncing_disk_ros.study.studies import definition_of

Place = str | Path | None
_ABOUT = """
`path`: the folder of a store that keeps the result; the same call goes on from it. `workers`:
threads that compute, 0 for one on each core. `progress`: whether a bar shows on stderr; None where
it is a terminal or a notebook. Raises InputError for what cannot be used. `preset` and `bag` are
of the command alone. Parameters, with their defaults:
"""


class StudyFunction(Protocol):
    """A study as a function."""

    __name__: str

    def __call__(
        self,
        path: Place = None,
        *,
        workers: int = 0,
        progress: bool | None = None,
        **parameters: object,
    ) -> xr.Dataset:
        """Run the study; what it takes and returns is in its own docstring."""
        ...


def __getattr__(name: str) -> StudyFunction:
    """Make the function of a study when it is first used (PEP 562)."""
    if name not in STUDIES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    function = _function(name)
    globals()[name] = function
    return function


def __dir__() -> list[str]:
    """List the functions, made or not."""
    return sorted({*STUDIES, *globals()})


def _function(name: str) -> StudyFunction:
    definition = definition_of(name)

    def function(
        path: Place = None, *, workers: int = 0, progress: bool | None = None, **parameters: object
    ) -> xr.Dataset:
        found = run(name, path, workers=workers, progress=progress, **parameters)  # type: ignore[arg-type]
        if found is None:
            raise FailedError(f"{name} was stopped")  # nobody asks it to
        return found

    lines = [
        f"- `{spec.name}` ({f'{spec.default!r} {spec.shown_unit}'.rstrip()}): {spec.description}"
        for spec in definition.specs
    ]
    function.__name__ = function.__qualname__ = name
    text = "\n".join([*_ABOUT.splitlines(), "", *lines, ""])
    function.__doc__ = f"{definition.function.strip()}\n{text}"
    return function
