"""The files of a report: their names, and the mark by which a report knows its own files.

Nothing of others is overwritten.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

from bouncing_disk_ros.errors import InputError

MARK = "bouncing_disk_ros bag_report"


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


def check_ours(files: Iterable[Path]) -> None:
    """InputError where a file stands that no report has made."""
    for file in files:
        if file.is_dir() or (file.is_file() and MARK.encode() not in file.read_bytes()):
            allowed = "a new file, or one that bag_report has made"
            raise InputError("output", str(file), allowed, "Move it, or give another OUTPUT.")
