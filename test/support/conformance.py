"""The conformance files of the MCAP format, laid out byte by byte.

Six kinds of data times the features of the published conformance suite (github.com/foxglove/mcap,
tests/conformance): 416 files. A feature is named as there.

| feature | the file has |
|---|---|
| ch, mx | chunks; message indexes behind them |
| st, chx, ax, mdx | statistics; indexes of chunks, attachments, metadata in its summary |
| rsh, rch | schemas and channels repeated in its summary |
| sum | offsets of the groups of its summary |
| pad | bytes behind the last field of each record that may grow |
"""

from __future__ import annotations

import itertools
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

from mcap.opcode import Opcode

MAGIC = b"\x89MCAP0\r\n"
DATA = ("NoData", "OneAttachment", "OneMetadata", "OneMessage", "OneSchemalessMessage",
        "TenMessages")  # fmt: skip
FEATURES = ("ch", "mx", "st", "rsh", "rch", "ax", "mdx", "chx", "sum", "pad")
_NEEDS = {"ch": "Message", "mx": "Message", "chx": "Message", "rch": "Message",
          "ax": "Attachment", "mdx": "Metadata"}  # fmt: skip
_NOT_PADDED = (Opcode.MESSAGE, Opcode.CHUNK, Opcode.DATA_END, Opcode.FOOTER)
"""Their last field takes all that is left, or their length is fixed."""
_PADDING = b"\x01\xff\xff"


class Message(NamedTuple):
    """A message of the suite."""

    log_time: int
    publish_time: int
    sequence: int
    data: bytes


def messages_of(data: str) -> list[Message]:
    """The messages of a kind of data."""
    if data == "TenMessages":
        return [Message(i, i, i, bytes([i]) * i) for i in range(10)]
    return [Message(2, 1, 10, b"\x01\x02\x03")] if "Message" in data else []


def variants() -> Iterator[tuple[str, frozenset[str]]]:
    """Data and features of each file: those that the data can have, and that make a difference."""
    for data in DATA:
        for chosen in itertools.product((False, True), repeat=len(FEATURES)):
            features = frozenset(name for name, on in zip(FEATURES, chosen, strict=True) if on)
            if _is_variant(data, features):
                yield data, features


def _is_variant(data: str, features: frozenset[str]) -> bool:
    if any(name in features and needed not in data for name, needed in _NEEDS.items()):
        return False
    if "rsh" in features and data not in ("OneMessage", "TenMessages"):
        return False
    if features & {"mx", "chx"} and "ch" not in features:
        return False
    return "sum" not in features or bool(features & {"st", "rsh", "rch", "ax", "mdx", "chx"})


@dataclass
class _File:
    """A file under way; `at`: opcode to what the summary says of its records."""

    features: frozenset[str]
    content: bytearray = field(default_factory=lambda: bytearray(MAGIC))

    def add(self, opcode: Opcode, *parts: bytes) -> tuple[int, int]:
        """Add a record: where it stands and how long it is."""
        made = self.record(opcode, *parts)
        offset = len(self.content)
        self.content += made
        return offset, len(made)

    def record(self, opcode: Opcode, *parts: bytes) -> bytes:
        """The bytes of a record."""
        padding = _PADDING if "pad" in self.features and opcode not in _NOT_PADDED else b""
        body = b"".join(parts) + padding
        return struct.pack("<BQ", opcode, len(body)) + body


def _text(value: bytes) -> bytes:
    return struct.pack("<I", len(value)) + value


def _texts(*values: bytes) -> bytes:
    return _text(b"".join(map(_text, values)))


def made(data: str, features: frozenset[str]) -> bytes:
    """The bytes of one file."""
    file = _File(features)
    file.add(Opcode.HEADER, _text(b""), _text(b""))
    definitions, chunks = _messages(file, data)
    attachments, notes = [], []
    if data == "OneAttachment":
        body = struct.pack("<QQ", 2, 1) + _text(b"myFile") + _text(b"application/octet-stream")
        body += struct.pack("<Q", 3) + b"\x01\x02\x03"
        attachments.append(file.add(Opcode.ATTACHMENT, body, struct.pack("<I", zlib.crc32(body))))
    if data == "OneMetadata":
        notes.append(file.add(Opcode.METADATA, _text(b"myMetadata"), _texts(b"foo", b"bar")))
    file.add(Opcode.DATA_END, struct.pack("<I", 0))
    _close(file, data, definitions, chunks, attachments, notes)
    return bytes(file.content)


class _Chunk(NamedTuple):
    offset: int
    length: int
    index_offset: int  # of its message index
    index_length: int
    size: int


