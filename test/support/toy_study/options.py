"""The executable `toy`: squares of numbers. It computes nothing of use, and has all that a study
has; `unit/study/test_new_study.py` adds it to the package."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from bouncing_disk_ros.parameters import Spec, Value
from bouncing_disk_ros.study.command import main_of
from bouncing_disk_ros.study.definition import Idle, StudyDefinition

if TYPE_CHECKING:
    import xarray as xr


_FUNCTION = """\
Squares of numbers.

>>> toy(count=3)["square"]
"""
_SPECS = (
    Spec("count", 4, "", "how many numbers", low=1, high=1000),
    Spec("largest", 3.0, "m", "the last of them; the first is 0", low=0.0, high=1e3),
    Spec("marks", "", "m", "numbers that the picture marks", numbers=True),
)


def _idle(values: Mapping[str, Value]) -> Iterator[Idle]:
    if values["count"] == 1:
        yield "largest", "none with count:=1", "The one number is 0."


def lines(result: xr.Dataset) -> list[str]:
    """The sum."""
    return [f"  sum of squares {float(result['sum']):g} m²"]


DEFINITION = StudyDefinition(
    name="toy",
    about="Squares of numbers.",
    example="ros2 run bouncing_disk_ros toy --ros-args -p count:=3",
    function=_FUNCTION,
    specs=_SPECS,
    study="support.toy_study.compute:Toy",
    lines=lines,
    not_taken={"gravity": "Squares do not fall"},
    idle=_idle,
)
main = main_of(DEFINITION)
