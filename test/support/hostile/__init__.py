"""Bags that damage or malice could have made: the corpus that every reader of bags must survive.

CORPUS holds those made by hand, `forgeries` each field of the format with other values.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from support.hostile import chunks, files, floods, messages, records, texts
from support.hostile.base import CORPUS, content, put


class Forgery(NamedTuple):
    """One field of the format with another value."""

    field: str
    what: str
    value: Any


def forgeries(kinds: Mapping[str, str]) -> Sequence[Forgery]:
    """Every field of a file, each with several values that are not true."""
    found = []
    sizes = {"u8": 8, "u16": 16, "u32": 32, "u64": 64}
    for name, kind in kinds.items():
        if kind in sizes:
            top = 1 << sizes[kind]
            changes: dict[str, Any] = {
                "0": 0, "largest": top - 1, "half": top // 2, "one more": lambda true: true + 1,
                "one less": lambda true: true - 1, "a million": 1_000_000,
            }  # fmt: skip
        else:
            changes = {
                "empty": b"", "zeros": lambda true: bytes(len(true)), "cut": lambda true: true[:-1],
                "long": lambda true: true * 3 + b"x", "not UTF-8": b"\xff\xfe\xfd",
            }  # fmt: skip
        found += [Forgery(name, what, value) for what, value in changes.items()]
    return found


__all__ = [
    "CORPUS", "Forgery", "chunks", "content", "files", "floods", "forgeries", "messages", "put",
    "records", "texts",
]  # fmt: skip
