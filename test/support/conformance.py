"""The conformance files of the MCAP format, by the writer of `mcap`.

Six kinds of data times the features of the published conformance suite (github.com/foxglove/mcap,
tests/conformance): 416 files. A feature is named as there.

| feature | the file has |
|---|---|
| ch, mx | chunks; message indexes behind them |
| st, chx, ax, mdx | statistics; indexes of chunks, attachments, metadata in its summary |
| rsh, rch | schemas and channels repeated in its summary |
| sum | offsets of the groups of its summary |
| pad | bytes behind the last field of each record that may grow, attachments excepted |
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from io import BytesIO
from typing import NamedTuple
from unittest.mock import patch

from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.writer import CompressionType, IndexType, Writer

DATA = ("NoData", "OneAttachment", "OneMetadata", "OneMessage", "OneSchemalessMessage",
        "TenMessages")  # fmt: skip
FEATURES = ("ch", "mx", "st", "rsh", "rch", "ax", "mdx", "chx", "sum", "pad")
_NEEDS = {"ch": "Message", "mx": "Message", "chx": "Message", "rch": "Message",
          "ax": "Attachment", "mdx": "Metadata"}  # fmt: skip
_INDEXES = {"mx": IndexType.MESSAGE, "chx": IndexType.CHUNK, "ax": IndexType.ATTACHMENT,
            "mdx": IndexType.METADATA}  # fmt: skip
_NOT_PADDED = (Opcode.MESSAGE, Opcode.CHUNK, Opcode.DATA_END, Opcode.FOOTER)
"""Their last field takes all that is left, or their length is fixed."""


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


class _Padded(RecordBuilder):
    """Adds bytes behind the last field."""

    def start_record(self, opcode: Opcode) -> None:
        self._opcode = opcode
        super().start_record(opcode)

    def finish_record(self) -> None:
        if self._opcode not in _NOT_PADDED:
            self.write(b"\x01\xff\xff")
        super().finish_record()


def made(data: str, features: frozenset[str]) -> bytes:
    """The bytes of one file."""
    builder = _Padded if "pad" in features else RecordBuilder
    out, indexes = BytesIO(), IndexType.NONE
    for name in features & _INDEXES.keys():
        indexes |= _INDEXES[name]
    with (
        patch("mcap.writer.RecordBuilder", builder),
        patch("mcap._chunk_builder.RecordBuilder", builder),
    ):
        writer = Writer(
            out, compression=CompressionType.NONE, index_types=indexes,
            repeat_channels="rch" in features, repeat_schemas="rsh" in features,
            use_chunking="ch" in features, use_statistics="st" in features,
            use_summary_offsets="sum" in features,
        )  # fmt: skip
        writer.start("", "")
        _write(writer, data)
        writer.finish()
    return out.getvalue()


def _write(writer: Writer, data: str) -> None:
    """Write the content of a kind of data."""
    if data == "OneAttachment":
        writer.add_attachment(1, 2, "myFile", "application/octet-stream", b"\x01\x02\x03")
    if data == "OneMetadata":
        writer.add_metadata("myMetadata", {"foo": "bar"})
    if not messages_of(data):
        return
    schema = 0
    if data != "OneSchemalessMessage":
        schema = writer.register_schema("Example", "c", b"\x04\x05\x06")
    channel = writer.register_channel("example", "a", schema, {"foo": "bar"})
    for one in messages_of(data):
        writer.add_message(channel, one.log_time, one.data, one.publish_time, one.sequence)
