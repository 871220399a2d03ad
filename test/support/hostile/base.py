"""What the corpus of hostile bags is made of: a whole bag, whose fields can be forged."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, cast

from rclpy.serialization import serialize_message
from std_msgs.msg import String

from bouncing_disk_ros import bag
from bouncing_disk_ros.bag.metadata import qos_text
from bouncing_disk_ros.bag.notes import signed
from bouncing_disk_ros.bag.schema import schema_of
from support.mcap_bytes import Content, Sent, forged
from support.recorded import RecordedRun

Make = Callable[[Path], Path]
CORPUS: dict[str, Make] = {}
"""Name -> a function that puts the bag into a folder and returns the path to give to a tool."""
INPUTS, IMPACTS = "/disk/inputs", "/disk/impacts"
NOTES = {"format": "1", "version": "1.2.3", "lost": "{}"}
QOS = qos_text([bag.OfferedQos().as_dict()])


class _Collector:
    """Takes messages in place of a writer of bags."""

    def __init__(self) -> None:
        self.kinds: dict[str, str] = {}
        self.sent: list[Sent] = []

    def add_topic(self, name: str, kind: str, _qos: Any = ()) -> None:
        self.kinds[name] = kind

    def write(self, topic: str, data: bytes, log: int, sent: int, number: int) -> None:
        kind = self.kinds[topic]
        self.sent.append(Sent(topic, kind, schema_of(kind).text, bytes(data), log, sent, number))


@functools.cache
def messages() -> tuple[Sent, ...]:
    """The messages of a short run of the simulator, of all its topics."""
    collector = _Collector()
    run = RecordedRun(cast("bag.Writer", collector), preset="pizza_multiple_toss")
    run.run(1.0, {0.5: lambda session: session.apply_impulse(session.input_ns, 0.01, 0.0)})
    return tuple(collector.sent)


def content(**changes: Any) -> Content:
    """The content of a whole bag of that run; what is changed may be given as a function."""
    whole: dict[str, Any] = {"messages": messages, "qos": QOS, "notes": signed(NOTES)}
    given = {**whole, **changes}
    return Content(**{name: one() if callable(one) else one for name, one in given.items()})


def put(folder: Path, data: bytes, name: str = "run_0.mcap") -> Path:
    """A bag folder with one file of these bytes."""
    folder.mkdir(exist_ok=True)
    (folder / name).write_bytes(data)
    return folder


def entry(name: str) -> Callable[[Make], Make]:
    """Enter a maker of a bag in the corpus."""

    def enter(make: Make) -> Make:
        assert name not in CORPUS
        CORPUS[name] = make
        return make

    return enter


def enter_forged(name: str, forge: Mapping[str, Any] | Callable[[], Mapping[str, Any]],
                 **changes: Any) -> None:  # fmt: skip
    """Enter a bag with forged fields."""

    def make(folder: Path) -> Path:
        return put(folder, forged(forge() if callable(forge) else forge, content(**changes)))

    entry(name)(make)


def other_data(topic: str, change: Callable[[bytes], bytes], first: int = 1) -> list[Sent]:
    """`messages` with other bytes in those of a topic from its `first` on."""
    rows, count = [], 0
    for row in messages():
        is_changed = row.topic == topic and count >= first
        count += row.topic == topic
        rows.append(row._replace(data=change(row.data)) if is_changed else row)
    return rows


def text_data(text: str) -> bytes:
    """The CDR of a String."""
    return bytes(serialize_message(String(data=text)))
