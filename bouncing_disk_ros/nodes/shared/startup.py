"""How an executable begins, before its slow imports: signals, surroundings, command line.

Loads neither rclpy nor numba: --help and a wrong argument are answered at once.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence

from bouncing_disk_ros import environment
from bouncing_disk_ros.errors import ExitCode
from bouncing_disk_ros.help_text import spec_lines
from bouncing_disk_ros.parameters import Spec
from bouncing_disk_ros.ros.stop import Stop


class Start:
    """An executable with a table of options that has begun; made first of all in its `main`.

    `args`: the command line, None for that of the process. `code`: what a signal ends it with.
    """

    def __init__(
        self,
        name: str,
        about: str,
        table: Mapping[str, Spec],
        example: str,
        args: Sequence[str] | None,
        code: ExitCode = ExitCode.DONE,
    ) -> None:
        self.name = name
        self.stop = Stop(code).install()
        environment.prepare()
        self.own, self.ros = split_arguments(args)
        self.parser = parser_of(name, about, table, example)

    def parse(self) -> argparse.Namespace:
        """What stands before --ros-args; ends the process for --help and for what is unknown."""
        return self.parser.parse_args(self.own)


def split_arguments(args: Sequence[str] | None) -> tuple[list[str], list[str]]:
    """What stands before --ros-args, and the rest; None: the command line of the process.

    The first step of every executable, so it makes stdout take any text, whatever the terminal.
    """
    environment.accept_any_text()
    argv = list(sys.argv[1:] if args is None else args)
    at = argv.index("--ros-args") if "--ros-args" in argv else len(argv)
    return argv[:at], argv[at:]


def parser_of(
    name: str, about: str, table: Mapping[str, Spec], example: str
) -> argparse.ArgumentParser:
    """The parser of an executable; --help shows its options from the table."""
    lines = ["parameters (--ros-args -p NAME:=VALUE):"]
    for spec in table.values():
        lines += spec_lines(spec)
    return argparse.ArgumentParser(
        prog=name,
        description=about,
        usage=f"{name} [--help] [--ros-args -p NAME:=VALUE ... -r __ns:=/NAMESPACE ...]",
        epilog="\n".join([*lines, "", "example:", f"  {example}"]),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
