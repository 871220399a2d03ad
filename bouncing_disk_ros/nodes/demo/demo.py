"""The executable `demo`: a helical toss into the period-1 orbit, live over DDS, with a summary."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path

from bouncing_disk_ros.command_line.environment import ros_is_here
from bouncing_disk_ros.command_line.start import Start, option_values
from bouncing_disk_ros.errors import ExitCode
from bouncing_disk_ros.kernel_cache import announce_compilation
from bouncing_disk_ros.parameters import Spec

_ABOUT = """Start a simulator with a disk at rest, let `perform` toss it into the period-1 orbit,
watch both over DDS, record the run, and show the result: a summary, a picture, a report on
the bag, and its replay. Ctrl-C ends all of it. Where ROS is not installed, the same run is
simulated in one process, without a bag."""
_EXAMPLE = "python -m bouncing_disk_ros demo --ros-args -p duration:=30.0"
BAG = "output/demo_bag"

_SPECS = (
    Spec("duration", 18.0, "s", "time from the programme's begin to the end", low=3.0, high=3600.0),
    Spec("picture", "output/demo.png", "", "file for the picture (png, pdf, svg)"),
)
OPTIONS = {spec.name: spec for spec in _SPECS}


def main(args: Sequence[str] | None = None) -> int:
    """Run the demonstration; exit code 0 done, 1 failed, 2 bad input, 130 interrupted."""
    start = Start("demo", _ABOUT, OPTIONS, _EXAMPLE, args, ExitCode.INTERRUPTED, needs_ros=False)
    parser = start.parser
    parser.usage = "demo [--help] [--bag FOLDER] [--ros-args -p NAME:=VALUE ...]"
    parser.add_argument("--bag", type=Path, default=Path(BAG), metavar="FOLDER",
                        help=f"where to record; replaces an earlier bag ({BAG})")  # fmt: skip
    folder = start.parse().bag
    way = partial(_with_ros, start, folder) if ros_is_here() else partial(_without_ros, start)
    return start.run(way)


def _with_ros(start: Start, folder: Path) -> int:
    with start.stop.loading():
        from bouncing_disk_ros.command_line.private_domain import use_private_domain
        from bouncing_disk_ros.nodes.demo.demo_bag import remove_old_bag
        from bouncing_disk_ros.nodes.demo.demo_node import DemoNode
        from bouncing_disk_ros.nodes.demo.demo_story import picture_of
        from bouncing_disk_ros.ros.spin import run_node

    picture_of(option_values(start.overrides, OPTIONS))  # what is wrong is refused before that
    remove_old_bag(folder)
    export = use_private_domain()
    with DemoNode.children(folder) as children:
        make = partial(DemoNode, OPTIONS, children, folder)
        present = partial(DemoNode.present, export=export)
        return run_node(start, make, present)


def _without_ros(start: Start) -> int:
    with start.stop.loading():
        announce_compilation("demo")
        from bouncing_disk_ros.nodes.demo.demo_alone import present_without_ros

    return present_without_ros(OPTIONS, start.overrides)
