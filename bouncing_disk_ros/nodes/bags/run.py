"""Reads one run of one simulator out of a bag, as a `RunRecord`; memory stays bounded."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.analysis.recorded.run_record import (
    UNKNOWN_DISK,
    RunRecord,
    State,
    joined_rows,
)
from bouncing_disk_ros.analysis.report.report import Source, TopicCount
from bouncing_disk_ros.bag import Bag, BagError
from bouncing_disk_ros.bag.topic import Message
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.nodes.bags.order import Losses, in_order_of_sending
from bouncing_disk_ros.nodes.bags.simulators import WANTED, choose, is_there
from bouncing_disk_ros.nodes.shared.hearing import Hearing
from bouncing_disk_ros.ros.conversions import impacts_from_msg

T = TypeVar("T")
MOST_SAMPLES = 200_000
"""Of joint_states and of disk/rotor_speed at most so many messages are kept, evenly taken."""
_JOIN, _JOIN_ROWS = 4096, 65536
"""So many small arrays of impacts, or arrays with so many rows, are joined into one."""


class Wish(NamedTuple):
    """What to read: None and 0 leave the choice to the bag."""

    namespace: str | None = None
    run: int = 0  # from 1; 0: the last
    begin: float = -math.inf  # simulated s
    end: float = math.inf
    most_rows: int = 1_000_000
    topics: tuple[str, ...] = ()  # of the simulator, by their short names; none: all

    @property
    def is_cut(self) -> bool:
        """Whether times are left out."""
        return self.begin > -math.inf or self.end < math.inf

    def nothing_between(self, first: float, last: float) -> InputError:
        """The refusal of times in which a run, from `first` to `last` s, has nothing."""
        given = " ".join(
            f"{word} {time:g} s"
            for word, time in (("from", self.begin), ("to", self.end))
            if math.isfinite(time)
        )
        inside = self.begin <= last and self.end > first
        hint = "No message lies within." if inside else "That lies outside the run."
        allowed = f"times within the run, from {first:.3f} s to {last:.3f} s"
        return InputError("from, to", given, allowed, hint)


class Thinned(list[T]):
    """A list that keeps every first, second, fourth ... of what is appended, at most `most`."""

    def __init__(self, most: int) -> None:
        super().__init__()
        self.step, self._most, self._seen = 1, most, 0

    def append(self, item: T) -> None:
        """Take one more, or leave it out."""
        if self._seen % self.step == 0:
            super().append(item)
            if len(self) >= self._most:
                del self[1::2]
                self.step *= 2
        self._seen += 1


class BagRun:
    """Reads a bag once; after `read`, `record` and `source` are the run wished for."""

    def __init__(self, bag: Bag, wish: Wish) -> None:
        self._bag, self._wish = bag, wish
        self.namespace = choose(bag, wish.namespace)
        base = self.namespace.rstrip("/")
        names = {"/diagnostics": "/diagnostics"}
        names |= {f"{base}/{short}": short for short in WANTED}
        if wish.topics:
            names = {name: short for name, short in names.items() if short in wish.topics}
        self._names = {name: short for name, short in names.items() if is_there(bag, name, short)}
        self._missing = tuple(sorted(set(names.values()) - set(self._names.values())))
        self._losses = Losses()
        self._stopped = ""
        self._runs = self._kept_run = 0
        self.record = RunRecord(UNKNOWN_DISK)
        self._bounded = Bounded(self.record.chunks, wish)
        self._begin_run()

    def _begin_run(self) -> None:
        self._runs += 1
        self._record = RunRecord(UNKNOWN_DISK)
        self._record.states = Thinned[State](MOST_SAMPLES)
        self._record.speeds = Thinned[tuple[float, float]](MOST_SAMPLES)
        self._hearing = Hearing(self._record, self.namespace)
        self._latest = {"disk/inputs": -1, "disk/impacts": -1}
        if self._wish.run in (0, self._runs):
            self.record, self._kept_run = self._record, self._runs
            self._bounded = Bounded(self._record.chunks, self._wish)

    # --- reading ----------------------------------------------------------------------------------
    @property
    def total(self) -> int:
        """Messages to go through."""
        return sum(self._bag.topics[name].count for name in self._names)

    def read(self) -> Iterator[None]:
        """Go through the bag; one step for each message. InputError: there is no such run."""
        for message, content in in_order_of_sending(self._decoded()):
            self._take(self._names[message.topic], content)
            yield
        if not self._kept_run:
            raise InputError("run", self._wish.run, f"1 to {self._runs}")
        if self._wish.is_cut:
            self._clip()

    def _decoded(self) -> Iterator[tuple[Message, Any]]:
        try:
            for message, content in self._bag.decoded(self._names):
                self._losses.note(message)
                yield message, content
        except BagError as error:
            self._stopped = f"{error}; what follows is not in this report (bag_recover saves it)"

    def _take(self, short: str, content: Any) -> None:
        if short in self._latest:
            first, last = _indices(short, content)
            if first <= self._latest[short]:  # a running index falls
                self._begin_run()
            self._latest[short] = max(self._latest[short], last)
        self._hearing.takers[short](content)
        if self._record is not self.record:
            self._record.chunks.clear()
        elif short == "disk/impacts":
            self._bounded.tidy()

    def _clip(self) -> None:
        """Keep what lies in the times wished for; InputError: the run has nothing there."""
        low, high, record = self._wish.begin, self._wish.end, self.record
        times = [*self._bounded.seen, *(row.time for row in record.states)]
        times += [time for time, _ in record.speeds]
        times += [row.simulated for row in record.health]
        record.states[:] = [row for row in record.states if low <= row.time < high]
        record.speeds[:] = [row for row in record.speeds if low <= row[0] < high]
        record.health[:] = [row for row in record.health if low <= row.simulated < high]
        heard = record.states or record.speeds or record.health or len(record.rows)
        if times and not heard:
            raise self._wish.nothing_between(min(times), max(times))

    # --- what it was ------------------------------------------------------------------------------
    @property
    def source(self) -> Source:
        """Where the record comes from."""
        bag, found = self._bag, sorted(self._names)
        damage = [*bag.remarks, self._stopped] if self._stopped else bag.remarks
        return Source(
            str(bag.path), self.namespace, self._kept_run, self._runs,
            bag.notes.get("version", ""),
            tuple(
                TopicCount(n, bag.topics[n].count, self._losses.of(n, self._runs)) for n in found
            ),
            self._missing, bag.notes, tuple(damage), tuple(self._limits()), self._wish.is_cut,
        )  # fmt: skip

    def _limits(self) -> Iterator[str]:
        if self._wish.is_cut:
            yield f"all before {self._wish.begin:g} s and from {self._wish.end:g} s on, as asked"
        if self._bounded.dropped:
            yield (
                f"the first {self._bounded.dropped} rows of impacts: only the last ones fit in "
                "memory (--rows); take earlier ones with --from and --to"
            )
        for name, kept in (
            ("joint_states", self.record.states), ("disk/rotor_speed", self.record.speeds)
        ):  # fmt: skip
            if isinstance(kept, Thinned) and kept.step > 1:
                yield f"of {name} all but every {kept.step}th message"


class Bounded:
    """Keeps the last rows only, of the times wished for, in few arrays."""

    def __init__(self, chunks: list[NDArray[np.void]], wish: Wish) -> None:
        self.dropped = 0
        self.seen: list[float] = []  # first and last time of an impact, wished for or not
        self._chunks, self._wish = chunks, wish
        self._held = self._fresh_rows = self._fresh = 0

    def tidy(self) -> None:
        """After an array has been appended (or none, where a message was empty)."""
        chunks, wish = self._chunks, self._wish
        if not chunks:
            return
        rows = chunks[-1]
        if len(rows):  # else nothing new: an empty message
            first = self.seen[0] if self.seen else float(rows["time"][0])
            self.seen = [first, float(rows["time"][-1])]
        inside = (rows["time"] >= wish.begin) & (rows["time"] < wish.end)
        if not np.all(inside):
            chunks[-1] = rows = rows[inside]
        self._held += len(rows)
        self._fresh_rows += len(rows)
        self._fresh += 1
        if self._fresh >= _JOIN or self._fresh_rows >= _JOIN_ROWS:
            chunks[-self._fresh :] = [joined_rows(chunks[-self._fresh :])]
            self._fresh = self._fresh_rows = 0
            while self._held - len(chunks[0]) >= wish.most_rows:
                self._held -= len(chunks[0])
                self.dropped += len(chunks.pop(0))


def _indices(short: str, content: Any) -> tuple[int, int]:
    """First and last running index of a message; of an empty one what changes nothing."""
    if short == "disk/inputs":
        index = int(json.loads(content.data)["index"])
        return index, index
    rows = impacts_from_msg(content)
    return (int(rows["index"][0]), int(rows["index"][-1])) if len(rows) else (2**62, -1)
