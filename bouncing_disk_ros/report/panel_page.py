"""Panels drawn with matplotlib: one in given axes, or several as a page for PNG, SVG and PDF."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from bouncing_disk_ros.matplotlib_figures import light_grid, mark_in_pi, new_figure, typeset
from bouncing_disk_ros.report.panel import Panel, Series, SeriesStyle
from bouncing_disk_ros.report.report_files import mark_of

_RASTER = 3000
"""Points from which on a series in a file of vectors is drawn as an image."""
_COLUMNS, _LEGEND_LINE = 2, 11.5
"""Of a legend: columns, and the height of a line in points."""
_METADATA = {"png": "Software", "svg": "Creator", "pdf": "Creator"}


def panels_page(title: str, subtitle: str, drawn: Sequence[tuple[Panel, str]]) -> Figure:
    """Panels, with the reason why one is empty: two in a row; the last of an odd number has one."""
    names = [str(place) for place in range(len(drawn))]
    pairs = [(*names[place : place + 2], names[-1])[:2] for place in range(0, len(names), 2)]
    panels = {name: panel for name, (panel, _) in zip(names, drawn, strict=True)}
    absences = {name: absence for name, (_, absence) in zip(names, drawn, strict=True)}
    heading = f"{_plain(title)}\n{typeset(_plain(subtitle))}"
    size = 10.0, 4.3 * len(pairs)
    figure, _ = panels_figure(heading, size, dict.fromkeys(pairs, 1.0), panels, absences)
    return figure


def panels_figure(
    title: str, size: tuple[float, float], rows: Mapping[tuple[str, ...], float],
    panels: Mapping[str, Panel], absences: Mapping[str, str] | None = None,
) -> tuple[Figure, Mapping[str, Any]]:  # fmt: skip
    """A figure of panels by name, and the axes of each. `absences`: why one is empty.

    `rows`: the names in each row, twice that of a panel as wide as two, and how high the row is.
    """
    figure = new_figure(*size)
    axes = figure.subplot_mosaic([list(row) for row in rows], height_ratios=list(rows.values()))
    for name, panel in panels.items():
        draw_panel(axes[name], panel, (absences or {}).get(name, "nothing recorded"))
    figure.suptitle(title, fontsize=12)
    return figure, axes


def save_page(figure: Figure, path: Path, maker: str) -> None:
    """Write it in the kind of the file's name, marked as of an executable. Raises OSError."""
    kind = path.suffix[1:]
    figure.savefig(path, dpi=150, metadata={_METADATA[kind]: mark_of(maker)})


def _plain(text: str) -> str:
    """A name as it is: no sign of it means anything to matplotlib."""
    return text.replace("$", r"\$")


def draw_panel(axes: Any, panel: Panel, absence: str) -> None:
    """Draw a panel; in an empty one stands `absence`, the reason."""
    axes.set_xlabel(typeset(panel.x_label))
    axes.set_ylabel(typeset(panel.y_label))
    has_legend = len(panel.series) > 1 and not panel.is_empty
    strip = math.ceil(len(panel.series) / _COLUMNS) * _LEGEND_LINE if has_legend else 0.0
    axes.set_title(typeset(panel.title), fontsize=11, pad=6.0 + strip)
    if panel.is_empty:
        axes.text(0.5, 0.5, absence, transform=axes.transAxes, ha="center", color="#555")
        axes.set_xticks([])
        axes.set_yticks([])
        return
    for begin, end in panel.spans:
        axes.axvspan(begin, end, color="#999999", alpha=0.25, lw=0)
    for at in panel.lines:
        axes.axvline(at, color="#999999", lw=0.8)
    for part in panel.series:
        _draw_series(axes, part)
    _scales(axes, panel)
    light_grid(axes)
    if has_legend:  # between title and axes, where it covers no curve
        legend = axes.legend(
            fontsize=8, ncols=_COLUMNS, loc="lower left", bbox_to_anchor=(0.0, 1.0), frameon=False,
            borderaxespad=0.0, borderpad=0.2, labelspacing=0.3, columnspacing=1.5,
        )  # fmt: skip
        for handle in legend.legend_handles:
            handle.set_markersize(min(max(handle.get_markersize(), 4.0), 8.0))
    if panel.note:
        note = "\n".join(textwrap.wrap(panel.note, 75))
        axes.text(1.0, -0.19, note, transform=axes.transAxes, ha="right", va="top", fontsize=7,
                  color="#555555")  # fmt: skip


def _scales(axes: Any, panel: Panel) -> None:
    if panel.y_is_log:
        axes.set_yscale("log")
    x, y = panel.limits
    axes.set(**{name: ends for name, ends in (("xlim", x), ("ylim", y)) if ends is not None})
    if not panel.y_is_log and not panel.y_is_phase:
        axes.yaxis.get_major_formatter().set_useOffset(False)
    for is_phase, axis in ((panel.x_is_phase, axes.xaxis), (panel.y_is_phase, axes.yaxis)):
        if is_phase:
            mark_in_pi(axis, 0.5, math.pi)


def _draw_series(axes: Any, part: Series) -> None:
    color, count = part.colour, len(part.x)
    label = typeset(_plain(part.name))
    many = {"rasterized": count > _RASTER}
    match part.look:
        case SeriesStyle.POINTS:
            size = (4.0, 2.0, 1.2)[part.crowding]
            axes.plot(part.x, part.y, "o", color=color, ms=size, mew=0, label=label, **many)
        case SeriesStyle.LINE | SeriesStyle.WIDE:
            width = 1.4 if part.look is SeriesStyle.LINE else 4.0
            axes.plot(part.x, part.y, color=color, lw=width, label=label, **many)
        case SeriesStyle.DASHED:
            axes.plot(part.x, part.y, "--", color=color, lw=1.4, label=label, zorder=3)
        case SeriesStyle.RINGS:
            size, width = ((8.0, 1.4), (5.0, 1.0), (3.0, 0.7))[part.crowding]
            axes.plot(part.x, part.y, "o", mfc="none", color=color, ms=size, mew=width,
                      label=label, zorder=4, **many)  # fmt: skip
        case SeriesStyle.CROSSES:
            axes.plot(part.x, part.y, "+", color=color, ms=14, mew=1.6, label=label, zorder=5)
