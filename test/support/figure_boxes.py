"""Texts of a figure that cover each other."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations
from typing import Any

from matplotlib.figure import Figure
from matplotlib.text import Text

_TOUCH = 1.0
"""Pixels by which the boxes of two texts may overlap: their margins."""


def covered(figure: Figure) -> list[tuple[str, str]]:
    """Pairs of texts whose boxes intersect, or lie under a legend, as the figure is drawn."""
    figure.canvas.draw()
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


def _texts(figure: Figure) -> Iterator[Text]:
    for axes in figure.axes:
        if not axes.get_visible():
            continue
        own = [axes.title, axes.xaxis.label, axes.yaxis.label, *axes.texts]
        yield from filter(_is_seen, [*own, *_tick_labels(axes.xaxis), *_tick_labels(axes.yaxis)])
    yield from filter(_is_seen, [*figure.texts])


def _is_seen(text: Text) -> bool:
    return text.get_visible() and bool(text.get_text().strip())


def _tick_labels(axis: Any) -> Iterator[Text]:
    low, high = sorted(axis.get_view_interval())
    for tick in axis.get_major_ticks():
        if low <= tick.get_loc() <= high:
            yield from (label for label in (tick.label1, tick.label2) if label.get_visible())
