"""Run command lines of the package one after the other in one process: imports cost most.

    python test/support/several.py basins --ros-args -p width:=8 + toss_map --help

A + stands between them. Each is followed by a line that tells its exit code.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence


def run_all(words: Sequence[str]) -> None:
    """Run the command lines that these words are."""
    from bouncing_disk_ros.__main__ import run

    for line in "\n".join(words).split("\n+\n"):
        name, *arguments = line.split("\n")
        code: str | int | None
        try:
            code = run(name, arguments)
        except SystemExit as end:  # of --help
            code = end.code
        print(f"{name} ended with {code or 0}", flush=True)


if __name__ == "__main__":
    del sys.path[0]  # this folder has modules with names of others
    run_all(sys.argv[1:])
