"""The topics and message types that a file defines, each number once."""

from __future__ import annotations

from collections.abc import Iterator

from mcap.opcode import Opcode
from mcap.records import Channel, Schema

from bouncing_disk_ros.bag import fields
from bouncing_disk_ros.bag.chunk_reader import Inner
from bouncing_disk_ros.bag.files import HEAD
from bouncing_disk_ros.bag.formats import BagError


class Definitions:
    """Message types and channels by number; those of chunks have a checksum and prevail."""

    def __init__(self) -> None:
        self.schemas: dict[int, Schema] = {}
        self.channels: dict[int, Channel] = {}
        self._sure: dict[tuple[int, int], Schema | Channel] = {}

    def take(self, opcode: int, content: fields.Content) -> None:
        """Take one that stands outside of chunks; BagError when damaged."""
        row = _read(opcode, content)
        if (opcode, row.id) not in self._sure:
            self._keep(row)

    def take_inner(self, inner: Inner) -> None:
        """Take those in a chunk; BagError when damaged, or unlike others in it or another chunk."""
        found: dict[tuple[int, int], Schema | Channel] = {}
        for opcode, row in inner_definitions(inner):
            key = opcode, row.id
            if self._sure.get(key, row) != row or found.setdefault(key, row) != row:
                raise BagError(f"its definition of number {row.id} differs from an earlier one")
        self._sure.update(found)
        for row in found.values():
            self._keep(row)

    def _keep(self, row: Schema | Channel) -> None:
        if isinstance(row, Schema):
            self.schemas[row.id] = row
        else:
            self.channels[row.id] = row


def inner_definitions(inner: Inner) -> Iterator[tuple[int, Schema | Channel]]:
    """The definitions in a chunk, with their opcode; BagError when damaged."""
    for opcode, position, whole in inner.definitions:
        yield opcode, _read(opcode, inner.data[position + HEAD.size : position + whole])


def _read(opcode: int, content: fields.Content) -> Schema | Channel:
    return fields.schema(content) if opcode == Opcode.SCHEMA else fields.channel(content)
