"""The executable `bag_recover`: repair a bag that is incomplete or damaged."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from bouncing_disk_ros.command_line.start import Start
from bouncing_disk_ros.errors import ExitCode

_ABOUT = """Repair a bag that is incomplete or damaged: copy all its complete chunks into a new
folder, rebuild index and metadata.yaml, and say what was lost. The original bag is not changed."""
_EXAMPLE = "ros2 run bouncing_disk_ros bag_recover run_1 run_1_recovered"


def main(args: Sequence[str] | None = None) -> int:
    """Recover a bag; exit code 0 saved, 1 no room, 2 bad input or nothing to be saved, 130."""
    start = Start("bag_recover", _ABOUT, None, _EXAMPLE, args, ExitCode.INTERRUPTED)
    start.parser.add_argument("bag", help="the folder of a bag, or one .mcap file")
    start.parser.add_argument("output", nargs="?", help="a new folder; default: BAG_recovered")
    given = start.parse()
    unfinished = "; the new folder is not whole, delete it"
    return start.run(lambda: _recover(start, given), given.bag, unfinished)


def _recover(start: Start, given: argparse.Namespace) -> int:
    with start.stop.loading():
        from bouncing_disk_ros import bag
        from bouncing_disk_ros.bag.reader import walking

    with walking("bag_recover") as watch:
        report = bag.recover(given.bag, given.output, watch)
    more = [f"and {report.unlisted} more damaged places"] if report.unlisted else []
    print("\n".join([*report.lines, *more]))
    if not report.saved and (report.lost or not report.exact):
        print(f"bag_recover: {report.summary}", file=sys.stderr)
        return ExitCode.BAD_INPUT
    print(report.summary)
    return ExitCode.DONE
