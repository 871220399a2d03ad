"""metadata.yaml of a rosbag2 bag (version 9, ROS 2 Jazzy), our notes in it, and which files it has.

An mcap metadata record has no checksum of its own, so the notes carry one. Storages that cannot be
read are refused with a way out.
"""

from __future__ import annotations

import json
import re
import zlib
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import yaml

from bouncing_disk_ros import limits
from bouncing_disk_ros.bag.records import MAGIC
from bouncing_disk_ros.errors import BagError, InputError
from bouncing_disk_ros.parsing import read_yaml, text_of
from bouncing_disk_ros.regular_file import irregular, is_regular, read_text

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
    files outside of the bag, or one twice.
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
    different = len({Path(name) for name in names})
    if len(names) > limits.FILES or different < len(names):
        given = f"{len(names)} files, {different} of them different"
        raise InputError(str(path), given, f"up to {limits.FILES} files, each once")
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
    parts = Path(name).parts
    is_name = name.isprintable() and len(name.encode()) <= limits.NAME
    return bool(parts) and is_name and not Path(name).is_absolute() and ".." not in parts


# --- notes of this package ------------------------------------------------------------------------
FORMAT_VERSION = 1
"""Grows when a bag is laid out in another way. Bags of every older version stay readable."""
FORMAT_KEY = "format"
NOTE = "bouncing_disk_ros"
"""Name of our metadata record in every file."""
_CRC = "crc32"


def signed(notes: Mapping[str, str]) -> dict[str, str]:
    """Notes with their checksum."""
    texts = {key: str(value) for key, value in notes.items() if key != _CRC}
    return {**texts, _CRC: f"{_checksum(texts):08x}"}


def checked(notes: Mapping[str, str]) -> dict[str, str]:
    """Notes without their checksum; BagError when it does not fit, or they cannot be shown."""
    texts = {key: value for key, value in notes.items() if key != _CRC}
    if notes.get(_CRC) != f"{_checksum(texts):08x}":
        raise BagError("the notes of the bag are damaged (their checksum is wrong)")
    for key, text in texts.items():
        if len(text) > limits.NOTE or not text.isprintable():
            raise BagError(f"the note {key!r} is too long, or has characters that cannot be shown")
    return texts


def last_notes(notes: Mapping[str, str], files: Metadata) -> dict[str, dict[str, str]]:
    """The metadata records at the end of a file: our notes, and what rosbag2 reads of it."""
    return {NOTE: signed(notes), "rosbag2": {"serialized_metadata": files.record()}}


def _checksum(texts: Mapping[str, str]) -> int:
    return zlib.crc32(json.dumps(sorted(texts.items())).encode())


# --- the files of a bag ---------------------------------------------------------------------------
ALLOWED = "a rosbag2 bag in MCAP (its folder), or one .mcap file"
_OTHER = (".db3", ".bag", ".mcap.zstd", ".mcap.lz4", ".db3.zstd")


@dataclass
class Located:
    """The files of a bag in order, and what is odd about them."""

    files: list[Path]
    remarks: list[str] = field(default_factory=list)
    custom: dict[str, str] = field(default_factory=dict)  # custom data of metadata.yaml


def files_of(path: Path) -> Located:
    """Find the files; InputError when there are none that can be read."""
    try:
        kind = irregular(path)
        if kind == "a folder":
            return _of_folder(path)
        if kind:
            raise InputError("bag", str(path), ALLOWED, f"It is {kind}.")
    except (OSError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        missing = isinstance(error, FileNotFoundError)
        why = "There is no file or folder of that name." if missing else str(error)
        raise InputError("bag", str(path), ALLOWED, why) from None
    if path.name == FILE_NAME:
        return files_of(path.absolute().parent)
    _refuse_other(path, path)
    return Located([path])


def _of_folder(folder: Path) -> Located:
    found = _named(folder)
    seen: dict[tuple[int, int], Path] = {}
    filled = []
    for file in found.files:
        status = file.stat()
        first = seen.setdefault((status.st_dev, status.st_ino), file)
        if first is not file:
            found.remarks.append(f"{file.name} is the same file as {first.name}; read once")
        elif status.st_size < len(MAGIC):
            found.remarks.append(f"{file.name} is empty")
        else:
            filled.append(file)
    if not filled:  # then the first of them is refused by name
        return found
    return Located(filled, found.remarks, found.custom)


def _named(folder: Path) -> Located:
    found = mcap_files(folder)
    said = read(folder)
    if said is not None:
        _refuse_storage(folder, said)
        files = [folder / Path(row.path) for row in said.files]
        present = [file for file in files if is_regular(file)]
        there = set(present)
        remarks = [f"{file.name} is {_why_not(file)}" for file in files if file not in there]
        more = [file for file in found.files if file not in there]
        remarks += [f"{file.name}: metadata.yaml does not name it; read as well" for file in more]
        if present or more:
            return Located(sorted([*present, *more], key=_number), remarks, said.custom)
    if found.files:
        broken = (folder / FILE_NAME).exists()
        why = "cannot be used" if broken else "is missing: the recording was not completed"
        return Located(found.files, [f"metadata.yaml {why}", *found.remarks])
    for file in sorted(folder.iterdir()):
        _refuse_other(folder, file)
    why = "; ".join(found.remarks) or "It holds no .mcap file"
    raise InputError("bag", str(folder), ALLOWED, f"{why}.")


def _why_not(file: Path) -> str:
    """Why a named file cannot be read."""
    try:
        return irregular(file) or "missing"
    except (OSError, ValueError):
        return "missing"


def mcap_files(folder: Path) -> Located:
    """The .mcap files of a folder, in the order of their numbers."""
    named = sorted(folder.glob("*.mcap"), key=_number)
    if len(named) > limits.FILES:
        raise InputError("bag", f"{folder} of {len(named)} files", f"at most {limits.FILES}")
    files = [file for file in named if is_regular(file)]
    return Located(
        files, [f"{file.name} is {_why_not(file)}" for file in named if not is_regular(file)]
    )


def _number(file: Path) -> tuple[int, str]:
    match = re.search(r"_(\d+)$", file.stem)
    return (int(match[1][:18]) if match else 0, file.name)


def _refuse_storage(folder: Path, said: Metadata) -> None:
    if said.storage != "mcap":
        raise InputError("bag storage", said.storage, "mcap", converting(folder))
    if said.compression_mode.lower() not in ("", "none", "null"):
        given = f"compression mode {said.compression_mode}"
        allowed = "mcap with compression of its own chunks"
        raise InputError("bag storage", given, allowed, converting(folder))


def _refuse_other(bag: Path, file: Path) -> None:
    if file.name.endswith(_OTHER):
        raise InputError("bag storage", file.name, ALLOWED, converting(bag))


def converting(bag: Path) -> str:
    """The command that makes an MCAP bag of another one."""
    output = f"{bag.stem}_mcap"
    if bag.suffix == ".bag":
        return f"It is of ROS 1. Convert it: rosbags-convert --src {bag} --dst {output}."
    return (
        f"Convert it: echo 'output_bags: [{{uri: {output}, storage_id: mcap, all_topics: true}}]' "
        f"> out.yaml && ros2 bag convert -i {bag} -o out.yaml"
    )
