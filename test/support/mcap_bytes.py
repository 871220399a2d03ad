"""An .mcap file laid out byte by byte, so that each of its fields can be forged.

Checksums and lengths are those of what is written, unless they are forged themselves: only so does
a forged field reach the code behind them.

    forged({"chunk.size": 1 << 62}, content)       # every chunk says so
    fields(content)                                # the names of all fields, with their kinds
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


RECORDS: Mapping[str, tuple[int, tuple[str, ...]]] = {
    "header": (1, ("profile text", "library text")),
    "footer": (2, ("summary_start u64", "summary_offset_start u64", "crc u32")),
    "schema": (3, ("id u16", "name text", "encoding text", "data text")),
    "channel": (4, ("id u16", "schema_id u16", "topic text", "message_encoding text",
                    "metadata map")),
    "message": (5, ("channel_id u16", "sequence u32", "log_time u64", "publish_time u64",
                    "data bytes")),
    "chunk": (6, ("start_time u64", "end_time u64", "size u64", "crc u32", "compression text",
                  "stored long_text")),
    "message_index": (7, ("channel_id u16", "length rows time u64 offset u64")),
    "chunk_index": (8, ("start_time u64", "end_time u64", "offset u64", "length u64",
                        "indices_length rows channel_id u16 index_offset u64",
                        "message_index_length u64", "compression text", "compressed_size u64",
                        "uncompressed_size u64")),
    "attachment": (9, ("log_time u64", "create_time u64", "name text", "media_type text",
                       "data long_text", "crc crc")),
    "attachment_index": (10, ("offset u64", "length u64", "log_time u64", "create_time u64",
                              "data_size u64", "name text", "media_type text")),
    "statistics": (11, ("message_count u64", "schema_count u16", "channel_count u32",
                        "attachment_count u32", "metadata_count u32", "chunk_count u32",
                        "start_time u64", "end_time u64",
                        "counts_length rows channel_id u16 count u64")),
    "metadata": (12, ("name text", "metadata map")),
    "metadata_index": (13, ("offset u64", "length u64", "name text")),
    "summary_offset": (14, ("opcode u8", "start u64", "length u64")),
    "data_end": (15, ("crc u32",)),
}  # fmt: skip
"""Opcode and fields of each record: name and kind of a field, or the name of the length of rows,
"rows", and the names and kinds of their columns. `crc` is that of all before it."""


class Layout:
    """Writes fields; `forge` gives other values for some of them, by name."""

    def __init__(self, forge: Mapping[str, Any]) -> None:
        self.kinds: dict[str, str] = {}  # of all fields by name
        self._forge = forge

    def record(self, name: str, *values: Any) -> bytes:
        """A whole record with these values of its fields, in order."""
        opcode, fields = RECORDS[name]
        content = b""
        for field_, value in zip(fields, values, strict=True):
            content += self._field(name, field_.split(), value, content)
        head = self._number(f"{name}.opcode", "u8", opcode)
        return head + self._number(f"{name}.record_length", "u64", len(content)) + content

    def value(self, name: str, kind: str, value: Any) -> Any:
        """The value of a field, forged or not."""
        self.kinds[name] = kind
        given = self._forge.get(name, value)
        return given(value) if callable(given) else given

    def _field(self, record: str, words: Sequence[str], value: Any, before: bytes) -> bytes:
        name, kind, *columns = (f"{record}.{words[0]}", *words[1:])
        match kind:
            case "text":
                return self._text(name, value)
            case "long_text":
                return self._text(name, value, "u64")
            case "bytes":
                return bytes(self.value(name, kind, value))
            case "map":
                inner = b"".join(
                    self._text(f"{name}.key", key) + self._text(f"{name}.value", text)
                    for key, text in value.items()
                )
                inner = self.value(name, kind, inner)
                return self._number(f"{name}.length", "u32", len(inner)) + inner
            case "rows":
                pairs = list(zip(columns[::2], columns[1::2], strict=True))
                inner = b"".join(
                    self._number(f"{record}.{column}", size, number)
                    for row in value
                    for (column, size), number in zip(pairs, row, strict=True)
                )
                return self._number(name, "u32", len(inner)) + inner
            case "crc":
                return self._number(name, "u32", zlib.crc32(before))
            case _:
                return self._number(name, kind, value)

    def _number(self, name: str, kind: str, value: int) -> bytes:
        form = _FORMS[kind]
        given = self.value(name, kind, value)
        return struct.pack(form, given % (1 << (8 * struct.calcsize(form))))

    def _text(self, name: str, value: str | bytes, length_kind: str = "u32") -> bytes:
        """A text or bytes after their length; both can be forged."""
        raw = value.encode() if isinstance(value, str) else value
        given = self.value(name, "text", raw)
        raw = given.encode("utf-8", "surrogateescape") if isinstance(given, str) else given
        return self._number(f"{name}.length", length_kind, len(raw)) + raw


class Place(NamedTuple):
    """Where a record stands."""

    offset: int
    length: int


class File:
    """One file while it is laid out."""

    def __init__(self, forge: Mapping[str, Any], content: Content) -> None:
        self.out = Layout(forge)
        self._content = content
        self._data = bytearray(self.out.value("magic", "bytes", MAGIC))
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        self._definitions = b""
        self._counts: dict[int, int] = {}
        self._chunks: list[bytes] = []  # their records in the index

    def whole(self) -> bytes:
        """The bytes of the file."""
        content = self._content
        self._add("header", "ros2", "tests")
        self._define()
        for first in range(0, len(content.messages), content.per_chunk):
            self._chunk(content.messages[first : first + content.per_chunk])
        about = ("parameters.yaml", "text/yaml")
        attached = self._add("attachment", 1, 1, *about, content.attachment, 0)
        noted = self._add("metadata", "bouncing_disk_ros", content.notes)
        self._add("data_end", 0)
        start = len(self._data)
        groups = self._groups(attached, noted, about) if content.summary else []
        offsets = b""
        for opcode, rows in groups:
            place = self._append(rows)
            offsets += self.out.record("summary_offset", opcode, *place)
        offsets_at = self._append(offsets).offset
        ends = (start, offsets_at) if groups else (0, 0)
        head = self.out.record("footer", *ends, 0)[:-4]
        crc = zlib.crc32(bytes(self._data[start:]) + head) if groups else 0
        self._append(self.out.record("footer", *ends, crc))
        self._data += self.out.value("end_magic", "bytes", MAGIC)
        return bytes(self._data)

    def _append(self, data: bytes) -> Place:
        place = Place(len(self._data), len(data))
        self._data += data
        return place

    def _add(self, name: str, *values: Any) -> Place:
        return self._append(self.out.record(name, *values))

    def _define(self) -> None:
        out = self.out
        for row in self._content.messages:
            if row.kind not in self._schemas:
                number = self._schemas[row.kind] = len(self._schemas) + 1
                self._definitions += out.record(
                    "schema", number, row.kind, "ros2msg", row.definition
                )
            if row.topic not in self._channels:
                number = self._channels[row.topic] = len(self._channels)
                values = {"offered_qos_profiles": self._content.qos, "topic_type_hash": ""}
                self._definitions += out.record(
                    "channel", number, self._schemas[row.kind], row.topic, "cdr", values
                )
        self._append(self._definitions)

    def _chunk(self, rows: Sequence[Sent]) -> None:
        out, inner, name = self.out, bytearray(self._definitions), self._content.compression
        places: dict[int, list[tuple[int, int]]] = {}
        for row in rows:
            channel = self._channels[row.topic]
            self._counts[channel] = self._counts.get(channel, 0) + 1
            places.setdefault(channel, []).append((row.log_time_ns, len(inner)))
            times = (row.log_time_ns, row.publish_time_ns)
            inner += out.record("message", channel, row.sequence, *times, row.data)
        ends = [min(row.log_time_ns for row in rows), max(row.log_time_ns for row in rows)]
        data = out.value("chunk.records", "bytes", bytes(inner))
        stored = COMPRESSIONS[name](data)
        place = self._add("chunk", *ends, len(data), zlib.crc32(data), name, stored)
        found = {channel: self._add("message_index", channel, one)
                 for channel, one in places.items()}  # fmt: skip
        offsets = [(channel, one.offset) for channel, one in found.items()]
        length = sum(one.length for one in found.values())
        sizes = (length, name, place.length - 49, len(inner))
        self._chunks.append(out.record("chunk_index", *ends, *place, offsets, *sizes))

    def _groups(
        self, attached: Place, noted: Place, about: tuple[str, str]
    ) -> list[tuple[int, bytes]]:
        """Opcode and records of each part of the summary."""
        out, times = self.out, [row.log_time_ns for row in self._content.messages]
        counts = (len(times), len(self._schemas), len(self._channels), 1, 1, len(self._chunks))
        ends = (min(times, default=0), max(times, default=0))
        size = len(self._content.attachment)
        return [
            (3, self._definitions),  # with the channels
            (11, out.record("statistics", *counts, *ends, self._counts.items())),
            (8, b"".join(self._chunks)),
            (10, out.record("attachment_index", *attached, 1, 1, size, *about)),
            (13, out.record("metadata_index", *noted, "bouncing_disk_ros")),
        ]


def forged(forge: Mapping[str, Any], content: Content) -> bytes:
    """A file with some fields forged: by a value, or by a function of the true value."""
    return File(forge, content).whole()


def fields(content: Content) -> dict[str, str]:
    """The names of all fields of such a file, and what each is."""
    file = File({}, content)
    file.whole()
    return file.out.kinds
