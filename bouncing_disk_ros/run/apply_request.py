"""A request from outside becomes an input of a session: validated, scheduled, applied."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from bouncing_disk_ros.run.command_validation import (
    ImpulseRequest,
    Instant,
    ProgrammeRequest,
    describe,
    far_ahead,
    schedule_impulse,
    schedule_programme,
    validate_impulse,
    validate_programme,
)
from bouncing_disk_ros.run.trajectory_validation import (
    TrajectoryRequest,
    describe_trajectory,
    schedule_trajectory,
    validate_trajectory,
)
from bouncing_disk_ros.units import NS

if TYPE_CHECKING:
    from bouncing_disk_ros.run.session import Session

Request = ProgrammeRequest | TrajectoryRequest | ImpulseRequest
Arrive: TypeAlias = "Callable[[], tuple[Session, Instant]]"
"""Gives the session and the instant of arrival; called once all else about a request is right."""


class Accepted(NamedTuple):
    """What was accepted, in words for a log."""

    line: str
    remark: str  # what the sender should look at; empty: nothing


def apply_request(request: Request, arrive: Arrive) -> Accepted:
    """Give a request to the session; InputError where it is not accepted, then nothing changes."""
    match request:
        case ProgrammeRequest():
            changes = validate_programme(request)
            session, instant = arrive()
            points = schedule_programme(request, changes, instant, session.latest_target)
            session.command(points)
            line = describe(points)
        case TrajectoryRequest():
            validate_trajectory(request)
            session, instant = arrive()
            splice = schedule_trajectory(
                request, instant, session.latest_offset, session.latest_values
            )
            session.trajectory(splice)
            line = describe_trajectory(splice)
        case ImpulseRequest():
            validate_impulse(request)
            session, instant = arrive()
            at_ns, axial, angular = schedule_impulse(request, instant)
            session.apply_impulse(at_ns, axial, angular)
            line = f"{axial:g} N·s, {angular:g} N·m·s at {at_ns / NS:.9f} s"
    return Accepted(f"{line}; pending: {session.pending}", far_ahead(request, instant))
