"""Records of a run as exact numbers: what the proof takes from the core.

A float64 is a dyadic number, so every field here is exact: the proof asks what follows from these
numbers, not from others near them.
"""

from __future__ import annotations

from enum import StrEnum
from typing import NamedTuple

from bouncing_disk_ros.core.model import Phase


class Kind(StrEnum):
    """Kind of an event, and with it what is to be proved."""

    IMPACT = "impact"
    SEPARATION = "separation"
    SLIP = "slip begins"
    SLIP_ENDS = "slip ends"
    CHATTER = "chatter completed"
    STILL = "bounce without duration"
    PROPAGATED = "no event until"  # an input, an end of a cross-fade, the end of the trace


class State(NamedTuple):
    """State of the disk and the clock at an instant, as the core stores it."""

    ns: int
    sub: float  # ns
    cycles: int
    tau: float  # rad
    phase: Phase
    slip_sign: float
    gap: float  # m
    u: float  # m/s, of the gap
    omega: float  # α̇, rad/s


class OffsetPiece(NamedTuple):
    """One polynomial of an offset: what is stated at its ends, and its degree (0: a hold)."""

    begin_ns: int
    end_ns: int
    start: tuple[float, ...]  # position, velocity, acceleration (m or rad, per s)
    end: tuple[float, ...]
    degree: int


class MotionRecord(NamedTuple):
    """Platform motion: values at begin_ns, what a cross-fade adds to them, and the offsets."""

    fading: bool
    begin_ns: int
    end_ns: int
    cycles: int  # at begin_ns
    tau: float
    a: float
    da: float
    p: float
    dp: float
    f: float
    df: float
    lag: float
    dlag: float
    axial: OffsetPiece | None = None  # offset of s; None: 0
    angular: OffsetPiece | None = None  # of β

    @property
    def repeats(self) -> bool:
        """Whether it is the same in each period, but for what is held."""
        return not self.fading and not any(x and x.degree for x in (self.axial, self.angular))


class DiskRecord(NamedTuple):
    """Disk and contact: ε, g + P/m, μ a_e m/I, T_L/I and T_B/I."""

    restitution: float
    g: float
    grip: float
    lag: float
    brake: float = 0.0


class Event(NamedTuple):
    """One event of a run: the state before, when the event is said to come, the state after."""

    kind: Kind
    before: State
    motion: MotionRecord
    disk: DiskRecord
    delay: float  # s from the clock of `before`
    value: float  # w_A of an impact; sign of w_T in a chatter and where a slip begins
    after: State | None  # None: the trace ends here
    boundary_ns: int | None = None  # the next input or end of a cross-fade; None: there is none
    inherited: float = 0.0  # rad/s: α̇ that the slip before began with, whose rounding α̇ still has
