"""The files of a bag: found in its folder, or refused with a way out."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

from bouncing_disk_ros import limits
from bouncing_disk_ros.bag.metadata import FILE_NAME, Metadata, read
from bouncing_disk_ros.bag.records import MAGIC
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.regular_file import irregular, is_regular, reason

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
        if irregular(path) == "a folder":
            return _of_folder(path)
    except (OSError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        missing = isinstance(error, FileNotFoundError)
        why = "There is no file or folder of that name." if missing else f"{reason(error)}."
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
        return irregular(file)
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
