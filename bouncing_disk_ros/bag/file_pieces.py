"""What a walk through a file finds: whole records, and what is lost."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

from mcap.opcode import Opcode

from bouncing_disk_ros.bag.chunk_reader import Inner


@dataclass
class Piece:
    """A whole record of `length` bytes at `offset`, or (MESSAGE) messages in a row.

    `record` are its bytes, but of attachments, which may be long. `inner`: its messages.
    """

    opcode: int
    offset: int
    length: int
    record: bytes = b""
    inner: Inner | None = None


@dataclass
class Damage:
    """Bytes that are lost; `counts` the messages of each channel in them, where that is known.

    `holds_messages` is false of a record that is certainly no chunk.
    """

    offset: int
    length: int
    reason: str
    counts: Counter[int] = field(default_factory=Counter)
    span_ns: tuple[int, int] | None = None
    holds_messages: bool = True
    record: str = ""  # the attachment or note that it is, where it certainly is one


def describe(name: str, damage: Damage) -> str:
    """A damage in words."""
    what = f"{damage.counts.total()} messages" if damage.counts else "messages in them unknown"
    what = what if damage.holds_messages else damage.record or "no messages"
    return (
        f"{name}: bytes {damage.offset} to {damage.offset + damage.length}: {damage.reason}: {what}"
    )


def record_name(opcode: int, name: str) -> str:
    """An attachment or a metadata record in words; name '': not known."""
    what = "attachment" if opcode == Opcode.ATTACHMENT else "note"
    return f"{what} {name}" if name else f"an {what}" if what == "attachment" else f"a {what}"
