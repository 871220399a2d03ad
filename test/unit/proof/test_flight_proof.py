"""The referee of flights: what is right is proved, whatever is a little wrong is refuted."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from functools import cache

import pytest

from bouncing_disk_ros.core.model import Disk, InitialState, Motion, Phase
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.proof.event_proof import prove
from bouncing_disk_ros.proof.event_trace import trace
from bouncing_disk_ros.proof.exact_records import DiskRecord, Event, Kind, MotionRecord, State
from bouncing_disk_ros.proof.verdicts import Outcome

FREE = State(0, 0.0, 0, 0.0, Phase.FLIGHT, 0.0, 0.0, 0.0, 0.0)
STILL = MotionRecord(False, 0, 2**63 - 1, 0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
DISK = DiskRecord(0.5, 9.8, 0.0, 0.0)


def landing_after(d: float, w: float, state: State, motion: MotionRecord) -> Event:
    """An impact d seconds on; its instant is that of the delay."""
    grown = math.tau * motion.f * d
    cycles, tau = divmod(state.tau + grown, math.tau)
    ns = int(Fraction(d) * 10**9)
    sub = float(Fraction(d) * 10**9 - ns)
    after = state._replace(cycles=int(cycles), tau=tau, ns=ns, sub=sub, gap=0.0, u=-0.5 * w)
    return Event(Kind.IMPACT, state, motion, DISK, d, w, after)


@cache
def bounces(count: int) -> list[Event]:
    """Impacts of a disk that bounces at random, flights of up to some periods."""
    run = Simulation(
        Motion(0.01, 0.3, 12.0, 0.4), Disk(1.0, 0.95, 0.3, 0.1, 0.1, 9.81), InitialState(0.02)
    )
    events = [event for event in trace(run, 60_000_000_000) if event.kind is Kind.IMPACT]
    return events[:count]


def test_a_drop_on_a_platform_at_rest_is_proved() -> None:
    state = FREE._replace(gap=0.5)
    d = math.sqrt(2 * 0.5 / 9.8)
    verdict = prove(landing_after(d, -9.8 * d, state, STILL))
    assert verdict.outcome is Outcome.PROVED
    assert 0.0 < verdict.tolerance < 1e-14


def test_the_disk_that_fell_through_is_refuted() -> None:
    """A drop on a small, fast platform, said to have no impact within half a second."""
    motion = STILL._replace(a=1.598345836565672e-07, f=679.9234494730042)
    tau = 0.9047641082604492
    u = -1.8546770207731322 - motion.a * math.tau * motion.f * math.cos(tau)
    state = FREE._replace(gap=0.031169516410861017, u=u, tau=tau)
    event = Event(Kind.PROPAGATED, state, motion, DISK, 0.5, 0.0, None, 500_000_000)
    verdict = prove(event)
    assert verdict.outcome is Outcome.REFUTED
    assert "the gap is -" in verdict.reason
    assert prove(event._replace(boundary_ns=10_000_000)).outcome is Outcome.PROVED


def test_bounces_are_proved() -> None:
    events = bounces(50)
    assert len(events) == 50
    assert {prove(event).outcome for event in events} == {Outcome.PROVED}


def later(event: Event, tau: float = 0.0, cycles: int = 0) -> Event:
    after = event.after
    assert after is not None
    return event._replace(after=after._replace(tau=after.tau + tau, cycles=after.cycles + cycles))


WRONG: list[tuple[str, Callable[[Event], Event]]] = [
    *[("", lambda event, part=part: event._replace(delay=event.delay * (1.0 + part)))
      for part in (1e-13, -1e-13, 1e-6, -1e-6, 0.3)],
    *[("", lambda event, at=at: event._replace(delay=at)) for at in (-1.0, math.nan, math.inf)],
    *[("", lambda event, w=w: event._replace(value=w)) for w in (0.0, 1.0, math.nan, -math.inf)],
    ("w_A", lambda event: event._replace(value=event.value * (1.0 + 1e-12))),
    ("forcing phase", lambda event: later(event, tau=1e-12)),
    ("forcing phase", lambda event: later(event, cycles=1)),
]  # fmt: skip


@pytest.mark.parametrize(("reason", "wrong"), WRONG)
def test_an_impact_at_another_time_speed_or_phase_is_refuted(
    reason: str, wrong: Callable[[Event], Event]
) -> None:
    for event in bounces(20):
        verdict = prove(wrong(event))
        assert verdict.outcome is Outcome.REFUTED, (event, verdict)
        assert reason in verdict.reason


@pytest.mark.parametrize(
    ("shift", "outcome"),
    [(1e-13, Outcome.PROVED), (-3e-16, Outcome.UNDECIDED), (-1e-13, Outcome.REFUTED)],
)
def test_a_graze_within_rounding_is_undecided(shift: float, outcome: Outcome) -> None:
    """Thrown so that it is highest, at x = A, where the platform is: Aω² > g, so it touches."""
    t, motion = 0.1, STILL._replace(a=1.0, f=1.0)
    omega = math.tau * motion.f
    tau = math.pi / 2 - omega * t
    x, v = motion.a - DISK.g * t * t / 2 + shift, DISK.g * t
    s, s1 = motion.a * math.sin(tau), motion.a * omega * math.cos(tau)
    state = FREE._replace(tau=tau, gap=x - s, u=v - s1)
    verdict = prove(Event(Kind.PROPAGATED, state, motion, DISK, 0.15, 0.0, None, 150_000_000))
    assert verdict.outcome is outcome
    assert ("graze" in verdict.reason) == (outcome is Outcome.UNDECIDED)
    assert 0.0 < verdict.tolerance < 1e-13


def test_flights_of_tiny_bounces_keep_their_digits() -> None:
    """u = 1e-10 m/s on a platform of a metre: flight time and speed are right to rounding."""
    run = Simulation(
        Motion(1.0, 0.0, 0.3, 0.0), Disk(1.0, 1.0, 0.3, 0.1, 0.1, 9.81), InitialState()
    )
    run.apply_impulse(0, 1e-10, 0.0)
    event = next(event for event in trace(run, 1_000_000_000) if event.kind is Kind.IMPACT)
    assert event.before.u == 1e-10
    assert prove(event).outcome is Outcome.PROVED
    for changed in (
        event._replace(delay=event.delay * (1.0 + 1e-13)),
        event._replace(value=event.value * (1.0 + 1e-13)),
    ):
        assert prove(changed).outcome is Outcome.REFUTED
