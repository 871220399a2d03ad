"""Speeds after a change: transients, rise times, and the part at the end whose mean is reported."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from bouncing_disk_ros import simulate
from bouncing_disk_ros.core.model import IMPACT_DTYPE, Disk, Motion
from bouncing_disk_ros.maps.period_one import period_one
from bouncing_disk_ros.report.estimate import Estimate
from bouncing_disk_ros.report.rise_time import rise_time_of
from bouncing_disk_ros.report.spans import Segment
from bouncing_disk_ros.report.steady_speed import (
    angle_of_means,
    mean_in_flight,
    mean_of_angle,
    tail_begin,
)
from bouncing_disk_ros.report.time_curves import Curve, fit, interval
from bouncing_disk_ros.report.transient import Transient, TransientKind, transient_of
from bouncing_disk_ros.run.session import motion_of
from reference.cases import covers, in_soak
from support.checks import there

T = np.linspace(5.0, 15.0, 400)
APPROACH = 20.0 - 5.0 * np.exp(-(T - 5.0) / 1.7)


def wandering(rng: np.random.Generator, n: int, memory: float) -> NDArray[np.float64]:
    """Noise of σ = 1 whose neighbours are correlated by `memory`."""
    noise = rng.normal(0.0, 1.0, n)
    for i in range(1, n):
        noise[i] = memory * noise[i - 1] + math.sqrt(1.0 - memory**2) * noise[i]
    return noise


def test_exponential_without_noise_is_exact() -> None:
    found = transient_of(T, APPROACH)
    assert (found.kind, found.finished, found.note) == (TransientKind.EXPONENTIAL, True, "")
    assert found.time_constant.value == pytest.approx(1.7, rel=1e-12)
    assert (found.initial, found.final) == pytest.approx((15.0, 20.0), rel=1e-13)
    assert math.isnan(found.rate.value)


@pytest.mark.parametrize("end", [5.5, 8.3, 14.8])
def test_linear_without_noise_is_exact(end: float) -> None:
    found = transient_of(T, 20.0 + 3.0 * np.minimum(T - end, 0.0))
    assert (found.kind, found.finished, found.note) == (TransientKind.LINEAR, True, "")
    assert found.rate.value == pytest.approx(3.0, rel=1e-12)
    assert found.end == pytest.approx(end, rel=1e-12)
    assert found.final == pytest.approx(20.0, rel=1e-13)
    assert math.isnan(found.time_constant.value)


@pytest.mark.parametrize("memory", [0.8, *in_soak(0.0)])
def test_time_constants_cover(memory: float) -> None:
    """Noise of 1/25 of the approach, from point to point or lasting; n/τ is itself estimated."""

    def trial(rng: np.random.Generator) -> bool:
        found = transient_of(T, APPROACH + 0.2 * wandering(rng, len(T), memory))
        assert found.kind is TransientKind.EXPONENTIAL
        return found.time_constant.low <= 1.7 <= found.time_constant.high

    covers(trial, 0.93 if memory else 0.95, poor=0.6)


@pytest.mark.parametrize("memory", [0.8, *in_soak(0.0)])
def test_rates_cover(memory: float) -> None:
    def trial(rng: np.random.Generator) -> bool:
        ramp = 20.0 + np.minimum(T - 11.0, 0.0)
        found = transient_of(T, ramp + 0.1 * wandering(rng, len(T), memory))
        assert found.kind is TransientKind.LINEAR
        return found.rate.low <= 1.0 <= found.rate.high

    covers(trial, 0.93 if memory else 0.95, poor=0.6)


@pytest.mark.parametrize("memory", [0.95, *in_soak(0.0, 0.8)])
def test_noise_alone_is_no_transient(memory: float) -> None:
    def trial(rng: np.random.Generator) -> bool:
        kind = transient_of(T, 20.0 + wandering(rng, len(T), memory)).kind
        return kind in (TransientKind.NONE, TransientKind.UNRESOLVED)

    covers(trial, 0.98, poor=0.6)


def test_not_finished() -> None:
    line = transient_of(T, 2.0 * T)
    assert (line.kind, line.finished) == (TransientKind.LINEAR, False)
    assert line.rate.value == pytest.approx(2.0, rel=1e-12)
    assert math.isnan(line.final)
    assert math.isnan(line.end)
    assert line.note.startswith("not finished: a straight line so far")
    early = transient_of(T[:120], APPROACH[:120])  # 3 s: less than two time constants
    assert (early.kind, early.finished) == (TransientKind.EXPONENTIAL, False)
    assert early.note.startswith("not finished: less than three")
    assert early.time_constant.value == pytest.approx(1.7, rel=1e-9)
    noise = 0.2 * wandering(np.random.default_rng(1), 60, 0.0)
    start = transient_of(T[:60], APPROACH[:60] + noise)
    assert not start.finished


def test_shapes_that_are_none_or_not_clear_are_said() -> None:
    level = transient_of(T, np.full(len(T), 27.39))
    assert (level.kind, level.finished) == (TransientKind.NONE, True)
    assert level.final == pytest.approx(27.39, rel=1e-14)
    noisy = transient_of(T, APPROACH + 2.0 * wandering(np.random.default_rng(2), len(T), 0.0))
    assert noisy.kind is TransientKind.EXPONENTIAL
    assert noisy.note == "a straight line that ends fits as well"
    few = transient_of(T[:7], APPROACH[:7])
    assert (few.kind, few.finished) == (TransientKind.UNRESOLVED, False)
    assert few.note == "not identifiable: 7 points, at least 8 are needed"
    with_gaps = APPROACH.copy()
    with_gaps[::2] = math.nan
    assert transient_of(T, with_gaps).time_constant.value == pytest.approx(1.7, rel=1e-12)


def test_a_random_walk_has_no_transient() -> None:
    def trial(rng: np.random.Generator) -> bool:
        found = transient_of(T, np.cumsum(rng.normal(0.0, 1.0, len(T))))
        assert "wanders" in found.note or found.kind is not TransientKind.UNRESOLVED
        return found.kind in (TransientKind.NONE, TransientKind.UNRESOLVED)

    covers(trial, 0.95, poor=0.5)


def test_bad_input() -> None:
    with pytest.raises(ValueError, match="alike"):
        transient_of(T, T[:5])
    with pytest.raises(ValueError, match="rise"):
        transient_of(T[::-1], APPROACH)


@pytest.mark.parametrize("load_torque", [0.0, 0.001])
def test_slip_at_every_impact_is_linear(load_torque: float) -> None:
    """Period 1: an impact each period turns the disk by μ a_e 2(πg/ω)/a_g², so α̈ = μ a_e g/a_g².

    A load torque takes T_L/(m a_g²) from it. The line ends at ωΦ cos(τ_imp + θ) (eq. 4).
    """
    result = simulate(
        60.0, preset="pizza_multiple_toss", friction=0.01, initial_angular_velocity=0.0,
        load_torque=load_torque,
    )  # fmt: skip
    values = result.parameters
    disk = Disk.of(values)
    motion = motion_of(values)
    rate = disk.friction * disk.friction_radius * disk.gravity / disk.gyration_radius**2
    rate -= load_torque / (disk.mass * disk.gyration_radius**2)
    found = transient_of(result.impacts["time"], result.impacts["angular_velocity"])
    orbit = period_one(motion, disk)
    assert orbit is not None
    assert (found.kind, found.finished) == (TransientKind.LINEAR, True)
    assert found.rate.value == pytest.approx(rate, rel=1e-9)
    assert found.final == pytest.approx(orbit.angular_velocity, rel=1e-9)


def test_an_interval_does_not_depend_on_the_unit_of_time() -> None:
    """A ramp of milliseconds: its normal matrix must not be all rounding."""
    rng = np.random.default_rng(9)
    times = np.linspace(0.0, 87 * 2.5e-5, 88)
    speeds = 44_864.0 * np.minimum(times, 1.7e-3) + rng.normal(scale=0.05, size=88)
    quick, slow = (
        interval(fit(Curve.RAMP, scaled, speeds), scaled, speeds, 88.0)
        for scaled in (times, np.linspace(0.0, 87 * 0.25, 88))
    )
    assert quick.low < 44_864.0 < quick.high
    for one, other in zip(quick[:3], slow[:3], strict=True):
        assert one == pytest.approx(1e4 * other, rel=1e-6)
    assert quick.high - quick.low == pytest.approx(1e4 * (slow.high - slow.low), rel=1e-3)


# --- rise times -----------------------------------------------------------------------------------
TIMES = np.linspace(-1.0, 50.0, 5101)


def test_a_line_that_ends_and_its_way_back_and_a_speed_that_wanders_then() -> None:
    up = np.clip(TIMES, 0.0, 10.0) * 3.0 + 2.0
    found = there(rise_time_of(TIMES, up, 0.0))
    assert (found.initial, found.final) == (2.0, 32.0)
    assert found.to_1_e == pytest.approx(10.0 * (1.0 - math.exp(-1.0)), abs=1e-9)
    assert found.to_95 == pytest.approx(9.5, abs=1e-9)
    down = there(rise_time_of(TIMES, -up, 0.0))
    assert (down.to_1_e, down.to_95) == (found.to_1_e, found.to_95)
    times = np.linspace(-1.0, 30.0, 600)
    speeds = np.where(times < 0.0, 0.0, 25.0 + 2.0 * np.sin(3.0 * times))
    wandered = there(rise_time_of(times, speeds, 0.0))
    assert wandered.ended


def test_an_exponential_takes_its_time_constant_and_three_of_them_a_step_a_straight_line() -> None:
    speeds = 5.0 * (1.0 - np.exp(-np.maximum(TIMES, 0.0) / 2.0))
    found = there(rise_time_of(TIMES, speeds, 0.0))
    assert found.to_1_e == pytest.approx(2.0, rel=1e-4)
    assert found.to_95 == pytest.approx(2.0 * math.log(20.0), rel=1e-4)
    found = there(
        rise_time_of(np.arange(-1.0, 20.0), np.where(np.arange(-1.0, 20.0) > 0, 1.0, 0.0), 0.0)
    )
    assert found.to_95 == pytest.approx(0.95)


@pytest.mark.parametrize(
    ("times", "speeds"),
    [
        (TIMES, np.full(TIMES.shape, 3.0)),
        (TIMES, 3.0 + 0.1 * np.sin(40.0 * TIMES)),
        (TIMES[TIMES > 0.0], TIMES[TIMES > 0.0]),
        (TIMES[:104], TIMES[:104]),
        (TIMES[:0], TIMES[:0]),
    ],
)
def test_no_clear_change_or_nothing_from_before_it(
    times: np.ndarray[tuple[int], np.dtype[np.float64]],
    speeds: np.ndarray[tuple[int], np.dtype[np.float64]],
) -> None:
    assert rise_time_of(times, speeds, 0.0) is None


# --- the part at the end --------------------------------------------------------------------------
NONE = Estimate(math.nan, math.nan, math.nan, 0, "")
LEVEL = Transient(TransientKind.NONE, True, 1.0, 1.0, NONE, NONE, math.nan, "")
LINE = LEVEL._replace(kind=TransientKind.LINEAR)
CURVE = LEVEL._replace(
    kind=TransientKind.EXPONENTIAL, time_constant=Estimate(0.1, 0.09, 0.11, 50, "")
)
DISK = Disk(0.5, 0.5, 0.5, 0.1, 0.1, 10.0)


def segment(length: float, frequency: float = 100.0) -> Segment:
    return Segment(5.0, 5.0 + length, "start", Motion(0.01, 0.1, frequency, 0.0), DISK)


@pytest.mark.parametrize(
    ("length", "transient", "tail"),
    [
        (1.0, LEVEL, 1.0),
        (60.0, LEVEL, 2.0),
        (1.0, LINE._replace(end=5.4), 0.54),  # 0.6 without their first tenth
        (60.0, LINE._replace(end=5.4), 2.0),
        (1.0, LINE._replace(end=5.99), 0.2),
        (1.0, LINE._replace(finished=False), 0.2),
        (1.0, CURVE, 0.3),
        (0.5, CURVE, 0.1),
        (1.0, None, 0.2),
    ],
)
def test_a_transient_is_left_out(length: float, transient: Transient | None, tail: float) -> None:
    part = segment(length)
    assert part.end - tail_begin(part, transient) == pytest.approx(tail)


def test_at_least_three_periods_are_in_it() -> None:
    assert tail_begin(segment(1.5, 3.0), None) == pytest.approx(5.5)
    assert tail_begin(segment(0.5, 3.0), None) == 5.0


def test_between_impacts_a_load_takes_speed_on_a_line() -> None:
    """After each impact 3 rad/s; a brake takes 1 rad/s until the next one, or stops the rotor."""
    rows = np.zeros(4, IMPACT_DTYPE)
    rows["index"], rows["time"], rows["angular_velocity"] = np.arange(4), [0.0, 1.0, 2.0, 3.0], 3.0
    rows["axial_velocity"], rows["count"] = 5.0, 1  # back after a second, with g = 10 m/s²
    rows["angular_impulse"] = DISK.inertia * 1.0
    assert mean_in_flight(rows, DISK) == 3.0
    braked = DISK._replace(brake_torque=DISK.inertia * 1.0)
    assert mean_in_flight(rows, braked) == pytest.approx(2.5)
    rows["angular_impulse"] = DISK.inertia * 3.0
    assert math.isnan(mean_in_flight(rows, braked))
    rows["index"][3] = 4.0
    assert math.isnan(mean_in_flight(rows, DISK)), "a row was lost"
    rows["index"][3], rows["axial_velocity"][1] = 3.0, 0.0
    assert math.isnan(mean_in_flight(rows, DISK)), "the second impact led into contact"


def test_means_are_angle_over_time() -> None:
    times = np.arange(0.0, 10.0, 0.1)
    angles = 2.0 * times + 0.3 * np.sin(math.tau * times / 0.7)
    whole = mean_of_angle(times, angles, 7.0, 0.7)
    assert whole.value == pytest.approx(2.0, abs=1e-9)
    assert whole.end - whole.begin == pytest.approx(4 * 0.7)
    other = mean_of_angle(times, angles, 7.0, 0.0)
    assert other.value == pytest.approx((angles[99] - angles[70]) / 2.9)
    assert math.isnan(mean_of_angle(times[:1], angles[:1], 0.0, 0.0).value)
    # each mean is since the message before; one is missing at 3 s
    at, turned = angle_of_means(np.array([1.0, 2.0, 4.0, 5.0, 6.0]), np.array([9, 9, 9, 2.0, 4.0]))
    assert (at.tolist(), turned.tolist()) == ([4.0, 5.0, 6.0], [0.0, 2.0, 6.0])
    at, turned = angle_of_means(np.array([1.0, 6.0]), np.array([9.0, 2.0]))
    assert (len(at), len(turned)) == (0, 0), "means between these two may be missing"
