"""What `perform` makes of a simulator's answer for its parameters."""

from __future__ import annotations

from array import array
from typing import Any

import pytest
from rcl_interfaces.msg import ParameterValue

from bouncing_disk_ros.core.model import Disk
from bouncing_disk_ros.nodes.performer import answered
from bouncing_disk_ros.parameters import complete
from bouncing_disk_ros.run.presets import load_preset

FACTOR = ParameterValue(type=3, double_value=0.5)
FADE = ParameterValue(type=3, double_value=0.25)
CLOCK = ParameterValue(type=1, bool_value=True)
SWUM = complete(load_preset("swum"))
DISK = [ParameterValue(type=3, double_value=float(SWUM[name])) for name in Disk._fields]


def test_an_answer_gives_the_values_asked_for() -> None:
    disk = [SWUM[name] for name in Disk._fields]
    assert answered([FACTOR, FADE, CLOCK, *DISK]) == [0.5, 0.25, True, *disk]
    whole = ParameterValue(type=2, integer_value=2)
    assert answered([whole, FADE, CLOCK, *DISK]) == [2.0, 0.25, True, *disk]


@pytest.mark.parametrize(
    "first",
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
def test_any_other_answer_is_none(first: list[Any]) -> None:
    assert answered([*first, *DISK]) is None
