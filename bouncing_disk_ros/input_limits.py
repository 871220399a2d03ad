"""Limits of what comes in over the middleware: commands, requests, answers. The one table.

They are checked before anything else. docs/interfaces.md shows the table.
"""

from __future__ import annotations

from typing import NamedTuple


class Limit(NamedTuple):
    """One limit: what is limited, how much is accepted, and what becomes of more."""

    what: str
    most: int
    unit: str
    beyond: str


_TABLE: list[Limit] = []


def _limit(what: str, most: int, unit: str, beyond: str) -> int:
    _TABLE.append(Limit(what, most, unit, beyond))
    return most


COMMAND_BYTES = _limit(
    "a message of a command topic, serialized", 100_000, "bytes", "refused, unread"
)
COMMAND_NAMES = _limit("joint_names of platform/command", 4, "names", "refused")
COMMAND_POINTS = _limit("points of platform/command", 1000, "points", "refused")
INPUTS_AHEAD = _limit(
    "accepted inputs whose instant is not resolved yet, or impulses that lie ahead",
    1000,
    "inputs",
    "further commands are refused until some have acted",
)
REQUEST_ITEMS = _limit(
    "names, parameters or prefixes in a request to a service, numbers in an array",
    200,
    "items",
    "answered as refused, or with nothing where the answer has no room for that",
)
REQUEST_TEXT = _limit(
    "a text in a request: the name or the value of a parameter", 10_000, "characters", "refused"
)
SHOWN_TEXT = _limit("a given value in a line of the log", 120, "characters", "cut")
LOG_PERIOD = _limit(
    "time between lines on the log about refusals for one reason",
    1,
    "s, at least",
    "counted; the next line tells how many",
)
REASONS = _limit(
    "reasons for which lines are counted apart", 100, "reasons", "counted together as others"
)
ASKED_NODES = _limit("nodes that a recorder asks for their parameters", 100, "nodes", "not asked")
ANSWER_BYTES = _limit(
    "the parameters of a node that a recorder attaches", 100_000, "bytes", "not attached"
)
PRESET_BYTES = _limit("a preset that a recorder attaches", 100_000, "bytes", "not attached")
LOOKED_TOPICS = _limit(
    "topics that a recorder with `all` or `regex` takes up", 10_000, "topics", "not recorded"
)

LIMITS: tuple[Limit, ...] = tuple(_TABLE)
