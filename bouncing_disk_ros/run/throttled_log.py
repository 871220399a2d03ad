"""Logs with at most one line a second for each reason: of any lines, and of refused inputs."""

from __future__ import annotations

import re
import time
from collections.abc import Callable

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.limits import LOG_PERIOD, REASONS

_OTHERS = "others"


class Reason:
    """When a reason was last on the log, and what came since."""

    def __init__(self) -> None:
        self.logged_at = float("-inf")
        self.since = 0
        self.line: Callable[[], str] = str


class ThrottledLog:
    """Logs lines, each under a reason.

    `log` takes a line, `clock` gives seconds of the steady clock. Call `flush` once a second, so
    that what is counted is logged even when nothing more comes.
    """

    def __init__(
        self, log: Callable[[str], object], clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._log, self._clock = log, clock
        self._reasons: dict[str, Reason] = {}

    def reason(self, key: str) -> Reason:
        """The reason of a key, for `note`; from REASONS of them on, one for all others."""
        if key not in self._reasons and len(self._reasons) >= REASONS:
            key = _OTHERS
        return self._reasons.setdefault(key, Reason())

    def note(self, reason: str | Reason, line: Callable[[], str]) -> None:
        """Log a line, or count it when its reason was on the log a moment ago."""
        found = self.reason(reason) if isinstance(reason, str) else reason
        found.line = line
        now = self._clock()
        if now - found.logged_at < LOG_PERIOD:
            found.since += 1
        else:
            self._log_reason(found, now)

    def flush(self) -> None:
        """Log what was counted, for each reason whose last line is old enough."""
        now = self._clock()
        for reason in self._reasons.values():
            if reason.since and now - reason.logged_at >= LOG_PERIOD:
                reason.since -= 1  # this line stands for one
                self._log_reason(reason, now)

    def _log_reason(self, reason: Reason, now: float) -> None:
        more = f" (and {reason.since} more)" if reason.since else ""
        reason.logged_at, reason.since = now, 0
        self._log(f"{reason.line()}{more}")


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
