"""The executable `reference_cases`: list the reference cases, show one, write their files."""

from __future__ import annotations

import argparse
import importlib.util
from collections.abc import Sequence

from bouncing_disk_ros.command_line.start import Start
from bouncing_disk_ros.errors import ExitCode, MissingLibraryError
from bouncing_disk_ros.folders import user_path
from bouncing_disk_ros.kernel_cache import announce_compilation

NAME = "reference_cases"
_ABOUT = """List the reference cases: runs of a bouncing disk whose events are known with certain
bounds, for comparison with any simulator. With CASE, show one: its files and its events. With
--write, enclose all of them again by interval arithmetic and write their JSON and CSV files."""
_EXAMPLES = """ros2 run bouncing_disk_ros reference_cases
  ros2 run bouncing_disk_ros reference_cases chaos
  ros2 run bouncing_disk_ros reference_cases --write cases/"""


def main(args: Sequence[str] | None = None) -> int:
    """List, show or write the cases; exit code 0 done, 1 failed, 2 bad input, 130 interrupted."""
    start = Start(NAME, _ABOUT, None, _EXAMPLES, args, ExitCode.INTERRUPTED)
    parser = start.parser
    parser.add_argument("case", nargs="?", help="number or name of a case")
    parser.add_argument("--write", metavar="FOLDER", help="enclose again, and write the files")
    given = start.parse()
    return start.run(lambda: _run(start, given), given.write or "")


def _run(start: Start, given: argparse.Namespace) -> int:
    with start.stop.loading():
        announce_compilation(NAME)
        from bouncing_disk_ros.cases.files import folder, reference_case, reference_cases, write

    cases = [reference_case(given.case)] if given.case else list(reference_cases())
    if given.write:
        if importlib.util.find_spec("flint") is None:
            raise MissingLibraryError("--write", "python-flint")
        target = user_path(given.write)
        for case in cases:
            for path in write(target, case.case):
                print(f"written: {path}", flush=True)
        return ExitCode.DONE
    if not given.case:
        for case in cases:
            print(f"{case.number:>2}  {case.name:<18} {len(case.events):>3} events  {case.tests}")
        print(f"files: {folder()}")
        return ExitCode.DONE
    case = cases[0]
    print(f"case {case.number}, {case.name}: {case.tests}; {case.duration:g} s")
    for event in case.events:
        print(f"{event['event']:>3}  {event['kind']:<10}  t = {event['time_lower']:.16f} s")
    for ending in ("json", "csv"):
        print(folder() / f"{case.case.file_stem}.{ending}")
    return ExitCode.DONE
