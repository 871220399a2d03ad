"""What maps share: colours, axes in units of π, a raster within a vector figure."""

from __future__ import annotations

from typing import Any

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MultipleLocator

# Okabe and Ito's colours, told apart by colour-blind people too
BLUE, ORANGE, GREEN, VERMILION = "#0072B2", "#E69F00", "#009E73", "#D55E00"
SKY, YELLOW, PURPLE, GREY, BLACK = "#56B4E9", "#F0E442", "#CC79A7", "#999999", "#000000"


def new_figure(width: float, height: float) -> Figure:
    """An empty figure (inches) that needs no screen."""
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def in_pi(axis: Any, step: float = 0.5) -> None:
    """Label an axis whose unit is π in steps of that many."""
    axis.set_major_locator(MultipleLocator(step))
    axis.set_major_formatter(FuncFormatter(lambda x, _: "0" if x == 0 else f"{x:g}π"))