def _messages(file: _File, data: str) -> tuple[dict[str, bytes], list[_Chunk]]:
    """Add the messages with their definitions, in a chunk or not."""
    messages = messages_of(data)
    if not messages:
        return {}, []
    number = 0 if data == "OneSchemalessMessage" else 1
    definitions = {}
    if number:
        parts = struct.pack("<H", 1) + _text(b"Example") + _text(b"c") + _text(b"\x04\x05\x06")
        definitions["rsh"] = file.record(Opcode.SCHEMA, parts)
    parts = struct.pack("<HH", 1, number) + _text(b"example") + _text(b"a")
    definitions["rch"] = file.record(Opcode.CHANNEL, parts, _texts(b"foo", b"bar"))
    inner = bytearray(b"".join(definitions.values()))
    places = []
    for log_time, publish_time, sequence, content in messages:
        places.append(struct.pack("<QQ", log_time, len(inner)))
        head = struct.pack("<HIQQ", 1, sequence, log_time, publish_time)
        inner += file.record(Opcode.MESSAGE, head, content)
    if "ch" not in file.features:
        file.content += inner
        return definitions, []
    times = [message.log_time for message in messages]
    head = struct.pack("<QQQI", min(times), max(times), len(inner), zlib.crc32(inner))
    size = struct.pack("<Q", len(inner))
    chunk = file.add(Opcode.CHUNK, head, _text(b""), size, bytes(inner))
    index = (sum(chunk), 0)
    if "mx" in file.features:
        parts = struct.pack("<H", 1) + _text(b"".join(places))
        index = file.add(Opcode.MESSAGE_INDEX, parts)
    return definitions, [_Chunk(*chunk, *index, len(inner))]


def _close(
    file: _File,
    data: str,
    definitions: dict[str, bytes],
    chunks: list[_Chunk],
    attachments: list[tuple[int, int]],
    notes: list[tuple[int, int]],
) -> None:
    """Add summary, footer and magic."""
    start, groups = len(file.content), []
    for name, opcode, records in _summary(file, data, definitions, chunks, attachments, notes):
        if name in file.features and records:
            groups.append((opcode, len(file.content), len(b"".join(records))))
            file.content += b"".join(records)
    end = len(file.content)
    if "sum" in file.features:
        for group in groups:
            file.add(Opcode.SUMMARY_OFFSET, struct.pack("<BQQ", *group))
    places = start if groups else 0, end if "sum" in file.features else 0
    head = struct.pack("<BQQQ", Opcode.FOOTER, 20, *places)
    crc = zlib.crc32(head, zlib.crc32(file.content[start:]))
    file.content += head + struct.pack("<I", crc) + MAGIC


def _summary(
    file: _File,
    data: str,
    definitions: dict[str, bytes],
    chunks: list[_Chunk],
    attachments: list[tuple[int, int]],
    notes: list[tuple[int, int]],
) -> Iterator[tuple[str, Opcode, list[bytes]]]:
    """The groups of records that a summary may have, by the feature that puts them there."""
    messages, times = messages_of(data), [message.log_time for message in messages_of(data)]
    yield "rsh", Opcode.SCHEMA, [definitions[name] for name in definitions if name == "rsh"]
    yield "rch", Opcode.CHANNEL, [definitions[name] for name in definitions if name == "rch"]
    counts = struct.pack("<QHIIII", len(messages), "rsh" in definitions, "rch" in definitions,
                         len(attachments), len(notes), len(chunks))  # fmt: skip
    span = struct.pack("<QQ", min(times, default=0), max(times, default=0))
    by_channel = _text(struct.pack("<HQ", 1, len(messages)) if messages else b"")
    yield "st", Opcode.STATISTICS, [file.record(Opcode.STATISTICS, counts, span, by_channel)]
    yield (
        "chx",
        Opcode.CHUNK_INDEX,
        [
            file.record(
                Opcode.CHUNK_INDEX,
                struct.pack("<QQQQ", min(times), max(times), chunk.offset, chunk.length),
                _text(struct.pack("<HQ", 1, chunk.index_offset) if chunk.index_length else b""),
                struct.pack("<Q", chunk.index_length),
                _text(b""),
                struct.pack("<QQ", chunk.size, chunk.size),
            )
            for chunk in chunks
        ],
    )
    yield "ax", Opcode.ATTACHMENT_INDEX, [
        file.record(
            Opcode.ATTACHMENT_INDEX, struct.pack("<QQQQQ", *place, 2, 1, 3), _text(b"myFile"),
            _text(b"application/octet-stream"),
        )
        for place in attachments
    ]  # fmt: skip
    yield (
        "mdx",
        Opcode.METADATA_INDEX,
        [
            file.record(Opcode.METADATA_INDEX, struct.pack("<QQ", *place), _text(b"myMetadata"))
            for place in notes
        ],
    )
