"""The workbench's map: views of basins, and from a click to the orbit."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator

import numpy as np
from bokeh.events import Tap

from bench.processor import work
from bench.table import Aim, Row, row
from bouncing_disk_ros.maps.next_collision import NextCollisionMap
from bouncing_disk_ros.parameters import DEFAULTS
from bouncing_disk_ros.workbench.basin_pane import FULL, BasinPane, view
from bouncing_disk_ros.workbench.start_plane import Window, whole_window
from support.bokeh_page import BokehPage

PART = "workbench"
AIMS = {0.45: 0.15, 0.55: 0.6}
VIEWS, CLICKS = 40, 60
SMALLEST = 1e-6
"""Windows are squares about random starts, from this half-width to the whole plane."""


def measure() -> list[Row]:
    """The rows of this part."""
    rows = []
    for axial_forcing, aim in AIMS.items():
        first, *seconds = _views(axial_forcing)
        name = f"view of basins {FULL} × {FULL}, Γ = {axial_forcing}"
        rows += [
            row(PART, f"{name}, any zoom", "s of the processor", seconds),
            row(
                PART,
                f"{name}: 95 % within",
                "s of the processor",
                [_most(seconds)],
                Aim(at_most=work(aim)),
            ),
            row(
                PART,
                f"{name}: the first, which finds the attractors",
                "s of the processor",
                [first],
            ),
        ]
    clicks = _clicks()
    return [
        *rows,
        row(PART, "click to orbit", "ms", clicks),
        row(PART, "click to orbit: 95 % within", "ms", [_most(clicks)], Aim(at_most=work(100.0))),
    ]


def _most(values: list[float]) -> float:
    return float(np.percentile(values, 95))


def _windows() -> Iterator[Window]:
    whole = whole_window()
    yield whole
    draw = np.random.default_rng(512)
    for _ in range(VIEWS):
        phase, velocity = draw.uniform(*whole[:2]), draw.uniform(*whole[2:])
        half = min(math.exp(draw.uniform(math.log(SMALLEST), math.log(2.5))), -velocity)
        yield Window(phase - half, phase + half, velocity - half, velocity + half)


def _views(axial_forcing: float) -> list[float]:
    """Seconds of the processor."""
    view(NextCollisionMap(0.5, 0.5), whole_window(), 16)  # what is compiled is loaded
    found = []
    for window in _windows():
        begin = time.thread_time()
        view(NextCollisionMap(axial_forcing, 0.5), window, FULL)
        found.append(time.thread_time() - begin)
    return found


def _clicks() -> list[float]:
    """ms from the event to the orbit on the page's document, without the way to the browser."""
    values = {name: value for name, value in DEFAULTS.items() if isinstance(value, float)}
    pane = BasinPane(lambda: values, lambda _: None)
    page = BokehPage(pane)
    pane.parameters_changed()
    page.settle()
    draw, found = np.random.default_rng(100), []
    for _ in range(CLICKS):
        place = draw.uniform(0.0, math.tau), draw.uniform(-5.0, 0.0)
        begin = time.perf_counter()
        page.trigger(Tap(pane.plot, x=place[0], y=place[1]))
        found.append(1e3 * (time.perf_counter() - begin))
    return found
