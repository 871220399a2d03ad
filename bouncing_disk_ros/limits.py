"""Limits of what comes in from outside, as a file or over the middleware. The one table.

They are checked before what is given costs time or memory; a file beyond one is refused in one
line. docs/recording.md shows the limits of FILES_READ, docs/interfaces.md those of MESSAGES
(`table`), and a test holds them equal.
"""

from __future__ import annotations

from typing import NamedTuple

KIB, MIB = 1 << 10, 1 << 20


class Limit(NamedTuple):
    """One row of the table."""

    home: str  # FILES_READ or MESSAGES
    what: str
    most: int
    unit: str  # MiB, KiB, or what is counted
    beyond: str  # what becomes of more; of files: all are refused


FILES_READ, MESSAGES = "files", "messages"
TABLE: list[Limit] = []


def _limit(what: str, most: int, unit: str = "", beyond: str = "") -> int:
    """Enter a limit in the table; its value, in bytes where the unit is one of bytes.

    `beyond`: what becomes of more, for those of messages.
    """
    TABLE.append(Limit(MESSAGES if beyond else FILES_READ, what, most, unit, beyond))
    return most * {"KiB": KIB, "MiB": MIB}.get(unit, 1)


# --- .mcap files ----------------------------------------------------------------------------------
CHUNK = _limit("a chunk, stored and decompressed; therefore also a message in a chunk", 128, "MiB")
OVERLAP = _limit("chunks that overlap in time, decompressed together", 256, "MiB")
RECORD = _limit("any other record except a message or an attachment", 16, "MiB")
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
ARRAY = _limit("strings or messages in the arrays of fixed length of a definition", 500)
OBJECTS = _limit("strings and messages in the sequences of one message", 1_000_000)
CLOUD_FIELDS = _limit("fields of a point cloud", 256)
# --- texts ----------------------------------------------------------------------------------------
JSON = _limit("a record of inputs (JSON)", 4, "MiB")
JSON_DEPTH = _limit("levels of a record of inputs", 16)
DIGITS = _limit("digits of a whole number in JSON or YAML", 19)
YAML = _limit("metadata.yaml, a preset or a programme", 8, "MiB")
QOS = _limit("quality of service in the metadata of a channel (YAML)", 256, "KiB")
QOS_ALL = _limit("quality of service in the metadata of all channels of a file", 4, "MiB")
YAML_DEPTH = _limit("levels of a YAML text (aliases, anchors and tags of programs are refused)", 16)
YAML_NODES = _limit("values in a YAML text", 300_000)
FILES = _limit("files of a bag", 100_000)
# --- results of studies ---------------------------------------------------------------------------
RESULT_METADATA = _limit("the metadata of an array or a group in a result of a study", 16, "MiB")
RESULT_ARRAYS = _limit("arrays in a result", 1000)
RESULT_CHUNKS = _limit("chunks of an array in a result", 10_000_000)
RESULT_CHUNK = _limit("a chunk of an array in a result, decompressed", 512, "MiB")
# --- reading a run --------------------------------------------------------------------------------
WAITING = _limit("messages kept in memory to sort them by time of sending", 64, "MiB")
EVENTS = _limit("motions, changes, or reports of a run kept in memory", 100_000)
NUMBER_EXPONENT = _limit("exponent of ten of a number in impacts and states", 30)
LARGEST = 10.0**NUMBER_EXPONENT
# --- messages, requests and answers of other nodes ------------------------------------------------
COMMAND_BYTES = _limit(
    "a message of a command topic, serialized", 100_000, "bytes", "refused, unread"
)
COMMAND_NAMES = _limit("joint_names of platform/command", 4, "names", "refused")
COMMAND_POINTS = _limit("points of platform/command", 1000, "points", "refused")
TURNS_BYTES = _limit(
    "messages of command topics that wait for their turn, where reading them takes long",
    10,
    "MiB",
    "refused, unread",
)
INPUTS_AHEAD = _limit(
    "accepted inputs whose instant is not resolved yet, or pending impulses",
    1000,
    "inputs",
    "further commands are refused until some have acted",
)
GATE_INPUTS = _limit(
    "inputs at one gate of a lockstep, kept or announced", 1000, "inputs", "refused, and counted"
)
GATE_BYTES = _limit("all inputs that one gate keeps", 10_000_000, "bytes", "refused, and counted")
KNOTS_AHEAD = _limit(
    "knots of offset trajectories that lie ahead, of both joints",
    10_000,
    "knots",
    "further trajectories are refused until some have passed",
)
REQUEST_ITEMS = _limit(
    "names, parameters or prefixes in a request to a service, numbers in an array",
    200,
    "items",
    "answered as refused, or with an empty answer where it has no field for that",
)
REQUEST_TEXT = _limit(
    "a text in a request: the name or the value of a parameter", 10_000, "characters", "refused"
)
SHOWN_TEXT = _limit("a value shown in a line of the log", 120, "characters", "cut")
LOG_PERIOD = _limit(
    "time between lines on the log about refusals for one reason",
    1,
    "s, at least",
    "counted; the next line says how many",
)
REASONS = _limit(
    "reasons that are counted separately", 100, "reasons", "counted together as others"
)
ASKED_NODES = _limit("nodes that a recorder asks for their parameters", 100, "nodes", "not asked")
ANSWER_BYTES = _limit(
    "the parameters of a node that a recorder attaches", 100_000, "bytes", "not attached"
)
PRESET_BYTES = _limit("a preset that a recorder attaches", 100_000, "bytes", "not attached")
LOOKED_TOPICS = _limit(
    "topics that a recorder with `all` or `regex` records", 10_000, "topics", "not recorded"
)


def table(home: str) -> str:
    """The limits of FILES_READ or of MESSAGES as a Markdown table."""
    rows = [row for row in TABLE if row.home == home]
    if home == FILES_READ:
        head = ["| | at most |", "|---|---|"]
        return "\n".join([*head, *(f"| {row.what} | {_most(row)} |" for row in rows)])
    head = ["| | at most | beyond |", "|---|---|---|"]
    return "\n".join([*head, *(f"| {row.what} | {_most(row)} | {row.beyond} |" for row in rows)])


def _most(row: Limit) -> str:
    return f"{_shown(row.most)} {row.unit}".rstrip()


def _shown(number: int) -> str:
    """A number in groups of three digits; one beyond them as a power of two."""
    return f"{number:,}".replace(",", " ") if number < 10**9 else f"2^{number.bit_length()}"
