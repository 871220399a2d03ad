"""Angles: as people write them, 0.25pi is π/4, and the shortest way from one to another."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from bouncing_disk_ros.errors import InputError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


def angle_of(text: str) -> float | None:
    """The angle (rad) that a text gives as a part of π, such as 0.25pi or -π; else None."""
    number, pi, rest = text.strip().replace("π", "pi").partition("pi")
    value = _finite({"": "1", "+": "1", "-": "-1"}.get(number, number))
    return None if rest or not pi or value is None else value * math.pi


def numbers_of(field: str, text: str, allowed: str) -> list[float]:
    """The numbers of a list, at least one: blanks or commas between, parts of π among them.

    Raises InputError.
    """
    found = []
    for word in text.replace(",", " ").split():
        angle = angle_of(word)
        value = _finite(word) if angle is None else angle
        if value is None:
            raise InputError(field, word, allowed)
        found.append(value)
    if not found:
        raise InputError(field, text, allowed)
    return found


def angles_of(field: str, text: str) -> list[float]:
    """The angles (rad) of such a list."""
    return numbers_of(field, text, "angles in rad, such as '0 0.785 -0.25pi'")


def wrap_to_pi(angle: NDArray[np.float64]) -> NDArray[np.float64]:
    """The same angle in [−π, π): the shortest way from one phase to another."""
    return (angle + math.pi) % math.tau - math.pi


def _finite(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None
