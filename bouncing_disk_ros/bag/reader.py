"""Read a bag: a folder made here or by `ros2 bag record`, or a single .mcap file, whole or not.

    with bag.open("run_1") as run:
        impacts = run.rows("/disk/impacts")              # one structured array
        states = run.columns("/joint_states", ["header.stamp", "position"])
        for message in run.messages(["/disk/inputs"]): ...

Everything read is checked by its checksum; damage raises `BagError`.
"""

from __future__ import annotations

import contextlib
import heapq
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from mcap.records import Channel, ChunkIndex, Schema
from numpy.typing import NDArray

from bouncing_disk_ros import limits
from bouncing_disk_ros.bag.files import files_of
from bouncing_disk_ros.bag.index import Index
from bouncing_disk_ros.bag.messages import Decode, Form, check_installed, decoder
from bouncing_disk_ros.bag.metadata import qos_from_text
from bouncing_disk_ros.bag.notes import FORMAT_KEY, FORMAT_VERSION, NOTE, checked
from bouncing_disk_ros.bag.records import Watch, nothing, without_repeats
from bouncing_disk_ros.bag.rows import CLOUD, CloudRows, gather
from bouncing_disk_ros.bag.source import Source
from bouncing_disk_ros.errors import BagError, InputError, closest, one_line
from bouncing_disk_ros.impact_layout import IMPACT_LAYOUT
from bouncing_disk_ros.units import NS


class Message(NamedTuple):
    """One message of a bag: times of reception and of sending in ns since 1970, raw CDR."""

    topic: str
    log_time_ns: int
    publish_time_ns: int
    sequence: int
    data: bytes


@dataclass
class Topic:
    """A topic of a bag: its type, and the messages of all its channels."""

    name: str
    form: Form
    count: int = 0
    qos: list[dict[str, Any]] = field(default_factory=list)
    type_hash: str = ""

    @property
    def type(self) -> str:
        """The message type, pkg/msg/Name."""
        return self.form.type

    @property
    def definition(self) -> str:
        """The definition of the message type, with all dependencies."""
        return self.form.definition

    @property
    def encoding(self) -> str:
        """The encoding of the definition: ros2msg."""
        return self.form.encoding

    def check(self, form: Form) -> None:
        """Note when another channel of the topic has messages of another form."""
        if form != self.form and not self.form.fault:
            self.form = self.form._replace(fault="it has messages of two forms")


def topics_of(files: Iterable[tuple[Index, Mapping[int, Channel]]]) -> dict[str, Topic]:
    """The topics of some channels of some files by name, with the messages of all of them."""
    topics: dict[str, Topic] = {}
    left = limits.QOS_ALL
    for index, channels in files:
        schemas, counts = index.schemas, index.counts
        forms: dict[tuple[int, str], Form] = {}  # each definition is looked at once
        for number, channel in channels.items():
            key = channel.schema_id, channel.message_encoding
            if key not in forms:
                forms[key] = _form(channel, schemas.get(channel.schema_id))
            topic = topics.setdefault(channel.topic, Topic(channel.topic, forms[key]))
            topic.check(forms[key])
            topic.count += counts[number]
            text = channel.metadata.get("offered_qos_profiles", "")
            if not topic.qos and len(text) <= left:
                left -= len(text)
                topic.qos = qos_from_text(text)
            topic.type_hash = topic.type_hash or channel.metadata.get("topic_type_hash", "")
    return topics


def _form(channel: Channel, schema: Schema | None) -> Form:
    encoding = channel.message_encoding
    if schema is None:
        return Form(message_encoding=encoding, fault="its type is not in the bag")
    fault = text = ""
    if len(schema.data) > limits.DEFINITION:
        fault = f"its definition of {len(schema.data)} bytes: at most {limits.DEFINITION}"
    else:
        try:
            text = schema.data.decode()
        except UnicodeDecodeError:
            fault = "its definition is not UTF-8"
    return Form(schema.name, text, schema.encoding, encoding, fault)


