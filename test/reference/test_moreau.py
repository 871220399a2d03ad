"""The core against Moreau time-stepping: first-order convergence to the core's trajectory.

A run of step h ends with an error e = h Σ cᵢ Uᵢ + o(h), a sum over the events within it, where Uᵢ
is the place of event i within its step. Steps of random length make the runs of one h independent
samples of e. From h to h/2ᴶ the root-mean-square error E falls by 2ᴶ: log₂(E/E')/J is the order, 1.
A core that is off by δ stops the fall at δ, order 0. The verdict is the half way: the core fails if
E' > 2⁻ᴶᐟ² E, so what it may be off by is that part of E, about 1e-4 in the model's units.

What else changes the order:

- E/h is constant only while the same bounces are resolved. An impact leaves the disk up to |w_A| h
  below the platform, and the rebound comes out of there only if its height ε²w²/2a is more. So
  bounces slower than w = 2ah/ε² are not resolved, and with them the end of the chatter may be early
  or late by up to the time they take, 2εw/(a(1 − ε)) = 4h/(ε(1 − ε)): first order too, but E/h may
  differ between two h by a factor of 1/(ε(1 − ε)). Half an order in J = 7 halvings allows for 2³·⁵
  = 11, which is ε = 0.1 … 0.9 (and ε = 0, without rebound). Smaller ε are judged where h resolves
  the rebound that matters: `test_small_restitution`.
- The mean of e² over n samples is good to √(κ − 1)/√n, κ ≤ 3: half of that and over J ln 2, 0.07
  of an order for the 4 runs of the shorter step.
- Beside a graze, or where a slip is just about to stick, the trajectory depends on changes of size
  h by a square root or a jump. `response` measures the order of just that, of the core alone with
  its start changed by as much as one step: such runs are left out, and counted.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, note, reject, seed, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from bouncing_disk_ros.core.model import Disk, InitialState, Motion, Sample
from reference import moreau
from reference.cases import NS, SLOW, Case, Fade, examples, runs
from reference.offset_path import Point, Trajectory, pieces

PERIODS = 2.0
HALVINGS = 7  # J
LONG = 1 / 8000  # h, periods
LONG_RUNS, SHORT_RUNS = 16, 4
LEAST_ORDER = 0.5
LEAST_RESPONSE = (
    0.75  # of the core alone, which has no noise: between first order and a square root
)
SATURATED = 0.1  # a response as large, in the model's units, is no small change
NOISE = 1e-10  # rounding of 1e6 steps, in the units of Case.scales


def state_of(sample: Sample) -> NDArray[np.float64]:
    """What is compared: axial position and velocity, angle and angular velocity."""
    return np.array(
        [
            sample.axial_position,
            sample.axial_velocity,
            sample.unwrapped_angle,
            sample.angular_velocity,
        ]
    )


def by_core(case: Case, end_ns: int) -> NDArray[np.float64]:
    """State at the end."""
    run = case.start()
    run.advance(end_ns)
    return state_of(run.sample())


def is_quiet(case: Case, end_ns: int) -> bool:
    """Neither an impact nor a change of phase within 20 long steps of the end: a velocity is not
    off by a whole impact."""
    run, margin = case.start(), round(20 * LONG * NS)
    run.advance(end_ns - margin)
    phase = run.sample().phase
    rows = 0
    for instant in (end_ns, end_ns + margin):
        rows += len(run.advance(instant)[0])
        if run.sample().phase != phase:
            return False
    return rows == 0


def changed(case: Case, delta: float) -> list[Case]:
    """The case with its start changed by delta in the model's units, in one way each."""
    start = case.initial
    height, speed, _, spin = delta * case.scales
    ways = [
        start._replace(forcing_phase=start.forcing_phase + delta),
        start._replace(forcing_phase=start.forcing_phase - delta),
        start._replace(angular_velocity=start.angular_velocity + spin),
        start._replace(angular_velocity=start.angular_velocity - spin),
    ]
    if start.height > 0.0:
        ways.append(start._replace(height=start.height + height))
        if start.axial_velocity is not None:
            ways.append(start._replace(axial_velocity=start.axial_velocity + speed))
    return [case._replace(initial=way) for way in ways]


def response(case: Case, end_ns: int, long: float = LONG, halvings: int = HALVINGS) -> float:
    """Order of what changes by a step at the start bring about at the end, by the core alone; 0
    where the longer step's is no small change."""
    end = by_core(case, end_ns)
    size = [
        max(
            float(np.max(np.abs(by_core(other, end_ns) - end) / case.scales))
            for other in changed(case, math.tau * h)
        )
        for h in (long, long / 2**halvings)
    ]
    if size[0] > SATURATED:
        return 0.0
    if size[1] < NOISE:
        return math.inf
    return math.log2(size[0] / size[1]) / halvings


