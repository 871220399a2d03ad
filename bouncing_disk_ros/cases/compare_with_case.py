"""The executable `compare_with_case`: how far a simulator is from the rigid-impact law."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from bouncing_disk_ros.command_line.start import FIGURE_KINDS, Start, check_figure_file
from bouncing_disk_ros.errors import ExitCode, InputError
from bouncing_disk_ros.kernel_cache import announce_compilation

NAME = "compare_with_case"
_ABOUT = """Compare the events of any simulator with a reference case: events that are missed, false
or late, and what is wrong with them. The file is CSV: a column time (s), and any of kind, position,
velocity_before, velocity_after, angle, angular_velocity_before, angular_velocity_after (SI units).
Time and position alone are samples, in which impacts are found. With a column flight (the number of
the event from which the simulator was started again) each row is one flight, so that errors do not
add up."""
_EXAMPLES = """ros2 run bouncing_disk_ros compare_with_case drop my_impacts.csv --tolerance 1e-6
  ros2 run bouncing_disk_ros compare_with_case 9 my_samples.csv --figure chaos.png"""


def main(args: Sequence[str] | None = None) -> int:
    """Compare; exit code 0 within the tolerance, 1 beyond it, 2 bad input, 130 interrupted."""
    start = Start(NAME, _ABOUT, None, _EXAMPLES, args, ExitCode.INTERRUPTED)
    parser = start.parser
    parser.add_argument("case", help="number or name of a case (see reference_cases)")
    parser.add_argument("file", help="a CSV file of events, or of samples (time, position)")
    parser.add_argument(
        "--tolerance", type=float, default=1e-9,
        help="s, m, m/s, rad, rad/s: what an error may be; default: 1e-9",
    )  # fmt: skip
    parser.add_argument(
        "--set", action="append", default=[], metavar="NAME=VALUE",
        help="another value of a parameter of the case, which is then enclosed anew",
    )  # fmt: skip
    parser.add_argument(
        "--figure", type=Path, metavar="FILE", help="a picture (" + ", ".join(FIGURE_KINDS) + ")"
    )
    given = start.parse()
    return start.run(lambda: _run(start, given), given.file)


def _run(start: Start, given: argparse.Namespace) -> int:
    with start.stop.loading():
        announce_compilation(NAME)
        from bouncing_disk_ros.cases.comparison import compare_with_case
        from bouncing_disk_ros.cases.files import reference_case

    if given.figure is not None:
        check_figure_file("--figure", given.figure)
    changes = dict(map(_change, given.set))
    case = reference_case(given.case, **changes)
    found = compare_with_case(case, given.file, tolerance=given.tolerance)
    print("\n".join(found.lines), flush=True)
    if given.figure is not None:
        from bouncing_disk_ros.matplotlib_figures import save_picture

        save_picture(found.figure(), given.figure)
        print(f"written: {given.figure}")
    return ExitCode.DONE if found.is_within else ExitCode.FAILED


def _change(text: str) -> tuple[str, float]:
    name, _, value = text.partition("=")
    try:
        return name, float(value)
    except ValueError:
        raise InputError("set", text, "NAME=VALUE, such as restitution=0.7") from None
