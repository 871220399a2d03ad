"""Chunks and the messages in them: checked, decompressed, walked through without mcap's objects."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Container, Iterator
from typing import NamedTuple

import lz4.frame
import zstandard
from mcap.opcode import Opcode

from bouncing_disk_ros.bag.formats import BagError
from bouncing_disk_ros.bag.index import CHUNK_HEAD, HEAD

MESSAGE_HEAD = struct.Struct("<HIQQ")
"""Channel, sequence, log_time, publish_time before the data of a message."""
LARGEST_CHUNK = 4 << 30
"""A chunk that claims to be larger is taken for a damaged one."""


class Stored(NamedTuple):
    """One message as it is stored."""

    channel: int
    log_time_ns: int
    publish_time_ns: int
    sequence: int
    data: bytes


def unpacked(content: bytes | memoryview) -> bytes:
    """The records within a chunk, from the content of the chunk record; BagError when damaged."""
    try:
        _, _, size, crc, name_length = CHUNK_HEAD.unpack_from(content)
        place = CHUNK_HEAD.size + name_length
        name = bytes(content[CHUNK_HEAD.size : place]).decode()
        (length,) = struct.unpack_from("<Q", content, place)
        stored = bytes(content[place + 8 : place + 8 + length])
        if length != len(content) - place - 8 or size > LARGEST_CHUNK:
            raise BagError("lengths do not fit")
        data = _decompressed(name, stored, size)
    except BagError:
        raise
    except Exception as error:  # noqa: BLE001 (each library has its own; whatever it is, it is damage)
        raise BagError(f"damaged: {error}") from None
    if len(data) != size or (crc and zlib.crc32(data) != crc):
        raise BagError("damaged: the checksum does not fit")
    return data


def _decompressed(name: str, stored: bytes, size: int) -> bytes:
    if name == "":
        return stored
    if name == "zstd":
        if zstandard.frame_content_size(stored) not in (-1, size):
            raise BagError("lengths do not fit")
        return zstandard.ZstdDecompressor().decompress(stored, max_output_size=size)
    if name == "lz4":
        data: bytes = lz4.frame.decompress(stored)
        return data
    raise BagError(f"compression {name!r} is not known (none, lz4 and zstd are)")


def records(data: bytes | memoryview) -> Iterator[tuple[int, int, int]]:
    """Opcode, place and whole length of each record in a row; BagError when they do not fit."""
    position, end = 0, len(data)
    while position + HEAD.size <= end:
        opcode, length = HEAD.unpack_from(data, position)
        whole = HEAD.size + length
        if position + whole > end:
            break
        yield opcode, position, whole
        position += whole
    if position != end:
        raise BagError("damaged: a record runs over the end")


def messages(data: bytes, channels: Container[int]) -> Iterator[Stored]:
    """The messages of some channels among records, in the order of storage."""
    head, message_head = HEAD.unpack_from, MESSAGE_HEAD.unpack_from
    first, skip = HEAD.size, HEAD.size + MESSAGE_HEAD.size
    position, end, wanted = 0, len(data), int(Opcode.MESSAGE)
    while position < end:
        opcode, length = head(data, position)
        if opcode == wanted:
            channel, sequence, log_time, publish_time = message_head(data, position + first)
            if channel in channels:
                content = data[position + skip : position + first + length]
                yield Stored(channel, log_time, publish_time, sequence, content)
        position += first + length
