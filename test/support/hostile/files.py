"""Things that stand in place of the files of a bag."""

from __future__ import annotations

import os
import socket
from pathlib import Path

from support.hostile.base import content, entry, put
from support.mcap_bytes import MAGIC, forged


@entry("an empty file")
def _empty(folder: Path) -> Path:
    return put(folder, b"")


@entry("only the mark")
def _mark(folder: Path) -> Path:
    return put(folder, MAGIC)


@entry("the mark twice")
def _marks(folder: Path) -> Path:
    return put(folder, MAGIC + MAGIC)


@entry("a FIFO for a file")
def _fifo(folder: Path) -> Path:
    folder.mkdir()
    os.mkfifo(folder / "run_0.mcap")
    return folder


@entry("a FIFO for a bag")
def _fifo_alone(folder: Path) -> Path:
    folder.mkdir()
    os.mkfifo(folder / "run_0.mcap")
    return folder / "run_0.mcap"


@entry("a folder for a file")
def _folder(folder: Path) -> Path:
    (folder / "run_0.mcap").mkdir(parents=True)
    return folder


@entry("a link to a device")
def _device(folder: Path) -> Path:
    folder.mkdir()
    (folder / "run_0.mcap").symlink_to("/dev/zero")
    return folder


@entry("a device for a bag")
def _zero(folder: Path) -> Path:
    folder.mkdir()
    return Path("/dev/zero")


@entry("a link in a circle")
def _circle(folder: Path) -> Path:
    folder.mkdir()
    (folder / "run_0.mcap").symlink_to("run_1.mcap")
    (folder / "run_1.mcap").symlink_to("run_0.mcap")
    return folder


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
