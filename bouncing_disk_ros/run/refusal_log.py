"""The log of refused inputs: at most one line a second for each reason, and a count of the rest."""

from __future__ import annotations

import re
import time
from collections.abc import Callable

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.limits import REASONS
from bouncing_disk_ros.run.throttled_log import Reason, ThrottledLog

_INDEX = re.compile(r"\[\d+\]")


class RefusalLog:
    """Logs refusals. The reason is the field at fault, whatever its index.

    Arguments and `flush` are those of `ThrottledLog`.
    """

    def __init__(
        self, log: Callable[[str], object], clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._lines = ThrottledLog(log, clock)
        self._of_field: dict[str, Reason] = {}  # the reasons of some fields as they are
        self.flush = self._lines.flush

    def note(self, error: InputError) -> None:
        """Log a refusal, or count it when its reason was on the log a moment ago."""
        self._lines.note(self._reason(error.field), lambda: f"refused: {error.line}")

    def _reason(self, field: str) -> Reason:
        reason = self._of_field.get(field)
        if reason is None:
            reason = self._lines.reason(_INDEX.sub("[]", field))
            if len(self._of_field) < REASONS:
                self._of_field[field] = reason
        return reason
