"""The executable of a study: its options, its text for --help, its start."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from bouncing_disk_ros.environment import ros_is_here
from bouncing_disk_ros.errors import ExitCode
from bouncing_disk_ros.kernel_cache import announce_compilation
from bouncing_disk_ros.parameters import Spec
from bouncing_disk_ros.ros.ros_arguments import RosArguments
from bouncing_disk_ros.ros.startup import Start, option_values, run_without_ros
from bouncing_disk_ros.study.study_view import StudyView
from bouncing_disk_ros.study_tables import LISTS, refuse_not_taken, table_of


@dataclass(frozen=True)
class StudyTool:
    """The executable of a study; `make_view` imports what it needs when it is called."""

    name: str
    about: str
    example: str
    make_view: Callable[[], StudyView[Any]]

    @property
    def table(self) -> Mapping[str, Spec]:
        """The options: those of the study, and those of all studies."""
        return table_of(self.name)

    def main(self, args: Sequence[str] | None = None) -> int:
        """Run; exit code 0 done, 1 failed, 2 bad input, 130 interrupted (what is done is kept)."""
        code = ExitCode.INTERRUPTED
        start = Start(self.name, self.about, self.table, self.example, args, code, needs_ros=False)
        start.parse()
        if not ros_is_here():
            return run_without_ros(self.name, partial(self._run_without_ros, start))
        with start.stop.importing():
            announce_compilation(self.name)
            from bouncing_disk_ros.ros.spin import run_node
            from bouncing_disk_ros.study.study_node import StudyNode

        make = partial(StudyNode, self.name, self.table, self.make_view)
        return run_node(self.name, start.ros, make, StudyNode.present, start.stop)

    def _run_without_ros(self, start: Start) -> int:
        overrides = RosArguments(start.ros, self.name).overrides
        refuse_not_taken(self.name, overrides)
        values = option_values(overrides, self.table, LISTS)
        with start.stop.importing():
            announce_compilation(self.name)
            from bouncing_disk_ros.study.study_work import run_study

        return run_study(
            self.name, self.table, values, set(overrides), self.make_view(), start.stop
        )
