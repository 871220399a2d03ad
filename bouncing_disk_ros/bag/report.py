"""What a recovery tells: what was saved, what was lost, as far as that can be known."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path


@dataclass
class Report:
    """What recovery saved and what it could not save, in words and in numbers."""

    output: Path
    saved: int = 0
    lost: int = 0
    exact: bool = True  # else more may be lost than `lost`
    lines: list[str] = field(default_factory=list)

    @property
    def summary(self) -> str:
        """One line."""
        lost = f"{self.lost} lost" if self.lost else "nothing that was written is lost"
        if not self.exact:
            more = "what was cut off or unreadable is lost, how much is unknown"
            lost = f"{lost}, and {more}" if self.lost else more
        return f"{self.output}: {self.saved} messages saved, {lost}"
