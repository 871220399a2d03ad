"""The executable `workbench`: a page in the browser to see a run and touch it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING

from bouncing_disk_ros.command_line import environment
from bouncing_disk_ros.command_line.start import Start, option_values
from bouncing_disk_ros.command_line.stop import Answer
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.kernel_cache import announce_compilation
from bouncing_disk_ros.parameters import Spec, Value

if TYPE_CHECKING:
    from bouncing_disk_ros.workbench.run_link import RunLink

NAME = "workbench"
_ABOUT = """Serve a page on which a run is seen and touched: platform and disk, path, rotor speed
and section live; sliders and buttons that send ROS commands and show them; scenes for a lesson.
Starts a simulator unless one runs. Without ROS it simulates by itself. Ctrl-C ends it."""
_EXAMPLE = "ros2 run bouncing_disk_ros workbench --ros-args -p preset:=pizza_multiple_toss"

_SPECS = (
    Spec("address", "localhost", "", "interface to listen on; whoever has the printed address can "
         "command the run: it holds a token"),
    Spec("port", 5006, "", "port of the page; 0: any that is free", low=0, high=65535),
    Spec("origins", "", "", "further hosts (host:port) under which the page is reached: those of a "
         "proxy", listed=True),
    Spec("open_browser", True, "", "open the page in a browser where there is a display"),
    Spec("bag", "", "", "show this recorded run, with a time slider, instead of a live one"),
    Spec("namespace", "", "", "of the simulator in the bag, where it has several"),
    Spec("start_simulator", True, "", "start a simulator unless one runs"),
    Spec("preset", "pizza_multiple_toss", "", "preset of the simulator that is started"),
)  # fmt: skip
OPTIONS = {spec.name: spec for spec in _SPECS}


def main(args: Sequence[str] | None = None) -> int:
    """Serve the page until a signal; exit code 0 done, 1 failed, 2 bad input."""
    start = Start(NAME, _ABOUT, OPTIONS, _EXAMPLE, args, needs_ros=False)
    start.parse()
    return start.run(partial(_serve, start))


def _serve(start: Start) -> int:
    """Serve a bag or a run of this process; with ROS, make the node that serves a simulator."""
    values = option_values(start.overrides, OPTIONS)
    bag, here = str(values["bag"]), environment.ros_is_here()
    if values["namespace"] and not bag:
        hint = "Give the namespace of a live simulator with -r __ns:=/NAME."
        raise InputError("namespace", values["namespace"], "none without bag", hint)
    with start.stop.loading():
        announce_compilation(NAME)
        from bouncing_disk_ros.workbench.page_server import serve
    if bag or not here:
        with start.stop.loading():
            link = _recorded(values) if bag else _local(values)
        start.stop.answer = Answer.NOTE
        try:
            return serve(values, link, start.stop)
        finally:
            link.close()
    with start.stop.loading():
        from bouncing_disk_ros.ros.spin import run_node
        from bouncing_disk_ros.workbench.workbench_node import WorkbenchNode
    return run_node(start, partial(WorkbenchNode, OPTIONS), WorkbenchNode.serve)


def _recorded(values: Mapping[str, Value]) -> RunLink:
    from bouncing_disk_ros.bag import BagError
    from bouncing_disk_ros.workbench.bag_link import BagLink

    try:
        return BagLink(str(values["bag"]), str(values["namespace"]))
    except (BagError, OSError) as error:
        allowed = "a recorded run that can be read"
        raise InputError("bag", values["bag"], allowed, str(error)) from None


def _local(values: Mapping[str, Value]) -> RunLink:
    from bouncing_disk_ros.run.presets import load_preset
    from bouncing_disk_ros.workbench.local_link import LocalLink

    preset = str(values["preset"])
    return LocalLink(load_preset(preset) if preset else {})
