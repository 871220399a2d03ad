"""Small studies as a user sees them: figures, lines and result."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType

import xarray as xr
from matplotlib.figure import Figure

from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.study import named, run

Shown = tuple[dict[str, Figure], list[str], xr.Dataset]


def shown(path: Path, tool: ModuleType, **given: Value) -> Shown:
    """The figures, all drawn, the lines and the result of a small study."""
    study = named(tool.DEFINITION.name, **given)
    result = run(study, path / "r.zarr")
    assert result is not None
    figures = dict(tool.DEFINITION.pictures(study, result))
    for figure in figures.values():
        figure.set_layout_engine("none")  # takes three times as long as the rest
        figure.draw_without_rendering()
        assert "(1)" not in text_of(figure), "an axis has the unit 1"
    return figures, told(tool, result), result


def told(tool: ModuleType, result: xr.Dataset) -> list[str]:
    """The printed lines of a result."""
    lines: list[str] = tool.DEFINITION.lines(result)
    assert all("\n" not in line for line in lines)
    return lines


def text_of(figure: Figure) -> str:
    """Titles, labels and legends."""
    found = [str(figure.get_suptitle())]
    for axes in figure.axes:
        legend = axes.get_legend()
        found += [text.get_text() for text in legend.get_texts()] if legend else []
        found += [axes.get_title(), axes.get_xlabel(), axes.get_ylabel()]
    return "\n".join(found)
