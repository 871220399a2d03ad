"""The bag of the demonstration: its folder, and the report on it at the end."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

from bouncing_disk_ros.command_line.child import Child
from bouncing_disk_ros.command_line.stop import Answer, Stop
from bouncing_disk_ros.errors import FailedError, InputError


def remove_old_bag(folder: Path) -> None:
    """Take away the bag of an earlier demonstration; InputError if it is anything else."""
    if not folder.exists():
        return
    if not folder.is_dir() or not all(map(_is_of_a_bag, folder.iterdir())):
        hint = "There is a file of that name, or a folder that is not a bag."
        raise InputError("--bag", str(folder), "a new folder, or an earlier bag to replace", hint)
    try:
        shutil.rmtree(folder)
    except OSError as error:
        raise InputError(
            "--bag", str(folder), "a folder that can be replaced", str(error)
        ) from None


def _is_of_a_bag(file: Path) -> bool:
    return file.is_file() and (file.suffix == ".mcap" or file.name == "metadata.yaml")


def report_bag(folder: Path, stop: Stop) -> None:
    """Name the bag, report on it and replay it; FailedError when that cannot be, or differs."""
    print(f"Bag: {folder}", flush=True)
    with stop.loading():
        from bouncing_disk_ros import bag
        from bouncing_disk_ros.nodes.replay.bag_streams import Recorded, replay_bag
        from bouncing_disk_ros.nodes.replay.replay_text import verdict
    stop.answer = Answer.INTERRUPT
    if stop.asked:
        raise KeyboardInterrupt
    with Child("bag_report", str(folder), "--figures", "none") as report:  # beside the replay
        try:
            with bag.open(folder) as opened:
                found = replay_bag(Recorded(opened))
        except (InputError, bag.BagError, OSError) as error:
            raise FailedError(f"the bag cannot be replayed: {error}") from None
        if not found.identical:
            raise FailedError(verdict(found))
        if report.wait():
            raise FailedError(f"no report on the bag: {report.last_line}")
        print(f"Report: {os.path.relpath(report.last_line.removeprefix('written: '))}", flush=True)
    print(verdict(found), flush=True)
