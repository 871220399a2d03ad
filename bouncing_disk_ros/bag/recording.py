"""A writer in a thread of its own, behind a queue that is bounded in bytes.

The thread that receives messages never waits for the disk. What the queue cannot hold is counted.
"""

from __future__ import annotations

import queue
import threading
import time
from collections import Counter
from collections.abc import Callable, Mapping
from typing import NamedTuple

from bouncing_disk_ros.bag.writer import WriteError, Writer, write_error

PATIENCE = 0.1
"""Seconds after which the thread looks at the age of the open chunk."""
CHECK_SECONDS = 0.4
"""How often it looks whether the bag is still in its place, and its disk not full."""


class _Item(NamedTuple):
    topic: str
    data: bytes
    log_time_ns: int
    publish_time_ns: int
    sequence: int


class Recording:
    """Puts messages into a bag; `error` is what ended it. One thread may call the methods.

    Whatever goes wrong in the thread that writes ends the recording, with the bag closed.
    """

    def __init__(self, writer: Writer, capacity: int) -> None:
        self.writer = writer
        self.error: WriteError | None = None
        self.accepted: Counter[str] = Counter()
        self.dropped: Counter[str] = Counter()
        self._capacity = capacity
        self._queue: queue.SimpleQueue[_Item | Callable[[], object] | None] = queue.SimpleQueue()
        self._put_bytes = self._taken_bytes = 0  # each is changed by one thread only
        self._unwritten: Counter[str] = Counter()
        self._thread = threading.Thread(target=self._run, name="bag writer")
        self._thread.start()

    # --- the thread that receives -----------------------------------------------------------------
    def put(
        self, topic: str, data: bytes, log_time_ns: int, publish_time_ns: int, sequence: int
    ) -> bool:
        """Queue one message; False when the queue is full or the disk is: it is counted."""
        size = len(data)
        if self.error is not None or (self.queued and self.queued + size > self._capacity):
            self.dropped[topic] += 1
            return False
        self._put_bytes += size
        self.accepted[topic] += 1
        self._queue.put(_Item(topic, data, log_time_ns, publish_time_ns, sequence))
        return True

    def do(self, action: Callable[[], object]) -> None:
        """Queue something to do with the writer between two messages."""
        self._queue.put(action)

    @property
    def queued(self) -> int:
        """Bytes of messages that wait for the disk."""
        return self._put_bytes - self._taken_bytes

    def note(self, notes: Mapping[str, str]) -> None:
        """Notes for the bag, from now on."""
        self.writer.notes = {**self.writer.notes, **notes}

    def close(self) -> None:
        """Write all that waits and close the bag; the first error is in `error`."""
        self._queue.put(None)
        self._thread.join()

    @property
    def recorded(self) -> Counter[str]:
        """Messages of each topic that are in the bag (final after `close`)."""
        lost = self._unwritten + self.writer.lost_on_disk
        return Counter({topic: n - lost[topic] for topic, n in self.accepted.items()})

    @property
    def unrecorded(self) -> Counter[str]:
        """Messages of each topic that were received and are not in the bag."""
        return self.dropped + self._unwritten + self.writer.lost_on_disk

    # --- the thread that writes -------------------------------------------------------------------
    def _run(self) -> None:
        check_at = 0.0
        while True:
            if (now := time.monotonic()) >= check_at:
                self._guarded(self.writer.check)
                check_at = now + CHECK_SECONDS
            try:
                item = self._queue.get(timeout=PATIENCE)
            except queue.Empty:
                self._guarded(self.writer.tick)
                continue
            if item is None:
                break
            if isinstance(item, _Item):
                self._write(item)
            else:
                self._guarded(item)
        self._guarded(self.writer.close)

    def _write(self, item: _Item) -> None:
        self._taken_bytes += len(item.data)
        if self.error is not None:
            self._unwritten[item.topic] += 1
            return
        self._guarded(lambda: self.writer.write(*item))

    def _guarded(self, action: Callable[[], object]) -> None:
        if self.error is not None:
            return
        try:
            action()
        except WriteError as error:
            self.error = error
        except Exception as error:  # noqa: BLE001 (the thread must not die of it in silence)
            self.error = self._ended_by(error)

    def _ended_by(self, error: Exception) -> WriteError:
        try:
            return self.writer.fail(error)
        except Exception as second:  # noqa: BLE001 (the file is unfinished, and can be recovered)
            return write_error(self.writer.folder, second, self.accepted.total())
