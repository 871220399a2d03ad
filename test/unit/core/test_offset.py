"""Offset trajectories: the formula, splices, extremes, and what they do to a run at each knot."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from mpmath import im, mpf, polyroots, re, workdps

from bouncing_disk_ros.core.layout import NEVER
from bouncing_disk_ros.core.model import Disk, InitialState, Motion
from bouncing_disk_ros.core.offset import (
    CUBIC,
    LINE,
    QUINTIC,
    Knot,
    Lane,
    Offset,
    OffsetState,
    Segment,
    coefficients,
    derivative,
    highest,
)
from bouncing_disk_ros.core.offset_extremes import extremes, newest_extremes
from bouncing_disk_ros.core.simulation import Simulation
from reference.cases import FIRST, examples
from reference.offset_path import Point, Trajectory, pieces
from support.random_runs import OffsetRun, Spliced, knots, points, random_offset_run

SECOND = 10**9
STILL = Motion(0.0, 0.0, 1.0, 0.0)
G = 10.0


def disk(restitution: float = 0.5, friction: float = 0.5) -> Disk:
    return Disk(1.0, restitution, friction, 0.1, 0.1, G)


def still(height: float = 0.0, speed: float | None = None, **values: float) -> Simulation:
    """A platform that nothing but offsets move, and a disk above or on it."""
    return Simulation(STILL, disk(**values), InitialState(height, speed, 0.0, 0.0, 0.0))


def later(sent: Spliced, ns: int) -> list[tuple[tuple[float, ...], ...]]:
    """The points of both joints, so much later."""
    return [tuple((at + ns, *state) for at, *state in points) for points in sent[1:]]


def line(at_ns: int, position: float) -> Knot:
    return Knot(at_ns, OffsetState(position), LINE)


def cubic(at_ns: int, position: float, velocity: float) -> Knot:
    return Knot(at_ns, OffsetState(position, velocity), CUBIC)


# --- the formula ----------------------------------------------------------------------------------
def random_segment(rng: np.random.Generator) -> Segment:
    duration = int(math.exp(rng.uniform(math.log(2e3), math.log(1e11))))
    begin, seconds = int(rng.integers(0, 10**12)), duration / SECOND
    degree = int(rng.choice([LINE, CUBIC, QUINTIC]))
    stated = {LINE: 1, CUBIC: 2, QUINTIC: 3}[degree]
    rates = [seconds**-order * 10.0 ** rng.uniform(-1, 1.5) for order in range(3)]
    start = OffsetState(*(float(rng.normal() * rate) for rate in rates))
    end = OffsetState(*(float(rng.normal() * rate) for rate in rates[:stated]))
    return Segment(begin, begin + duration, start, end, degree)


def reference(segment: Segment, ns: int, order: int) -> Fraction:
    """A derivative of a segment by Hermite's basis functions."""
    kind = {LINE: 1, CUBIC: 2, QUINTIC: 3}[segment.degree]
    values = tuple(Fraction(v) for v in (*segment.start, *segment.end))
    begin, end = Fraction(segment.begin_ns, SECOND), Fraction(segment.end_ns, SECOND)
    from reference.offset_path import Piece

    return Fraction(Piece(begin, end, values, kind).at(Fraction(ns, SECOND), order))


@pytest.fixture
def forty_digits() -> Iterator[None]:
    with workdps(40):
        yield


