"""What `perform` makes of a simulator's parameters, and how long it waits."""

from __future__ import annotations

from array import array
from types import SimpleNamespace
from typing import Any

import pytest
from rcl_interfaces.msg import ParameterValue

from bouncing_disk_ros.command_line.stop import Stop
from bouncing_disk_ros.core.model import Disk
from bouncing_disk_ros.nodes import performer
from bouncing_disk_ros.nodes.performer import PATIENCE, Performer, answered
from bouncing_disk_ros.parameters import complete
from bouncing_disk_ros.run.presets import load_preset

FACTOR = ParameterValue(type=3, double_value=0.5)
FADE = ParameterValue(type=3, double_value=0.25)
CLOCK = ParameterValue(type=1, bool_value=True)
FREE = ParameterValue(type=4, string_value="off")
SWUM = complete(load_preset("swum"))
DISK = [ParameterValue(type=3, double_value=float(SWUM[name])) for name in Disk._fields]


def test_an_answer_gives_the_values_asked_for() -> None:
    disk = [SWUM[name] for name in Disk._fields]
    assert answered([FACTOR, FADE, CLOCK, FREE, *DISK]) == [0.5, 0.25, True, "off", *disk]
    whole = ParameterValue(type=2, integer_value=2)
    assert answered([whole, FADE, CLOCK, FREE, *DISK]) == [2.0, 0.25, True, "off", *disk]


@pytest.mark.parametrize(
    "first",
    [
        [],
        [FACTOR, FADE],
        [FACTOR, FADE, CLOCK, CLOCK],
        [ParameterValue(type=99), FADE, CLOCK, FREE],
        [ParameterValue(type=0), FADE, CLOCK, FREE],
        [ParameterValue(type=4, string_value="fast"), FADE, CLOCK, FREE],
        [ParameterValue(type=3, double_value=float("nan")), FADE, CLOCK, FREE],
        [ParameterValue(type=3, double_value=-1.0), FADE, CLOCK, FREE],
        [ParameterValue(type=8, double_array_value=array("d", [1.0])), FADE, CLOCK, FREE],
        [FACTOR, FADE, ParameterValue(type=3, double_value=1.0), FREE],
    ],
)
def test_any_other_answer_is_none(first: list[Any]) -> None:
    assert answered([*first, *DISK]) is None


@pytest.mark.parametrize(
    ("factors", "waits", "done"),
    [
        ([0.1], [4.0 + PATIENCE, 36.0 + 9.0 * PATIENCE], True),  # slowed down once, then in force
        ([1.0], [4.0 + PATIENCE], False),  # as fast as before: it was refused
        ([0.0], [4.0 + PATIENCE], False),
    ],
)
def test_a_run_that_is_slowed_down_is_waited_for(
    monkeypatch: pytest.MonkeyPatch, factors: list[float], waits: list[float], done: bool
) -> None:
    """On the page a user chooses slow motion after the first toss: that was called a refusal."""
    waited: list[float] = []

    def wait_for(_node: object, _stop: Stop, _condition: object, seconds: float) -> bool:
        waited.append(seconds)
        return len(waited) > 1

    monkeypatch.setattr(performer, "wait_for", wait_for)
    given = iter(factors)
    node: Any = SimpleNamespace(_settings=lambda _stop: {"real_time_factor": next(given)})
    found, seconds = Performer._wait(node, Stop(), lambda: done, 4.0, 1.0)
    assert found == done
    assert waited == pytest.approx(waits)
    assert seconds == pytest.approx(sum(waits))
