"""Angles as parts of π, alone and in lists."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bouncing_disk_ros.angles import angle_of, angles_of, numbers_of
from bouncing_disk_ros.errors import InputError


@pytest.mark.parametrize(
    ("text", "parts"),
    [("0.25pi", 0.25), ("-0.5pi", -0.5), ("pi", 1.0), ("-pi", -1.0), ("+pi", 1.0), ("1e-1pi", 0.1),
     ("0.1234π", 0.1234), (" 2pi ", 2.0)],
)  # fmt: skip
def test_parts_of_pi(text: str, parts: float) -> None:
    assert angle_of(text) == parts * math.pi


@pytest.mark.parametrize("text", ["", "1", "0.25", "pi/4", "pi2", "pipi", "xpi", "nanpi", "infpi"])
def test_texts_that_are_none(text: str) -> None:
    assert angle_of(text) is None


@given(st.lists(st.floats(-1e6, 1e6), min_size=1), st.sampled_from([" ", ",", ", ", "  "]))
def test_a_list_gives_its_numbers(numbers: list[float], between: str) -> None:
    assert numbers_of("list", between.join(map(repr, numbers)), "numbers") == numbers
    parts = between.join(f"{number!r}pi" for number in numbers)
    assert angles_of("list", parts) == [number * math.pi for number in numbers]


@pytest.mark.parametrize("text", ["", " , ", "1 x", "0.25pi nan", "1 2 3pi4"])
def test_a_list_that_cannot_be_read_names_the_word(text: str) -> None:
    with pytest.raises(InputError, match="allowed: angles in rad") as caught:
        angles_of("phase_lags", text)
    assert str(caught.value.given) in text
