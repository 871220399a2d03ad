"""The files of a report: their names, and the mark by which an executable knows its own files.

Nothing of others is overwritten.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.folders import PACKAGE

FORMATS = ("html", "png", "pdf", "svg")


def targets(bag: str, output: str | None, kinds: Iterable[str]) -> list[Path]:
    """The files to write: BAG_report.KIND beside the bag, in a folder OUTPUT, or OUTPUT.KIND."""
    source = Path(bag).absolute()
    name = f"{source.name.removesuffix('.mcap')}_report"
    stem = source.parent / name
    if output is not None:
        given = Path(output).expanduser()
        if given.is_dir() or output.endswith(os.sep):
            stem = given / name
        else:
            stem = given.with_suffix("") if given.suffix[1:] in FORMATS else given
    return [stem.with_name(f"{stem.name}.{kind}") for kind in dict.fromkeys(kinds)]


def mark_of(maker: str) -> str:
    """The text in each file that the executable `maker` has made."""
    return f"{PACKAGE} {maker}"


def check_ours(files: Iterable[Path], maker: str) -> None:
    """InputError where a file stands that the executable `maker` has not made."""
    mark = mark_of(maker).encode()
    for file in files:
        if file.is_dir() or (file.is_file() and mark not in file.read_bytes()):
            allowed = f"a new file, or one that {maker} has made"
            raise InputError("output", str(file), allowed, "Move it, or give another OUTPUT.")