@pytest.mark.usefixtures("forty_digits")
@pytest.mark.parametrize("begin", [0, 10**6 * SECOND], ids=["steady", "in a fade"])
def test_a_run_shows_the_formula_within_2e_15(begin: int) -> None:
    """Through the compiled kernels, of random trajectories on a platform that stands.

    Also in the middle of a cross-fade of 23 days.
    """
    rng = np.random.default_rng(2)
    for seed in range(examples(15)):
        run = random_offset_run(seed)._replace(motion=STILL, disk=disk(0.0 if begin else 1.0))
        height = 0.0 if begin else 100.0
        run = run._replace(initial=InitialState(height, 0.0, 0.0, 0.0, 0.0))
        trajectories = [Spliced(begin + one[0], *later(one, begin)) for one in run.trajectories]
        simulation = run._replace(trajectories=tuple(trajectories)).start()
        if begin:
            simulation.command([(2 * begin, STILL._replace(frequency=2.0))], 2 * begin)
        message = [
            Trajectory(one.begin_ns, tuple(Point(int(p[0]), p[1:]) for p in one.axial))
            for one in trajectories
            if one.axial
        ]
        found = pieces(message, mpf)
        for at in sorted((begin + rng.integers(1, SECOND // 2, 6)).tolist()):
            simulation.advance(at)
            segment = simulation.offset.axial.segment_at(at)
            scale = extremes([segment]).position
            piece = max((p for p in found if p.begin <= mpf(at) / SECOND), key=lambda p: p.begin)
            wanted = piece.at(mpf(at) / SECOND)
            assert abs(simulation.sample().platform_position - wanted) <= 2e-15 * max(scale, 1e-300)


def exact_extremes(segment: Segment) -> list[Any]:
    """Largest position, velocity and acceleration by the zeros of polynomials in 40 digits."""
    found, c = [], coefficients(segment)
    for order in range(3):
        slopes = [mpf(v.numerator) / v.denominator for v in derivative(c)]
        while len(slopes) > 1 and slopes[-1] == 0:
            slopes.pop()
        roots = polyroots(slopes[::-1], maxsteps=500, extraprec=400) if len(slopes) > 1 else []
        places = [re(x) for x in roots if abs(im(x)) < mpf(10) ** -15 and 0 < re(x) < 1]
        values = [
            sum(mpf(v.numerator) / v.denominator * x**i for i, v in enumerate(c))
            for x in (mpf(0), mpf(1), *places)
        ]
        unit = segment.duration**order
        found.append(max(map(abs, values)) * unit.denominator / unit.numerator)
        c = derivative(c)
    return found


def terms(segment: Segment) -> float:
    """Sum of the six stated numbers over x in [0, 1], of which the coefficients are sums."""
    t = float(segment.duration)
    ends = (segment.start, segment.end)
    return sum(abs(p) + abs(v) * t + abs(a) * t * t / 2 for p, v, a in ends)


@pytest.mark.usefixtures("forty_digits")
def test_extremes_are_exact_to_rounding() -> None:
    """A coefficient of x³ to x⁵ is off by some 8 half ulps of at most 15 times the terms.

    With x ≤ 1/2 these sum to 26, 190 and 1020 of them for the position and its derivatives; own
    roundings come on top.
    """
    rng = np.random.default_rng(3)
    segments = [random_segment(rng) for _ in range(examples(60))]
    flat = OffsetState(0.0, 1.0)  # a velocity that touches 0 at x = 1/2, as its slope does
    segments.append(Segment(0, SECOND, flat, OffsetState(1 / 3, 1.0), CUBIC))
    for segment in segments:
        three = exact_extremes(segment)
        for order, (found, value) in enumerate(zip(extremes([segment]), three, strict=False)):
            most = (40, 250, 1200)[order] * terms(segment) / float(segment.duration) ** order
            assert abs(found - value) <= most * 2**-53
        for v in np.linspace(0.0, 1.0, 5):
            c = [float(one) for one in coefficients(segment)]
            assert highest(coefficients(segment)) >= np.polyval(c[::-1], v) - 1e-12 * max(
                map(abs, c)
            )


def test_extremes_at_the_knots_are_what_is_stated() -> None:
    """Not a bit more: a limit may be what a trajectory states."""
    lane = Lane().spliced(7, [line(SECOND + 7, 0.3), cubic(2 * SECOND, 0.1, 0.7)])
    found = newest_extremes(lane)
    assert (found.position, found.jump) == (0.3, 0.7)
    top = Knot(3 * SECOND, OffsetState(1.3, 0.0, -7.1), QUINTIC)
    assert newest_extremes(Lane().spliced(0, [top])).position == 1.3
    for value in np.random.default_rng(5).normal(size=100).tolist():  # at rest at both ends
        rests = [Knot(SECOND // 3, OffsetState(value), QUINTIC), cubic(SECOND, -value, 0.0)]
        assert newest_extremes(Lane().spliced(0, rests)).position == abs(value)


# --- splices --------------------------------------------------------------------------------------
def test_a_future_splice_leaves_what_is_before_it() -> None:
    first = Lane().spliced(0, [cubic(SECOND, 0.1, 0.0), cubic(2 * SECOND, 0.0, 0.0)])
    both = first.spliced(SECOND // 2, [cubic(3 * SECOND, -0.1, 0.0)])
    for ns in range(0, SECOND // 2 + 1, SECOND // 20):
        assert both.segment_at(ns).at(ns) == first.segment_at(ns).at(ns)
    assert both.jump_at(SECOND // 2) == 0.0
    assert both.segment_at(4 * SECOND).at(4 * SECOND).position == -0.1
    assert both.boundary_after(0) == SECOND // 2
    assert both.boundary_after(3 * SECOND) == int(NEVER)


def test_an_earlier_splice_replaces_a_later_one_and_cancelling_keeps_what_has_begun() -> None:
    lane = Lane().spliced(SECOND, [line(2 * SECOND, 1.0)])
    lane = lane.spliced(SECOND // 2, [line(3 * SECOND, 0.5)])
    assert lane.segment_at(2 * SECOND).at(2 * SECOND).position == pytest.approx(0.3)
    assert len(lane.plans) == 2
    lane = Lane().spliced(0, [line(SECOND, 1.0), line(2 * SECOND, 0.0)])
    spliced = lane.spliced(3 * SECOND // 2, [line(4 * SECOND, 9.0)])
    assert spliced.cancelled(SECOND) == lane
    assert lane.spliced(SECOND, [line(4 * SECOND, 9.0)]).cancelled(SECOND // 2) == lane


def test_trimmed_lanes_splice_the_same() -> None:
    run = random_offset_run(11)
    offset = run.start().offset
    for now in range(0, SECOND // 4, SECOND // 100):
        more = [cubic(now + SECOND, 0.01, 0.0)]
        assert offset.trimmed(now).axial.spliced_state(now) == offset.axial.spliced_state(now)
        fresh = offset.trimmed(now).axial.spliced(now, more).plans[-1]
        assert fresh == offset.axial.spliced(now, more).plans[-1]


# --- what a knot does to the disk -----------------------------------------------------------------


def test_an_impact_at_a_knot_goes_before_it() -> None:
    """0.05 = g t²/2 with t = 0.1: the first impact meets a platform at rest, the second a rise."""
    sim = still(0.05, 0.0, restitution=0.5)
    sim.trajectory(SECOND // 10, [line(SECOND, 1.8)])
    rows, _ = sim.advance(SECOND // 10)
    assert rows["axial_impact_velocity"].tolist() == [
        pytest.approx(-1.0, abs=1e-15),
        pytest.approx(-1.5, abs=1e-15),  # 0.5 up, the platform 2 up
    ]


def test_a_reset_takes_the_offset_away() -> None:
    sim = still()
    sim.trajectory(0, [line(SECOND, 0.1)])
    sim.advance(SECOND // 2)
    sim.reset()
    assert sim.offset == Offset.at_rest(SECOND // 2)
    assert sim.sample().platform_position == 0.0


# --- bits -----------------------------------------------------------------------------------------
def digest(run: Simulation, end: int, step: int) -> bytes:
    parts = []
    for at in range(step, end + step, step):
        rows, behind = run.advance(min(at, end), 10**6)
        assert not behind
        parts.append(rows.tobytes())
    return b"".join(parts) + repr(run.sample()).encode()


def one_by_one(run: OffsetRun, rate: float) -> Simulation:
    """Each knot in a message of its own, sent in the last tick before the knot before it."""
    sim = Simulation(run.motion, run.disk, run.initial)
    tick = round(SECOND / rate)
    sends: list[tuple[int, Spliced]] = []
    for one in run.trajectories:
        for joint, sent in enumerate((one.axial, one.angular)):
            begin = one.begin_ns
            for point in sent:
                lanes = ((point,), ()) if joint == 0 else ((), (point,))
                sends.append((begin, Spliced(begin, *lanes)))
                begin = int(point[0])
    # what a later message of the same run replaces is not sent
    for begin, one in sorted(sends, key=lambda send: send[0]):
        sim.advance(max(begin // tick * tick - (0 if begin % tick else tick), 0))
        sim.trajectory(begin, knots(one.axial), knots(one.angular))
    return sim


@pytest.mark.parametrize("rate", [50.0, 100.0, 1000.0])
def test_knots_sent_at_once_or_one_by_one_are_the_same_bits(rate: float) -> None:
    for seed in range(20):
        run = random_offset_run(seed)
        run = run._replace(trajectories=run.trajectories[:1])
        end = int(3 / run.motion.frequency * SECOND)
        whole = run.start()
        parts = one_by_one(run, rate)
        first = b"".join(whole.advance(end, 10**6)[0].tobytes() for _ in range(1))
        rows = parts.advance(end, 10**6)[0].tobytes()
        assert first.endswith(rows)
        assert parts.sample() == whole.sample()


@pytest.mark.parametrize("moved", [False, True], ids=["still", "moved"])
def test_a_checkpoint_after_a_reset_continues_with_the_same_bits(moved: bool) -> None:
    """Whether a trajectory came before the reset, and with one that is sent after it."""
    for seed in range(12):
        run = random_offset_run(seed)
        half = int(1.5 / run.motion.frequency * SECOND)
        whole = run.start() if moved else run._replace(trajectories=()).start()
        whole.advance(half, 10**6)
        whole.reset()
        again = Simulation.restore(json.loads(json.dumps(whole.snapshot())))
        digests = []
        for one in (whole, again):
            one.advance(half + half // 3, 10**6)
            for sent in run.trajectories:
                one.trajectory(half + sent.begin_ns, *map(knots, later(sent, half)))
            digests.append((digest(one, 3 * half, half), one.offset_index, one.offset_begin_ns))
        assert digests[0] == digests[1]


def check_future_splice(seed: int) -> None:
    """Splice random points into a random run at a random later instant.

    Over a splice the platform moves by what its speeds allow in 1 ns, to rounding.
    """
    rng = np.random.default_rng(seed)
    run = random_offset_run(seed)
    sim = run.start()
    frequency = run.motion.frequency
    sim.advance(int(rng.uniform(0.0, 1.0) / frequency * SECOND))
    at = sim.time_ns + 1 + int(rng.uniform(0.0, 1.5) / frequency * SECOND)
    before = sim.offset
    scale = 0.3 * 9.81 / frequency**2
    sim.trajectory(at, knots(points(rng, at, scale, frequency)))
    for ns in rng.integers(sim.time_ns, at + 1, 5).tolist():
        assert sim.offset.axial.segment_at(ns).at(ns) == before.axial.segment_at(ns).at(ns), seed
    assert sim.offset.angular == before.angular, seed
    found = []
    for ns in (at - 1, at, at + 1):
        sim.advance(ns)
        found.append(sim.sample())
    speed = 1e-9 * max(abs(one.platform_velocity) for one in found)
    size = max(abs(one.platform_position) for one in found)
    room = 1.01 * speed + 1e-15 * size + 1e-17
    assert abs(found[1].platform_position - found[0].platform_position) <= room, seed
    assert abs(found[2].platform_position - found[1].platform_position) <= room, seed


def test_future_splices_while_moving_keep_the_position_continuous() -> None:
    """`make soak`: ten thousand."""
    for seed in range(FIRST, FIRST + examples(60, 10_000)):
        check_future_splice(seed)


@pytest.mark.parametrize(
    "change",
    [
        {"index": -1}, {"in_force": []}, {"axial": []}, {"axial": [[[0, 1, 2]]]},
        {"axial": [[[0, 5, *[0.0] * 6, 1]]]}, {"angular": [[[0, 5, *[0.0] * 6, 2]]]},
        {"axial": [[[0, 5, *[math.nan] * 6, 1], [5, int(NEVER), *[0.0] * 6, 0]]]},
        {"axial": [[[0, 5, *[0.0] * 6, 1], [6, int(NEVER), *[0.0] * 6, 0]]]},
        {"axial": [[[0, 5, *[0.0] * 6, 0]]]},
    ],
)  # fmt: skip
def test_a_damaged_checkpoint_is_refused_in_one_line(change: dict[str, object]) -> None:
    sim = random_offset_run(3).start()
    sim.advance(SECOND // 100)
    values = sim.snapshot()
    values["offset"] = {**values["offset"], **change}
    with pytest.raises(ValueError, match="offset") as caught:
        Simulation.restore(values)
    assert "\n" not in str(caught.value)