# --- messages in order ----------------------------------------------------------------------------
class Part(NamedTuple):
    """A chunk to be opened when its time has come."""

    start_ns: int  # no message in it is earlier
    size: int  # bytes in memory once it is open
    open: Callable[[], Iterator[Message]]  # its messages in the order of their times


def in_order(parts: Iterable[Part]) -> Iterator[Message]:
    """Messages of parts that come in the order of their start; of equal times the first part's.

    Raises BagError when too many parts overlap in time.
    """
    heap: list[tuple[int, int, Message, Iterator[Message], int]] = []
    held = 0
    for number, part in enumerate(parts):
        while heap and heap[0][0] < part.start_ns:
            yield heap[0][2]
            held -= _advance(heap)
        rest = part.open()
        first = next(rest, None)
        if first is None:
            continue
        held += part.size
        if held > limits.OVERLAP:
            most = limits.OVERLAP // limits.MIB
            raise BagError(
                f"chunks of more than {most} MiB overlap in time: the messages cannot be brought "
                "into order. `columns` and `rows` read them as stored"
            )
        heapq.heappush(heap, (first.log_time_ns, number, first, rest, part.size))
    while heap:
        yield heap[0][2]
        _advance(heap)


def _advance(heap: list[tuple[int, int, Message, Iterator[Message], int]]) -> int:
    """Replace the first message by the next of its part; the size of a part that is at its end."""
    _, number, _, rest, size = heap[0]
    following = next(rest, None)
    if following is None:
        heapq.heappop(heap)
        return size
    heapq.heapreplace(heap, (following.log_time_ns, number, following, rest, size))
    return 0


