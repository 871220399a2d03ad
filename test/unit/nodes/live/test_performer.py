"""What `perform` makes of a simulator's answer for its parameters."""

from __future__ import annotations

from array import array
from typing import Any

import pytest
from rcl_interfaces.msg import ParameterValue

from bouncing_disk_ros.nodes.live.performer import answered

FACTOR = ParameterValue(type=3, double_value=0.5)
FADE = ParameterValue(type=3, double_value=0.25)
CLOCK = ParameterValue(type=1, bool_value=True)


def test_an_answer_gives_the_values_asked_for() -> None:
    assert answered([FACTOR, FADE, CLOCK]) == [0.5, 0.25, True]
    assert answered([ParameterValue(type=2, integer_value=2), FADE, CLOCK]) == [2.0, 0.25, True]


@pytest.mark.parametrize(
    "values",
    [
        [],
        [FACTOR, FADE],
        [FACTOR, FADE, CLOCK, CLOCK],
        [ParameterValue(type=99), FADE, CLOCK],
        [ParameterValue(type=0), FADE, CLOCK],
        [ParameterValue(type=4, string_value="fast"), FADE, CLOCK],
        [ParameterValue(type=3, double_value=float("nan")), FADE, CLOCK],
        [ParameterValue(type=3, double_value=-1.0), FADE, CLOCK],
        [ParameterValue(type=8, double_array_value=array("d", [1.0])), FADE, CLOCK],
        [FACTOR, FADE, ParameterValue(type=3, double_value=1.0)],
    ],
)
def test_any_other_answer_is_none(values: list[Any]) -> None:
    assert answered(values) is None
