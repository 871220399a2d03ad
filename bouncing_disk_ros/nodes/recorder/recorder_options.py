"""The table of the recorder's parameters, and which topics they choose; light, for --help."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.parameters import Spec, Value, items_of
from bouncing_disk_ros.topics import TOPICS, Direction

if TYPE_CHECKING:
    from bouncing_disk_ros.bag import Options

_SPECS = (
    Spec("output", "", "", "folder of the bag, which must not exist; may also be the first "
         "argument; empty: bag_ with date and time", read_only=True),
    Spec("topics", "", "", "names of the topics; empty: those that the simulator publishes, unless "
         "regex or all is given", read_only=True, listed=True),
    Spec("regex", "", "", "regular expression; topics whose whole name matches are recorded in "
         "addition", read_only=True),
    Spec("exclude", "", "", "regular expression; topics whose whole name matches are not recorded",
         read_only=True),
    Spec("all", False, "", "record every topic except hidden ones", read_only=True),
    Spec("compression", "zstd", "", "compression of the chunks: zstd, lz4 or none", read_only=True),
    Spec("chunk_size", 1 << 20, "B", "a chunk is closed when it reaches this size",
         low=1, high=1 << 30, read_only=True),
    Spec("chunk_period", 1.0, "s", "a chunk is closed when it reaches this age: the most that a "
         "killed recorder loses", low=0.01, high=3600.0, read_only=True),
    Spec("max_size", 0.0, "MB", "go on in a new file after this much; 0: one file", low=0.0,
         high=1e9, read_only=True),
    Spec("max_duration", 0.0, "s", "go on in a new file after this long; 0: one file", low=0.0,
         high=1e9, read_only=True),
    Spec("repeat_latched", True, "", "begin every further file with the latched messages in force, "
         "so that it can be used alone", read_only=True),
    Spec("presets", "", "", "files that may be attached when a simulator names one of them as its "
         "preset; the presets of the package always may", read_only=True, listed=True),
    Spec("queue_size", 256.0, "MB", "messages that may wait for the disk; messages beyond are "
         "dropped and counted", low=0.001, high=1e6, read_only=True),
    Spec("start_paused", False, "", "record nothing before ~/resume", read_only=True),
    Spec("status_period", 5.0, "s", "time between status lines on the log; 0: none", low=0.0,
         high=1e6, read_only=True),
)  # fmt: skip
OPTIONS: Mapping[str, Spec] = {spec.name: spec for spec in _SPECS}
MB = 1_000_000


def writer_options(values: Mapping[str, Value]) -> Options:
    """The part that the writer needs."""
    from bouncing_disk_ros.bag import Options

    return Options(
        compression=str(values["compression"]),
        chunk_size=int(values["chunk_size"]),
        chunk_period=float(values["chunk_period"]),
        max_size=round(float(values["max_size"]) * MB),
        max_duration=float(values["max_duration"]),
    )


def check_size(selection: Selection, attached: int, options: Options) -> None:
    """InputError where a file of `max_size` would have no room for messages.

    `attached`: bytes of the files that the recorder attaches itself.
    """
    from bouncing_disk_ros.bag.schema import schema_of

    texts = (schema_of(kind).text for kind in {topic.type for topic in selection.known.values()})
    head = attached + sum(len(text.encode()) for text in texts)
    if 0 < options.max_size < head:
        allowed = f"0 for one file, or at least {head / MB:.3f} MB, which the head of each takes"
        raise InputError("max_size", f"{options.max_size / MB:g} MB", allowed)


def default_folder() -> str:
    """A name of its own for each second."""
    return time.strftime("bag_%Y-%m-%d_%H-%M-%S")


def preset_files(values: Mapping[str, Value]) -> list[Path]:
    """The files that the user has named."""
    return [Path(name) for name in items_of(str(values["presets"]))]


class Selection:
    """Which topics are recorded. `known` are the package's own among them, with their types.

    `resolve` gives the full name of a relative one (namespace, remappings).
    """

    def __init__(self, values: Mapping[str, Value], resolve: Callable[[str], str]) -> None:
        given = items_of(str(values["topics"]))
        self._all = bool(values["all"])
        self._regex = _pattern("regex", str(values["regex"]))
        self._exclude = _pattern("exclude", str(values["exclude"]))
        default = not (given or self._all or self._regex)
        own = {resolve(name): topic for name, topic in TOPICS.items()}
        # a sender that waits for one listener must not find the recorder and leave before the
        # simulator receives it; and every command that was accepted is in disk/inputs
        usual = {name for name, topic in own.items() if topic.direction is Direction.OUT}
        self._names = usual if default else {_resolved(name, resolve) for name in given}
        self.known = {name: topic for name, topic in own.items() if self.wants(name)}

    def wants(self, name: str) -> bool:
        """Whether a topic of this full name is recorded."""
        if self._exclude is not None and self._exclude.fullmatch(name):
            return False
        if name in self._names or (self._regex is not None and self._regex.fullmatch(name)):
            return True
        return self._all and not any(part.startswith("_") for part in name.split("/"))


def _resolved(name: str, resolve: Callable[[str], str]) -> str:
    try:
        return resolve(name)
    except Exception as error:  # noqa: BLE001 (rclpy raises a private type here)
        why = str(error).removeprefix("failed to resolve name: ").partition(", at ")[0]
        raise InputError("topics", name, "names of topics", f"{why}.") from None


def _pattern(field: str, text: str) -> re.Pattern[str] | None:
    if not text:
        return None
    try:
        return re.compile(text)
    except re.error as error:
        raise InputError(field, text, "a regular expression", f"{error}.") from None
