"""Which .mcap files a bag consists of; storages that cannot be read are refused with a way out."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

from bouncing_disk_ros.bag import metadata
from bouncing_disk_ros.bag.index import MAGIC
from bouncing_disk_ros.errors import InputError

ALLOWED = "a rosbag2 bag in MCAP (its folder), or one .mcap file"
_OTHER = (".db3", ".bag", ".mcap.zstd", ".mcap.lz4", ".db3.zstd")


@dataclass
class Located:
    """The files of a bag in order, and what is odd about them."""

    files: list[Path]
    remarks: list[str] = field(default_factory=list)


def files_of(path: Path) -> Located:
    """Find the files; InputError when there are none that can be read."""
    if path.is_file():
        if path.name == metadata.FILE_NAME:
            return files_of(path.parent)
        _refuse_other(path, path)
        return Located([path])
    if not path.is_dir():
        raise InputError("bag", str(path), ALLOWED, "There is nothing of that name.")
    return _of_folder(path)


def _of_folder(folder: Path) -> Located:
    found = _named(folder)
    filled = [file for file in found.files if file.stat().st_size >= len(MAGIC)]
    if not filled:  # then the first of them is refused by name
        return found
    empty = [f"{file.name} is empty" for file in found.files if file not in filled]
    return Located(filled, [*found.remarks, *empty])


def _named(folder: Path) -> Located:
    said = metadata.read(folder)
    if said is not None:
        _refuse_storage(folder, said)
        files = [folder / Path(row.path) for row in said.files]
        remarks = [f"{file.name} is missing" for file in files if not file.is_file()]
        present = [file for file in files if file.is_file()]
        more = [file for file in mcap_files(folder) if file not in present]
        remarks += [f"{file.name}: metadata.yaml does not name it; read as well" for file in more]
        if present or more:
            return Located(sorted([*present, *more], key=_number), remarks)
    found = mcap_files(folder)
    if found:
        broken = (folder / metadata.FILE_NAME).exists()
        why = "cannot be used" if broken else "is missing: the recording did not end in order"
        return Located(found, [f"metadata.yaml {why}"])
    for file in sorted(folder.iterdir()):
        _refuse_other(folder, file)
    raise InputError("bag", str(folder), ALLOWED, "It holds no .mcap file.")


def mcap_files(folder: Path) -> list[Path]:
    """The .mcap files of a folder, in the order of their numbers."""
    return sorted(folder.glob("*.mcap"), key=_number)


def _number(file: Path) -> tuple[int, str]:
    match = re.search(r"_(\d+)$", file.stem)
    return (int(match[1]) if match else 0, file.name)


def _refuse_storage(folder: Path, said: metadata.Metadata) -> None:
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
