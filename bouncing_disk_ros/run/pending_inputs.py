"""What of the accepted inputs has not acted yet, counted."""

from __future__ import annotations

from typing import NamedTuple

from bouncing_disk_ros.units import NS


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
        return text if self.next_ns is None else f"{text}, the first at {self.next_ns / NS:.9f} s"


NOTHING_PENDING = Pending()
