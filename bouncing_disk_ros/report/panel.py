"""A panel of a report: its series, its axes, and which points are left out where there are many.

Beside it the table, of what a report says in words.

`report_html` draws panels with Bokeh, `panel_page` with matplotlib.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bouncing_disk_ros.colours import BLUE, GREEN, GREY, ORANGE, PURPLE, VERMILION
from bouncing_disk_ros.units import in_pi

SEED = 20090  # any; fixed so that a report can be made again
Column = NDArray[np.float64]
Pairs = list[tuple[str, str]]
Limits = tuple[float, float] | None
"""The ends of an axis; None: where its data end."""
COLOURS = (BLUE, VERMILION, GREEN, ORANGE, GREY, PURPLE)
PHASE_TICKS = [k * math.pi / 2.0 for k in range(5)]
PHASE_TEXTS = [in_pi(0.5 * k) for k in range(5)]
_LEAST_RANGE = 1e-6
"""Values that differ by less than this part of their size are drawn as equal."""
_FEW, _SOME = 200, 1000
"""Points at up to so many places are drawn large, or of middle size."""


class Table(NamedTuple):
    """A heading and its lines: what, and its value in words."""

    title: str
    rows: Pairs


class SeriesStyle(StrEnum):
    """How a series is drawn."""

    POINTS = "points"
    LINE = "line"
    WIDE = "wide"  # a line that one of LINE may run on
    DASHED = "dashed"
    RINGS = "rings"
    CROSSES = "crosses"


@dataclass(frozen=True)
class Series:
    """One set of data; `number` is its colour's in COLOURS: 0 the main one."""

    name: str
    x: Column
    y: Column
    look: SeriesStyle
    number: int = 0

    @property
    def colour(self) -> str:
        """Its colour, #rrggbb."""
        return COLOURS[self.number]

    @property
    def crowding(self) -> int:
        """0, 1, 2: its points lie at few, some or many places; the more, the smaller they are."""
        at = places(self)
        return (at >= _FEW) + (at >= _SOME)


@dataclass(frozen=True)
class Panel:
    """One set of axes; labels have symbol and unit, and mark an index by _ (w_A, τ_(n+1))."""

    title: str
    x_label: str
    y_label: str
    series: Sequence[Series]
    note: str = ""  # what to know when reading it: thinning, what is absent
    spans: Sequence[tuple[float, float]] = ()  # of x, shaded
    lines: Sequence[float] = ()  # of x, marked
    x_range: tuple[float, float] | None = None
    x_is_phase: bool = False  # 0 to 2π
    y_is_phase: bool = False
    y_is_log: bool = False
    topics: tuple[str, ...] = ()  # what it is drawn from

    @property
    def is_empty(self) -> bool:
        """Whether there is nothing to draw."""
        return not any(len(series.x) for series in self.series)

    @property
    def limits(self) -> tuple[Limits, Limits]:
        """The ends of the axes of x and y; values that are nearly equal are not drawn apart."""
        turn = PHASE_TICKS[0], PHASE_TICKS[-1]
        x = turn if self.x_is_phase else self.x_range
        return x, turn if self.y_is_phase else None if self.y_is_log else self._wide()

    def _wide(self) -> Limits:
        drawn = [part.y[np.isfinite(part.y)] for part in self.series]
        values = np.concatenate([part for part in drawn if len(part)] or [np.zeros(0)])
        if not len(values):
            return None
        low, high = float(np.min(values)), float(np.max(values))
        size = max(abs(low), abs(high))
        if high - low > _LEAST_RANGE * size or size == 0.0:
            return None
        return low - 0.05 * size, high + 0.05 * size


def series(
    name: str, x: ArrayLike, y: ArrayLike, look: SeriesStyle = SeriesStyle.POINTS, colour: int = 0
) -> Series:
    """A series of anything like an array."""
    return Series(name, np.asarray(x, float), np.asarray(y, float), look, colour)


def spread(count: int, most: int) -> NDArray[np.intp]:
    """Places of at most `most` of `count` points, at random (a stride could hide a period)."""
    if count <= most:
        return np.arange(count)
    chosen = np.random.default_rng(SEED).choice(count, most, replace=False)
    return np.sort(chosen)


def envelope(values: Column, most: int) -> NDArray[np.intp]:
    """Places of the least and the greatest of each of `most`/2 groups of neighbours, in order."""
    if len(values) <= most:
        return np.arange(len(values))
    edges = np.linspace(0, len(values), most // 2 + 1).astype(int)
    places = {0, len(values) - 1}
    for first, last in pairwise(edges):
        part = values[first:last]
        places |= {int(first + np.argmin(part)), int(first + np.argmax(part))}
    return np.array(sorted(places))


def with_gaps(x: Column, y: Column, after: float) -> tuple[Column, Column]:
    """The same line, broken (nan) where neighbours in x lie further apart than `after`."""
    return broken(x, y, np.flatnonzero(np.diff(x) > after) + 1)


def broken(x: Column, y: Column, before: NDArray[np.intp]) -> tuple[Column, Column]:
    """The same line, broken (nan) before the points at some places."""
    return np.insert(x, before, np.nan), np.insert(y, before, np.nan)


def places(part: Series, cells: int = 400) -> int:
    """At how many different places of its panel the points of a series lie; so dots are sized."""
    seen = []
    for values in (part.x, part.y):
        width = float(np.ptp(values)) if len(values) else 0.0
        seen.append(
            np.round((values - values.min()) / width * cells) if width > 0.0 else 0 * values
        )
    return len(np.unique(np.stack(seen), axis=1).T)
