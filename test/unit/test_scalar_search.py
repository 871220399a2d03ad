"""Maxima and roots of functions of one variable, and where a condition ends."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bouncing_disk_ros.scalar_search import golden_section, halved, root_between


def test_golden_section_finds_creases_and_hills() -> None:
    place, value = golden_section(lambda x: 3.0 - abs(x - 0.7), -1.0, 2.0)
    assert place == pytest.approx(0.7, abs=1e-12)
    assert value == pytest.approx(3.0, abs=1e-12)
    place, value = golden_section(lambda x: 1.0 - (x - 0.3) ** 2, 0.0, 1.0)
    assert place == pytest.approx(0.3, abs=3e-8)  # √(2 ε)
    assert value == 1.0
    place, _ = golden_section(lambda x: x if x < 0.5 else math.nan, 0.0, 1.0)
    assert place == pytest.approx(0.5, abs=1e-12)


@pytest.mark.parametrize(("a", "b"), [(0.0, 2.0), (2.0, 0.0)])
def test_root_between_finds_steps_and_crossings(a: float, b: float) -> None:
    sign = 1.0 if a < b else -1.0

    def falling(x: float) -> float:
        return sign * (math.sqrt(2.0) - x)

    def step(x: float) -> float:
        return 0.25 if (x < 0.7) == (a < b) else -0.75

    root = root_between(falling, a, falling(a), b, falling(b))
    assert root == pytest.approx(math.sqrt(2.0), rel=1e-15)
    place = root_between(step, a, step(a), b, step(b), 1e-6)
    assert step(place) < 0.0, "the end where it is <= 0"
    assert place == pytest.approx(0.7, abs=1e-6)


@pytest.mark.parametrize("outside", [2.0, -5.0])
def test_halved_finds_where_a_condition_ends(outside: float) -> None:
    def is_near(x: float) -> bool:
        return abs(x) < 0.7

    last, first = halved(is_near, 0.5, outside, width=1e-9)
    assert is_near(last)
    assert not is_near(first)
    assert abs(first - last) <= 1e-9
    near, far = np.array([0.0, 0.0]), np.array([3.0, 4.0])
    place = halved(lambda one: bool(np.hypot(*one) < 1.0), near, far, steps=60)[0]
    assert place == pytest.approx([0.6, 0.8], rel=1e-15)