def offset_tables(case: Case) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The offsets of both joints, by the formula that shares nothing with the core."""
    lanes = []
    for joint in ("axial", "angular"):
        messages = [
            Trajectory(one.begin_ns, tuple(Point(int(p[0]), p[1:]) for p in getattr(one, joint)))
            for one in case.trajectories
        ]
        lanes.append(moreau.offset_rows(pieces(messages, float)))
    return lanes[0], lanes[1]


def root_mean_square(case: Case, end_ns: int, h: float, seeds: range) -> float:
    """Distance of Moreau's final states, one for each seed, from the core's, in the units of the
    model."""
    fades = [moreau.Crossfade(f.begin_ns / NS, f.end_ns / NS, f.target) for f in case.fades]
    impulses = [moreau.Kick(k.at_ns / NS, k.axial, k.angular) for k in case.impulses]
    rows = moreau.segments(case.motion, case.initial.forcing_phase, fades)
    offsets = offset_tables(case)
    s, s1 = moreau.axial(rows, offsets[0], 0.0)
    velocity = case.initial.axial_velocity
    start = moreau.State(
        s + case.initial.height,
        s1 if velocity is None else velocity,
        case.initial.angle,
        case.initial.angular_velocity,
    )
    end = by_core(case, end_ns)
    found = np.array(
        [
            moreau.integrate(rows, impulses, case.disk, start, end_ns / NS, h, seed, offsets)
            for seed in seeds
        ]
    )
    return float(np.sqrt(np.mean(np.sum(((found - end) / case.scales) ** 2, axis=1))))


def order(
    case: Case, end_ns: int, long: float = LONG, halvings: int = HALVINGS
) -> tuple[float, float]:
    """Order of the convergence between two steps, and the root-mean-square error of the shorter
    one."""
    first = root_mean_square(case, end_ns, long, range(LONG_RUNS))
    seeds = range(LONG_RUNS, LONG_RUNS + SHORT_RUNS)
    last = root_mean_square(case, end_ns, long / 2**halvings, seeds)
    if last < NOISE:
        return math.inf, last
    return math.log2(first / last) / halvings, last


@pytest.mark.parametrize(
    ("start", "brake", "offsets", "number"),
    [(1, False, False, 2), (4, True, False, 1), (6, False, True, 1), (7, True, True, 1)],
)
def test_time_stepping_converges_to_the_core(
    start: int, brake: bool, offsets: bool, number: int
) -> None:
    end_ns = round(PERIODS * NS)
    judged: list[float] = []
    left_out: list[Case] = []

    @seed(start)
    @given(runs(PERIODS, restitution=st.just(0.0) | st.floats(0.1, 0.9), brake=brake,
                offsets=offsets))  # fmt: skip
    @settings(
        SLOW,
        max_examples=examples(number),
        suppress_health_check=[HealthCheck.filter_too_much, HealthCheck.too_slow],
    )
    def converges(case: Case) -> None:
        assume(is_quiet(case, end_ns))
        if response(case, end_ns) < LEAST_RESPONSE:
            left_out.append(case)
            reject()
        found, last = order(case, end_ns)
        judged.append(found)
        note(f"order {found:.3f}, last error {last:.2e}")
        assert found > LEAST_ORDER

    converges()
    print(f"{len(judged)} judged, {len(left_out)} left out, least order {min(judged):.2f}")
    assert 2 * len(left_out) <= len(judged), "the filter must not swallow the test"


def test_small_restitution() -> None:
    """ε = 0.01, sliding that starts in the pauses of a chatter, a cross-fade: the first rebound
    needs h < ε²w/2a = 1.4e-5 s."""
    disk = Disk(1.501, 0.01, 0.5, 0.05, 0.1224, 9.81, -4.418, 0.0515)
    motion, later = Motion(0.384, 1.4758, 1.0, 2.17115), Motion(0.0906, 0.674, 0.9217, -3.962)
    initial = InitialState(0.6807, 0.0, -5.17768, 0.0, 1.35)
    case = Case(motion, disk, initial, (Fade(1_087_300_000, 1_546_000_000, later),))
    end_ns = round(PERIODS * NS)
    found, last = order(case, end_ns, 2.0**-18, 4)
    assert last < 2e-4
    assert found > LEAST_ORDER
    assert order(case, end_ns, LONG, 2)[0] < LEAST_ORDER  # steps that are too long show nothing
