"""Tosses in lanes are the rides of the stepper."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from bouncing_disk_ros.core.layout import LEDGER_FIELDS, STATE_DTYPE, disk_record
from bouncing_disk_ros.core.model import Disk
from bouncing_disk_ros.maps import single_toss
from bouncing_disk_ros.maps.lanes.toss_lanes import tosses
from bouncing_disk_ros.maps.lanes.toss_table import lane_angle

DOUGH = Disk(0.3, 0.5, 0.6, 0.12, 0.3 / math.sqrt(8.0), 10.0)
FREQUENCY = 3.0
ARC = 0.25
Floats = NDArray[np.float64]


def starts(n: int, seed: int, from_rest: bool) -> Floats:
    rng = np.random.default_rng(seed)
    angle = rng.uniform(0, math.pi / 2, n)
    table = np.empty((n, 5))
    table[:, single_toss.START_AXIAL_AMPLITUDE] = ARC * np.cos(angle)
    table[:, single_toss.START_ANGULAR_AMPLITUDE] = ARC * np.sin(angle) / DOUGH.friction_radius
    table[:, single_toss.START_PHASE_LAG] = rng.uniform(-math.pi, math.pi, n)
    table[:, single_toss.START_FORCING_PHASE] = (
        1.5 * math.pi if from_rest else rng.uniform(0, math.tau, n)
    )
    table[:, single_toss.START_ANGULAR_SPEED] = 0.0 if from_rest else rng.uniform(-30, 30, n)
    return table


def by_ride(table: Floats, frequency: float, disk: Disk) -> tuple[Floats, NDArray[np.int8]]:
    out, codes = np.empty((len(table), 4)), np.empty(len(table), np.int8)
    state, ledger = np.zeros(1, STATE_DTYPE), np.zeros((2, len(LEDGER_FIELDS)))
    single_toss.toss_each(table, frequency, disk_record(disk, 0.0), 1000, state, ledger, out, codes)
    return out, codes


@pytest.mark.parametrize("from_rest", [True, False])
@pytest.mark.parametrize(
    "disk",
    [
        DOUGH,
        DOUGH._replace(friction=3.0),  # sticks often
        DOUGH._replace(friction=0.05, preload=0.5),
        DOUGH._replace(load_torque=0.01),
        DOUGH._replace(friction=0.0),
    ],
)
def test_rides_are_those_of_the_stepper(disk: Disk, from_rest: bool) -> None:
    table = starts(3000, 51, from_rest)
    expected, expected_codes = by_ride(table, FREQUENCY, disk)
    found, codes = tosses(table, FREQUENCY, disk)
    np.testing.assert_array_equal(codes, expected_codes)
    assert {single_toss.TOSS_SLID, single_toss.TOSS_STAYS} <= set(codes.tolist())
    # an instant good to a few roundings of a phase of 8 rad, times accelerations of a few hundred
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)


def test_rows_know_nothing_of_each_other() -> None:
    table = starts(3000, 52, False)
    whole = tosses(table, FREQUENCY, DOUGH)
    order = np.random.default_rng(53).permutation(3000)[:100]
    part = tosses(table[order], FREQUENCY, DOUGH)
    shared = tosses(table, FREQUENCY, DOUGH, workers=2)
    for k in range(2):
        np.testing.assert_array_equal(whole[k][order], part[k])
        np.testing.assert_array_equal(whole[k], shared[k])


@settings(max_examples=60)
@given(
    st.floats(-1, 5),
    st.floats(-2, 1.5),
    st.floats(-2, 0),
    st.floats(-4, 3),
    st.floats(-3, 3),
    st.sampled_from(["still", "slow", "fast", "graze", "flat"]),
    st.integers(0, 2**32 - 1),
)
def test_rides_are_those_of_the_stepper_for_any_motion(
    frequency: float, friction: float, radius: float, load: float, turn: float, kind: str, seed: int
) -> None:
    """Logarithms of frequency, friction, radius of gyration, A ω²/g − 1 and of Φ over γA."""
    frequency = 10.0**frequency
    disk = DOUGH._replace(friction=10.0**friction, gyration_radius=10.0**radius)
    omega, n = math.tau * frequency, 64
    rng = np.random.default_rng(seed)
    fall, grip = (
        disk.gravity / omega**2,
        disk.friction * disk.friction_radius * 10.0 ** (-2 * radius),
    )
    table = np.empty((n, 5))
    axial, angular, lag, tau, speed = table.T
    axial[:] = fall * (1.0 + 10.0**load * rng.uniform(0.5, 2, n))
    angular[:] = grip * axial * 10.0**turn * rng.uniform(0.5, 2, n)
    lag[:] = rng.uniform(-math.pi, math.pi, n)
    tau[:] = rng.uniform(0, math.tau, n)
    swing = omega * (grip * axial + angular)
    sign = rng.choice([-1.0, 1.0], n)
    if kind == "flat":
        angular[:], lag[:] = flat(axial, sign, grip, fall, rng)
    if kind in ("flat", "graze"):
        speed[:] = omega * grazing(table, sign, grip, fall, rng)
    else:
        speed[:] = {"still": 0.0, "slow": 1e-6, "fast": 3.0}[kind] * swing * rng.uniform(-1, 1, n)
    expected, expected_codes = by_ride(table, frequency, disk)
    found, codes = tosses(table, frequency, disk)
    np.testing.assert_array_equal(codes, expected_codes)
    # both sum a few dozen terms, none larger than these; an instant at which a slip ends is less
    # exact near a fold, but what follows depends on its square
    moment, weight = disk.mass * disk.gyration_radius**2, disk.mass * disk.gravity
    pull = grip * (axial + 4.0 * math.pi * fall)
    cosine = np.sqrt(np.maximum(1.0 - (fall / axial) ** 2, 1e-300))
    terms = np.stack(
        (
            np.abs(speed) + omega * (angular + pull),
            (4.0 * math.pi + 1.0 / cosine) / omega,
            disk.mass * (omega * axial) ** 2 + weight * axial,
            moment * omega**2 * angular * (angular + 4.0 * math.pi * pull),
        ),
        axis=1,
    )
    left = codes != single_toss.TOSS_STAYS
    assert np.all(np.abs(found - expected)[left] <= 64 * 2.0**-53 * terms[left])


def flat(
    axial: Floats, sign: Floats, grip: float, fall: float, rng: np.random.Generator
) -> tuple[Floats, Floats]:
    """Φ and θ with which the drive of a slip of that sign hardly reaches zero, or hardly not."""
    n = len(axial)
    near = 1.0 + rng.choice([-1.0, 1.0], n) * 10.0 ** rng.uniform(-12, -1, n)
    drive = grip * fall * near * np.exp(1j * rng.uniform(-math.pi, math.pi, n))
    turned = sign * (drive - grip * axial)
    return np.abs(turned), np.angle(turned)


def grazing(
    table: Floats, sign: Floats, grip: float, fall: float, rng: np.random.Generator
) -> Floats:
    """Starts α̇/ω with which a slip of that sign comes as close to zero as chosen where it turns."""
    axial, angular, lag, tau, _ = table.T
    n = len(table)
    rise, down = grip * axial, grip * fall
    p, q = rise + sign * angular * np.cos(lag), sign * angular * np.sin(lag)
    span = np.hypot(p, q)
    # the drive p sin x + q cos x − fall rises through zero half a falling piece after its steepest
    half = np.arctan2(np.sqrt(np.maximum(span**2 - down**2, 0.0)), -down)
    turns = np.arctan2(-p, -q) + half
    turns += math.tau * np.ceil((tau - turns) / math.tau)
    least = (down + span) * rng.choice([-1.0, 0.0, 1.0], n) * 10.0 ** rng.uniform(-14, -1, n)
    start = least + down * turns + p * np.cos(turns) - q * np.sin(turns)
    speed: Floats = sign * (start - down * tau - rise * np.cos(tau))
    return speed


@pytest.fixture
def left_to_the_stepper(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """How many rides each call of `tosses` has left to `single_toss.toss_each`."""
    left: list[int] = []
    one_by_one = single_toss.toss_each

    def rides(table: Floats, *arguments: object) -> None:
        left.append(len(table))
        one_by_one(table, *arguments)

    monkeypatch.setattr(single_toss, "toss_each", rides)
    return left


@pytest.mark.parametrize("fastest", [0.0, 30.0, 60.0])
def test_few_rides_are_left_to_the_stepper(fastest: float, left_to_the_stepper: list[int]) -> None:
    table = starts(20000, 54, fastest == 0.0)
    table[:, single_toss.START_ANGULAR_SPEED] *= fastest / 30.0
    _, codes = tosses(table, FREQUENCY, DOUGH._replace(friction=3.0 if fastest > 30.0 else 0.6))
    in_flight = np.count_nonzero(codes == single_toss.TOSS_NONE)  # not for lanes
    assert sum(left_to_the_stepper) - in_flight <= len(table) // 2000


def test_a_platform_that_does_not_turn_is_left_sticking(left_to_the_stepper: list[int]) -> None:
    table = starts(500, 56, True)
    table[:, single_toss.START_ANGULAR_AMPLITUDE] = 0.0
    table[::2, single_toss.START_ANGULAR_SPEED] = 0.01
    found, codes = tosses(table, FREQUENCY, DOUGH)
    assert set(codes.tolist()) == {single_toss.TOSS_STUCK, single_toss.TOSS_STAYS}
    assert not left_to_the_stepper
    expected, expected_codes = by_ride(table, FREQUENCY, DOUGH)
    np.testing.assert_array_equal(codes, expected_codes)
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)


def test_angles_are_those_of_the_arc_tangent() -> None:
    rng = np.random.default_rng(55)
    y, x = rng.normal(size=(2, 2000)) * 10.0 ** rng.uniform(-8, 8, (2, 2000))
    y[:3], x[:3] = (0.0, 0.0, 1.0), (0.0, -1.0, 0.0)
    found = [lane_angle(b, a) for b, a in zip(y, x, strict=True)]
    # three roundings of at most π, and those of the library
    np.testing.assert_allclose(found, np.arctan2(y, x), rtol=0, atol=4 * 2.0**-52)
