"""The executable of a study: its command line, its start, with ROS and without."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

from bouncing_disk_ros.environment import ros_is_here
from bouncing_disk_ros.errors import ExitCode
from bouncing_disk_ros.kernel_cache import announce_compilation
from bouncing_disk_ros.ros.startup import Start, option_values, run_without_ros
from bouncing_disk_ros.study.study_definition import StudyDefinition


def main_of(definition: StudyDefinition) -> Callable[..., int]:
    """The function that runs a study: with the arguments of a command line, or with None.

    It returns the exit code: 0 done, 1 failed, 2 bad input, 130 interrupted (what is done is kept).
    """
    return partial(_main, definition)


def _main(study: StudyDefinition, args: Sequence[str] | None = None) -> int:
    code = ExitCode.INTERRUPTED
    start = Start(study.name, study.about, study.table, study.example, args, code, needs_ros=False)
    start.parse()
    if not ros_is_here():
        return run_without_ros(study.name, partial(_run_without_ros, study, start))
    with start.stop.importing():
        announce_compilation(study.name)
        from bouncing_disk_ros.ros.spin import run_node
        from bouncing_disk_ros.study.study_node import StudyNode

    make = partial(StudyNode, study)
    return run_node(study.name, start.ros, make, StudyNode.present, start.stop)


def _run_without_ros(study: StudyDefinition, start: Start) -> int:
    study.refuse_not_taken(start.overrides)
    values = option_values(start.overrides, study.table)
    with start.stop.importing():
        announce_compilation(study.name)
        from bouncing_disk_ros.study.study_work import run_study

    return run_study(study, values, set(start.overrides), start.stop)
