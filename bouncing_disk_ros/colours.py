"""The colours of all figures: Okabe and Ito's, which colour-blind people can distinguish.

Ticks, labels and files of the figures are in `matplotlib_figures`.
"""

from __future__ import annotations

from collections.abc import Sequence

BLUE, ORANGE, GREEN, VERMILION = "#0072B2", "#E69F00", "#009E73", "#D55E00"
SKY, YELLOW, PURPLE, GREY, BLACK = "#56B4E9", "#F0E442", "#CC79A7", "#999999", "#000000"

DISK, PLATFORM, THEORY = BLUE, ORANGE, VERMILION
"""The same in every figure and on the page."""
INK = "#444444"
"""Of values that belong to no attractor, beside attractors in their colours."""
REST_AREA, CONTACT_AREA, UNRESOLVED_AREA = "#f3ead8", "#d9d9d9", "#777777"
"""Areas of a map: a disk at rest, an attractor with contact, no decision. White is the 0 of a
scale."""
ABSENT = "#e8e8e8"
"""The ground where a map has no value."""
GRID = "#dddddd"
VALUES_SCALE, SIGNED_SCALE = "viridis", "RdBu_r"
"""Scales of maps by matplotlib's names: of values from the least on, and of both signs about 0."""
ATTRACTORS = (BLUE, ORANGE, GREEN, PURPLE, SKY, VERMILION, YELLOW)
"""The period-1 orbit, mostly the first of these, is dark on light as in the paper."""


def attractor_colours(names: Sequence[str]) -> list[str]:
    """One colour for each attractor: light for rest and chattering, strong for the others."""
    strong = iter(ATTRACTORS * (1 + len(names) // len(ATTRACTORS)))
    plain = {"rest": REST_AREA, "chattering": CONTACT_AREA}
    return [plain.get(name.split()[0]) or next(strong) for name in names]
