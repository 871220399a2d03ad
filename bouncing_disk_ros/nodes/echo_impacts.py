"""The executable `echo_impacts`: impacts as readable rows, or as CSV."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence

from bouncing_disk_ros import environment
from bouncing_disk_ros.parameters import Spec
from bouncing_disk_ros.ros.stop import Stop

_ABOUT = """Print the impacts of disk/impacts as they happen. Ctrl-C ends it. Lost rows and other
remarks go to stderr."""
_EXAMPLE = "ros2 run bouncing_disk_ros echo_impacts --ros-args -p csv:=true > impacts.csv"

_SPECS = (
    Spec("once", False, "", "end after the first message"),
    Spec("count", 0, "", "end after this many rows; 0: go on", low=0, high=10**12),
    Spec("csv", False, "", "all fields as comma-separated values, floats in round-trip form"),
    Spec("timeout", 0.0, "s", "end with exit code 1 when no row came for this long; 0: wait",
         low=0.0, high=1e6),
)  # fmt: skip
OPTIONS = {spec.name: spec for spec in _SPECS}


def main(args: Sequence[str] | None = None) -> int:
    """Print impacts; exit code 0 done or interrupted, 1 nothing came in time, 2 bad input."""
    argv = list(sys.argv[1:] if args is None else args)
    stop = Stop().install()
    environment.prepare()
    stop.importing = True
    from bouncing_disk_ros.nodes.impact_printer import ImpactPrinter
    from bouncing_disk_ros.nodes.tool import own_arguments, parser_of, run_tool

    stop.importing = False
    own = own_arguments(argv)
    parser_of("echo_impacts", _ABOUT, OPTIONS, _EXAMPLE).parse_args(own)
    try:
        return run_tool(
            "echo_impacts",
            argv[len(own) :],
            lambda: ImpactPrinter(OPTIONS),
            lambda node: node.print_all(stop),
            stop,
        )
    except BrokenPipeError:  # the reader (head, less) has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0


if __name__ == "__main__":
    sys.exit(main())
