"""Notes of this package in a bag.

An mcap metadata record has no checksum of its own, so the notes carry one.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Mapping

from bouncing_disk_ros import limits
from bouncing_disk_ros.errors import BagError

FORMAT_VERSION = 1
"""Grows when a bag is laid out in another way. Bags of every older version stay readable."""
FORMAT_KEY = "format"
NOTE = "bouncing_disk_ros"
"""Name of our metadata record in every file."""
_CRC = "crc32"


def signed(notes: Mapping[str, str]) -> dict[str, str]:
    """Notes with their checksum."""
    texts = {key: str(value) for key, value in notes.items() if key != _CRC}
    return {**texts, _CRC: f"{_checksum(texts):08x}"}


def checked(notes: Mapping[str, str]) -> dict[str, str]:
    """Notes without their checksum; BagError when it does not fit, or they cannot be shown."""
    texts = {key: value for key, value in notes.items() if key != _CRC}
    if notes.get(_CRC) != f"{_checksum(texts):08x}":
        raise BagError("the notes of the bag are damaged (their checksum is wrong)")
    for key, text in texts.items():
        if len(text) > limits.NOTE or not text.isprintable():
            raise BagError(f"the note {key!r} is too long, or has characters that cannot be shown")
    return texts


def _checksum(texts: Mapping[str, str]) -> int:
    return zlib.crc32(json.dumps(sorted(texts.items())).encode())
