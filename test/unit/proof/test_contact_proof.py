"""The referee of contact: separation, slips and their ends; what is a little wrong is refuted."""

from __future__ import annotations

import itertools
import math

import pytest

from bouncing_disk_ros.core.model import Disk, InitialState, Motion, Phase
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.proof.event_proof import prove
from bouncing_disk_ros.proof.event_trace import trace
from bouncing_disk_ros.proof.exact_records import Event, Kind, Outcome

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


def both(kind: Kind) -> list[Event]:
    """Events in steady motions and in a cross-fade from one to the other."""
    found = events(TOSSED, kind) + events(SHAKEN, kind)
    found += events(SHAKEN, kind, fade=TOSSED._replace(frequency=3.0))
    assert len(found) > 2
    return found[:12]


def test_all_events_of_contact_are_proved() -> None:
    for kind in (*NAMES, Kind.IMPACT, Kind.PROPAGATED):
        for event in events(TOSSED, kind) + events(SHAKEN, kind, fade=TOSSED):
            verdict = prove(event)
            assert verdict.outcome is Outcome.PROVED, (event, verdict)


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


def test_slips_of_the_wrong_sign_are_refuted() -> None:
    for event in both(Kind.SLIP):
        assert prove(event._replace(value=-event.value)).outcome is Outcome.REFUTED
    for event in both(Kind.SLIP_ENDS):
        before = event.before._replace(slip_sign=-event.before.slip_sign)
        assert prove(event._replace(before=before)).outcome is Outcome.REFUTED


def test_sticking_where_the_disk_slides_is_refuted() -> None:
    for event in both(Kind.SLIP_ENDS):
        before = event.before._replace(phase=Phase.STICKING)
        carried = event._replace(kind=Kind.PROPAGATED, before=before)
        assert prove(carried).outcome is Outcome.REFUTED


@pytest.mark.parametrize("off", [1e-9, -1e-9])
def test_sticking_at_another_speed_than_the_platform_s_is_refuted(off: float) -> None:
    for event in both(Kind.SLIP):
        before = event.before._replace(omega=event.before.omega + off)
        verdict = prove(event._replace(before=before))
        assert verdict.outcome is Outcome.REFUTED
        assert "the speed of a disk that sticks" in verdict.reason


def test_sliding_where_the_disk_sticks_is_refuted() -> None:
    for event in both(Kind.SLIP):
        for sign in (1.0, -1.0):
            before = event.before._replace(phase=Phase.SLIDING, slip_sign=sign)
            carried = event._replace(kind=Kind.PROPAGATED, before=before)
            assert prove(carried).outcome is Outcome.REFUTED


def test_flight_where_the_platform_presses_is_refuted() -> None:
    for event in both(Kind.SLIP):
        before = event.before._replace(phase=Phase.FLIGHT)
        verdict = prove(event._replace(kind=Kind.PROPAGATED, before=before))
        assert verdict.outcome is Outcome.REFUTED
        assert "gap" in verdict.reason


def test_another_speed_after_an_event_is_refuted() -> None:
    for kind in (Kind.SLIP, Kind.SLIP_ENDS, Kind.SEPARATION, Kind.CHATTER):
        for event in both(kind):
            assert event.after is not None
            after = event.after._replace(omega=event.after.omega + 1e-11)
            verdict = prove(event._replace(after=after))
            assert verdict.outcome is Outcome.REFUTED
            assert "turns on" in verdict.reason


def test_an_event_that_cannot_end_the_phase_is_refuted() -> None:
    for event in both(Kind.SLIP):
        verdict = prove(event._replace(kind=Kind.SLIP_ENDS))
        assert verdict.outcome is Outcome.REFUTED
        assert "cannot end STICKING" in verdict.reason


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
