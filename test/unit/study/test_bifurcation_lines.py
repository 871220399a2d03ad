"""What the command `bifurcation` prints of its result."""

from __future__ import annotations

from typing import Any

import pytest

from bouncing_disk_ros import bifurcation
from bouncing_disk_ros.study.bifurcation.options import lines

SHORT: dict[str, Any] = {"count": 2, "settling": 10, "measured": 20, "kept": 5}


def hints(**given: Any) -> list[str]:
    return [line for line in lines(bifurcation(**SHORT, **given)) if "no period doubling" in line]


def test_an_axis_that_ends_before_the_first_doubling_is_told() -> None:
    (line,) = hints(restitution=0.3, begin=0.6, end=0.65)
    assert line == (
        "  no period doubling up to 0.65: at ε = 0.3 the first is at 0.677151, so let the axis end "
        "beyond it"
    )


@pytest.mark.parametrize(
    "given",
    [
        {"restitution": 0.3, "begin": 0.6, "end": 0.69, "doublings": 1},
        {"restitution": 0.3, "begin": 0.6, "end": 0.65, "doublings": 0},
        {"along": "restitution", "begin": 0.5, "end": 0.52},
    ],
    ids=["beyond it", "none asked for", "along another parameter"],
)
def test_else_nothing_is_said_of_it(given: dict[str, Any]) -> None:
    assert hints(**given) == []
