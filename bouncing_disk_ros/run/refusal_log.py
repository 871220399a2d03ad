"""The log of refused inputs: at most one line a second for each reason, and a count of the rest."""

from __future__ import annotations

import re
import time
from collections.abc import Callable

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.limits import LOG_PERIOD, REASONS

_INDEX = re.compile(r"\[\d+\]")
_OTHERS = "others"


class _Reason:
    """When a reason was last on the log, and what came since."""

    def __init__(self) -> None:
        self.logged_at = float("-inf")
        self.since = 0
        self.last: InputError | None = None


class RefusalLog:
    """Logs refusals. The reason is the field at fault, whatever its index.

    `log` takes a line, `clock` gives seconds of the steady clock. Call `flush` once a second, so
    that what is counted is logged even when nothing more comes.
    """

    def __init__(
        self, log: Callable[[str], object], clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._log, self._clock = log, clock
        self._reasons: dict[str, _Reason] = {}
        self._of_field: dict[str, _Reason] = {}  # the same by some fields as they are

    def note(self, error: InputError) -> None:
        """Log a refusal, or count it when its reason was on the log a moment ago."""
        reason = self._reason(error.field)
        reason.last = error
        now = self._clock()
        if now - reason.logged_at < LOG_PERIOD:
            reason.since += 1
        else:
            self._log_reason(reason, now)

    def flush(self) -> None:
        """Log what was counted, for each reason whose last line is old enough."""
        now = self._clock()
        for reason in self._reasons.values():
            if reason.since and now - reason.logged_at >= LOG_PERIOD:
                reason.since -= 1  # this line stands for one
                self._log_reason(reason, now)

    def _reason(self, field: str) -> _Reason:
        reason = self._of_field.get(field)
        if reason is None:
            key = _INDEX.sub("[]", field)
            if key not in self._reasons and len(self._reasons) >= REASONS:
                key = _OTHERS
            reason = self._reasons.setdefault(key, _Reason())
            if len(self._of_field) < REASONS:
                self._of_field[field] = reason
        return reason

    def _log_reason(self, reason: _Reason, now: float) -> None:
        assert reason.last is not None
        more = f" (and {reason.since} more for this reason)" if reason.since else ""
        reason.logged_at, reason.since = now, 0
        self._log(f"refused: {reason.last.line}{more}")
