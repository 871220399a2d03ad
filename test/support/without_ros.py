"""Run an executable of the package, or code, as on a machine without ROS: its imports fail.

    python test/support/without_ros.py basins --ros-args -p width:=8
    python test/support/without_ros.py basins --ros-args -p width:=8 + toss_paths
    python test/support/without_ros.py -c "from bouncing_disk_ros import simulate; ..." + demo

What ROS brings, its definitions of messages too, is not found. Several command lines may stand
there, with a + in between: imports cost most. Each is followed by a line that tells its exit code.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Sequence
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType

ROS_MODULES = re.compile(
    r"(rclpy|rcl|rpyutils|std_srvs|ament_\w+|rosidl_\w+|launch\w*|\w+_msgs|\w+_interfaces)(\..*)?"
)
"""Everything that a ROS installation brings."""


class NoRos(MetaPathFinder):
    """Refuses to import what ROS brings."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if ROS_MODULES.fullmatch(fullname):
            raise ModuleNotFoundError(f"No module named {fullname!r}", name=fullname)
        return None


def hide_ros() -> None:
    """Let imports of ROS fail in this process."""
    loaded = [name for name in sys.modules if ROS_MODULES.fullmatch(name)]
    assert not loaded, loaded
    sys.meta_path.insert(0, NoRos())
    os.environ["AMENT_PREFIX_PATH"] = ""
    from bouncing_disk_ros.bag import schema
    from bouncing_disk_ros.errors import InputError

    def no_file(name: str, suffix: str) -> None:
        raise InputError("message type", name, "a type whose .msg file is installed")

    schema._file = no_file  # type: ignore[assignment]


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


def main() -> int | None:
    """Run what the command line names."""
    del sys.path[0]  # this folder has modules with names of others
    hide_ros()
    if sys.argv[1] == "-c":
        exec(compile(sys.argv[2], "<code>", "exec"), {"__name__": "__main__"})
        run_all(sys.argv[sys.argv.index("+") + 1 :])
        return 0
    from bouncing_disk_ros.__main__ import run

    if "+" not in sys.argv:
        return run(sys.argv[1], sys.argv[2:])
    run_all(sys.argv[1:])
    return 0


if __name__ == "__main__":
    sys.exit(main())
