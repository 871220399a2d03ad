"""What a reader of bags is given: messages as stored, and what is known of a topic."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple


class Message(NamedTuple):
    """One message of a bag: times of reception and of sending in ns since 1970, raw CDR."""

    topic: str
    log_time_ns: int
    publish_time_ns: int
    sequence: int
    data: bytes


@dataclass
class Topic:
    """One topic of a bag."""

    name: str
    type: str
    count: int = 0
    qos: list[dict[str, Any]] = field(default_factory=list)
    type_hash: str = ""
    definition: str = ""
    encoding: str = ""
