"""The executable `replay`: a recorded run again from its inputs alone, and what if it had differed.

Needs no ROS running.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from bouncing_disk_ros.command_line.start import FIGURE_KINDS, Start, check_figure_file
from bouncing_disk_ros.errors import ExitCode, InputError
from bouncing_disk_ros.kernel_cache import announce_compilation
from bouncing_disk_ros.units import NS

if TYPE_CHECKING:
    from bouncing_disk_ros import bag
    from bouncing_disk_ros.nodes.replay.bag_streams import Recorded, ReplayedBag

_ABOUT = """Simulate a recorded run again from disk/inputs alone, and compare every impact with the
recorded one, bit by bit. Exit code 0: identical, 3: it differs (the first difference is
printed), or rows of another version have other fields (those not compared are named)."""
_EXAMPLES = """ros2 run bouncing_disk_ros replay run_1
  ros2 run bouncing_disk_ros replay run_1 --what-if restitution:=0.4 --figure what_if.png"""


def main(args: Sequence[str] | None = None) -> int:
    """Replay; exit code 0 identical, 1 failed, 2 bad input, 3 it differs, 130 interrupted."""
    start = Start("replay", _ABOUT, None, _EXAMPLES, args, ExitCode.INTERRUPTED)
    _add_options(start.parser)
    given = start.parse()
    with start.stop.loading():
        announce_compilation("replay")
        from bouncing_disk_ros.nodes.replay import bag_streams as _  # noqa: F401 (loads kernels)

    return start.run(lambda: _work(given), given.bag)


def _add_options(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    add("bag", help="the folder of a bag, or one .mcap file")
    add("--namespace", metavar="NS", help="of the simulator, when the bag holds several; / is none")
    add("--inputs", default="", metavar="TOPIC", help="the record, if disk/inputs was remapped")
    add("--impacts", default="", metavar="TOPIC", help="the impacts, if disk/impacts was remapped")
    add("--what-if", nargs="+", action="extend", default=[], metavar="NAME:=VALUE",
        help="also simulate the run with other parameters of the disk (restitution:=0.4) or "
        "another motion of the platform (frequency:=3.1), and compare the two")  # fmt: skip
    add("--run", type=int, metavar="N", help="which run --what-if is for, when there are several")
    add("--figure", type=Path, metavar="FILE",
        help="picture of the two runs of --what-if (" + ", ".join(FIGURE_KINDS) + ")")  # fmt: skip


def _work(given: argparse.Namespace) -> int:
    from bouncing_disk_ros import bag
    from bouncing_disk_ros.bag.reader import walking
    from bouncing_disk_ros.nodes.replay.bag_streams import Recorded
    from bouncing_disk_ros.nodes.replay.replay_text import run_lines, verdict
    from bouncing_disk_ros.run.what_if import changes_of

    changes = changes_of(_settings(given.what_if))
    if given.figure is not None:
        check_figure_file("--figure", given.figure)
        if not given.what_if:
            allowed = "a figure of --what-if NAME:=VALUE"
            raise InputError("--figure", str(given.figure), allowed)
    with walking("replay") as watch:
        opened = bag.open(given.bag, watch)
    with opened:
        recorded = Recorded(opened, given.namespace, given.inputs, given.impacts)
        print(f"{given.bag}: {recorded.inputs}, {recorded.impacts}", flush=True)
        for remark in opened.remarks:
            print(f"  ! {remark}")
        found = _replayed(opened, recorded)
        for number, run in enumerate(found.runs, 1):
            print("\n".join(run_lines(number, run)))
        if found.left_over:
            print(f"{found.left_over} rows not compared: they may belong to either of two runs")
        if found.rows or not found.not_compared:
            print(verdict(found), flush=True)
        if given.what_if:  # after the verdict: it is what was asked for
            from bouncing_disk_ros.nodes.replay.replay_text import compare

            compare(recorded, found, changes, given.run, given.figure)
    if not found.rows and found.not_compared:
        print(f"replay: none of the {found.not_compared} rows can be compared", file=sys.stderr)
        return ExitCode.BAD_INPUT
    return ExitCode.DONE if found.identical else ExitCode.REPLAY_DIFFERS


def _settings(texts: Sequence[str]) -> dict[str, object]:
    """Pairs of NAME:=VALUE, as ROS writes them."""
    from bouncing_disk_ros.parsing import read_yaml

    settings: dict[str, object] = {}
    for text in texts:
        name, separator, value = text.partition(":=")
        if not separator:
            hint = "The bag comes before --what-if." if Path(text).exists() else ""
            raise InputError("--what-if", text, "NAME:=VALUE, such as restitution:=0.4", hint)
        try:
            settings[name] = read_yaml(f"--what-if {name}", value)
        except InputError:
            settings[name] = value
    return settings


def _replayed(opened: bag.Bag, recorded: Recorded) -> ReplayedBag:
    """Replay with a progress bar on a terminal: by the bag, and the simulated time reached."""
    from tqdm import tqdm

    from bouncing_disk_ros.nodes.replay.bag_streams import replay_bag

    start, end = opened.start_ns, opened.end_ns
    with tqdm(total=round((end - start) / NS, 1), unit="s", desc="replay", leave=False,
              disable=None, file=sys.stderr) as bar:  # fmt: skip

        def heard(time_ns: int) -> None:
            bar.update(max(0.0, (time_ns - start) / NS - bar.n))

        def reached(time_ns: int) -> None:
            bar.set_postfix_str(f"simulated {time_ns / NS:.1f} s", refresh=False)
            bar.update(0)

        return replay_bag(recorded, heard, reached)
