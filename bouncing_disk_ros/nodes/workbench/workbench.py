"""The executable `workbench`: a page in the browser to see a run and touch it."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

from bouncing_disk_ros import environment
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.kernel_cache import announce_compilation
from bouncing_disk_ros.nodes.shared.startup import Start, run_without_ros
from bouncing_disk_ros.parameters import Spec

if TYPE_CHECKING:
    pass

NAME = "workbench"
_ABOUT = """Serve a page on which a run is seen and touched: platform and disk, path, rotor speed
and section live; sliders and buttons that send ROS commands and show them; scenes for a lesson.
Starts a simulator unless one runs. Without ROS it simulates by itself. Ctrl-C ends it."""
_EXAMPLE = "ros2 run bouncing_disk_ros workbench --ros-args -p preset:=pizza_multiple_toss"

_SPECS = (
    Spec("address", "localhost", "", "interface to listen on; other than localhost, everybody who "
         "has the address with its token can command the run"),
    Spec("port", 5006, "", "port of the page; 0: any that is free", low=0, high=65535),
    Spec("origins", "", "", "further hosts (host:port) whose pages may open a session: those of a "
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
    try:
        require_bokeh()
    except InputError as error:
        return run_without_ros(NAME, partial(_raise, error))
    if not environment.ros_is_here():
        return run_without_ros(NAME, partial(_without_ros, start))
    with start.stop.importing():
        announce_compilation(NAME)
        from bouncing_disk_ros.nodes.workbench.workbench_node import WorkbenchNode
        from bouncing_disk_ros.ros.spin import run_node

    make = partial(WorkbenchNode, OPTIONS)
    return run_node(NAME, start.ros, make, WorkbenchNode.serve, start.stop)


def require_bokeh() -> None:
    """Raise InputError where Bokeh is not installed."""
    import importlib.util

    if importlib.util.find_spec("bokeh") is None:
        hint = "pip install 'bouncing_disk_ros[workbench]' brings it."
        raise InputError("bokeh", "not installed", "Bokeh, which makes the page", hint)


def _raise(error: InputError) -> int:
    raise error


def _without_ros(start: Start) -> int:
    raise NotImplementedError


if __name__ == "__main__":
    sys.exit(main())
