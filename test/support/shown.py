"""Small studies as a user sees them: figures, lines and result."""

from __future__ import annotations

from types import ModuleType

import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.study import named, run
from support.checks import there

Shown = tuple[dict[str, Figure], list[str], xr.Dataset]


def result_of(name: str, **given: Value) -> xr.Dataset:
    """The result of a study with these parameters, kept in memory."""
    return there(run(named(name, **given)))


def undrawn(tool: ModuleType, **given: Value) -> Shown:
    """The figures, the lines and the result of a small study."""
    study = named(tool.DEFINITION.name, **given)
    result = there(run(study))
    figures = dict(tool.DEFINITION.pictures(study, result))
    for figure in figures.values():
        figure.set_layout_engine("none")  # takes three times as long as the rest
        assert "(1)" not in text_of(figure), "an axis has the unit 1"
    return figures, told(tool, result), result


def shown(tool: ModuleType, **given: Value) -> Shown:
    """As `undrawn`, with all figures drawn."""
    made = undrawn(tool, **given)
    for figure in made[0].values():
        drawn(figure)
    return made


def drawn(figure: Figure) -> None:
    """Draw a figure without its layout."""
    figure.set_layout_engine("none")
    figure.draw_without_rendering()


def told(tool: ModuleType, result: xr.Dataset) -> list[str]:
    """The printed lines of a result."""
    lines: list[str] = tool.DEFINITION.lines(result)
    assert all("\n" not in line for line in lines)
    return lines


def legend_of(axes: Axes) -> list[str]:
    """The texts of a legend."""
    legend = axes.get_legend()
    assert legend is not None, axes.get_ylabel()
    return [text.get_text() for text in legend.get_texts()]


def text_of(figure: Figure) -> str:
    """Titles, labels and legends."""
    found = [str(figure.get_suptitle())]
    for axes in figure.axes:
        legend = axes.get_legend()
        found += [text.get_text() for text in legend.get_texts()] if legend else []
        found += [axes.get_title(), axes.get_xlabel(), axes.get_ylabel()]
    return "\n".join(found)
