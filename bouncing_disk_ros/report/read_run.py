"""Read one run of one simulator out of a bag as a `RunRecord`, in bounded memory.

In this order: which simulators a bag holds, and `read_run` with its class `BagRun`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros import limits
from bouncing_disk_ros.bag import Bag, BagError
from bouncing_disk_ros.bag import open as open_bag
from bouncing_disk_ros.bag.reader import Message
from bouncing_disk_ros.bounded import Downsampled, Newest, NewestRows
from bouncing_disk_ros.core.model import IMPACT_DTYPE
from bouncing_disk_ros.errors import InputError, closest, counted
from bouncing_disk_ros.report.message_order import (
    REPEAT,
    Losses,
    RunOrder,
    Sign,
    in_order_of_sending,
)
from bouncing_disk_ros.report.run_record import (
    MOST_ROWS,
    UNKNOWN_DISK,
    HealthReport,
    RecordSource,
    RunRecord,
    State,
    TopicCount,
)
from bouncing_disk_ros.report.run_record_builder import Parsed, RunRecordBuilder
from bouncing_disk_ros.running_numbers import UNKNOWN
from bouncing_disk_ros.topics import TOPICS
from bouncing_disk_ros.units import NS

WANTED = ("disk/impacts", "disk/inputs", "platform/motion", "disk/rotor_speed", "joint_states",
          "disk/phase")  # fmt: skip
"""Topics of a simulator, within its namespace."""
OPTIONAL = ("platform/offset",)
"""Topics that are there only where something was commanded."""


def simulators(bag: Bag) -> list[str]:
    """The namespaces of the simulators in a bag."""
    found = set()
    for name, topic in bag.topics.items():
        for wanted in WANTED:
            ours = wanted.startswith(("disk/", "platform/")) and topic.count > 0
            if ours and name.endswith(f"/{wanted}") and topic.type == TOPICS[wanted].type:
                found.add(name[: -len(wanted) - 1] or "/")
    return sorted(found)


def choose(bag: Bag, namespace: str | None) -> str:
    """The namespace asked for, or the only one; InputError names the candidates."""
    found = simulators(bag)
    if not found:
        given = ", ".join(sorted(n for n, t in bag.topics.items() if t.count)) or "no messages"
        allowed = "a bag with topics of a simulator (disk/impacts, disk/inputs ...)"
        raise InputError(f"bag {bag.path}", given, allowed)
    if namespace is None:
        if len(found) > 1:
            given = f"a bag of {len(found)} simulators"
            raise InputError(
                "namespace", given, ", ".join(found), "Choose one with the option namespace."
            )
        return found[0]
    wanted = "/" + namespace.strip("/")
    if wanted not in found:
        raise InputError("namespace", namespace, ", ".join(found), closest(wanted, found))
    return wanted


def is_there(bag: Bag, name: str, short: str) -> bool:
    """Whether a bag holds messages of topic `name` of the type of `short`."""
    topic = bag.topics.get(name)
    return topic is not None and topic.type == TOPICS[short].type and topic.count > 0


# ------------------------------------------------------------------------------------------------
# Reads one run of one simulator out of a bag, as a `RunRecord`; memory stays bounded.


MOST_SAMPLES = 200_000
"""Of joint_states and of disk/rotor_speed at most so many messages are kept, evenly taken."""
MOST_WAITING = 10_000
"""So many messages wait at most for another one that shows whether their run goes on."""


class ReadOptions(NamedTuple):
    """What to read: None and 0 leave the choice to the bag."""

    namespace: str | None = None
    run: int = 0  # from 1; 0: the last
    begin: float = -math.inf  # simulated s
    end: float = math.inf
    most_rows: int = MOST_ROWS  # 0: none, and nothing of them is checked
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
    """Record of a run from its bag: impacts, states, speeds, motions, inputs.

    `namespace` and `run` (from 1; 0: the last) choose where a bag holds several. Raises InputError,
    BagError where it cannot be read.

    >>> read_run("run_1").rows["axial_impact_velocity"]
    """
    with open_bag(path) as opened:
        reader = BagRun(opened, ReadOptions(namespace, run))
        for _ in reader.read():
            pass
    for name, kept in vars(reader.record).items():
        if isinstance(kept, Downsampled | Newest):  # a copy appends its items, and would cut them
            setattr(reader.record, name, list(kept))
    return reader.record


def names_of(namespace: str) -> dict[str, str]:
    """The topics of a simulator: full and short names."""
    base = namespace.rstrip("/")
    names = {f"{base}/{short}": short for short in (*WANTED, *OPTIONAL)}
    return {"/diagnostics": "/diagnostics"} | names


class _RowsWithin(NewestRows):
    """The newest impacts in the times of the options.

    `seen`: times of the first and the last of all, s.
    """

    def __init__(self, options: ReadOptions) -> None:
        super().__init__(IMPACT_DTYPE, options.most_rows)
        self._begin, self._end_time = options.begin, options.end
        self.seen: list[float] = []

    def append(self, rows: NDArray[np.void]) -> None:
        """Add rows, one or more; those outside of the times are left out."""
        times = rows["time"]
        first = self.seen[0] if self.seen else float(times[0])
        self.seen = [first, float(times[-1])]
        inside = (times >= self._begin) & (times < self._end_time)
        super().append(rows if np.all(inside) else rows[inside])


class BagRun:
    """Reads a bag once; after `read`, `record` and `source` are the run wished for.

    `parts` says of each topic how many messages in turn belong to which run (0: to none); `ends`
    the last instant (simulated ns) of each run that anything but its impacts shows.
    """

    def __init__(
        self, bag: Bag, options: ReadOptions, names: Mapping[str, str] | None = None
    ) -> None:
        """`names`: full and short names of topics; None: those of the one namespace wished for."""
        self._bag, self._wish = bag, options
        if names is None:
            self.namespace = choose(bag, options.namespace)
            names = names_of(self.namespace)
        else:
            self.namespace = options.namespace or "/"
        if options.topics:
            names = {name: short for name, short in names.items() if short in options.topics}
        self._names = {name: short for name, short in names.items() if is_there(bag, name, short)}
        for name in self._names:
            bag.check_installed(name)
        absent = sorted(set(names.values()) - {*self._names.values(), *OPTIONAL})
        in_bag = {short for name, short in names.items() if name in bag.topics}
        self._missing = tuple(short for short in absent if short not in in_bag)
        self._empty = tuple(short for short in absent if short in in_bag)
        self._order = RunOrder()
        self._losses = Losses()
        self._stopped = ""
        self.damage: BagError | None = None  # where reading ended early
        self._cut_off = False  # the run goes on after the times wished for
        self._kept_run = self._undecided = 0
        self.record = self._record = RunRecord(UNKNOWN_DISK)
        self._builder = RunRecordBuilder(self._record, self.namespace)
        self.parts: dict[str, list[tuple[int, int]]] = {}
        self.ends: list[int] = []
        self._waiting: list[tuple[str, Parsed | None]] = []  # until a sign tells the run
        self._impacts = self.record.impacts = _RowsWithin(options)

    def _end_run(self) -> None:
        """Note where the run under way ends."""
        last = (self._record.states, self._record.speeds)
        times = [float(series[-1][0]) for series in last if series]
        times += [report.simulated for report in self._record.health[-1:]]
        times = [time - 2.0 * self._record.rounding for time in times]
        self.ends.append(math.floor(max(times, default=0.0) * NS))

    def _begin_run(self) -> None:
        if self._order.run > 1:
            self._end_run()
        self._record = RunRecord(UNKNOWN_DISK)
        self._record.impacts = NewestRows(IMPACT_DTYPE, 0)
        self._record.states = Downsampled[State](MOST_SAMPLES)
        self._record.speeds = Downsampled[tuple[float, float]](MOST_SAMPLES)
        self._record.health = Downsampled[HealthReport](limits.EVENTS)
        self._record.motions = Newest[Any](limits.EVENTS)
        self._record.changes = Newest[Any](limits.EVENTS)
        self._record.disks = Newest[Any](limits.EVENTS)
        self._record.offsets = Newest[Any](limits.EVENTS)
        self._builder = RunRecordBuilder(self._record, self.namespace)
        if self._wish.run in (0, self._order.run):
            self.record, self._kept_run = self._record, self._order.run
            self._impacts = self.record.impacts = _RowsWithin(self._wish)

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
            self._take(self._names[message.topic], message, content)
            yield
        self._take_waiting()
        if self._order.run:
            self._end_run()
        if not self._kept_run and self._wish.run:
            raise InputError("run", self._wish.run, f"1 to {max(1, self._order.run)}")
        if self._wish.is_cut:
            self._clip()

    def _messages(self) -> Iterator[Message]:
        try:
            yield from self._bag.messages(self._names)
        except BagError as error:
            self._stop(error)

    def _stop(self, error: BagError) -> None:
        self.damage = error
        self._stopped = f"{error}; what follows is not in this report (bag_recover saves it)"

    def _take(self, short: str, message: Message, content: Any) -> None:
        """Take one message into the run to which it belongs."""
        if self._order.is_repeat(short, message):
            self._waiting.append((message.topic, None))
            return
        self._losses.note(message)
        parsed = self._builder.parse(short, content)
        if parsed is None:  # of another node
            self._waiting.append((message.topic, None))
            return
        is_numbered = 0 < message.sequence < UNKNOWN and short != "/diagnostics"
        number = message.sequence if is_numbered else 0
        found = self._builder.counts(short, parsed, is_numbered=is_numbered)
        shown = self._order.take(short, number, found)
        if shown is Sign.BEGINS:
            for topic, waits in self._waiting:
                self._undecided += waits is not None
                self._note_part(topic, REPEAT if waits is None else 0)
            self._waiting.clear()
            self._begin_run()
        self._waiting.append((message.topic, parsed))
        if shown is not Sign.NOTHING or len(self._waiting) > MOST_WAITING:
            self._take_waiting()

    def _take_waiting(self) -> None:
        """Take the messages that wait into the run under way."""
        for topic, parsed in self._waiting:
            short = self._names[topic]
            self._note_part(topic, REPEAT if parsed is None else self._order.run)
            if parsed is None or (short == "disk/impacts" and not self._wish.most_rows):
                continue
            self._builder.take(short, parsed)
        self._waiting.clear()

    def _note_part(self, topic: str, run: int) -> None:
        parts = self.parts.setdefault(topic, [])
        same = parts.pop()[1] if parts and parts[-1][0] == run else 0
        parts.append((run, same + 1))

    def _clip(self) -> None:
        """Keep what lies in the times wished for; InputError: the run has nothing there."""
        low, high, record = self._wish.begin, self._wish.end, self.record
        times = [*self._impacts.seen, *(row.time for row in record.states)]
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
    def source(self) -> RecordSource:
        """Where the record comes from."""
        bag, found = self._bag, sorted(self._names)
        damage = [*bag.remarks, self._stopped] if self._stopped else bag.remarks
        return RecordSource(
            str(bag.path), self.namespace, max(1, self._kept_run), max(1, self._order.run),
            bag.notes.get("version", ""),
            tuple(
                TopicCount(n, bag.topics[n].count, self._losses.of(n))
                for n in found
            ),
            self._missing, self._empty, bag.notes, tuple(damage), tuple(self._limits()),
            self._wish.is_cut, self._cut_off,
        )  # fmt: skip

    def _limits_between_runs(self) -> Iterator[str]:
        mixed = ", ".join(sorted(self._losses.mixed - {"/diagnostics"}))
        if mixed and self._order.run > 1:
            yield f"which of several simulators sent what: they published at once on {mixed}"
        if self._undecided:
            messages = counted(self._undecided, "message")
            yield f"{messages} between two runs, which may belong to either"

    def _limits(self) -> Iterator[str]:
        begin, end = self._wish.begin, self._wish.end
        if self._wish.is_cut:
            sides = ((f"before {begin:g} s", begin), (f"from {end:g} s on", end))
            left = " and ".join(text for text, time in sides if math.isfinite(time))
            yield f"all {left}, as asked"
        yield from self._limits_between_runs()
        if names := ", ".join(self.record.lacking):
            yield f"impacts without {names}, as another version wrote them"
        if self.record.untimed:
            samples = counted(self.record.untimed, "sample")
            yield (
                f"{samples} without a simulated time: platform/motion, disk/inputs or impacts do "
                "not give it"
            )
        if self._impacts.dropped:
            yield (
                f"the first {self._impacts.dropped} rows of impacts: only the last ones fit in "
                "memory (--rows); take earlier ones with --from and --to"
            )
        for name, kept in (
            ("joint_states", self.record.states), ("disk/rotor_speed", self.record.speeds),
            ("/diagnostics", self.record.health),
        ):  # fmt: skip
            if isinstance(kept, Downsampled) and kept.step > 1:
                yield f"of {name} all but every {kept.step}th message"
        record = self.record
        for events in (record.motions, record.changes, record.disks, record.offsets):
            if isinstance(events, Newest) and events.dropped:
                yield f"the first {events.dropped} motions, changes, disks or offsets of the run"
