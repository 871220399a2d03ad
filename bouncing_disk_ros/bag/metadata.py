"""metadata.yaml of a rosbag2 bag (version 9, ROS 2 Jazzy): written, and read."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import yaml

from bouncing_disk_ros import limits
from bouncing_disk_ros.bag.notes import NOTE, signed
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.parsing import read_yaml, text_of
from bouncing_disk_ros.regular_file import read_text

VERSION = 9
FILE_NAME = "metadata.yaml"
ROOT_KEY = "rosbag2_bagfile_information"
ROS_DISTRO = "jazzy"
INFINITE = (9223372036, 854775807)
"""Seconds and nanoseconds of a duration without end, as rmw writes it."""


@dataclass(frozen=True)
class OfferedQos:
    """Quality of service of one publisher, in the words of rosbag2; durations as (s, ns)."""

    history: str = "unknown"
    depth: int = 0
    reliability: str = "reliable"
    durability: str = "volatile"
    deadline: tuple[int, int] = INFINITE
    lifespan: tuple[int, int] = INFINITE
    liveliness: str = "automatic"
    liveliness_lease_duration: tuple[int, int] = INFINITE

    def as_dict(self) -> dict[str, Any]:
        """The mapping that rosbag2 reads."""

        def time(value: tuple[int, int]) -> dict[str, int]:
            return {"sec": value[0], "nsec": value[1]}

        return {
            "history": self.history,
            "depth": self.depth,
            "reliability": self.reliability,
            "durability": self.durability,
            "deadline": time(self.deadline),
            "lifespan": time(self.lifespan),
            "liveliness": self.liveliness,
            "liveliness_lease_duration": time(self.liveliness_lease_duration),
            "avoid_ros_namespace_conventions": False,
        }


def qos_text(profiles: Sequence[Mapping[str, Any]]) -> str:
    """QoS profiles as the text of a channel's metadata; it parses equal to metadata.yaml's."""
    return _dump(list(profiles)) if profiles else ""


def qos_from_text(text: str) -> list[dict[str, Any]]:
    """The profiles of a channel's metadata; none where the text is none that we know."""
    try:
        content = read_yaml("quality of service", text, limits.QOS)
    except InputError:
        return []
    return [row for row in content if isinstance(row, dict)] if isinstance(content, list) else []


@dataclass
class TopicRow:
    """One topic of a bag."""

    name: str
    type: str
    qos: Sequence[Mapping[str, Any]] = ()
    type_hash: str = ""
    count: int = 0


@dataclass
class FileRow:
    """One file of a bag; times of reception in ns since 1970."""

    path: str
    start_ns: int = 0
    end_ns: int = 0
    count: int = 0


@dataclass
class Metadata:
    """What metadata.yaml says."""

    files: list[FileRow]
    topics: list[TopicRow]
    custom: dict[str, str] = field(default_factory=dict)
    storage: str = "mcap"
    compression_mode: str = ""

    def text(self) -> str:
        """The YAML of metadata.yaml."""
        return _dump({ROOT_KEY: self.content()})

    def record(self) -> str:
        """The YAML of the mcap metadata record named `rosbag2`."""
        return _dump(self.content())

    def content(self) -> dict[str, Any]:
        """What stands below the root key."""
        start, duration = _span(self.files)
        return {
            "version": VERSION,
            "storage_identifier": "mcap",
            "duration": {"nanoseconds": duration},
            "starting_time": {"nanoseconds_since_epoch": start},
            "message_count": sum(file.count for file in self.files),
            "topics_with_message_count": [
                {
                    "topic_metadata": {
                        "name": topic.name,
                        "type": topic.type,
                        "serialization_format": "cdr",
                        "offered_qos_profiles": [dict(row) for row in topic.qos],
                        "type_description_hash": topic.type_hash,
                    },
                    "message_count": topic.count,
                }
                for topic in self.topics
            ],
            "compression_format": "",
            "compression_mode": "",
            "relative_file_paths": [file.path for file in self.files],
            "files": [_file_content(file) for file in self.files],
            "custom_data": {str(key): str(value) for key, value in self.custom.items()},
            "ros_distro": ROS_DISTRO,
        }