# --- the bag --------------------------------------------------------------------------------------
class Bag:
    """An open bag. `remarks` say what is missing or damaged; `complete` is whether there are none.

    `notes` are what the recorder noted (version, losses); empty for bags of other programs.
    Times are those of reception in ns since 1970; ranges include `start_ns`, not `end_ns`.
    """

    def __init__(self, path: str | Path, watch: Watch = nothing) -> None:
        found = files_of(Path(path))
        self.path = Path(path)
        self._sources = [Source(file, watch) for file in found.files]
        for source in self._sources[1:]:
            source.channels = without_repeats(source.channels)
        remarks = [found.remarks, *(source.remarks for source in self._sources)]
        self.remarks = [one_line(remark) for some in remarks for remark in some]
        self.topics = topics_of((one.index, one.channels) for one in self._sources)
        self.notes = self._notes()
        version = self.notes.get(FORMAT_KEY, "0")
        if not version.isdecimal() or len(version) > 9 or int(version) > FORMAT_VERSION:
            hint = "It was made by a newer version of this package: update the package."
            given = int(version) if version.isdecimal() and len(version) <= 9 else version
            raise InputError("bag format", given, f"1 to {FORMAT_VERSION}", hint)

    def __repr__(self) -> str:
        """Where it is and what is in it."""
        remarks = f", {len(self.remarks)} remarks" if self.remarks else ""
        counts = f"{self.message_count} messages on {len(self.topics)} topics"
        return f"<bag {self.path}: {counts}{remarks}>"

    def _notes(self) -> dict[str, str]:
        notes: dict[str, str] = {}
        for source in self._sources:
            for record in source.metadata():
                if record.name == NOTE:
                    notes.update(checked(record.metadata))
        return notes

    # --- info -------------------------------------------------------------------------------------
    @property
    def complete(self) -> bool:
        """Whether nothing is missing or damaged, as far as opening shows."""
        return not self.remarks

    @property
    def message_count(self) -> int:
        """Messages of all topics."""
        return sum(topic.count for topic in self.topics.values())

    @property
    def start_ns(self) -> int:
        """Time of the first reception; 0 without messages."""
        return min((chunk.message_start_time for _, chunk in self._chunks()), default=0)

    @property
    def end_ns(self) -> int:
        """Time of the last reception; 0 without messages."""
        return max((chunk.message_end_time for _, chunk in self._chunks()), default=0)

    @property
    def attachments(self) -> dict[str, bytes]:
        """Attached files by name (of equal names the last)."""
        rows = (row for source in self._sources for row in source.attachments())
        return {row.name: row.data for row in rows}

    def info(self) -> str:
        """A summary for people."""
        span = (self.end_ns - self.start_ns) / NS
        files = f"{len(self._sources)} file(s)"
        lines = [f"{self.path}: {self.message_count} messages in {span:.3f} s, {files}"]
        width = max((len(name) for name in self.topics), default=0)
        for name, topic in sorted(self.topics.items()):
            lines.append(f"  {name:{width}}  {topic.count:8}  {topic.type}")
        lines += [f"  {key}: {value}" for key, value in self.notes.items()]
        return "\n".join([*lines, *(f"  ! {remark}" for remark in self.remarks)])

    # --- messages ---------------------------------------------------------------------------------
    def messages(
        self,
        topics: Iterable[str] | str | None = None,
        start_ns: int | None = None,
        end_ns: int | None = None,
    ) -> Iterator[Message]:
        """Messages in the order of reception; memory holds only chunks that overlap in time."""
        names = self._names(topics)
        rows = sorted(self._chunks(start_ns, end_ns), key=lambda row: row[1].message_start_time)

        def part(source: Source, chunk: ChunkIndex) -> Part:
            return Part(
                chunk.message_start_time, chunk.uncompressed_size,
                lambda: self._chunk(source, chunk, names, start_ns, end_ns, sort=True),
            )  # fmt: skip

        return in_order(part(*row) for row in rows)

    def decoded(
        self,
        topics: Iterable[str] | str | None = None,
        start_ns: int | None = None,
        end_ns: int | None = None,
    ) -> Iterator[tuple[Message, Any]]:
        """The same with each message decoded: an object with the fields of its type."""
        for message in self.messages(topics, start_ns, end_ns):
            yield message, self.decoder(message.topic)(message.data)

    def columns(
        self,
        topic: str,
        fields: Sequence[str] | None = None,
        start_ns: int | None = None,
        end_ns: int | None = None,
    ) -> dict[str, NDArray[Any]]:
        """Arrays of one topic by field, in the order of storage.

        Point clouds: one entry for each point, views into the array of `rows`. Other types: dotted
        names (`twist.angular.z`); times are int64 ns; arrays of one length become 2-D; also
        `log_time_ns` and `publish_time_ns`, of clouds only where `fields` names them: those of the
        message that has the point. Without `fields`: all.
        """
        if self._topic(topic).type == CLOUD:
            timed = not {"log_time_ns", "publish_time_ns"}.isdisjoint(fields or ())
            rows, times_of = self._rows(topic, start_ns, end_ns, timed=timed)
            return {
                name: times_of[name] if name in times_of else _field(rows, name)
                for name in fields or rows.dtype.names or ()
            }
        times: dict[str, list[int]] = {"log_time_ns": [], "publish_time_ns": []}
        read = self.decoder(topic)

        def objects() -> Iterator[Any]:
            for message in self._stored(topic, start_ns, end_ns):
                times["log_time_ns"].append(message.log_time_ns)
                times["publish_time_ns"].append(message.publish_time_ns)
                yield read(message.data)

        wanted = None if fields is None else [name for name in fields if name not in times]
        found = gather(objects(), wanted)
        columns = {**{k: np.array(v, np.int64) for k, v in times.items()}, **found}
        return columns if fields is None else {name: columns[name] for name in fields}

    def rows(
        self, topic: str, start_ns: int | None = None, end_ns: int | None = None
    ) -> NDArray[np.void]:
        """All points of the clouds of a topic as one structured array, by their own field list.

        >>> pandas.DataFrame(bag.open("run_1").rows("/disk/impacts"))
        """
        return self._rows(topic, start_ns, end_ns)[0]

    def _rows(
        self, topic: str, start_ns: int | None, end_ns: int | None, *, timed: bool = False
    ) -> tuple[NDArray[np.void], dict[str, NDArray[np.int64]]]:
        """All points of the clouds of a topic; if `timed` the times of their messages beside."""
        if (kind := self._topic(topic).type) != CLOUD:
            raise InputError(f"type of {topic}", kind, CLOUD, "Use `columns` for it.")
        self.check_installed(topic)
        gathered = CloudRows(self.decoder(topic))
        counts: list[int] = []
        times: list[tuple[int, int]] = []
        for message in self._stored(topic, start_ns, end_ns):
            counts.append(gathered.add(message.data))
            times.append((message.log_time_ns, message.publish_time_ns))
        rows = gathered.array() if gathered.dtype is not None else self._no_rows(topic)
        if not timed:
            return rows, {}
        both = np.repeat(np.array(times, np.int64).reshape(-1, 2), counts, axis=0)
        return rows, {"log_time_ns": both[:, 0], "publish_time_ns": both[:, 1]}

    def _no_rows(self, topic: str) -> NDArray[np.void]:
        """No rows, with the fields of the topic: of its first message, or of disk/impacts."""
        for message in self._stored(topic, None, None):
            gathered = CloudRows(self.decoder(topic))
            gathered.add(message.data)
            return gathered.array()[:0]
        is_ours = topic.endswith("/disk/impacts")
        return np.zeros(0, np.dtype(dict(IMPACT_LAYOUT)) if is_ours else np.dtype([]))  # type: ignore[call-overload, no-any-return, unused-ignore]

    # --- inside -----------------------------------------------------------------------------------
    def _chunks(
        self, start_ns: int | None = None, end_ns: int | None = None
    ) -> Iterator[tuple[Source, ChunkIndex]]:
        for source in self._sources:
            for chunk in source.index.chunks:
                early = start_ns is not None and chunk.message_end_time < start_ns
                if not early and not (end_ns is not None and chunk.message_start_time >= end_ns):
                    yield source, chunk

    def _chunk(
        self, source: Source, chunk: ChunkIndex, names: set[str], start: int | None,
        end: int | None, *, sort: bool = False,
    ) -> Iterator[Message]:  # fmt: skip
        topics = {n: c.topic for n, c in source.channels.items() if c.topic in names}
        inner = source.read(chunk)
        low = max(0, start or 0)
        high = min(limits.TIME_NS + 1, limits.TIME_NS + 1 if end is None else max(0, end))
        chosen = inner.chosen(topics, low, high, sort)
        for channel, received, sent, sequence, data in inner.messages(chosen):
            yield Message(topics[channel], received, sent, sequence, data)

    def _stored(self, topic: str, start: int | None, end: int | None) -> Iterator[Message]:
        for source, chunk in self._chunks(start, end):
            yield from self._chunk(source, chunk, {topic}, start, end)

    def _names(self, topics: Iterable[str] | str | None) -> set[str]:
        if topics is None:
            return set(self.topics)
        names = [topics] if isinstance(topics, str) else list(topics)
        return {self._topic(name).name for name in names}

    def _topic(self, name: str) -> Topic:
        if name not in self.topics:
            allowed = ", ".join(sorted(self.topics)) or "none: the bag has no topics"
            raise InputError("topic", name, allowed, closest(name, self.topics))
        return self.topics[name]

    def decoder(self, name: str) -> Decode:
        """A function that decodes messages of a topic. Raises InputError, BagError as `decoded`."""
        return decoder(self._topic(name).form)

    def check_installed(self, name: str) -> None:
        """InputError when a topic's definition has other fields than the type installed here."""
        check_installed(self._topic(name).form)

    def close(self) -> None:
        """Let go of the bag (its files are open only while they are read)."""

    def __enter__(self) -> Bag:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _field(rows: NDArray[np.void], name: str) -> NDArray[Any]:
    names = rows.dtype.names or ()
    if not names:  # no message says which fields there are
        return np.zeros(0)
    if name not in names:
        raise InputError("field", name, ", ".join(names), closest(name, names))
    return rows[name]


@contextlib.contextmanager
def walking(name: str) -> Iterator[Callable[[int, int], None]]:
    """A watch for `bag.open`: on a terminal, a bar while files are walked through."""
    from tqdm import tqdm

    bar = tqdm(desc=name, unit="B", unit_scale=True, leave=False, disable=None, delay=0.5)

    def watch(passed: int, size: int) -> None:
        bar.total = size
        bar.update(passed - bar.n)

    try:
        yield watch
    finally:
        bar.close()
