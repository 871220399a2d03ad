"""Searches for events: no root is missed, work is bounded, a state without numbers is an error."""

from __future__ import annotations

import json
import math
import random
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from bouncing_disk_ros.core import flight as flight_kernels
from bouncing_disk_ros.core import platform as platform_kernels
from bouncing_disk_ros.core.arithmetic import sincos as sincos_kernel
from bouncing_disk_ros.core.model import Disk, InitialState, Motion, Phase, SimulationError
from bouncing_disk_ros.core.next_event import SLIDE_PERIODS
from bouncing_disk_ros.core.simulation import Simulation
from reference.cases import examples
from support.kernels import Kernels, from_python

flight = Kernels(flight_kernels)
platform = Kernels(platform_kernels)
sincos = from_python(sincos_kernel)

G = 9.8
SECOND = 10**9
BUDGET = 4_000  # events of one call, as the node gives it


def disk(restitution: float = 0.5, friction: float = 0.5, gravity: float = G) -> Disk:
    return Disk(1.0, restitution, friction, 0.1, 0.1, gravity)


def drop(motion: Motion, height: float, speed: float, tau: float, **values: float) -> Simulation:
    return Simulation(motion, disk(**values), InitialState(height, speed, 0.0, 0.0, tau))


def time_to_fall(motion: Motion, height: float, speed: float) -> float:
    """Seconds after which the disk would be below all that the platform reaches."""
    depth = height + 3.0 * motion.axial_amplitude + 1e-6
    return (speed + math.sqrt(speed * speed + 2.0 * G * depth)) / G + 1e-3


# --- no impact is missed --------------------------------------------------------------------------
FELL_THROUGH = (
    1.598345836565672e-07,
    679.9234494730042,
    0.031169516410861017,
    -1.8546770207731322,
    0.9047641082604492,
)


def assert_lands(values: tuple[float, ...]) -> None:
    amplitude, frequency, height, speed, tau = values
    motion = Motion(amplitude, 0.0, frequency, 0.0)
    sim = drop(motion, height, speed, tau, restitution=0.0)
    rows, _ = sim.advance(round(time_to_fall(motion, height, speed) * 1e9), 1_000)
    assert len(rows) > 0
    first = rows[0]
    assert first["axial_impact_velocity"] < 0
    # The disk falls from x₀ = s₀ + h: at the impact both are where the parabola is.
    t = float(first["time"])
    x = amplitude * math.sin(tau) + height + speed * t - 0.5 * G * t * t
    rounding = 1e-15 * (height + abs(speed) * t + G * t * t + amplitude)
    phase = 4e-16 * max(1.0, math.tau * frequency * t)  # of ωt, rad
    allowed = rounding + phase * (amplitude + abs(speed - G * t) / (math.tau * frequency))
    assert abs(x - amplitude * math.sin(first["forcing_phase"])) < 8.0 * allowed
    assert sim.sample().gap >= 0.0


def test_a_drop_on_a_small_fast_platform_and_many_random_ones_land() -> None:
    """Many periods lie within the last step to the root: a series step alone diverges there."""
    assert_lands(FELL_THROUGH)
    rows, _ = drop(Motion(*FELL_THROUGH[:1], 0.0, FELL_THROUGH[1], 0.0), *FELL_THROUGH[2:]).advance(
        SECOND // 2
    )
    assert len(rows) > 10
    rng = random.Random(52)
    for _ in range(examples(1_000)):
        assert_lands(
            (
                10 ** rng.uniform(-9, -1),
                10 ** rng.uniform(-1, 5),
                10 ** rng.uniform(-5, 0.47),
                rng.uniform(-2, 2),
                rng.uniform(0, 6.28),
            )
        )


def test_a_flight_of_hours_lands() -> None:
    """Over 7e9 periods the gap is rounded by more than its root could be resolved by."""
    steady = platform.steady(Motion(0.33964721975789064, 0.0, 132865.3397921879, 0.0), 0, 0, 0.0)
    motion = platform.without_offset(steady)
    s, c, g, u = 0.9088330181605752, 0.41716009528853515, 9.81, 148326.31630286115
    jet = platform.axial_jet(motion[0], s, c, 0.0)
    launch = flight.Launch(0.0, s, c, g, 0.0, u)
    d, w, _ = flight.search_impact(motion[0], launch, jet, 0.0, math.inf)
    assert w < 0.0
    gap = flight.gap_after(motion[0], launch, d)[0]
    assert abs(gap) < 4e-16 * (u + g * d) * d  # its rounding


