"""The executable `recorder`: topics into an MCAP bag that every ROS 2 tool opens."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from bouncing_disk_ros import environment
from bouncing_disk_ros.ros.stop import Stop

_ABOUT = """Record the topics of this package, or any others, to a rosbag2 bag in MCAP. Ctrl-C ends
it in order. Services: ~/pause, ~/resume, ~/split (std_srvs/srv/Trigger)."""
_EXAMPLE = "ros2 run bouncing_disk_ros recorder run_1 --ros-args -p max_duration:=60.0"


def main(args: Sequence[str] | None = None) -> int:
    """Record until a signal; exit code 0 done, 1 the disk took no more, 2 bad input."""
    argv = list(sys.argv[1:] if args is None else args)
    stop = Stop().install()
    environment.prepare()
    stop.importing = True
    from bouncing_disk_ros.nodes.recorder_node import Recorder
    from bouncing_disk_ros.nodes.recorder_options import OPTIONS
    from bouncing_disk_ros.nodes.tool import own_arguments, parser_of, run_tool

    stop.importing = False
    own = own_arguments(argv)
    parser = parser_of("recorder", _ABOUT, OPTIONS, _EXAMPLE)
    parser.usage = "recorder [OUTPUT] [--help] [--ros-args -p NAME:=VALUE ...]"
    parser.add_argument("output", nargs="?", default="", metavar="OUTPUT",
                        help="folder of the bag; must be new")  # fmt: skip
    given = parser.parse_args(own).output
    return run_tool(
        "recorder",
        argv[len(own) :],
        lambda: Recorder(given),
        lambda node: node.record(stop),
        stop,
    )


if __name__ == "__main__":
    sys.exit(main())
