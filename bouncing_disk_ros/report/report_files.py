"""The files of a report or a fit: their names, and the marks by which they are known.

Nothing of others is overwritten.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.folders import PACKAGE, user_path

PRESET_MARK, TABLE_MARK = "# fitted by fit_impacts to ", "time,error,level\n"
"""Begins of presets and of tables of hits."""
FORMATS = ("html", "png", "pdf", "svg")


def targets(source: str, ending: str, output: str | None, kinds: Iterable[str]) -> list[Path]:
    """The files to write: NAME_ENDING.KIND beside the source, in a folder OUTPUT, or OUTPUT.KIND.

    `source`: a bag, a recording or a sound; NAME is that of its folder, or of its file without its
    ending.
    """
    path, each = user_path(source).absolute(), list(dict.fromkeys(kinds))
    own = path.stem if path.is_file() or path.suffix == ".mcap" else path.name
    stem = path.parent / f"{own}_{ending}"
    if output:
        given = user_path(output)
        if given.is_dir() or output.endswith(os.sep):
            stem = given / stem.name
        else:
            stem = given.with_suffix("") if given.suffix[1:] in {*FORMATS, *each} else given
    return [stem.with_name(f"{stem.name}.{kind}") for kind in each]


def mark_of(maker: str) -> str:
    """The text in each page and picture that the executable `maker` has made."""
    return f"{PACKAGE} {maker}"


def made_by(maker: str) -> str:
    """The sentence in each page that the executable `maker` has made, version 0.3.0 too."""
    return f"Made by {maker} of {PACKAGE}"


def check_ours(files: Iterable[Path], maker: str) -> None:
    """InputError where a file stands that the executable `maker` has not made.

    Version 0.3.0 put the mark of bag_report into all figures. These belong to the page beside them.
    """
    marks = [mark.encode() for mark in (mark_of(maker), PRESET_MARK, TABLE_MARK, made_by(maker))]
    contents = {file: file.read_bytes() if file.is_file() else b"" for file in files}
    if any(marks[-1] in content for content in contents.values()):
        marks.append(mark_of("bag_report").encode())
    for file, content in contents.items():
        if file.is_dir() or (file.is_file() and not any(mark in content for mark in marks)):
            allowed = f"a new file, or one that {maker} has made"
            raise InputError("output", str(file), allowed, "Move it, or give another OUTPUT.")
