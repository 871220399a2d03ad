"""Things that stand in place of the files of a bag."""

from __future__ import annotations

import os
import socket
from collections.abc import Callable
from pathlib import Path

from support.hostile.base import content, entry, put
from support.mcap_bytes import MAGIC, forged

FILES: dict[str, Callable[[Path], object]] = {
    "an empty file": Path.touch,
    "only the mark": lambda file: file.write_bytes(MAGIC),
    "the mark twice": lambda file: file.write_bytes(MAGIC + MAGIC),
    "a FIFO": os.mkfifo,
    "a folder": Path.mkdir,
    "a link to a device": lambda file: file.symlink_to("/dev/zero"),
    "a link in a circle": lambda file: file.symlink_to(file.name),
}
"""What may stand at the place of the file of a bag."""


def _enter(name: str, make: Callable[[Path], object]) -> None:
    def made(folder: Path) -> Path:
        folder.mkdir()
        make(folder / "run_0.mcap")
        return folder

    entry(name)(made)


for _name, _make in FILES.items():
    _enter(_name, _make)


@entry("a FIFO for a bag")
def _fifo_alone(folder: Path) -> Path:
    folder.mkdir()
    os.mkfifo(folder / "run_0.mcap")
    return folder / "run_0.mcap"


@entry("a device for a bag")
def _zero(folder: Path) -> Path:
    folder.mkdir()
    return Path("/dev/zero")


@entry("a link to the same file")
def _same(folder: Path) -> Path:
    put(folder, forged({}, content()))
    (folder / "run_1.mcap").symlink_to("run_0.mcap")
    return folder


@entry("a socket for a file")
def _socket(folder: Path) -> Path:
    folder.mkdir()
    here = Path.cwd()
    os.chdir(folder)  # names of sockets are short
    try:
        with socket.socket(socket.AF_UNIX) as one:
            one.bind("run_0.mcap")
    finally:
        os.chdir(here)
    return folder


@entry("a name with a zero byte")
def _zero_byte(folder: Path) -> Path:
    folder.mkdir()
    return folder / "a\0b"


@entry("a name too long")
def _long(folder: Path) -> Path:
    folder.mkdir()
    return folder / ("a" * 5000)
