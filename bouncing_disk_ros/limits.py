"""Limits of what is read from outside: bags, records of inputs, texts. The one table.

What exceeds a limit is refused in one line before it costs time or memory. docs/recording.md shows
the table (`table()`), and a test holds the two equal.
"""

from __future__ import annotations

from typing import NamedTuple

KIB, MIB = 1 << 10, 1 << 20


class Limit(NamedTuple):
    """One row of the table."""

    what: str
    most: int
    unit: str = ""  # MiB, KiB, or what is counted


TABLE: list[Limit] = []


def _limit(what: str, most: int, unit: str = "") -> int:
    """Enter a limit in the table; its value, in bytes where the unit is one of bytes."""
    TABLE.append(Limit(what, most, unit))
    return most * {"KiB": KIB, "MiB": MIB}.get(unit, 1)


# --- .mcap files ----------------------------------------------------------------------------------
CHUNK = _limit("a chunk, as stored and decompressed; so also a message in one", 128, "MiB")
OVERLAP = _limit("chunks that overlap in time, decompressed together", 256, "MiB")
RECORD = _limit("any other record but a message or an attachment", 16, "MiB")
RECORDS = _limit("attachments and metadata records in a file; records of unknown kind", 20_000)
DEFINED = _limit("definitions of topics and types in a chunk, or outside of chunks", 131_072)
NAME = _limit("a name: topic, type, attachment, metadata record, key", 1, "KiB")
NOTE = _limit("a note of the recorder", 64, "KiB")
TIME_NS = _limit("a time, ns since 1970 (that is in 2262)", (1 << 63) - 1)
DAMAGES = _limit("damaged places in a file", 10_000)
SEARCHED = _limit("bytes of damaged chunks tried in a file, besides twice its size", 512, "MiB")
# --- message definitions and messages -------------------------------------------------------------
DEFINITION = _limit("the definition of a message type, with its dependencies", 256, "KiB")
FIELDS = _limit("lines in a definition, comments not counted", 2048)
DEPTH = _limit("levels of types within types", 16)
ARRAY = _limit("strings or messages in an array of fixed length, and in all within a message", 500)
OBJECTS = _limit("strings and messages in the sequences of one message", 1_000_000)
CLOUD_FIELDS = _limit("fields of a point cloud", 256)
# --- texts ----------------------------------------------------------------------------------------
JSON = _limit("a record of inputs (JSON)", 4, "MiB")
JSON_DEPTH = _limit("levels of a record of inputs", 16)
DIGITS = _limit("digits of a whole number in JSON or YAML", 19)
YAML = _limit("metadata.yaml, a preset or a programme", 8, "MiB")
QOS = _limit("quality of service in the metadata of a channel (YAML)", 256, "KiB")
QOS_ALL = _limit("the same of all channels of a file", 4, "MiB")
YAML_DEPTH = _limit("levels of a YAML text (aliases, anchors and tags of programs are refused)", 16)
YAML_NODES = _limit("values in a YAML text", 300_000)
FILES = _limit("files of a bag", 100_000)
# --- reading a run --------------------------------------------------------------------------------
WAITING = _limit("messages held to bring them into the order of sending", 64, "MiB")
EVENTS = _limit("motions, changes, or reports of a run kept in memory", 100_000)
NUMBER_EXPONENT = _limit("exponent of ten of a number in impacts and states", 30)
LARGEST = 10.0**NUMBER_EXPONENT


def table() -> str:
    """The limits as a Markdown table."""
    rows = [f"| {row.what} | {_shown(row.most)} {row.unit}".rstrip() for row in TABLE]
    return "\n".join(["| | at most |", "|---|---|", *(f"{row} |" for row in rows)])


def _shown(number: int) -> str:
    """A number in groups of three digits; one beyond them as a power of two."""
    return f"{number:,}".replace(",", " ") if number < 10**9 else f"2^{number.bit_length()}"
