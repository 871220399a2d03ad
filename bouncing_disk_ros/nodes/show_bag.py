"""The bag of the demonstration: room for it, and what is made of it at the end."""

from __future__ import annotations

import shutil
from pathlib import Path

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.nodes.tool import FailedError
from bouncing_disk_ros.ros.stop import Stop


def make_room(folder: Path) -> None:
    """Take away the bag of an earlier demonstration; InputError if it is anything else."""
    if not folder.exists():
        return
    if not folder.is_dir() or not all(map(_is_of_a_bag, folder.iterdir())):
        hint = "There is something else of that name."
        raise InputError("--bag", str(folder), "a new folder, or an earlier bag to replace", hint)
    try:
        shutil.rmtree(folder)
    except OSError as error:
        raise InputError(
            "--bag", str(folder), "a folder that can be replaced", str(error)
        ) from None


def _is_of_a_bag(file: Path) -> bool:
    return file.is_file() and (file.suffix == ".mcap" or file.name == "metadata.yaml")


def tell_of_bag(folder: Path, stop: Stop) -> None:
    """Name the bag, and replay it; FailedError when it cannot be replayed, or differs."""
    print(f"Bag: {folder}", flush=True)
    try:
        line = replayed(folder, stop)
    except KeyboardInterrupt:
        print("demo: interrupted", flush=True)
        return
    print(line, flush=True)


def replayed(folder: Path, stop: Stop) -> str:
    """The verdict of a replay of the bag."""
    from bouncing_disk_ros import bag  # here, at the end: it loads the kernels
    from bouncing_disk_ros.nodes.replay_bag import Recorded, replay_bag
    from bouncing_disk_ros.nodes.replay_text import verdict

    def look(_: int) -> None:
        if stop.asked:
            raise KeyboardInterrupt

    try:
        with bag.open(folder) as opened:
            found = replay_bag(Recorded(opened), watch=look)
    except (InputError, bag.BagError, OSError) as error:
        raise FailedError(f"the bag cannot be replayed: {error}") from None
    if not found.identical:
        raise FailedError(verdict(found))
    return verdict(found)
