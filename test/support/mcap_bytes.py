"""An .mcap file laid out byte by byte, so that each of its fields can be forged.

Checksums and lengths are those of what is written, unless they are forged themselves: only so does
a forged field reach the code behind them.

    forged({"chunk.size": 1 << 62}, messages)       # every chunk says so
    fields(messages)                                # the names of all fields, with their kinds
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import lz4.frame
import zstandard

MAGIC = b"\x89MCAP0\r\n"
_FORMS = {"u8": "<B", "u16": "<H", "u32": "<I", "u64": "<Q"}
Pack = Callable[[bytes], bytes]
COMPRESSIONS: Mapping[str, Pack] = {
    "": bytes,
    "zstd": zstandard.ZstdCompressor().compress,
    "lz4": lz4.frame.compress,
}


class Sent(NamedTuple):
    """One message to be laid out."""

    topic: str
    kind: str
    definition: str
    data: bytes
    log_time_ns: int
    publish_time_ns: int
    sequence: int


@dataclass
class Content:
    """What a file holds besides what each field says by itself."""

    messages: Sequence[Sent]
    per_chunk: int = 40
    compression: str = ""
    qos: str = ""
    notes: Mapping[str, str] = field(default_factory=dict)
    attachment: bytes = b"friction: 0.6\n"
    summary: bool = True


class Layout:
    """Writes fields; `forge` gives other values for some of them, by name."""

    def __init__(self, forge: Mapping[str, Any]) -> None:
        self.kinds: dict[str, str] = {}  # of all fields by name
        self._forge = forge

    def number(self, name: str, kind: str, value: int) -> bytes:
        """A number, or the bytes that stand in its place."""
        given = self._value(name, kind, value)
        if isinstance(given, bytes):
            return given
        form = _FORMS[kind]
        return struct.pack(form, given % (1 << (8 * struct.calcsize(form))))

    def text(self, name: str, value: str | bytes, length_kind: str = "u32") -> bytes:
        """A text or bytes after their length; both can be forged."""
        raw = value.encode() if isinstance(value, str) else value
        given = self._value(name, "text", raw)
        raw = given.encode("utf-8", "surrogateescape") if isinstance(given, str) else given
        return self.number(f"{name}.length", length_kind, len(raw)) + raw

    def texts(self, name: str, values: Mapping[str, str]) -> bytes:
        """Named texts after their length."""
        inner = b"".join(
            self.text(f"{name}.key", key) + self.text(f"{name}.value", value)
            for key, value in values.items()
        )
        inner = self._value(name, "map", inner)
        return self.number(f"{name}.length", "u32", len(inner)) + inner

    def record(self, name: str, opcode: int, content: bytes) -> bytes:
        """A whole record."""
        head = self.number(f"{name}.opcode", "u8", opcode)
        return head + self.number(f"{name}.record_length", "u64", len(content)) + content

    def magic(self, name: str) -> bytes:
        """The mark at an end of the file."""
        return bytes(self._value(name, "bytes", MAGIC))

    def _value(self, name: str, kind: str, value: Any) -> Any:
        self.kinds[name] = kind
        given = self._forge.get(name, value)
        return given(value) if callable(given) else given


class Place(NamedTuple):
    """Where a record stands."""

    offset: int
    length: int


class File:
    """One file while it is laid out."""

    def __init__(self, forge: Mapping[str, Any], content: Content) -> None:
        self.out = Layout(forge)
        self._content = content
        self._data = bytearray(self.out.magic("magic"))
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        self._definitions = b""
        self._counts: dict[int, int] = {}
        self._chunks: list[bytes] = []  # their records in the index
        self._attachment = self._metadata = Place(0, 0)

    def whole(self) -> bytes:
        """The bytes of the file."""
        self._header()
        self._define()
        sent = self._content.messages
        for first in range(0, len(sent), self._content.per_chunk):
            self._chunk(sent[first : first + self._content.per_chunk])
        self._attach()
        self._note()
        self._end()
        return bytes(self._data)

    def _add(self, record: bytes) -> Place:
        place = Place(len(self._data), len(record))
        self._data += record
        return place

    def _header(self) -> None:
        out = self.out
        content = out.text("header.profile", "ros2") + out.text("header.library", "tests")
        self._add(out.record("header", 1, content))

    def _define(self) -> None:
        out = self.out
        for row in self._content.messages:
            if row.kind not in self._schemas:
                number = self._schemas[row.kind] = len(self._schemas) + 1
                content = out.number("schema.id", "u16", number) + out.text("schema.name", row.kind)
                content += out.text("schema.encoding", "ros2msg")
                content += out.text("schema.data", row.definition)
                self._definitions += out.record("schema", 3, content)
            if row.topic not in self._channels:
                number = self._channels[row.topic] = len(self._channels)
                content = out.number("channel.id", "u16", number)
                content += out.number("channel.schema_id", "u16", self._schemas[row.kind])
                content += out.text("channel.topic", row.topic)
                content += out.text("channel.message_encoding", "cdr")
                values = {"offered_qos_profiles": self._content.qos, "topic_type_hash": ""}
                content += out.texts("channel.metadata", values)
                self._definitions += out.record("channel", 4, content)
        self._add(self._definitions)

    def _chunk(self, rows: Sequence[Sent]) -> None:
        out, inner = self.out, bytearray(self._definitions)
        places: dict[int, list[tuple[int, int]]] = {}
        for row in rows:
            channel = self._channels[row.topic]
            self._counts[channel] = self._counts.get(channel, 0) + 1
            places.setdefault(channel, []).append((row.log_time_ns, len(inner)))
            content = out.number("message.channel_id", "u16", channel)
            content += out.number("message.sequence", "u32", row.sequence)
            content += out.number("message.log_time", "u64", row.log_time_ns)
            content += out.number("message.publish_time", "u64", row.publish_time_ns)
            data = out._value("message.data", "bytes", row.data)
            inner += out.record("message", 5, content + data)
        times = [row.log_time_ns for row in rows]
        place = self._add(self._chunk_record(bytes(inner), min(times), max(times)))
        indices = {channel: self._message_index(channel, one) for channel, one in places.items()}
        self._chunks.append(self._chunk_index(place, indices, min(times), max(times), len(inner)))

    def _chunk_record(self, inner: bytes, first: int, last: int) -> bytes:
        out, name = self.out, self._content.compression
        inner = out._value("chunk.records", "records", inner)
        stored = out._value("chunk.stored", "bytes", COMPRESSIONS[name](inner))
        content = out.number("chunk.start_time", "u64", first)
        content += out.number("chunk.end_time", "u64", last)
        content += out.number("chunk.size", "u64", len(inner))
        content += out.number("chunk.crc", "u32", zlib.crc32(inner))
        content += out.text("chunk.compression", name)
        content += out.number("chunk.stored.length", "u64", len(stored)) + stored
        return out.record("chunk", 6, content)

    def _message_index(self, channel: int, rows: Sequence[tuple[int, int]]) -> Place:
        out = self.out
        inner = b"".join(
            out.number("message_index.time", "u64", time)
            + out.number("message_index.offset", "u64", offset)
            for time, offset in rows
        )
        content = out.number("message_index.channel_id", "u16", channel)
        content += out.number("message_index.length", "u32", len(inner)) + inner
        return self._add(out.record("message_index", 7, content))

    def _chunk_index(
        self, place: Place, indices: Mapping[int, Place], first: int, last: int, size: int
    ) -> bytes:
        out = self.out
        content = out.number("chunk_index.start_time", "u64", first)
        content += out.number("chunk_index.end_time", "u64", last)
        content += out.number("chunk_index.offset", "u64", place.offset)
        content += out.number("chunk_index.length", "u64", place.length)
        inner = b"".join(
            out.number("chunk_index.channel_id", "u16", channel)
            + out.number("chunk_index.index_offset", "u64", one.offset)
            for channel, one in indices.items()
        )
        content += out.number("chunk_index.indices_length", "u32", len(inner)) + inner
        length = sum(one.length for one in indices.values())
        content += out.number("chunk_index.message_index_length", "u64", length)
        content += out.text("chunk_index.compression", self._content.compression)
        content += out.number("chunk_index.compressed_size", "u64", place.length - 49)
        content += out.number("chunk_index.uncompressed_size", "u64", size)
        return out.record("chunk_index", 8, content)

    def _attach(self) -> None:
        out = self.out
        content = out.number("attachment.log_time", "u64", 1)
        content += out.number("attachment.create_time", "u64", 1)
        content += out.text("attachment.name", "parameters.yaml")
        content += out.text("attachment.media_type", "text/yaml")
        content += out.text("attachment.data", self._content.attachment, "u64")
        content += out.number("attachment.crc", "u32", zlib.crc32(content))
        self._attachment = self._add(out.record("attachment", 9, content))

    def _note(self) -> None:
        out = self.out
        content = out.text("metadata.name", "bouncing_disk_ros")
        content += out.texts("metadata.metadata", self._content.notes)
        self._metadata = self._add(out.record("metadata", 12, content))

    # --- the end ----------------------------------------------------------------------------------
    def _end(self) -> None:
        out = self.out
        content = out.number("data_end.crc", "u32", 0)
        self._add(out.record("data_end", 15, content))
        start = len(self._data)
        groups = self._groups() if self._content.summary else []
        offsets = b""
        for opcode, rows in groups:
            place = self._add(rows)
            content = out.number("summary_offset.opcode", "u8", opcode)
            content += out.number("summary_offset.start", "u64", place.offset)
            content += out.number("summary_offset.length", "u64", place.length)
            offsets += out.record("summary_offset", 14, content)
        offsets_at = self._add(offsets).offset
        content = out.number("footer.summary_start", "u64", start if groups else 0)
        content += out.number("footer.summary_offset_start", "u64", offsets_at if groups else 0)
        head = out.record("footer", 2, content + bytes(4))[:-4]
        crc = zlib.crc32(bytes(self._data[start:]) + head)
        self._add(head + out.number("footer.crc", "u32", crc if groups else 0))
        self._data += out.magic("end_magic")

    def _groups(self) -> list[tuple[int, bytes]]:
        return [
            (3, self._definitions),  # with the channels
            (11, self._statistics()),
            (8, b"".join(self._chunks)),
            (10, self._attachment_index()),
            (13, self._metadata_index()),
        ]

    def _statistics(self) -> bytes:
        out, times = self.out, [row.log_time_ns for row in self._content.messages]
        content = out.number("statistics.message_count", "u64", len(times))
        for name, kind, value in (
            ("schema_count", "u16", len(self._schemas)),
            ("channel_count", "u32", len(self._channels)),
            ("attachment_count", "u32", 1), ("metadata_count", "u32", 1),
            ("chunk_count", "u32", len(self._chunks)), ("start_time", "u64", min(times, default=0)),
            ("end_time", "u64", max(times, default=0)),
        ):  # fmt: skip
            content += out.number(f"statistics.{name}", kind, value)
        inner = b"".join(
            out.number("statistics.channel_id", "u16", channel)
            + out.number("statistics.count", "u64", count)
            for channel, count in self._counts.items()
        )
        content += out.number("statistics.counts_length", "u32", len(inner)) + inner
        return out.record("statistics", 11, content)

    def _attachment_index(self) -> bytes:
        out, place = self.out, self._attachment
        content = out.number("attachment_index.offset", "u64", place.offset)
        content += out.number("attachment_index.length", "u64", place.length)
        content += out.number("attachment_index.log_time", "u64", 1)
        content += out.number("attachment_index.create_time", "u64", 1)
        content += out.number("attachment_index.data_size", "u64", len(self._content.attachment))
        content += out.text("attachment_index.name", "parameters.yaml")
        content += out.text("attachment_index.media_type", "text/yaml")
        return out.record("attachment_index", 10, content)

    def _metadata_index(self) -> bytes:
        out, place = self.out, self._metadata
        content = out.number("metadata_index.offset", "u64", place.offset)
        content += out.number("metadata_index.length", "u64", place.length)
        content += out.text("metadata_index.name", "bouncing_disk_ros")
        return out.record("metadata_index", 13, content)


def forged(forge: Mapping[str, Any], content: Content) -> bytes:
    """A file with some fields forged: by a value, or by a function of the true value."""
    return File(forge, content).whole()


def fields(content: Content) -> dict[str, str]:
    """The names of all fields of such a file, and what each is."""
    file = File({}, content)
    file.whole()
    return file.out.kinds
