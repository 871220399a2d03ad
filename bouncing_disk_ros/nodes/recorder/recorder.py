"""The executable `recorder`: topics into an MCAP bag that every ROS 2 tool opens."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from bouncing_disk_ros.command_line.start import Start
from bouncing_disk_ros.nodes.recorder.recorder_options import OPTIONS

_ABOUT = """Record the topics of this package, or any others, to a rosbag2 bag in MCAP. Ctrl-C
completes the bag and ends. Services: ~/pause, ~/resume, ~/split (std_srvs/srv/Trigger)."""
_EXAMPLE = "ros2 run bouncing_disk_ros recorder run_1 --ros-args -p max_duration:=60.0"


def main(args: Sequence[str] | None = None) -> int:
    """Record until a signal; exit code 0 done, 1 the disk took no more, 2 bad input."""
    start = Start("recorder", _ABOUT, OPTIONS, _EXAMPLE, args)
    parser = start.parser
    parser.usage = "recorder [OUTPUT] [--help] [--ros-args -p NAME:=VALUE ...]"
    parser.add_argument("output", nargs="?", default="", metavar="OUTPUT",
                        help="folder of the bag; must be new")  # fmt: skip
    given = start.parse().output
    with start.stop.loading():
        from bouncing_disk_ros.nodes.recorder.recorder_node import Recorder
        from bouncing_disk_ros.ros.spin import run_node

    return run_node(start, partial(Recorder, given), Recorder.record)
