"""The arithmetic of lanes: selections, turns, and bounds that proofs rest on."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import numpy as np
from numba import njit

from bouncing_disk_ros.core.arithmetic import sincos_excess as sincos_excess_kernel
from bouncing_disk_ros.maps.lanes.lane_flight import (
    land_lanes,
    launch_lanes,
    refine_roots,
    search_step,
)
from bouncing_disk_ros.maps.lanes.lane_table import (
    COARSE,
    chosen,
    coarse_turn,
    fused,
    lane_phase_after,
    lane_turn,
)
from support.kernels import from_python

sincos_excess = from_python(sincos_excess_kernel)


def test_a_choice_leaves_the_other_number_alone() -> None:
    @njit
    def choices(x: float) -> tuple[float, float, float]:
        return chosen(x > 1.0, x, -x), chosen(x != x, 7.0, x), chosen(x > 1.0, x, math.nan)

    assert choices(2.0) == (2.0, 2.0, 2.0)
    assert choices(0.5)[:2] == (-0.5, 0.5)
    assert math.isnan(choices(0.5)[2])
    assert choices(math.nan)[1] == 7.0


def test_fused_sums_are_rounded_once_or_twice_but_never_otherwise() -> None:
    @njit
    def one(a: float, b: float, c: float) -> float:
        return fused(a, b, c)

    rng = np.random.default_rng(53)
    processors = set()
    for a, b, c in rng.uniform(-1.0, 1.0, (500, 3)):
        once = float(Fraction(a) * Fraction(b) + Fraction(c))
        twice = a * b + c
        found = one(a, b, c)
        assert found in (once, twice)
        if once != twice:
            processors.add(found == once)
    assert len(processors) == 1


def test_lanes_leave_no_choice_of_fusing_to_the_compiler() -> None:
    """With it the bits of a trajectory changed with the seed of Python's hashes."""
    functions: tuple[Any, ...] = (
        lane_turn,
        lane_phase_after,
        launch_lanes,
        search_step,
        refine_roots,
        land_lanes,
    )
    for function in functions:
        assert "contract" not in function.targetoptions["fastmath"]


def test_turns_are_those_of_the_stepper() -> None:
    """To a rounding, excesses of small turns to a few of themselves: sums are fused."""
    rng = np.random.default_rng(51)
    few = np.linspace(0.0, 8.0, 3001)
    for x in np.concatenate([few, 10.0 ** rng.uniform(-12, 5.9, 3000)]):
        found, expected = np.array(lane_turn(x)), np.array(sincos_excess(x))
        size = np.array([1.0, 1.0, max(1.0, x), 1.0]) if x > 0.7 else np.abs(expected)
        assert (np.abs(found - expected) <= 4.0 * np.finfo(float).eps * size).all()


def test_coarse_turns_are_within_their_bound() -> None:
    x = np.concatenate([np.linspace(0.0, 20.0, 20001), np.linspace(9e5, 9e5 + 7.0, 2001)])
    found = np.array([coarse_turn(t) for t in x])
    error = np.abs(found - np.column_stack([np.sin(x), np.cos(x)]))
    assert error.max() < COARSE - 1e-4  # room for the rounding of what is made of it
    assert error.max() > 0.05


def test_phases_stay_within_a_turn() -> None:
    rng = np.random.default_rng(52)
    for tau, d in zip(rng.uniform(0.0, math.tau, 500), rng.uniform(0.0, 100.0, 500), strict=True):
        phase = lane_phase_after(tau, d)
        assert 0.0 <= phase < math.tau
        assert abs(math.remainder(phase - tau - d, math.tau)) < 1e-13
