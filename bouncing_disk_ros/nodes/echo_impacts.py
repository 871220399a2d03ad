"""The executable `echo_impacts`: impacts as readable rows, or as CSV."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from bouncing_disk_ros.command_line.start import Start
from bouncing_disk_ros.parameters import Spec

_ABOUT = """Print the impacts of disk/impacts as they happen. Ctrl-C ends it. Lost rows and other
remarks go to stderr."""
_EXAMPLE = "ros2 run bouncing_disk_ros echo_impacts --ros-args -p csv:=true > impacts.csv"

_SPECS = (
    Spec("once", False, "", "end after the first message"),
    Spec("count", 0, "", "end after this many rows; 0: go on", low=0, high=10**12),
    Spec("csv", False, "", "all fields as comma-separated values, floats in round-trip form"),
    Spec("timeout", 0.0, "s", "end with exit code 1 when no row is received for this long; 0: wait",
         low=0.0, high=1e6),
)  # fmt: skip
OPTIONS = {spec.name: spec for spec in _SPECS}


def main(args: Sequence[str] | None = None) -> int:
    """Print impacts; exit code 0 done or interrupted, 1 nothing came in time, 2 bad input."""
    start = Start("echo_impacts", _ABOUT, OPTIONS, _EXAMPLE, args)
    start.parse()
    with start.stop.loading():
        from bouncing_disk_ros.nodes.impact_printer import ImpactPrinter
        from bouncing_disk_ros.ros.spin import run_node

    return run_node(start, partial(ImpactPrinter, OPTIONS), ImpactPrinter.print_all)
