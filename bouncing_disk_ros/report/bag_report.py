"""The executable `bag_report`: a report on a recorded run, from its bag alone."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from bouncing_disk_ros.command_line.start import Start, figure_kinds
from bouncing_disk_ros.errors import ExitCode, InputError
from bouncing_disk_ros.executables import PROVE_BAG, loaded
from bouncing_disk_ros.field_checks import whole
from bouncing_disk_ros.kernel_cache import announce_compilation

if TYPE_CHECKING:
    from bouncing_disk_ros.report.run_report import Report

_ABOUT = """Report on a recorded run, from its bag alone: impacts, next-collision section, return
map, period found, rotor speed with its transient, energy, real-time quality and loss, and estimates
of restitution and friction. A summary goes to the terminal; a page with interactive plots (opens
without network) and a page of figures go into files."""
_EXAMPLES = """ros2 run bouncing_disk_ros bag_report run_1
      writes run_1_report.html and run_1_report.png
  ros2 run bouncing_disk_ros bag_report run_1 --prove
      proves each event of the run in interval arithmetic, instead of a report
  ros2 run bouncing_disk_ros bag_report run_1 figures/ --figures "pdf svg" --segment last"""
NAME = "bag_report"


_OPTIONS: dict[str, tuple[type, object, str]] = {
    "namespace": (str, None, "of the simulator, where the bag has several"),
    "run": (int, 0, "where the simulator was started again: 1, 2 ...; default: the last"),
    "segment": (
        str, "longest",
        "which stretch of steady motion the figures show: longest (most impacts), last, a number",
    ),
    "from": (float, None, "leave out what lies before this simulated time, s"),
    "to": (float, None, "leave out what lies at or after this simulated time, s"),
    "figures": (str, "png", "kinds of figure files: any of png, pdf, svg, or none"),
    "rows": (int, 1_000_000, "rows of impacts held in memory, the last ones"),
    "every": (int, 1, "with --prove: prove every n-th event only"),
}  # fmt: skip
"""Name, type, default and help of each option."""


def main(args: Sequence[str] | None = None) -> int:
    """Report on a bag; exit code 0 done, 1 failed or refuted, 2 bad input, 130 interrupted."""
    start = Start(NAME, _ABOUT, None, _EXAMPLES, args, ExitCode.INTERRUPTED)
    with_options(start.parser)
    given = start.parse()
    return start.run(lambda: _report(start, given), given.bag)


def with_options(parser: argparse.ArgumentParser) -> argparse.ArgumentParser:
    """A parser that has been given what this executable takes."""
    parser.add_argument("bag", help="the folder of a bag, or one .mcap file")
    parser.add_argument(
        "output", nargs="?",
        help="name of the files without their endings, or a folder; default: BAG_report",
    )  # fmt: skip
    for name, (kind, default, text) in _OPTIONS.items():
        shown = f"; default: {default}" if default else ""
        parser.add_argument(f"--{name}", type=kind, default=default, help=text + shown)
    parser.add_argument("--text-only", action="store_true", help="write no files")
    parser.add_argument(
        "--prove", action="store_true", help="replay the run and prove each event; write no files"
    )
    return parser


def _report(start: Start, given: argparse.Namespace) -> int:
    if given.prove:
        with start.stop.loading():
            announce_compilation(NAME)
            prove_bag = loaded(PROVE_BAG)
        return int(prove_bag(given))
    kinds = figure_kinds(given.figures)
    with start.stop.loading():
        announce_compilation(NAME)
        import numpy as np

        from bouncing_disk_ros.report.report_files import check_ours, targets
        from bouncing_disk_ros.report.report_text import lines

    files = [] if given.text_only else targets(given.bag, "report", given.output, ["html", *kinds])
    check_ours(files, NAME)
    with np.errstate(all="ignore"):  # of numbers that mean nothing: what follows from them is nan
        report = read(given)
        print("\n".join(lines(report)), flush=True)
        for file in files:
            _write(start, report, file)
            print(f"written: {file}", flush=True)
    return ExitCode.DONE


def read(given: argparse.Namespace) -> Report:
    """Read the bag and work the report out."""
    from tqdm import tqdm

    from bouncing_disk_ros import bag
    from bouncing_disk_ros.bag.reader import walking
    from bouncing_disk_ros.report.read_run import BagRun, ReadOptions
    from bouncing_disk_ros.report.run_report import report_of

    whole("rows", given.rows, 1)
    whole("run", given.run, 0)
    begin, end = (vars(given)[name] for name in ("from", "to"))
    if begin is not None and end is not None and begin >= end:
        raise InputError("to", end, f"a time after --from, {begin:g} s")
    options = ReadOptions(
        given.namespace,
        given.run,
        -math.inf if begin is None else begin,
        math.inf if end is None else end,
        given.rows,
    )
    with walking(NAME) as watch:
        run = bag.open(given.bag, watch)
    with run:
        reader = BagRun(run, options)
        steps = tqdm(reader.read(), NAME, reader.total, leave=False, disable=None, unit=" messages")
        for _ in steps:
            pass
        return report_of(reader.record, reader.source, given.segment)


def _write(start: Start, report: Report, file: Path) -> None:
    """Write one file whole or not at all."""
    from bouncing_disk_ros.regular_file import replaced

    if file.suffix == ".html":
        with start.stop.loading():
            from bouncing_disk_ros.report.report_html import report_html

        text = report_html(report)
        replaced(file, lambda path: path.write_text(text, "utf-8"))
    else:
        with start.stop.loading():
            from bouncing_disk_ros.report.panel_page import save_page
            from bouncing_disk_ros.report.report_panels import report_page

        figure = report_page(report)
        replaced(file, lambda path: save_page(figure, path, NAME))
