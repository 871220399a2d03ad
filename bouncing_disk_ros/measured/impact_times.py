"""The executable `impact_times`: the hits in a sound file, as a table and a picture."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from bouncing_disk_ros.command_line.start import Start, figure_kinds, option_values
from bouncing_disk_ros.errors import ExitCode, MissingLibraryError
from bouncing_disk_ros.kernel_cache import announce_compilation
from bouncing_disk_ros.parameters import Spec

NAME = "impact_times"
_ABOUT = """The hits in the sound of impacts: their times with errors. The sound is a WAV, FLAC, OGG
or MP3 file. Writes SOUND_times.csv, a table for fit_impacts (which reads the sound too), and
figures."""
_EXAMPLE = "ros2 run bouncing_disk_ros impact_times drop.wav"
_FIGURES = Spec("figures", "png", "", "kinds of figure files: any of png, pdf, svg, or none")
OPTIONS = {_FIGURES.name: _FIGURES}


def main(args: Sequence[str] | None = None) -> int:
    """Write the hits of a sound; exit code 0 done, 2 bad input, 130 interrupted."""
    start = Start(NAME, _ABOUT, OPTIONS, _EXAMPLE, args, ExitCode.INTERRUPTED, needs_ros=False)
    parser = start.parser
    parser.usage = f"{NAME} [--help] SOUND [OUTPUT] [--ros-args -p NAME:=VALUE ...]"
    parser.add_argument("sound", help="a sound file")
    parser.add_argument(
        "output", nargs="?", help="name of the files, or a folder; default: SOUND_times"
    )
    given = start.parse()
    return start.run(partial(_hear, start, given))


def _hear(start: Start, given: argparse.Namespace) -> int:
    kinds = figure_kinds(str(option_values(start.overrides, OPTIONS)["figures"]))
    with start.stop.loading():
        announce_compilation(NAME)
        try:
            from bouncing_disk_ros.measured.sound import impact_times
        except ModuleNotFoundError as error:
            raise MissingLibraryError(NAME, str(error.name)) from None
        from bouncing_disk_ros.measured.sound_picture import sound_lines, sound_panel, sound_text
        from bouncing_disk_ros.regular_file import replaced
        from bouncing_disk_ros.report.panel_page import panels_page, save_page
        from bouncing_disk_ros.report.report_files import check_ours, targets

    files = targets(given.sound, "times", given.output, ["csv", *kinds])
    check_ours(files, NAME)
    sound = impact_times(given.sound)
    table, *figures = files
    print("\n".join(sound_lines(sound)), flush=True)
    replaced(table, partial(Path.write_text, data=sound_text(sound), encoding="utf-8"))
    for file in figures:
        drawn = panels_page(sound.name, sound_lines(sound)[0], [(sound_panel(sound), "")])
        replaced(file, partial(save_page, drawn, maker=NAME))
    for file in files:
        print(f"written: {file}", flush=True)
    return ExitCode.DONE
