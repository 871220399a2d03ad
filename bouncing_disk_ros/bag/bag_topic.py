"""Messages of a bag as stored, and the topics of a bag."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from mcap.records import Channel, Schema

from bouncing_disk_ros import limits
from bouncing_disk_ros.bag.metadata import qos_from_text
from bouncing_disk_ros.bag.source import Source


class Message(NamedTuple):
    """One message of a bag: times of reception and of sending in ns since 1970, raw CDR."""

    topic: str
    log_time_ns: int
    publish_time_ns: int
    sequence: int
    data: bytes


class Form(NamedTuple):
    """The form of the messages of a topic; `fault` says why it cannot be used."""

    type: str = ""
    definition: str = ""
    encoding: str = ""  # of the definition
    message_encoding: str = ""
    fault: str = ""


@dataclass
class Topic:
    """A topic of a bag: its type, and the messages of all its channels."""

    name: str
    form: Form
    count: int = 0
    qos: list[dict[str, Any]] = field(default_factory=list)
    type_hash: str = ""

    @property
    def type(self) -> str:
        """The message type, pkg/msg/Name."""
        return self.form.type

    @property
    def definition(self) -> str:
        """The definition of the message type, with all dependencies."""
        return self.form.definition

    @property
    def encoding(self) -> str:
        """The encoding of the definition: ros2msg."""
        return self.form.encoding

    def check(self, form: Form) -> None:
        """Note when another channel of the topic has messages of another form."""
        if form != self.form and not self.form.fault:
            self.form = self.form._replace(fault="it has messages of two forms")


def topics_of(sources: Iterable[Source]) -> dict[str, Topic]:
    """The topics of some files by name, with the messages of all of them."""
    topics: dict[str, Topic] = {}
    left = limits.QOS_ALL
    for source in sources:
        forms: dict[tuple[int, str], Form] = {}  # each definition is looked at once
        for number, channel in source.channels.items():
            key = channel.schema_id, channel.message_encoding
            if key not in forms:
                forms[key] = _form(channel, source.schemas.get(channel.schema_id))
            topic = topics.setdefault(channel.topic, Topic(channel.topic, forms[key]))
            topic.check(forms[key])
            topic.count += source.counts[number]
            text = channel.metadata.get("offered_qos_profiles", "")
            if not topic.qos and len(text) <= left:
                left -= len(text)
                topic.qos = qos_from_text(text)
            topic.type_hash = topic.type_hash or channel.metadata.get("topic_type_hash", "")
    return topics


def _form(channel: Channel, schema: Schema | None) -> Form:
    encoding = channel.message_encoding
    if schema is None:
        return Form(message_encoding=encoding, fault="its type is not in the bag")
    fault = text = ""
    if len(schema.data) > limits.DEFINITION:
        fault = f"its definition of {len(schema.data)} bytes: at most {limits.DEFINITION}"
    else:
        try:
            text = schema.data.decode()
        except UnicodeDecodeError:
            fault = "its definition is not UTF-8"
    return Form(schema.name, text, schema.encoding, encoding, fault)
