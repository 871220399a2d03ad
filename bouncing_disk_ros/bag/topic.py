"""What a reader of bags is given: messages as stored, and what is known of a topic."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from bouncing_disk_ros.bag.metadata import qos_from_text
from bouncing_disk_ros.bag.source import Source


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


def topics_of(sources: Iterable[Source]) -> dict[str, Topic]:
    """The topics of some files by name, with the messages of all of them."""
    topics: dict[str, Topic] = {}
    for source in sources:
        for number, channel in source.channels.items():
            schema = source.schemas.get(channel.schema_id)
            name = schema.name if schema else ""
            topic = topics.setdefault(channel.topic, Topic(channel.topic, name))
            topic.count += source.counts[number]
            topic.qos = topic.qos or qos_from_text(channel.metadata.get("offered_qos_profiles", ""))
            topic.type_hash = topic.type_hash or channel.metadata.get("topic_type_hash", "")
            if schema:
                topic.definition, topic.encoding = schema.data.decode(), schema.encoding
    return topics
