"""The referee of contact: separation, slips and their ends; what is a little wrong is refuted."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from functools import cache
from typing import Any

import pytest

from bouncing_disk_ros.core.model import Disk, InitialState, Motion, Phase
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.proof.event_proof import prove
from bouncing_disk_ros.proof.event_trace import trace
from bouncing_disk_ros.proof.exact_records import Event, Kind
from bouncing_disk_ros.proof.verdicts import Outcome

NS = 1_000_000_000
NAMES = {
    Kind.SEPARATION: "load",
    Kind.SLIP: "stick margin",
    Kind.SLIP_ENDS: "slip",
    Kind.CHATTER: "chatter",
}
#: sticks, slips, separates and comes back by chatter, over and over
TOSSED = Motion(0.08, 1.0, 2.0, 0.3)
#: never separates; sticks and slips to and fro
SHAKEN = Motion(0.02, 1.0, 2.0, 0.3)
DISK = Disk(0.5, 0.4, 0.5, 0.1, 0.1, 9.81)


def events(motion: Motion, kind: Kind, *, fade: Motion | None = None) -> list[Event]:
    """Events of a kind that a disk on the platform goes through."""
    run = Simulation(motion, DISK, InitialState())
    if fade is not None:
        run.command([(4 * NS, fade)], crossfade_ns=4 * NS)
    return [event for event in trace(run, 4 * NS) if event.kind is kind]


@cache
def both(kind: Kind) -> list[Event]:
    """Events in steady motions and in a cross-fade from one to the other."""
    found = events(TOSSED, kind) + events(SHAKEN, kind)
    found += events(SHAKEN, kind, fade=TOSSED._replace(frequency=3.0))
    assert len(found) > 2
    return found[:12]


@pytest.mark.parametrize("kind", NAMES)
@pytest.mark.parametrize("part", [1e-9, -1e-9, 0.01])
def test_an_event_at_another_time_is_refuted(kind: Kind, part: float) -> None:
    for event in both(kind):
        verdict = prove(event._replace(delay=event.delay * (1.0 + part)))
        assert verdict.outcome is Outcome.REFUTED, (event, verdict)
        if part > 0.0:
            assert NAMES[kind] in verdict.reason


@pytest.mark.parametrize("kind", [Kind.SEPARATION, Kind.SLIP, Kind.SLIP_ENDS])
def test_an_event_that_is_passed_over_is_refuted(kind: Kind) -> None:
    """Nothing is said to come until some time after it."""
    for event in both(kind):
        later = math.ceil(event.before.ns + 1.2 * event.delay * NS) + 1000
        verdict = prove(
            event._replace(kind=Kind.PROPAGATED, boundary_ns=later, after=None, value=0.0)
        )
        assert verdict.outcome is Outcome.REFUTED, (event, verdict)
        assert NAMES[kind] in verdict.reason


def begun(**other: Any) -> Callable[[Event], Event]:
    """Nothing is said to happen, to a disk that begins with other numbers."""
    return lambda event: event._replace(kind=Kind.PROPAGATED, before=event.before._replace(**other))


def faster_after(event: Event) -> Event:
    assert event.after is not None
    return event._replace(after=event.after._replace(omega=event.after.omega + 1e-11))


def off_the_platform(event: Event, off: float) -> Event:
    return event._replace(before=event.before._replace(omega=event.before.omega + off))


def turned(event: Event) -> Event:
    return event._replace(before=event.before._replace(slip_sign=-event.before.slip_sign))


STICKS = "the speed of a disk that sticks"
WRONG: list[tuple[Kind, Callable[[Event], Event], str]] = [
    (Kind.SLIP, lambda event: event._replace(value=-event.value), ""),
    (Kind.SLIP_ENDS, turned, ""),
    (Kind.SLIP_ENDS, begun(phase=Phase.STICKING), ""),
    (Kind.SLIP, lambda event: off_the_platform(event, 1e-9), STICKS),
    (Kind.SLIP, lambda event: off_the_platform(event, -1e-9), STICKS),
    (Kind.SLIP, begun(phase=Phase.SLIDING, slip_sign=1.0), ""),
    (Kind.SLIP, begun(phase=Phase.SLIDING, slip_sign=-1.0), ""),
    (Kind.SLIP, begun(phase=Phase.FLIGHT), "gap"),
    *[(kind, faster_after, "turns on") for kind in NAMES],
    (Kind.SLIP, lambda event: event._replace(kind=Kind.SLIP_ENDS), "cannot end STICKING"),
]


@pytest.mark.parametrize(("kind", "wrong", "reason"), WRONG)
def test_what_is_wrong_in_an_event_is_refuted(
    kind: Kind, wrong: Callable[[Event], Event], reason: str
) -> None:
    """Signs of slip, sticking where it slides, other speeds before and after, a flight."""
    for event in both(kind):
        verdict = prove(wrong(event))
        assert verdict.outcome is Outcome.REFUTED
        assert reason in verdict.reason


def test_chatter_that_does_not_complete_is_refuted() -> None:
    for event in both(Kind.CHATTER):
        cut = event._replace(boundary_ns=event.before.ns + math.floor(event.delay * NS / 2))
        assert "after the next input" in prove(cut).reason
        elastic = event._replace(disk=event.disk._replace(restitution=1.0))
        assert prove(elastic).outcome is Outcome.REFUTED


def test_friction_in_a_chatter_is_checked() -> None:
    """A chatter said to slip one way slips the other, or one that slips is said to stick."""
    changed = 0
    for event in both(Kind.CHATTER):
        others = {-1.0, 0.0, 1.0} - {event.value}
        for value in others:
            changed += prove(event._replace(value=value)).outcome is not Outcome.PROVED
        assert prove(event).outcome is Outcome.PROVED
    assert changed == 2 * len(both(Kind.CHATTER))


def test_endless_sliding_is_proved_in_few_pieces() -> None:
    """A slow slip of 10⁹ periods: no period is looked at by itself."""
    run = Simulation(
        Motion(1e-13, 1e-9, 1e6, 0.0),
        Disk(1.0, 0.0, 1e-4, 0.1, 0.1, 9.81),
        InitialState(angular_velocity=10.0),
    )
    found = list(itertools.islice(trace(run, 10**14), 5))
    assert any(event.delay > 100.0 for event in found)
    for event in found:
        verdict = prove(event)
        assert verdict.outcome is Outcome.PROVED, (event, verdict)
        assert verdict.pieces < 200
