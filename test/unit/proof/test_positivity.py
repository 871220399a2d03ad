"""Subdivision and zeros, on functions whose sign a dense grid of points shows too."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest
from flint import arb, ctx

from bouncing_disk_ros.core.model import Phase
from bouncing_disk_ros.proof.event_functions import Watched, gap_of
from bouncing_disk_ros.proof.exact_records import DiskRecord, MotionRecord, State
from bouncing_disk_ros.proof.platforms import Platform
from bouncing_disk_ros.proof.positivity import (
    Found,
    Sign,
    first_zero,
    positive_from_start,
    positive_on,
)

POINTS = 20_001


@pytest.fixture(autouse=True)
def digits() -> Iterator[None]:
    """The precision of a proof."""
    with ctx.workprec(160):
        yield


def gaps(n: int, seed: int) -> Iterator[tuple[Watched, State, float, float]]:
    """Random gaps, many of which come near the platform on the way: with Γ and end."""
    rng = np.random.default_rng(seed)
    for _ in range(n):
        tau, axial_forcing = float(rng.uniform(0.0, math.tau)), float(rng.uniform(0.0, 2.0))
        gap, u = float(rng.uniform(0.0, 2.0)) ** 2, float(rng.normal())
        state = State(0, 0.0, 0, tau, Phase.FLIGHT, 0.0, gap, u, 0.0)
        motion = MotionRecord(False, 0, 0, 0, tau, axial_forcing, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        platform = Platform(motion, state, arb(1))
        disk = DiskRecord(0.5, 1.0 / math.pi, 0.0, 0.0)
        yield gap_of(platform, state, disk), state, axial_forcing, float(rng.uniform(0.5, 12.0))


def values(state: State, axial_forcing: float, t: np.ndarray) -> np.ndarray:
    """The gap in floats."""
    s = axial_forcing * (np.sin(state.tau + t) - np.sin(state.tau) - np.cos(state.tau) * t)
    found: np.ndarray = state.gap + state.u * t - t * t / (2.0 * math.pi) - s
    return found


def test_signs_are_those_of_a_dense_grid() -> None:
    seen = set()
    for watched, state, axial_forcing, end in gaps(300, 1):
        finding = positive_on(watched, 0.0, end, watched.floor_zeros())
        least = values(state, axial_forcing, np.linspace(0.0, end, POINTS)).min()
        seen.add(finding.sign)
        if finding.sign is Sign.POSITIVE:
            assert least > -1e-12
        else:
            assert finding.sign is Sign.NEGATIVE
            assert 0.0 <= finding.at <= end
            assert watched.jet(arb(finding.at))[0] < 0
            assert finding.value == pytest.approx(
                float(values(state, axial_forcing, np.array([finding.at]))[0]), abs=1e-12
            )
            assert least < 1e-6
    assert seen == {Sign.POSITIVE, Sign.NEGATIVE}


def test_zeros_are_the_first_of_a_dense_grid() -> None:
    for watched, state, axial_forcing, _ in gaps(200, 2):
        end = 40.0
        zero = first_zero(watched, 0.0, end, watched.floor_zeros())
        assert zero.found is Found.ZERO
        assert zero.at.rad() < arb(10) ** -20
        grid = np.linspace(0.0, end, POINTS)
        below = values(state, axial_forcing, grid) < 0.0
        first = float(grid[int(np.argmax(below))])
        step = float(grid[1])
        assert float(zero.at) <= first
        assert float(zero.at) > first - step or _dips(watched, float(zero.at), step)


def _dips(watched: Watched, at: float, step: float) -> bool:
    """Whether the function is below zero for less than a step of the grid."""
    return any(watched.jet(arb(at + step * part))[0] < 0 for part in (1e-6, 1e-3, 0.1))


def test_a_dip_between_any_two_points_is_found() -> None:
    """Below zero for a millionth of the time: found, by the curvature that must be there."""
    state = State(0, 0.0, 0, math.pi / 2 - 1.0, Phase.FLIGHT, 0.0, 0.0, 0.0, 0.0)
    motion = MotionRecord(False, 0, 0, 0, 0.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    platform, disk = Platform(motion, state, arb(1)), DiskRecord(0.5, 0.3, 0.0, 0.0)
    rise = 3.0 * math.sin(state.tau + 1.0) - 3.0 * math.sin(state.tau)
    for depth, sign in ((1e-10, Sign.NEGATIVE), (-1e-10, Sign.POSITIVE)):
        # a parabola that touches the top of the platform after 1 s, but for `depth`
        u = 0.3 - 3.0 * math.cos(state.tau)
        gap = rise - 0.15 - depth
        high = state._replace(gap=gap, u=u)
        finding = positive_on(gap_of(platform, high, disk), 0.0, 1.7)
        assert finding.sign is sign


def test_what_begins_at_zero_must_rise() -> None:
    state = State(0, 0.0, 0, 0.0, Phase.FLIGHT, 0.0, 0.0, 0.0, 0.0)
    motion = MotionRecord(False, 0, 0, 0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    disk = DiskRecord(0.5, 0.3, 0.0, 0.0)
    for tau, rises in ((math.pi / 2, True), (1.5 * math.pi, False), (0.0, False)):
        here = state._replace(tau=tau)
        gap = gap_of(Platform(motion, here, arb(1)), here, disk)
        finding = positive_from_start(gap, 0.5, 1.0)
        assert (finding.sign is Sign.POSITIVE) == rises
        assert (finding.sign is Sign.NEGATIVE) == (not rises)
