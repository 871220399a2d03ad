"""The executable `fit_impacts`: from measured impacts to a model with intervals, and a preset."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from bouncing_disk_ros.command_line.start import Start, figure_kinds, option_values
from bouncing_disk_ros.errors import ExitCode, InputError
from bouncing_disk_ros.kernel_cache import announce_compilation
from bouncing_disk_ros.measured.fit_options import OPTIONS

if TYPE_CHECKING:
    from bouncing_disk_ros.measured.result import ImpactFit

NAME = "fit_impacts"
_ABOUT = """Fit measured times of impacts: restitution, platform, scatter and errors with 95 %
intervals, and the impacts to come. The recording is a text with a column of seconds, a sound file,
or a bag. Writes RECORDING_fit.yaml, a preset for the simulator and the studies, RECORDING_fit.html,
a page with plots, and figures."""
_EXAMPLE = "ros2 run bouncing_disk_ros fit_impacts times.csv --ros-args -p frequency:=20.0"


def main(args: Sequence[str] | None = None) -> int:
    """Fit a recording; exit code 0 done, 1 no model fits, 2 bad input, 130 interrupted."""
    start = Start(NAME, _ABOUT, OPTIONS, _EXAMPLE, args, ExitCode.INTERRUPTED, needs_ros=False)
    parser = start.parser
    parser.usage = f"{NAME} [--help] RECORDING [OUTPUT] [--ros-args -p NAME:=VALUE ...]"
    parser.add_argument("recording", help="a text with a column of seconds, a sound, or a bag")
    parser.add_argument(
        "output", nargs="?", help="name of the files, or a folder; default: RECORDING_fit"
    )
    given = start.parse()
    return start.run(partial(_fit, start, given))


def _fit(start: Start, given: argparse.Namespace) -> int:
    values = option_values(start.overrides, OPTIONS)
    kinds = figure_kinds(str(values.pop("figures")))
    with start.stop.loading():
        announce_compilation(NAME)
        from bouncing_disk_ros.measured.fit import fit_impacts
        from bouncing_disk_ros.measured.picture import lines_of
        from bouncing_disk_ros.report.report_files import check_ours, targets

    files = targets(given.recording, "fit", given.output, ["yaml", "html", *kinds])
    check_ours(files, NAME)
    fit = fit_impacts(given.recording, **values)  # type: ignore[arg-type]
    print("\n".join(lines_of(fit)), flush=True)
    preset, *pages = files
    _write_preset(fit, preset)
    _write_pages(fit, pages)
    return ExitCode.DONE


def _write_preset(fit: ImpactFit, file: Path) -> None:
    """Write the preset; one that cannot be is said, and no failure."""
    try:
        fit.write_preset(file)
        print(f"written: {file}", flush=True)
    except InputError as error:
        print(f"no {error}", flush=True)


def _write_pages(fit: ImpactFit, files: Sequence[Path]) -> None:
    """Write the page, then figures, for which matplotlib is loaded."""
    from bouncing_disk_ros.measured.picture import headline_of, panels_of, tables_of
    from bouncing_disk_ros.regular_file import replaced
    from bouncing_disk_ros.report.report_files import made_by
    from bouncing_disk_ros.report.report_html import html_page

    (title, subtitle), drawn = headline_of(fit), panels_of(fit)
    for file in files:
        if sys.stdout.isatty():
            print(f"writing: {file}", end="\r", flush=True)
        if file.suffix == ".html":
            page = html_page(title, subtitle, drawn, tables_of(fit), NAME, made_by(NAME))
            replaced(file, partial(Path.write_text, data=page, encoding="utf-8"))
        else:
            from bouncing_disk_ros.report.panel_page import panels_page, save_page

            figure = panels_page(title, subtitle, drawn)
            replaced(file, partial(save_page, figure, maker=NAME))
        print(f"written: {file}", flush=True)
