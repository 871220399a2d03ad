"""The facade: time, inputs, budgets, checkpoints."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from bouncing_disk_ros.core.engine import Engine
from bouncing_disk_ros.core.model import (
    IMPACT_DTYPE,
    LARGEST_FLOAT32,
    Disk,
    ImpactKind,
    InitialState,
    Motion,
    Phase,
    SimulationError,
    join_rows,
)
from bouncing_disk_ros.core.offset import LINE, Knot, OffsetState, hold
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.errors import InputError

MOTION = Motion(0.04, 0.5, 3.0, -0.7)
DISK = Disk(0.3, 0.5, 0.6, 0.12, 0.106, 10.0)
SECOND = 10**9


def run() -> Simulation:
    return Simulation(MOTION, DISK, InitialState())


def test_advance_reaches_the_instant_and_nothing_is_done_before_it() -> None:
    sim = run()
    rows, behind = sim.advance(SECOND)
    assert not behind
    assert sim.time_ns == SECOND
    assert rows.dtype == IMPACT_DTYPE
    assert len(rows) > 3
    state = sim.sample()
    rows, _ = sim.advance(SECOND // 2)
    assert len(rows) == 0
    assert sim.sample() == state
    with pytest.raises(ValueError, match=r"impulse at 1 ns: allowed from 1000000000 ns"):
        sim.apply_impulse(1, 0.1, 0.0)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_row_beyond_the_range_of_float32_is_finite(sign: float) -> None:
    slippery = DISK._replace(friction=0.0)
    start = InitialState(angular_velocity=sign)
    sim = Simulation(Motion(0.0, 1e-300, 1.0, 0.0), slippery, start)
    sim.apply_impulse(0, -1e39, 0.0)
    rows, _ = sim.advance(1)
    assert rows["axial_impact_velocity"][0] == -1e39 / 0.3
    assert rows["y"][0] == -LARGEST_FLOAT32
    assert rows["z"][0] == sign * LARGEST_FLOAT32
    assert all(np.isfinite(rows[name]).all() for name in IMPACT_DTYPE.names or ())


def test_a_disk_that_returns_after_sixty_years_lands_then() -> None:
    """Such a flight is searched in pieces of three years."""
    start = InitialState(axial_velocity=1e10)
    sim = Simulation(Motion(0.0, 0.0, 1.0, 0.0), DISK, start)
    rows, _ = sim.advance(2_000_000_001 * SECOND)
    assert rows["time"][0] == pytest.approx(2e9, rel=1e-14)
    assert rows["axial_impact_velocity"][0] == pytest.approx(-1e10, rel=1e-14)


@pytest.mark.parametrize("amplitude", [0.28, 1e6])
def test_a_disk_that_returns_after_ten_thousand_years_ends_no_run(amplitude: float) -> None:
    """The phase of a fast platform had overflowed by then: no next event, a fault."""
    start = InitialState(height=1e10, axial_velocity=1.5e12, forcing_phase=3.3)
    sim = Simulation(Motion(amplitude, 0.0, 1e7, 0.3), DISK, start)
    rows, behind = sim.advance(100 * SECOND)
    assert (len(rows), behind) == (0, False)
    assert sim.sample().axial_position == pytest.approx(1e10 + 1.5e14, rel=1e-7)


def test_a_bounce_too_short_to_have_a_duration_keeps_the_energy_ledger() -> None:
    """A platform of 12 days a period takes u = 5e-12 m/s; its work there is −m ṡ u."""
    climb = math.tau * 1e-6
    start = InitialState(0.0, climb + 5e-12, forcing_phase=0.0)
    sim = Simulation(Motion(1.0, 0.0, 1e-6, 0.0), DISK, start)
    assert sim.sample().gap == 0.0
    sim.advance(0)
    assert sim.sample().phase == Phase.STICKING
    energy = sim.energy()
    # velocities have the digits of u that climb leaves them: 1e-10 of it
    assert energy.work_axial == pytest.approx(-DISK.mass * climb * 5e-12, rel=1e-8, abs=0.0)
    assert energy.loss_impact_axial == pytest.approx(0.5 * DISK.mass * 25e-24, rel=1e-8, abs=0.0)
    assert abs(energy.residual) < 1e-14 * energy.kinetic


@pytest.mark.parametrize("restitution", [0.9, 0.997, 0.998, 0.9999])
def test_samples_within_a_chatter_show_its_bounces(restitution: float) -> None:
    """On a platform at rest: with ε = 0.9999 samples showed contact, and the ledger did not close.

    Its bounces of 2uεⁿ/g end after 2u/(g(1 − ε)); after a part x of that, where one begins,
    uεⁿ = u(1 − x). Instants are whole nanoseconds, of 4 µs at least.
    """
    speed, disk = 2e-3, DISK._replace(restitution=restitution)
    sim = Simulation(Motion(0.0, 0.0, 3.0, 0.0), disk, InitialState(axial_velocity=speed))
    lasts = 2.0 * speed / (disk.gravity * (1.0 - restitution))
    for part in (0.5, 0.9, 0.99, 0.999):
        sim.advance(round(part * lasts * SECOND))
        sample, energy = sim.sample(), sim.energy()
        bounce = math.hypot(sample.axial_velocity, math.sqrt(2.0 * disk.gravity * sample.gap))
        left = speed * (1.0 - part)
        assert left * (1.0 - 2e-4) <= bounce <= left / restitution * (1.0 + 2e-4)
        assert energy.relative_residual < 1e-12


def test_an_input_just_before_a_chatter_ends_comes_after_the_impacts_before_it() -> None:
    """A chatter of 2u/(g(1 − ε)) = 1.6 ms: the closed form, which ends 1 ns later, is no event."""
    sim = Simulation(Motion(0.0, 0.0, 3.0, 0.0), DISK, InitialState(0.0, 4e-3))
    sim.apply_impulse(1_600_000 - 1, 0.0, 0.0)
    sim.advance(1_600_000 - 1)
    # what is left of it is 1 ns at the end of a flight at least: of u = g(1 − ε)/2ε times that
    assert abs(sim.sample().axial_velocity) < 6e-9
    energy = sim.energy()
    assert abs(energy.residual) < 1e-10 * energy.throughput


# --- inputs at the instant of an event ------------------------------------------------------------
STILL = Motion(0.0, 0.0, 3.0, 0.0)


@pytest.mark.parametrize("motion", [STILL, Motion(1e-4, 0.1, 37.0, 0.4)], ids=["still", "moving"])
def test_an_impulse_in_contact_is_an_impact_at_its_own_instant(motion: Motion) -> None:
    """The instant of a forcing phase is rounded: half of the impacts came 5e-9 ns late."""
    random = np.random.default_rng(4)
    for at in random.integers(1, 10 * SECOND, 40).tolist():
        sim = Simulation(motion, DISK, InitialState())
        sim.apply_impulse(at, -0.03, 0.0)
        rows, _ = sim.advance(at)
        assert rows["time"].tolist() == [at / SECOND]
        assert rows["axial_impact_velocity"].tolist() == [-0.03 / DISK.mass]
        relative = sim.sample().axial_velocity - sim.sample().platform_velocity
        assert relative == pytest.approx(DISK.restitution * 0.1, rel=1e-13)


def test_what_comes_after_an_impulse_at_its_instant_finds_the_impact_done() -> None:
    for at in range(502_535_890, 502_535_910):
        sim = Simulation(STILL, DISK, InitialState())
        sim.advance(at)
        sim.apply_impulse(at, -0.03, 0.0)
        sim.set_disk(DISK._replace(restitution=1.0))
        assert sim.sample().axial_velocity == pytest.approx(DISK.restitution * 0.1, rel=1e-15)
        sim.reset()
        assert len(sim.advance(at)[0]) == 1


FALL = 100_000_000  # ns, of 0.05 m with g = 10
AT_THE_IMPACT: dict[str, Callable[[Simulation], object]] = {
    "impulse": lambda sim: sim.apply_impulse(FALL, 0.3, 0.0),
    "fade": lambda sim: sim.command(
        [(2 * SECOND, STILL._replace(frequency=4.0))], 2 * SECOND - FALL
    ),
    "trajectory": lambda sim: sim.trajectory(FALL, [Knot(SECOND, OffsetState(0.9), 1)]),
    "parameters": lambda sim: sim.set_disk(DISK._replace(gravity=10.0, restitution=1.0)),
    "reset": lambda sim: sim.reset(),
}


@pytest.mark.parametrize("kind", AT_THE_IMPACT)
@pytest.mark.parametrize("frequency", [3.0, 0.37, 81.3])
def test_an_impact_goes_before_an_input_at_its_instant(kind: str, frequency: float) -> None:
    """0.05 = g t²/2 with t = 0.1: rounding does not decide (rule 10)."""
    disk = DISK._replace(gravity=10.0)
    sim = Simulation(STILL._replace(frequency=frequency), disk, InitialState(0.05))
    rows = sim.advance(FALL if kind in ("parameters", "reset") else 0)[0]
    AT_THE_IMPACT[kind](sim)
    rows = join_rows([rows, sim.advance(FALL)[0]])
    row = rows[0]
    assert row["time"] == 0.1 or kind in ("parameters", "reset")  # which nobody expected
    assert row["axial_impact_velocity"] == pytest.approx(-1.0, abs=1e-15)
    assert row["axial_velocity"] == pytest.approx(disk.restitution, abs=1e-15)
    speed = {"impulse": 0.5 + 1.0, "reset": 0.0}.get(kind, 0.5)
    if kind == "trajectory":  # a line of 1 m/s: an impact of 0.5
        assert rows["axial_impact_velocity"].tolist()[1:] == [pytest.approx(-0.5, abs=1e-15)]
        speed = 1.25
    assert sim.sample().axial_velocity == pytest.approx(speed, abs=1e-14)


SECONDLY = STILL._replace(frequency=1.0)
DECIMAL = DISK._replace(gravity=10.0)


@pytest.mark.parametrize("budget", [1, 3, 10_000])
def test_a_chatter_that_ends_at_an_input_s_instant_is_over(budget: int) -> None:
    """0.2 m with ε = 0.5 last until 0.6 s: resolved before the input in parts, the rows differed.

    Then with ε = 1 the disk bounced on for ever, by rounding.
    """
    start = InitialState(0.2, 0.0, forcing_phase=2.983)
    runs = [Simulation(SECONDLY, DECIMAL, start) for _ in range(2)]
    rows = [sim.advance(6 * SECOND // 10)[0] for sim in runs]
    while not runs[1].resolve_due(budget, cut_chatter=True):
        pass
    for sim in runs:
        sim.set_disk(DECIMAL._replace(restitution=1.0))
    rows = [join_rows([row, ended(sim, SECOND)]) for row, sim in zip(rows, runs, strict=True)]
    assert rows[0].tobytes() == rows[1].tobytes()
    assert rows[0]["kind"].tolist()[-1] == ImpactKind.CHATTER_TAIL
    assert runs[0].sample() == runs[1].sample()
    assert runs[0].sample().phase is not Phase.FLIGHT


def test_an_impact_within_rounding_before_an_input_is_at_its_instant() -> None:
    """The second impact, at 0.3 s, of a disk with ε = 1: a platform that then rises as fast as it
    takes it along. It had flown on for 3e-17 s, and its gap made it bounce on without end.
    """
    start = InitialState(0.05, 0.0, forcing_phase=2.1)
    sim = Simulation(SECONDLY, DECIMAL._replace(restitution=1.0), start)
    rows = sim.advance(3 * SECOND // 10)[0]
    sim.trajectory(3 * SECOND // 10, [Knot(4 * SECOND // 10, OffsetState(0.1), 1)])
    rows = join_rows([rows, ended(sim, 39 * SECOND // 100)])
    assert rows["axial_impact_velocity"].tolist() == [pytest.approx(-1.0, abs=1e-15)] * 2
    assert sim.sample().phase is not Phase.FLIGHT


def test_an_impact_at_the_top_of_a_flight_goes_before_an_input_at_its_instant() -> None:
    """The platform comes up slowly, so the instant is known by the rounding of the gap alone."""
    sim = Simulation(SECONDLY, DECIMAL._replace(restitution=1.0), InitialState(0.2, 0.0))
    sim.trajectory(7 * SECOND // 10, [Knot(8 * SECOND // 10, OffsetState(0.2, 0.1, 0.2), 5)])
    rows = ended(sim, 82 * SECOND // 100)
    assert rows["time"].tolist() == [0.2, pytest.approx(0.6, abs=1e-15), 0.8]
    assert rows["axial_impact_velocity"][2] == pytest.approx(-0.1, abs=1e-13)
    assert sim.sample().axial_velocity == pytest.approx(0.0, abs=1e-13)  # it rose by 0.2 m/s


# --- every run ends -------------------------------------------------------------------------------
def ended(sim: Simulation, until: int) -> Any:
    """The rows up to an instant, within a budget of events."""
    rows, behind = sim.advance(until, 10_000)
    assert not behind
    return rows


def test_a_speed_within_the_rounding_of_the_platform_s_is_none() -> None:
    """With ε = 1 a disk at rest on the platform's lowest point bounced without end."""
    start = InitialState(axial_velocity=0.0)
    sim = Simulation(Motion(0.02, 0.3, 3.0, 0.0), DISK._replace(restitution=1.0), start)
    assert len(ended(sim, SECOND // 100)) == 0
    assert sim.sample().phase is not Phase.FLIGHT


@pytest.mark.parametrize("begin", [0, SECOND // 10])
@pytest.mark.parametrize("joint", ["rotation", "line", "fade"])
def test_contact_never_ends_at_the_forcing_where_the_load_touches_0(joint: str, begin: int) -> None:
    """Γ = 1/π with a platform whose other motions change: launches of 1e-29 m/s, without end."""
    frequency, disk = 2.0, DISK._replace(gravity=10.0, restitution=0.97, friction=0.08)
    motion = Motion(10.0 / (math.tau * frequency) ** 2, 0.3, frequency, 0.0)
    sim = Simulation(motion, disk, InitialState(forcing_phase=0.0))
    knots = [Knot(begin + 2 * SECOND, OffsetState(0.0), 1)]
    if joint == "fade":
        sim.command([(begin + 2 * SECOND, motion._replace(phase_lag=1.0))], 2 * SECOND)
    else:
        sim.trajectory(begin, *((knots, None) if joint == "line" else (None, knots)))
    assert len(ended(sim, begin + 2 * SECOND)) == 0
    assert sim.sample().phase is not Phase.FLIGHT


@pytest.mark.parametrize("speed", [2e-17, 1e-15, 2e-15])
def test_bounces_within_the_rounding_of_an_instant_are_contact(speed: float) -> None:
    """With ε = 1 they follow one another without end, each one ulp of the clock after the other.

    A bounce of 2u/g lasts less than 16 · 2⁻⁵³ of the period of 1/3 s.
    """
    sim = Simulation(STILL, DISK._replace(restitution=1.0), InitialState())
    sim.apply_impulse(SECOND, -speed * DISK.mass, 0.0)
    assert len(ended(sim, 2 * SECOND)) == 1
    assert sim.sample().phase is not Phase.FLIGHT
    assert sim.energy().relative_residual < 1e-12


def test_time_that_stands_and_turns_beyond_the_range_of_numbers_end_the_run() -> None:
    """Whatever the events are: so many within the rounding of one instant are without end."""
    engine = Engine(DISK, 0.0)
    engine.place(0, InitialState(), STILL, (hold(0, 0.0), hold(0, 0.0)))
    engine._check_that_time_goes_on(99_999)
    with pytest.raises(SimulationError, match=r"time does not go on: .* 0 ns: sticking, "):
        engine._check_that_time_goes_on(2)
    disk = DISK._replace(friction=0.0, load_torque=1e12)
    sim = Simulation(STILL, disk, InitialState())
    sim.apply_impulse(10_000 * SECOND, 0.1, 0.0)
    with pytest.raises(SimulationError, match="angle nan"):
        sim.advance(10_001 * SECOND)


# --- long flights over a fast platform ------------------------------------------------------------
FAST = Motion(0.1, 0.0, 1e6, 0.3)
SPEED_ROUNDING = 4 * 2.0**-53 * math.tau * FAST.frequency * FAST.axial_amplitude
"""Of a difference from Aω, m/s: both numbers are rounded, and so are sine and cosine."""


@pytest.mark.parametrize("fades", [False, True])
def test_a_long_flight_changes_the_disk_s_speed_by_gravity_alone(fades: bool) -> None:
    """Impulses of 0 divide it; the platform's phase grows by 1e6 rad, rounded by 2⁻⁵³ of that."""
    sim = Simulation(FAST, DISK, InitialState(height=2.0, axial_velocity=0.0))
    if fades:
        sim.command([(SECOND, FAST._replace(axial_amplitude=0.2))], SECOND)
    for i in range(1, 11):
        at = i * SECOND // 23
        sim.apply_impulse(at, 0.0, 0.0)
        sim.advance(at)
        sample, allowed = sim.sample(), i * SPEED_ROUNDING
        assert sample.phase is Phase.FLIGHT
        assert sample.axial_velocity == pytest.approx(-DISK.gravity * at / 1e9, abs=allowed)
        assert abs(sim.energy().residual) <= DISK.mass * abs(sample.axial_velocity) * 2.0 * allowed


def test_a_fast_platform_rounds_neither_the_disk_s_speed_nor_the_ledger() -> None:
    sim = Simulation(FAST, DISK, InitialState(height=2.0, axial_velocity=0.0))
    row = sim.advance(SECOND, 1)[0][0]
    jump = (1.0 + DISK.restitution) * row["axial_impact_velocity"]
    before = row["axial_velocity"] + jump
    assert before == pytest.approx(-DISK.gravity * row["time"], abs=2.0 * SPEED_ROUNDING)
    slow = Motion(1e-3, 0.0, 3.0, 0.0)
    faster = Simulation(slow, DISK, InitialState(height=1.0, axial_velocity=0.0))
    faster.command([(SECOND // 3, slow._replace(axial_amplitude=1e6))], SECOND // 3)
    for i in range(1, 100):
        faster.apply_impulse(i * SECOND // 2000, 0.0, 0.0)
        faster.advance(i * SECOND // 2000)
        assert faster.energy().relative_residual < 1e-12


def test_a_fade_from_a_slow_motion_is_sampled_right_after_an_impact_too() -> None:
    """The rounding of an instant is that of the frequency then, not that of 12 days a period."""
    slow, elastic = Motion(0.039, 0.0, 1e-6, 0.0), DISK._replace(restitution=1.0)
    sim = Simulation(slow, elastic, InitialState(axial_velocity=0.1))
    sim.command([(0, slow._replace(frequency=1e7))], 1_000_000)
    impacts = 0
    for at in range(40_000, 40_300):
        impacts += len(sim.advance(at)[0])
        assert sim.energy().relative_residual < 1e-12
    assert impacts > 3


def test_a_fade_of_days_is_sampled_right_after_an_impact_too() -> None:
    """The rounding of an instant does not grow with the time since the fade began: to 1 ns here.

    A period then is 100 ns. The platform never throws the disk, so the fade has no other events.
    """
    day, begin = Motion(1e-15, 0.0, 1e-6, 0.0), 900_000 * SECOND
    sim = Simulation(day, DISK._replace(restitution=1.0), InitialState())
    sim.command([(1_000_000 * SECOND, day._replace(frequency=1e7))], 1_000_000 * SECOND)
    sim.apply_impulse(begin, -1e-7 * DISK.mass, 0.0)
    impacts = 0
    for at in range(begin, begin + 300):
        impacts += len(sim.advance(at)[0])
        assert sim.energy().relative_residual < 1e-12
    assert impacts > 5


def test_a_chatter_with_next_to_no_loss_ends_in_a_fade_from_a_slow_motion() -> None:
    """Bounces of 1e-13 s, a hundred thousand of them, are no rounding of 12 days a period."""
    slow, tough = Motion(1e-9, 0.0, 1e-6, 0.0), DISK._replace(restitution=0.9999)
    sim = Simulation(slow, tough, InitialState(height=1e-6))
    sim.command([(1000 * SECOND, slow._replace(frequency=1e7))], 1000 * SECOND)
    rows, behind = sim.advance(10 * SECOND)
    assert not behind
    assert rows["count"].sum() > 100_000
    assert sim.sample().phase is Phase.STICKING


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_disk_sticks_on_after_an_impulse_that_changes_no_speed(sign: float) -> None:
    """Friction was taken for rounding on the scale of the end of the fade: it drove the disk."""
    slow = Motion(0.0, 0.5, 1e-6, 0.0)
    sim = Simulation(slow, DISK, InitialState())
    sim.command([(1000 * SECOND, slow._replace(frequency=1e7))], 1000 * SECOND)
    sim.apply_impulse(SECOND, 0.0, sign * 1e-30)
    for at in (SECOND, 12 * SECOND // 10, 2 * SECOND):
        sim.advance(at)
        sample = sim.sample()
        assert sample.phase is Phase.STICKING
        assert sample.angular_velocity == sample.platform_angular_velocity


def test_a_brake_in_a_fade_from_rest_keeps_the_ledger() -> None:
    """Its first turns are below the rounding of the amplitude to come: the brake lags behind.

    Then the brake's loss and the platform's work against it were entered with different signs.
    """
    rest = Motion(1e-17, 0.0, 1e4, 0.0)
    sim = Simulation(rest, DISK._replace(brake_torque=0.03, load_torque=0.01), InitialState())
    sim.command([(1000 * SECOND, Motion(1e-17, 0.5, 2e4, 0.0))], 1000 * SECOND)
    _, behind = sim.advance(SECOND // 50)
    assert not behind
    assert sim.sample().phase is Phase.STICKING
    assert sim.energy().relative_residual < 1e-12


def test_rows_of_a_long_call_are_those_of_short_ones_and_stay() -> None:
    whole, cut = run(), run()
    end, step = 2_000_000_000_000, 100_000_000_000
    rows = whole.advance(end)[0]
    assert len(rows) > 3 * 4096  # room for more is made on the way
    before = rows.tobytes()
    parts = [cut.advance(at)[0] for at in range(step, end + 1, step)]
    whole.advance(end + step)
    assert rows.tobytes() == before == b"".join(part.tobytes() for part in parts)


def test_the_separation_follows_a_change_of_the_preload() -> None:
    motion, disk = Motion(0.03, 0.2, 3.0, 0.3), Disk(0.5, 0.3, 0.3, 0.1, 0.1, 9.81)
    changed = Simulation(motion, disk, InitialState())
    changed.advance(3_000_000_000)
    changed.set_disk(disk._replace(preload=0.2))
    fresh = Simulation.restore(changed.snapshot())  # knows nothing of earlier separations
    rows = [sim.advance(9_000_000_000)[0] for sim in (changed, fresh)]
    assert len(rows[0]) > 10
    assert rows[0].tobytes() == rows[1].tobytes()


TEXT: Any = "0.04"


@pytest.mark.parametrize(
    ("change", "refused"),
    [
        ({"motion": MOTION._replace(axial_amplitude=TEXT)}, "motion axial_amplitude: got '0.04'"),
        ({"motion": MOTION._replace(frequency=-3.0)}, "motion frequency: got -3.0"),
        ({"motion": DISK}, "allowed: [axial_amplitude, angular_amplitude, frequency, phase_lag]"),
        ({"motion": None}, "motion: got None"),
        ({"disk": DISK._replace(restitution=math.nan)}, "disk restitution: got nan"),
        ({"disk": DISK._replace(mass=TEXT)}, "disk mass: got '0.04'"),
        ({"disk": DISK._replace(gravity=0.0)}, "disk gravity + preload/mass: got 0.0"),
        ({"disk": (0.25, 0.5)}, "disk: got (0.25, 0.5)"),
        ({"initial": InitialState(height=-1.0)}, "initial height: got -1.0"),
        ({"initial": 0.1}, "initial: got 0.1"),
        ({"chatter_report_speed": math.nan}, "chatter_report_speed: got nan"),
    ],
)
def test_numbers_that_no_run_has_are_refused_in_one_line(
    change: dict[str, Any], refused: str
) -> None:
    """Most were tracebacks from within; a restitution of nan ran on without a word."""
    arguments = {"motion": MOTION, "disk": DISK, "initial": InitialState(), **change}
    with pytest.raises(InputError) as made:
        Simulation(**arguments)
    assert refused in made.value.line
    simulation = Simulation(MOTION, DISK, InitialState())
    before = simulation.snapshot()
    calls: dict[str, Callable[[Any], None]] = {
        "motion": lambda motion: simulation.command([(SECOND, motion)]),
        "disk": simulation.set_disk,
        "initial": simulation.reset,
        "chatter_report_speed": simulation.set_chatter_report_speed,
    }
    ((name, wrong),) = change.items()
    with pytest.raises(InputError):
        calls[name](wrong)
    assert simulation.snapshot() == before


KNOT = Knot(SECOND, OffsetState(0.01), LINE)


@pytest.mark.parametrize(
    ("call", "refused"),
    [
        (lambda sim, wrong: sim.advance(wrong), "until_ns"),
        (lambda sim, wrong: sim.advance(SECOND, wrong), "max_events"),
        (lambda sim, wrong: sim.apply_impulse(wrong, 0.1, 0.0), "impulse instant"),
        (lambda sim, wrong: sim.command([(wrong, MOTION)]), "points[0] instant"),
        (lambda sim, wrong: sim.command([(SECOND, MOTION)], wrong), "crossfade_ns"),
        (lambda sim, wrong: sim.trajectory(wrong, [KNOT]), "begin_ns"),
        (lambda sim, wrong: sim.trajectory(0, [KNOT._replace(at_ns=wrong)]), "axial[0] instant"),
        (lambda sim, wrong: sim.trajectory(0, [KNOT._replace(degree=wrong)]), "axial[0] degree"),
        (lambda sim, wrong: sim.resolve_due(wrong, cut_chatter=False), "max_events"),
    ],
)
@pytest.mark.parametrize("wrong", ["a", b"1", math.nan, math.inf, 1.5, True, 1j, [1], np.ones(2)])
def test_instants_and_counts_are_whole_numbers(
    call: Callable[[Simulation, Any], object], refused: str, wrong: Any
) -> None:
    """Texts were tracebacks from within; 1.5 ns and nan ran on without a word."""
    simulation = Simulation(MOTION, DISK, InitialState(height=0.1))
    before = simulation.snapshot()
    with pytest.raises(InputError) as made:
        call(simulation, wrong)
    assert made.value.line.startswith(f"{refused}: got ")
    assert simulation.snapshot() == before


@pytest.mark.parametrize(
    ("call", "refused"),
    [
        (lambda sim: sim.command("ab"), "points: got 'ab', allowed: a list"),
        (lambda sim: sim.command([SECOND, MOTION]), f"points[0]: got {SECOND}, allowed: [ins"),
        (lambda sim: sim.command([(SECOND, MOTION)], -1), "crossfade_ns: got -1"),
        (lambda sim: sim.trajectory(0, None, [1]), "angular[0]: got 1, allowed: [at_ns, state"),
        (
            lambda sim: sim.trajectory(0, [KNOT._replace(state=OffsetState(math.nan))]),
            "axial[0] posit",
        ),
        (lambda sim: sim.set_parameters(None, DISK), "values: got None"),
    ],
)
def test_other_things_than_inputs_are_refused_in_one_line(
    call: Callable[[Simulation], object], refused: str
) -> None:
    simulation = Simulation(MOTION, DISK, InitialState(height=0.1))
    before = simulation.snapshot()
    with pytest.raises(InputError) as made:
        call(simulation)
    assert made.value.line.startswith(refused)
    assert simulation.snapshot() == before


def test_numbers_of_numpy_are_numbers() -> None:
    amplitude: Any = np.float64(MOTION.axial_amplitude)
    whole: Any = np.int64(10**8)
    half: Any = np.float32(0.5)
    motion = MOTION._replace(axial_amplitude=amplitude)
    disk = DISK._replace(load_torque=whole - whole)
    plain = Simulation(MOTION, DISK, InitialState(height=0.5))
    given = Simulation(motion, disk, InitialState(height=half))
    plain.apply_impulse(10**8, 0.5, 0.0)
    given.apply_impulse(whole, half, 0.0)
    assert given.snapshot() == plain.snapshot()
    later: Any = np.int64(SECOND)
    assert given.advance(later)[0].tobytes() == plain.advance(SECOND)[0].tobytes()
