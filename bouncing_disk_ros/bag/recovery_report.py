"""Report of a recovery: what was saved, what was lost, as far as that can be known."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from bouncing_disk_ros.bag.file_pieces import Damage
from bouncing_disk_ros.units import NS

MOST_LINES = 200
"""Damages that are listed one by one."""
_WHOLE = "nothing that was written is lost"


@dataclass
class Report:
    """Report of a recovery: what was saved and what was lost, in words and in numbers."""

    output: Path
    saved: int = 0
    lost: int = 0
    exact: bool = True  # else more may be lost than `lost`
    lines: list[str] = field(default_factory=list)
    lost_records: list[str] = field(default_factory=list)  # attachments and notes, in words
    unlisted: int = 0  # damages beyond MOST_LINES

    def add(self, line: str) -> None:
        """List one damage more, or count it."""
        if len(self.lines) < MOST_LINES:
            self.lines.append(line)
        else:
            self.unlisted += 1

    @property
    def summary(self) -> str:
        """One line."""
        whole = "no message that was written is lost" if self.lost_records else _WHOLE
        lost = f"{self.lost} lost" if self.lost else whole
        if not self.exact:
            more = "an unknown number of messages, cut off or unreadable, is lost"
            lost = f"{lost}, and {more}" if self.lost else more
        records = f"; lost: {', '.join(self.lost_records[:10])}" if self.lost_records else ""
        if (unnamed := len(self.lost_records) - 10) > 0:
            records += f" and {unnamed} more"
        return f"{self.output}: {self.saved} messages saved, {lost}{records}"


def loss_text(name: str, damage: Damage, topics: Mapping[int, str]) -> str:
    """What was lost in a file by one damage, in words; `topics` by channel."""
    where = f"{name}: bytes {damage.offset} to {damage.offset + damage.length}"
    if not damage.length:
        return f"{name}: {damage.reason}"
    span = ""
    if damage.span_ns is not None:
        first, last = (time / NS for time in damage.span_ns)
        span = f", received between {first:.3f} and {last:.3f} s"
    counted = ", ".join(f"{n} of {topics.get(c, c)}" for c, n in damage.counts.items())
    nothing_known = "what was there" if damage.holds_messages else damage.record or "no messages"
    return f"{where}: {damage.reason}: lost {counted or nothing_known}{span}"
