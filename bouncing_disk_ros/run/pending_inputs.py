"""What of the accepted inputs has not acted yet, counted."""

from __future__ import annotations

from typing import NamedTuple

from bouncing_disk_ros.units import NS


class Pending(NamedTuple):
    """Accepted inputs that have not acted."""

    motions: int = 0  # cross-fades that have not begun
    impulses: int = 0
    waiting: int = 0  # inputs whose instant is not resolved yet
    next_ns: int | None = None  # when the first cross-fade or impulse of them acts

    def __str__(self) -> str:
        if not any(self[:3]):
            return "none"
        parts = (
            (self.motions, "motion(s)"), (self.impulses, "impulse(s)"), (self.waiting, "waiting")
        )  # fmt: skip
        text = ", ".join(f"{count} {what}" for count, what in parts if count)
        return text if self.next_ns is None else f"{text}, the first at {self.next_ns / NS:.9f} s"


NOTHING_PENDING = Pending()
