"""Reads one run of one simulator out of a bag, as a `RunRecord`; memory stays bounded."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from bouncing_disk_ros import limits
from bouncing_disk_ros.analysis.recorded.run_record import (
    UNKNOWN_DISK,
    Health,
    RunRecord,
    State,
)
from bouncing_disk_ros.analysis.report.run_report import Source, TopicCount
from bouncing_disk_ros.bag import Bag, BagError
from bouncing_disk_ros.bag import open as open_bag
from bouncing_disk_ros.bag.bag_topic import Message
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.nodes.bags.bounded_columns import Bounded, EveryNth, Newest
from bouncing_disk_ros.nodes.bags.message_order import Losses, in_order_of_sending
from bouncing_disk_ros.nodes.bags.simulators import OPTIONAL, WANTED, choose, is_there
from bouncing_disk_ros.nodes.shared.run_record_builder import RunRecordBuilder, record_of
from bouncing_disk_ros.ros.from_messages import impacts_from_msg

MOST_SAMPLES = 200_000
"""Of joint_states and of disk/rotor_speed at most so many messages are kept, evenly taken."""


class ReadOptions(NamedTuple):
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
        hint = "There is no message in this time." if inside else "This time is outside the run."
        allowed = f"times within the run, from {first:.3f} s to {last:.3f} s"
        return InputError("from, to", given, allowed, hint)


def read_run(path: str | Path, namespace: str | None = None, run: int = 0) -> RunRecord:
    """A recorded run from its bag: impacts, states, speeds, motions, inputs.

    `namespace` and `run` (from 1; 0: the last) choose where a bag holds several. Raises InputError,
    BagError where it cannot be read.

    >>> read_run("output/demo_bag").rows["axial_impact_velocity"]
    """
    with open_bag(path) as opened:
        reader = BagRun(opened, ReadOptions(namespace, run))
        for _ in reader.read():
            pass
        return reader.record


class BagRun:
    """Reads a bag once; after `read`, `record` and `source` are the run wished for."""

    def __init__(self, bag: Bag, options: ReadOptions) -> None:
        self._bag, self._wish = bag, options
        self.namespace = choose(bag, options.namespace)
        base = self.namespace.rstrip("/")
        names = {"/diagnostics": "/diagnostics"}
        names |= {f"{base}/{short}": short for short in (*WANTED, *OPTIONAL)}
        if options.topics:
            names = {name: short for name, short in names.items() if short in options.topics}
        self._names = {name: short for name, short in names.items() if is_there(bag, name, short)}
        for name in self._names:
            bag.check_installed(name)
        self._missing = tuple(sorted(set(names.values()) - {*self._names.values(), *OPTIONAL}))
        self._losses = Losses()
        self._stopped = ""
        self._cut_off = False  # the run goes on after the times wished for
        self._runs = self._kept_run = 0
        self.record = RunRecord(UNKNOWN_DISK)
        self._bounded = self._bound()
        self._begin_run()

    def _bound(self) -> Bounded:
        options = self._wish
        return Bounded(self.record.chunks, options.begin, options.end, options.most_rows)

    def _begin_run(self) -> None:
        self._runs += 1
        self._record = RunRecord(UNKNOWN_DISK)
        self._record.states = EveryNth[State](MOST_SAMPLES)
        self._record.speeds = EveryNth[tuple[float, float]](MOST_SAMPLES)
        self._record.health = EveryNth[Health](limits.EVENTS)
        self._record.motions = Newest[Any](limits.EVENTS)
        self._record.changes = Newest[Any](limits.EVENTS)
        self._record.disks = Newest[Any](limits.EVENTS)
        self._record.offsets = Newest[Any](limits.EVENTS)
        self._builder = RunRecordBuilder(self._record, self.namespace)
        self._latest = {"disk/inputs": -1.0, "disk/impacts": -1.0}
        if self._wish.run in (0, self._runs):
            self.record, self._kept_run = self._record, self._runs
            self._bounded = self._bound()

    # --- reading ----------------------------------------------------------------------------------
    @property
    def total(self) -> int:
        """Messages to go through."""
        return sum(self._bag.topics[name].count for name in self._names)

    def read(self) -> Iterator[None]:
        """Go through the bag; one step for each message. InputError: there is no such run."""
        for message in in_order_of_sending(self._messages()):
            try:
                content = self._bag.decoder(message.topic)(message.data)
            except BagError as error:
                self._stop(error)
                break
            self._take(self._names[message.topic], content)
            yield
        if not self._kept_run:
            raise InputError("run", self._wish.run, f"1 to {self._runs}")
        if self._wish.is_cut:
            self._clip()

    def _messages(self) -> Iterator[Message]:
        try:
            for message in self._bag.messages(self._names):
                self._losses.note(message)
                yield message
        except BagError as error:
            self._stop(error)

    def _stop(self, error: BagError) -> None:
        self._stopped = f"{error}; what follows is not in this report (bag_recover saves it)"

    def _take(self, short: str, content: Any) -> None:
        if short == "disk/inputs":
            record = record_of(content)
            self._note_index(short, record["index"], record["index"])
            self._builder.take_record(record)
        else:
            if short == "disk/impacts" and len(rows := impacts_from_msg(content)):
                self._note_index(short, *(float(rows["index"][place]) for place in (0, -1)))
            self._builder.handlers[short](content)
        if self._record is not self.record:
            self._record.chunks.clear()
        elif short == "disk/impacts":
            self._bounded.tidy()

    def _note_index(self, short: str, first: float, last: float) -> None:
        """Note first and last running index of a message; one that falls begins another run."""
        if first <= self._latest[short]:
            self._begin_run()
        self._latest[short] = max(self._latest[short], last)

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
        self._cut_off = max(times, default=-math.inf) >= high
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
            self._cut_off,
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
            ("joint_states", self.record.states), ("disk/rotor_speed", self.record.speeds),
            ("/diagnostics", self.record.health),
        ):  # fmt: skip
            if isinstance(kept, EveryNth) and kept.step > 1:
                yield f"of {name} all but every {kept.step}th message"
        record = self.record
        for events in (record.motions, record.changes, record.disks, record.offsets):
            if isinstance(events, Newest) and events.dropped:
                yield f"the first {events.dropped} motions, changes, disks or offsets of the run"
