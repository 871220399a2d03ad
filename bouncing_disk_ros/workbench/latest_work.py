"""Work in a thread, of which the newest request alone counts."""

from __future__ import annotations

import threading
from collections.abc import Callable

from bouncing_disk_ros.niceness import give_way

IsObsolete = Callable[[], bool]
Work = Callable[[IsObsolete], None]


class LatestWork:
    """Does what was asked for last; what is in work then is told that it is obsolete.

    One thread at a time, which ends when there is nothing to do. `ask` never blocks.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._waiting: Work | None = None
        self._asked = 0
        self._thread: threading.Thread | None = None

    def ask(self, work: Work) -> None:
        """Call `work(is_obsolete)` in the thread; it returns early once `is_obsolete()` holds."""
        with self._lock:
            self._waiting = work
            self._asked += 1
            if self._thread is None:
                self._thread = threading.Thread(target=self._run, daemon=True)
                self._thread.start()

    def join(self) -> None:
        """Wait until there is nothing to do: for tests and measurements."""
        while (thread := self._thread) is not None:
            thread.join()

    def _run(self) -> None:
        give_way()
        while (taken := self._take()) is not None:
            work, number = taken
            try:
                work(lambda number=number: number != self._asked)  # type: ignore[misc]
            except BaseException:
                with self._lock:  # the next call starts a thread of its own
                    self._thread = None
                raise

    def _take(self) -> tuple[Work, int] | None:
        with self._lock:
            work, self._waiting = self._waiting, None
            if work is None:
                self._thread = None
                return None
            return work, self._asked
