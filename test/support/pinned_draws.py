"""Inputs of the pinned runs: drawn from seeds, the same with every library and processor.

Only `random()` of the standard library is used, which keeps its sequence, and every number is
rounded to six digits: no last digit of a logarithm or a power gets into a run.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

GRAVITY = 9.80665
T = TypeVar("T")


class PinnedRun(NamedTuple):
    """A run whose result is pinned; `compute` is given an empty folder that it may use."""

    kind: str
    name: str
    compute: Callable[[Path], Any]
    in_lanes: bool = False  # its sums are those of processors with fused multiply-add
    is_another: bool = False  # draw of the same kind: `make soak` and `make interop` have it


Runs = Iterator[PinnedRun]


def plain(
    kind: str, name: str, function: Callable[..., Any], *given: object, in_lanes: bool = False
) -> PinnedRun:
    """A run that needs no folder."""
    return PinnedRun(kind, name, lambda _: function(*given), in_lanes)


def seeded(
    kind: str, name: str, count: int, function: Callable[[int], Any], in_lanes: bool = False
) -> Runs:
    """Runs of the seeds from 0 on."""
    for seed in range(count):
        yield plain(kind, f"{name} {seed}", function, seed, in_lanes=in_lanes)


def drawn(kind: str, name: str, count: int, function: Callable[[int], Any]) -> Runs:
    """The same of parameters that are drawn: every second one is enough of its kind."""
    for run in seeded(kind, name, count, function):
        yield run._replace(is_another=int(run.name.rpartition(" ")[2]) % 2 == 1)


class Draw:
    """Numbers of a seed."""

    def __init__(self, seed: int) -> None:
        self._random = random.Random(seed)

    def number(self, low: float, high: float) -> float:
        """Between low and high, six digits."""
        return six(low + (high - low) * self._random.random())

    def decades(self, low: int, high: int) -> float:
        """Between 10**low and 10**high, each decade as likely as another."""
        mantissa = 1.0 + 9.0 * self._random.random()
        return float(f"{mantissa:.5f}e{self.whole(low, high - 1)}")

    def whole(self, low: int, high: int) -> int:
        """A whole number from low to high, both included."""
        return low + int(self._random.random() * (high - low + 1))

    def one_of(self, *choices: T) -> T:
        """One of these."""
        return choices[self.whole(0, len(choices) - 1)]


def six(number: float) -> float:
    """Six digits of a number."""
    return float(f"{number:.6g}")


def amplitude(axial_forcing: float, frequency: float, gravity: float = GRAVITY) -> float:
    """A of an axial forcing Γ = A ω²/(π g), m."""
    omega = math.tau * frequency
    return six(axial_forcing * math.pi * gravity / (omega * omega))


def drawn_values(draw: Draw, **fixed: Any) -> dict[str, Any]:
    """Parameters of a run from motions below separation to chaos, with loads and without."""
    frequency = draw.one_of(3.0, draw.number(1.0, 30.0))
    values: dict[str, Any] = {
        "frequency": frequency,
        "axial_amplitude": amplitude(draw.number(0.25, 0.9), frequency),
        "angular_amplitude": draw.one_of(0.0, draw.number(0.1, 1.5)),
        "phase_lag": draw.number(-3.0, 3.0),
        "restitution": draw.one_of(0.0, 0.5, draw.number(0.05, 0.95)),
        "friction": draw.one_of(0.0, 0.6, draw.number(0.01, 1.0)),
        "gravity": GRAVITY,
        "initial_height": draw.one_of(0.0, draw.number(0.0, 0.2)),
        "initial_angular_velocity": draw.number(-5.0, 5.0),
        "initial_forcing_phase": draw.number(0.0, 6.28),
        "chatter_report_speed": draw.one_of(0.0, 1e-3, 0.05),
    }
    return values | fixed
