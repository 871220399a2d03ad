"""What makes a study an executable: its table, its text for --help, and its pictures."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from bouncing_disk_ros import environment
from bouncing_disk_ros.errors import ExitCode
from bouncing_disk_ros.parameters import Spec, Value
from bouncing_disk_ros.ros.stop import Stop

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from bouncing_disk_ros.study import Study


@dataclass(frozen=True)
class Exhibit:
    """A study with the ways to show its result; made after the slow imports."""

    make: Callable[[Mapping[str, Value]], Study]
    pictures: Callable[[xr.Dataset], Mapping[str, Figure]]
    """Name of the file (without its kind) -> figure; the first one is published."""
    lines: Callable[[xr.Dataset], list[str]]
    from_bag: Callable[[Mapping[str, Value]], Sequence[str]] | None = None
    """The options that a recorded run can give, by the others; None: it takes no bag."""
    image: Callable[[xr.Dataset], NDArray[np.generic]] | None = None
    """The result as an image: (rows, columns) of float32, or int32 for ids; None: not a map."""


@dataclass(frozen=True)
class StudyTool:
    """An executable that runs a study; `exhibit` imports what it needs when it is called."""

    name: str
    about: str
    example: str
    table: Mapping[str, Spec]
    exhibit: Callable[[], Exhibit]

    def main(self, args: Sequence[str] | None = None) -> int:
        """Run; exit code 0 done, 1 failed, 2 bad input, 130 interrupted (what is done is kept)."""
        argv: list[Any] = list(sys.argv[1:] if args is None else args)
        stop = Stop(ExitCode.INTERRUPTED).install()
        environment.prepare()
        stop.importing = True
        from bouncing_disk_ros.nodes.study_node import StudyNode
        from bouncing_disk_ros.nodes.tool import own_arguments, parser_of, run_tool

        stop.importing = False
        own = own_arguments(argv)
        parser_of(self.name, self.about, self.table, self.example).parse_args(own)
        return run_tool(
            self.name,
            argv[len(own) :],
            lambda: StudyNode(self),
            lambda node: node.present(stop),
            stop,
        )
