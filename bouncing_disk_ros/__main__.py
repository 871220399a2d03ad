"""`python -m bouncing_disk_ros <executable> [...]`: `ros2 run` without the ros2 command."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from bouncing_disk_ros.command_line.stdout import prepare_stdout
from bouncing_disk_ros.errors import ExitCode, InputError, closest
from bouncing_disk_ros.executables import EXECUTABLES, entry_point, loaded

USAGE = "usage: python -m bouncing_disk_ros <executable> [arguments] [--ros-args ...]"


def overview() -> str:
    """Return the usage and the table of executables."""
    width = max(map(len, EXECUTABLES))
    rows = [f"  {name:{width}}  {summary}" for name, summary in EXECUTABLES.items()]
    ending = "Help on each: python -m bouncing_disk_ros <executable> --help"
    return "\n".join([USAGE, "", "executables:", *rows, "", ending])


def run(name: str, arguments: Sequence[str]) -> int | None:
    """Run the executable `name` as its console script would; return its exit code."""
    if name not in EXECUTABLES:
        hint = closest(name, EXECUTABLES) or "Without a name, all executables are listed"
        raise InputError("executable", name, ", ".join(EXECUTABLES), hint)
    sys.argv = [name, *arguments]
    code: int | None = loaded(entry_point(name))()
    return code


def main() -> int | None:
    """Run what the command line names; list the executables if it names none."""
    prepare_stdout()
    arguments = sys.argv[1:]
    if not arguments or arguments[0] in ("-h", "--help"):
        print(overview())
        return int(ExitCode.DONE)
    if arguments[0] == "--version":
        from bouncing_disk_ros import __version__

        print(f"bouncing_disk_ros {__version__}")
        return int(ExitCode.DONE)
    try:
        return run(arguments[0], arguments[1:])
    except InputError as error:
        print(f"bouncing_disk_ros: {error.line}", file=sys.stderr)
        return int(ExitCode.BAD_INPUT)


if __name__ == "__main__":
    sys.exit(main())
