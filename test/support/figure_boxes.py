"""Flaws of a figure: texts that cover each other or are cut, numbers as a program writes them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import combinations
from typing import Any

import numpy as np
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure
from matplotlib.text import Text

from bouncing_disk_ros.units import INDEXED

_TOUCH = 1.0
"""Pixels by which the boxes of two texts may overlap: their margins."""


def flaws(figure: Figure) -> list[Any]:
    """All that is wrong by the functions below: texts and rasters."""
    return [*covered(figure), *cut(figure), *ill_written(figure), *lost_cells(figure)]


def covered(figure: Figure) -> list[tuple[str, str]]:
    """Pairs of texts whose boxes intersect, or lie under a legend, as the figure is drawn."""
    figure.draw_without_rendering()
    boxes = [(text.get_text(), text.get_window_extent()) for text in _texts(figure)]
    legends = [*figure.legends, *filter(None, (axes.get_legend() for axes in figure.axes))]
    boxes += [("a legend", legend.get_window_extent()) for legend in legends]
    return [
        (one, other)
        for (one, a), (other, b) in combinations(boxes, 2)
        if min(a.x1, b.x1) - max(a.x0, b.x0) > _TOUCH and min(a.y1, b.y1) - max(a.y0, b.y0) > _TOUCH
    ]


def cut(figure: Figure) -> list[str]:
    """Texts that reach beyond the figure, drawn before by `covered`."""
    size = figure.bbox
    boxes = [(text.get_text(), text.get_window_extent()) for text in _texts(figure)]
    return [
        text for text, box in boxes
        if min(box.x0 - size.x0, box.y0 - size.y0, size.x1 - box.x1, size.y1 - box.y1) < -_TOUCH
    ]  # fmt: skip


_BY_PROGRAMS = re.compile(r"\d\.?e[+-]?\d|(?<![\w)])-[\d.]*\d")
"""1e+04, and a hyphen before a number."""


def ill_written(figure: Figure) -> list[str]:
    """Texts with 1e-07 for 10⁻⁷, a hyphen for a minus or w_A on one line, as drawn by `covered`."""
    texts = {text.get_text() for text in figure.findobj(Text) if _is_seen(text)}
    plain = {text: re.sub(r"\$[^$]*\$", "", text) for text in texts}
    return [
        text for text, rest in plain.items() if _BY_PROGRAMS.search(rest) or INDEXED.search(rest)
    ]


def lost_cells(figure: Figure) -> list[tuple[str, int]]:
    """Rasters of more rows or columns than pixels, drawn by `covered`: lines in them have gaps."""
    found = []
    for axes in (one for one in figure.axes if one.get_label() != "<colorbar>"):
        for mesh in (one for one in axes.collections if isinstance(one, QuadMesh)):
            rows, columns = (count - 1 for count in np.shape(mesh.get_coordinates())[:2])
            box, size = axes.bbox, 100.0 / figure.dpi  # a small file
            if rows > box.height * size or columns > box.width * size:
                found.append((axes.get_ylabel(), rows))
    return found


def _texts(figure: Figure) -> Iterator[Text]:
    for axes in figure.axes:
        if not axes.get_visible():
            continue
        own = [axes.title, axes.xaxis.label, axes.yaxis.label, *axes.texts]
        ticks = [*_tick_labels(axes.xaxis), *_tick_labels(axes.yaxis)] if axes.axison else []
        yield from filter(_is_seen, [*own, *ticks])
    yield from filter(_is_seen, [*figure.texts])


def _is_seen(text: Text) -> bool:
    return text.get_visible() and bool(text.get_text().strip())


def _tick_labels(axis: Any) -> Iterator[Text]:
    low, high = sorted(axis.get_view_interval())
    for tick in axis.get_major_ticks():
        if low <= tick.get_loc() <= high:
            yield from (label for label in (tick.label1, tick.label2) if label.get_visible())