# --- a bounce of any size -------------------------------------------------------------------------
@settings(max_examples=examples(100))
@example(1.0622170093353371e-234, 3.0)
@example(3.409199256352324e-285, 40_000.0)
@example(1e-100, 3.0)
@example(1e-200, 3.0)
@example(5e-324, 3.0)
@given(st.floats(-323, 0).map(lambda x: 10**x), st.sampled_from([1e-3, 3.0, 40_000.0, 1e6]))
def test_a_tiny_gap_closes(height: float, frequency: float) -> None:
    """A disk at rest above a platform at rest lands with w = √(2gh), down to the least height."""
    values = {"restitution": 0.0, "friction": 0.0, "gravity": 9.81}
    runs = []
    for ticks in (1, 7):
        sim = drop(Motion(0.0, 0.0, frequency, 0.0), height, 0.0, 0.0, **values)
        rows = [sim.advance(k * SECOND // ticks)[0] for k in range(1, ticks + 1)]
        runs.append((b"".join(r.tobytes() for r in rows), repr(sim.sample())))
        assert sim.sample().phase is not Phase.FLIGHT
        for row in np.concatenate(rows):
            w = -float(row["axial_impact_velocity"])
            # a denormal height has few digits, and so has its root
            assert w == pytest.approx(math.sqrt(2 * 9.81 * height), rel=1e-9, abs=1e-160)
    assert runs[0] == runs[1]


# --- bounded work ---------------------------------------------------------------------------------
WIDE_FADES = [
    (1.0, 4e4, 0.01, 0.01),
    (0.1, 4e4, 0.01, 0.01),
    (0.1, 4e4, 1e-9, 1e-9),
    (4e4, 0.1, 1e-9, 0.01),
    (0.1, 1e6, 1e-6, 1e-6),
    (1e-3, 1e6, 1e-13, 1e-13),
]


@pytest.mark.parametrize(("first", "last", "begin", "end"), WIDE_FADES)
@pytest.mark.parametrize("friction", [0.5, 0.0])
def test_a_fade_over_many_decades_is_stepped_in_bounded_calls(
    first: float,
    last: float,
    begin: float,
    end: float,
    friction: float,
) -> None:
    """The work of one call is bounded by its budget, not by the fade."""
    sim = Simulation(Motion(begin, 0.5, first, 0.3), disk(friction=friction), InitialState())
    sim.command([(1, Motion(end, 0.7, last, -0.3))])
    reached, calls = -1, 0
    while calls < 60:
        calls += 1
        # what the kernel reports as work passes the budget by one search at most
        used, behind = sim._engine.step(sim._boundary_ns(), sim._boundary_ns(), BUDGET, [])
        assert used <= BUDGET + 2 * flight.SEARCH_STEPS // 16 + 100
        state_ns = int(sim._engine.state["ns"][0])
        assert state_ns > reached  # each call comes on
        reached = state_ns
        if not behind:
            break


@pytest.mark.parametrize("budget", [1, 3, 50, 1_000_000])
def test_waypoints_do_not_depend_on_the_budget_or_the_ticks(budget: int) -> None:
    def result(max_events: int, ticks: int) -> tuple[bytes, str]:
        sim = Simulation(Motion(2e-4, 0.5, 0.5, 0.3), disk(), InitialState())
        sim.command([(1, Motion(1e-5, 0.7, 500.0, -0.3))])
        rows = b""
        for k in range(1, ticks + 1):
            behind = True
            while behind:
                part, behind = sim.advance(k * 2 * SECOND // ticks, max_events)
                rows += part.tobytes()
        return rows, repr(sim.sample()) + repr(sim.energy())

    assert result(budget, 13) == result(10_000, 1)


def test_a_long_slide_in_a_fade_keeps_its_energy() -> None:
    """A slide in pieces of some periods: the ledger balances to rounding over all of them."""
    sim = Simulation(Motion(1e-4, 0.9, 20.0, 0.3), disk(friction=0.01), InitialState())
    sim.command([(3 * SECOND, Motion(2e-4, 0.1, 40.0, -0.3))], 3 * SECOND)
    sim.advance(3 * SECOND)
    energy = sim.energy()
    assert energy.loss_sliding > 0
    assert abs(energy.residual) < 1e-12 * energy.throughput
    assert SLIDE_PERIODS < 20.0 * 3  # so there were several pieces


# --- bounds over a piece of a fade ----------------------------------------------------------------
@settings(max_examples=100)
@given(
    st.tuples(st.floats(0, 1), st.floats(0, 3), st.floats(0.1, 50), st.floats(-3, 3)),
    st.tuples(st.floats(0, 1), st.floats(0, 3), st.floats(0.1, 50), st.floats(-3, 3)),
    st.floats(0.001, 20),
    st.floats(0, 1),
)
def test_bounds_of_a_panel_hold(start: Any, target: Any, duration: float, part: float) -> None:
    end_ns = max(1, round(duration * 1e9))
    fade = platform.fade(Motion(*start), Motion(*target), 0, end_ns, 0, 1.0)
    motion = platform.without_offset(fade)[0]
    d = part * float(motion["duration"])
    over = platform.bounds_from(motion, 0.0, d)
    until = min(over.until, float(motion["duration"]))
    for t in np.linspace(d, max(until, d), 30):
        tau = 1.0 + platform.phase_advance(motion, 0.0, float(t))
        sine, cosine = sincos(tau)
        s = platform.axial_jet(motion, sine, cosine, float(t))
        b = platform.angular_jet(motion, sine, cosine, float(t))
        for value, bound in zip((*s[2:], *b[2:]), over[:6], strict=True):
            # the jets are sums of some ten terms, rounded on the scale of the bound
            assert abs(value) <= bound * (1.0 + 1e-12) + 1e-300


# --- a state without numbers ----------------------------------------------------------------------
@pytest.mark.parametrize("field", ["u", "omega", "gap", "angle"])
@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_a_state_that_is_not_finite_ends_the_run(field: str, value: float) -> None:
    sim = Simulation(Motion(0.04, 0.5, 3.0, -0.7), disk(), InitialState(height=0.1))
    sim.advance(SECOND)
    sim._engine.state[field] = value
    sim._engine.invalidate_next_event()
    with pytest.raises(SimulationError, match=rf"no next event .*{field} "):
        sim.advance(2 * SECOND)
    with pytest.raises(SimulationError):  # and it does not go on
        sim.advance(3 * SECOND)
    assert sim.time_ns == SECOND


# --- checkpoints that do not fit ------------------------------------------------------------------
def edited(path: str, value: Any) -> dict[str, Any]:
    sim = Simulation(Motion(0.04, 0.5, 3.0, -0.7), disk(), InitialState())
    sim.command([(2 * SECOND, Motion(0.05, 0.6, 4.0, 0.3)), (4 * SECOND, Motion(0, 0, 1.0, 0))])
    sim.apply_impulse(SECOND + 123, 0.01, 0.001)
    sim.advance(SECOND)
    snapshot: dict[str, Any] = json.loads(json.dumps(sim.snapshot()))
    Simulation.restore(snapshot)  # good as it is
    place: Any = snapshot
    *names, last = (int(n) if n.lstrip("-").isdigit() else n for n in path.split("/"))
    for name in names:
        place = place[name]
    place[last] = value
    return snapshot


AT_REST = [0.1, 0.1, 3.0, 0.0]


@pytest.mark.parametrize(
    ("path", "values"),
    [
        ("format", (0, None, "2")),
        ("engine", (None, {})),
        ("engine/books", ([[0.0] * 8], [[0.0] * 10, [0.0] * 10], [], 3)),
        ("engine/books/0/0", (math.nan, "1")),
        ("engine/state", ([],)),
        ("engine/state/ns", (1e400, -1, 2 * SECOND, True)),
        ("engine/state/cycles", (2**70,)),
        ("engine/state/phase", (4,)),
        ("engine/state/gap", (-1e-300, [0.0, 0.0])),
        ("engine/state/tau", (7.0,)),
        ("engine/state/omega", (math.inf,)),
        ("engine/motion/f", (0.0, -3.0)),
        ("engine/motion/a", (-0.1,)),
        ("engine/motion/kind", (2,)),
        ("engine/motion/df", (1.0,)),
        ("target", ([0.1, 0.1, 0.0, 0.0], [0.1, 0.1, 3.0], [0.1, 0.1, "3.0", 0.0])),
        ("disk", ([1.0] * 99,)),
        ("disk/0", (0.0,)),
        ("disk/1", (1.5,)),
        ("disk/5", (-9.0,)),
        ("initial/0", (-1.0,)),
        ("initial/4", (None,)),
        ("pending", ([[5, 5, AT_REST]], [[5, 4, AT_REST]], [[0, 1]] * 3, {"a": 1})),
        ("pending/0/2/2", (0.0,)),
        ("kicks", ([[1, 0.0, 0.0]], [[2 * SECOND, 0.0, 0.0], [SECOND + 1, 0.0, 0.0]],
                   [[2**62, 0.0, 0.0]])),
        ("held", ([{"index": 1}],)),
        ("time_ns", (0.5, 2**64)),
        ("motion_index", (None,)),
        ("chatter_report_speed", (math.nan,)),
    ],
)  # fmt: skip
def test_a_checkpoint_that_does_not_fit_is_refused(path: str, values: tuple[Any, ...]) -> None:
    words = "allowed: 1" if path == "format" else "checkpoint"
    for value in values:
        with pytest.raises(ValueError, match=words) as refused:
            Simulation.restore(edited(path, value))
        assert len(str(refused.value)) < 300, value


@pytest.mark.parametrize("path", ["start", "engine", "kicks", "time_ns", "engine/state/gap"])
def test_a_checkpoint_without_a_part_is_refused(path: str) -> None:
    snapshot: Any = edited("motion_index", 1)
    *folders, name = path.split("/")
    place = snapshot
    for folder in folders:
        place = place[folder]
    del place[name]
    with pytest.raises(ValueError, match=name):
        Simulation.restore(snapshot)


def test_what_follows_from_other_numbers_is_not_taken_from_a_checkpoint() -> None:
    """Bounds and the stored event decide how a kernel searches: a forged one must not count."""
    good = Simulation.restore(edited("motion_index", 1))
    forged = edited("engine/motion/s4", 0.0)
    forged["engine"]["motion"]["top"] = 0.0
    forged["engine"]["state"].update(event=2, event_delay=1e-9, event_value=5.0, sine=7.0)
    bad = Simulation.restore(forged)
    assert bad.advance(5 * SECOND)[0].tobytes() == good.advance(5 * SECOND)[0].tobytes()
