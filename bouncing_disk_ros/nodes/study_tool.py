"""What makes a study an executable: its table, its text for --help, and its pictures."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from bouncing_disk_ros.errors import ExitCode
from bouncing_disk_ros.nodes.start import Start
from bouncing_disk_ros.parameters import Spec, Value

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
        start = Start(self.name, self.about, self.table, self.example, args, ExitCode.INTERRUPTED)
        start.parse()
        with start.stop.importing():
            from bouncing_disk_ros.nodes.study_node import StudyNode
            from bouncing_disk_ros.ros.spin import run_node

        make = partial(StudyNode, self)
        return run_node(self.name, start.ros, make, StudyNode.present, start.stop)
