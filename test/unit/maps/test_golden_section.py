"""The golden section: smooth maxima, creases, and functions that are not defined everywhere."""

from __future__ import annotations

import math

import pytest

from bouncing_disk_ros.maps.golden_section import golden_section


def test_golden_section_finds_creases_and_hills() -> None:
    place, value = golden_section(lambda x: 3.0 - abs(x - 0.7), -1.0, 2.0)
    assert place == pytest.approx(0.7, abs=1e-12)
    assert value == pytest.approx(3.0, abs=1e-12)
    place, value = golden_section(lambda x: 1.0 - (x - 0.3) ** 2, 0.0, 1.0)
    assert place == pytest.approx(0.3, abs=3e-8)  # √(2 ε)
    assert value == 1.0
    place, _ = golden_section(lambda x: x if x < 0.5 else math.nan, 0.0, 1.0)
    assert place == pytest.approx(0.5, abs=1e-12)
