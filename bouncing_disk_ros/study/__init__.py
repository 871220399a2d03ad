"""Long computations in parts: stored as they grow, resumed, on all cores or on many machines.

A `Study` says what is computed; `run` computes what its store does not hold yet. The names are
loaded when first used: the help of a study needs none of them.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bouncing_disk_ros.study.computation import Arrays, Axis, Field, Region, Study
    from bouncing_disk_ros.study.definition import named
    from bouncing_disk_ros.study.exports import export, export_tables
    from bouncing_disk_ros.study.runner import Progress, run
    from bouncing_disk_ros.study.store import open_result

_PUBLIC = {
    "computation": "Arrays Axis Field Region Study",
    "runner": "Progress run",
    "store": "open_result",
    "exports": "export export_tables",
    "definition": "named",
}
_HOMES = {name: module for module, names in _PUBLIC.items() for name in names.split()}
__all__ = [
    "Arrays", "Axis", "Field", "Progress", "Region", "Study", "export", "export_tables",
    "named", "open_result", "run",
]  # fmt: skip


def __getattr__(name: str) -> object:
    """Load a public name when it is first used (PEP 562)."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value: object = getattr(importlib.import_module(f"{__name__}.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """List the public names, loaded or not."""
    return sorted({*__all__, *(name for name in globals() if name.startswith("__"))})