def summed(
    files: Iterable[tuple[FileRow, Mapping[str, int]]], topics: Iterable[TopicRow],
    notes: Mapping[str, str],
) -> Metadata:  # fmt: skip
    """Metadata of files with the messages of each topic in each, and our notes as custom data."""
    rows, counts = [], Counter[str]()
    for row, some in files:
        rows.append(row)
        counts.update(some)
    custom = {f"{NOTE}.{key}": value for key, value in notes.items()}
    return Metadata(rows, [replace(topic, count=counts[topic.name]) for topic in topics], custom)


def _file_content(file: FileRow) -> dict[str, Any]:
    start, duration = _span([file])
    return {
        "path": file.path,
        "starting_time": {"nanoseconds_since_epoch": start},
        "duration": {"nanoseconds": duration},
        "message_count": file.count,
    }


def _span(files: Iterable[FileRow]) -> tuple[int, int]:
    """Start and duration in ns; rosbag2 takes no negative duration, so 0 and 0 without messages."""
    filled = [file for file in files if file.count]
    start = min((file.start_ns for file in filled), default=0)
    return start, max((file.end_ns for file in filled), default=0) - start


class _Dumper(getattr(yaml, "CSafeDumper", yaml.SafeDumper)):  # type: ignore[misc]
    """No anchors: rosbag2's own parser takes them, people and other tools do not."""

    def ignore_aliases(self, data: Any) -> bool:  # noqa: ARG002 (PyYAML calls it so)
        return True


def _dump(content: Any) -> str:
    return yaml.dump(content, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=1 << 20)


def write(folder: Path, metadata: Metadata) -> None:
    """Write metadata.yaml at once: it is there whole or not at all. Raises OSError.

    Not by `regular_file.replaced`, which makes the folder anew where a bag was moved away.
    """
    passing = folder / f".{FILE_NAME}"
    try:
        passing.write_text(metadata.text(), encoding="utf-8")
        passing.replace(folder / FILE_NAME)
    except OSError:
        passing.unlink(missing_ok=True)
        raise


def read(folder: Path) -> Metadata | None:
    """What the metadata.yaml of a bag says of its files; None when it is missing or broken.

    Only what the .mcap files themselves do not say is taken from it: which files, which storage,
    which compression of whole files or messages, custom data. Raises InputError when it names
    files outside of the bag, or too many.
    """
    path = folder / FILE_NAME
    try:
        text = read_text(str(path), path, limits.YAML)
        content = read_yaml(str(path), text, plain=text_of)[ROOT_KEY]
        names = _texts(content["relative_file_paths"])
        custom = {str(k): str(v) for k, v in (content.get("custom_data") or {}).items()}
        storage, mode = _texts(
            [content["storage_identifier"], content.get("compression_mode") or ""]
        )
    except (InputError, KeyError, TypeError, AttributeError):
        return None
    if len(names) > limits.FILES:
        raise InputError(str(path), f"{len(names)} files", f"at most {limits.FILES}")
    for name in names:
        if not _is_inside(name):
            raise InputError(str(path), name, "names of files within the bag")
    return Metadata([FileRow(name) for name in names], [], custom, storage, mode)


def _texts(content: Any) -> list[str]:
    """A list of texts; TypeError for anything else."""
    if not isinstance(content, list) or not all(isinstance(one, str) for one in content):
        raise TypeError
    return content


def _is_inside(name: str) -> bool:
    """Whether a path leads to a file within its folder, by its text."""
    return not Path(name).is_absolute() and ".." not in Path(name).parts


def last_notes(notes: Mapping[str, str], files: Metadata) -> dict[str, dict[str, str]]:
    """The metadata records at the end of a file: our notes, and what rosbag2 reads of it."""
    return {NOTE: signed(notes), "rosbag2": {"serialized_metadata": files.record()}}
