"""One command to a run, from its request to the session: validated, scheduled, applied."""

from __future__ import annotations

from collections.abc import Callable

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
from bouncing_disk_ros.run.session import Session
from bouncing_disk_ros.run.trajectory_validation import (
    TrajectoryRequest,
    describe_trajectory,
    schedule_trajectory,
    validate_trajectory,
)
from bouncing_disk_ros.units import NS

Request = ProgrammeRequest | TrajectoryRequest | ImpulseRequest
Opened = Callable[[str], tuple[Session, Instant]]
"""Gives the session that accepts an input of a field, and the instant of its arrival."""


def apply_command(request: Request, opened: Opened) -> tuple[str, str]:
    """What a command does, in words, and a remark on it; InputError, and nothing done, if refused.

    The session is asked for only when everything else about the command is right.
    """
    match request:
        case ProgrammeRequest():
            changes = validate_programme(request)
            session, instant = opened(request.field)
            points = schedule_programme(request, changes, instant, session.latest_target)
            session.command(points)
            line = describe(points)
        case TrajectoryRequest():
            validate_trajectory(request)
            session, instant = opened(request.field)
            splice = schedule_trajectory(request, instant, session.latest_offset, session.values)
            session.trajectory(splice)
            line = describe_trajectory(splice)
        case ImpulseRequest():
            validate_impulse(request)
            session, instant = opened(request.field)
            at_ns, axial, angular = schedule_impulse(request, instant)
            session.apply_impulse(at_ns, axial, angular)
            line = f"{axial:g} N·s, {angular:g} N·m·s at {at_ns / NS:.9f} s"
    return f"{line}; pending: {session.pending}", far_ahead(request, instant)
