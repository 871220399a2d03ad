"""The bag of the demonstration: its folder, and the report on it at the end."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

from bouncing_disk_ros.errors import FailedError, InputError
from bouncing_disk_ros.ros.stop import Stop


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
    with _reporting(folder) as report:  # beside the replay: the other core has nothing to do
        try:
            line = replayed(folder, stop)
            print(f"Report: {_report(report, stop)}", flush=True)
        except KeyboardInterrupt:
            report.terminate()
            print("demo: interrupted", flush=True)
            return
        except BaseException:
            report.terminate()
            raise
    print(line, flush=True)


def _reporting(folder: Path) -> subprocess.Popen[str]:
    """`bag_report` at work; the demonstration has drawn its own figure."""
    command = [sys.executable, "-m", "bouncing_disk_ros", "bag_report", str(folder)]
    return subprocess.Popen(
        [*command, "--figures", "none"], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
        stderr=subprocess.PIPE, text=True,
    )  # fmt: skip


def _report(report: subprocess.Popen[str], stop: Stop) -> str:
    """The file of the report when it is done."""
    while True:
        try:
            said, wrong = report.communicate(timeout=0.1)
            break
        except subprocess.TimeoutExpired:
            if stop.asked:
                raise KeyboardInterrupt from None
    if stop.asked:
        raise KeyboardInterrupt
    if report.returncode:
        reason = (wrong.strip().splitlines() or ["without a message"])[-1]
        raise FailedError(f"no report on the bag: {reason}")
    return os.path.relpath(said.strip().splitlines()[-1].removeprefix("written: "))


def replayed(folder: Path, stop: Stop) -> str:
    """The verdict of a replay of the bag."""
    from bouncing_disk_ros import bag  # here, at the end: it loads the kernels
    from bouncing_disk_ros.nodes.replay.bag_streams import Recorded, replay_bag
    from bouncing_disk_ros.nodes.replay.replay_text import verdict

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
