"""Inputs that have not acted yet: cross-fades and impulses with their instants, counts of all."""

from __future__ import annotations

from bisect import insort
from collections.abc import Sequence
from typing import NamedTuple

from bouncing_disk_ros.core.model import Motion


class Fade(NamedTuple):
    """A cross-fade that has not begun."""

    begin_ns: int
    end_ns: int
    target: Motion


class Impulse(NamedTuple):
    """An impulse on the disk that has not acted."""

    at_ns: int
    axial_impulse: float  # N·s
    angular_impulse: float  # N·m·s


def crossfade_duration_ns(start: Motion, target: Motion) -> int:
    """Default duration of a cross-fade: one period of the slower motion, in whole nanoseconds."""
    return max(round(1e9 / min(start.frequency, target.frequency)), 1)


def shortest_crossfade_ns(start: Motion, target: Motion) -> int:
    """Shortest cross-fade, whole ns: 1/1000 of a period of the faster motion.

    The platform reaches speeds of 15 ΔA/(8 T) on the way, and what is relative to the platform is
    rounded on their scale: in a fade of nanoseconds that is all but the first eight digits.
    """
    return max(round(1e6 / max(start.frequency, target.frequency)), 1)


def plan_fades(
    points: Sequence[tuple[int, Motion]], start: Motion, free_ns: int, crossfade_ns: int
) -> list[Fade]:
    """Cross-fades that reach each point's motion at its time.

    A fade begins a duration before its point's time, but not before free_ns or the end of the one
    before, and ends at the point's time or a duration after its beginning, whichever is later.
    The duration is `crossfade_ns`, at least the shortest; 0: the default. Times must increase
    strictly.
    """
    fades: list[Fade] = []
    for at_ns, target in points:
        duration = crossfade_duration_ns(start, target)
        if crossfade_ns:
            duration = max(crossfade_ns, shortest_crossfade_ns(start, target))
        begin = max(at_ns - duration, free_ns)
        free_ns = max(at_ns, begin + duration)
        fades.append(Fade(begin, free_ns, target))
        start = target
    return fades


def add_impulse(impulses: list[Impulse], impulse: Impulse) -> None:
    """Queue an impulse behind those of the same instant."""
    insort(impulses, impulse, key=lambda queued: queued.at_ns)


class Pending(NamedTuple):
    """Accepted inputs that have not acted."""

    motions: int = 0  # cross-fades that have not begun
    impulses: int = 0
    waiting: int = 0  # inputs whose instant is not resolved yet
    next_ns: int | None = None  # when the first of them acts that waits for its stamp
    trajectories: int = 0  # instants at which offset trajectories take over

    def __str__(self) -> str:
        parts = (
            (self.motions, "motion(s)"), (self.trajectories, "offset(s)"),
            (self.impulses, "impulse(s)"), (self.waiting, "waiting"),
        )  # fmt: skip
        if not any(count for count, _ in parts):
            return "none"
        text = ", ".join(f"{count} {what}" for count, what in parts if count)
        if self.next_ns is None:
            return text
        return f"{text}, the first at {self.next_ns / 10**9:.9f} s"


NOTHING_PENDING = Pending()
