"""A log with at most one line a second for each reason: of any lines, and of refused inputs."""

from __future__ import annotations

import functools
import re
import time
from collections.abc import Callable
from dataclasses import dataclass

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.limits import LOG_PERIOD, REASONS

_OTHERS = "others"
_INDEX = re.compile(r"\[\d+\]")


@dataclass
class _Reason:
    """When a reason was last on the log, and what came since."""

    logged_at: float = float("-inf")
    since: int = 0
    line: Callable[[], str] = str


class ThrottledLog:
    """Logs lines, each under a reason.

    `log` takes a line, `clock` gives seconds of the steady clock. Call `flush` once a second, so
    that what is counted is logged even when nothing more comes.
    """

    def __init__(
        self, log: Callable[[str], object], clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._log, self._clock = log, clock
        self._reasons: dict[str, _Reason] = {}

    def note(self, reason: str, line: Callable[[], str]) -> None:
        """Log a line, or count it when its reason was on the log a moment ago.

        From REASONS of them on there is one reason for all others.
        """
        if reason not in self._reasons and len(self._reasons) >= REASONS:
            reason = _OTHERS
        found = self._reasons.setdefault(reason, _Reason())
        found.line = line
        now = self._clock()
        if now - found.logged_at < LOG_PERIOD:
            found.since += 1
        else:
            self._log_reason(found, now)

    def note_refusal(self, error: InputError) -> None:
        """Log a refusal, or count it. Its reason is the field at fault, whatever its index."""
        self.note(_without_index(error.field), lambda: f"refused: {error.line}")

    def flush(self) -> None:
        """Log what was counted, for each reason whose last line is old enough."""
        now = self._clock()
        for reason in self._reasons.values():
            if reason.since and now - reason.logged_at >= LOG_PERIOD:
                reason.since -= 1  # this line stands for one
                self._log_reason(reason, now)

    def _log_reason(self, reason: _Reason, now: float) -> None:
        more = f" (and {reason.since} more)" if reason.since else ""
        reason.logged_at, reason.since = now, 0
        self._log(f"{reason.line()}{more}")


@functools.lru_cache(REASONS)
def _without_index(field: str) -> str:
    return _INDEX.sub("[]", field)
