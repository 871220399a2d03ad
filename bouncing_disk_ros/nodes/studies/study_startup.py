"""How a study begins: command line, then the slow imports, then its node."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from bouncing_disk_ros.errors import ExitCode
from bouncing_disk_ros.nodes.shared.startup import Start
from bouncing_disk_ros.nodes.studies.study_view import StudyTool


def run_study(tool: StudyTool, args: Sequence[str] | None = None) -> int:
    """Run; exit code 0 done, 1 failed, 2 bad input, 130 interrupted (what is done is kept)."""
    start = Start(tool.name, tool.about, tool.table, tool.example, args, ExitCode.INTERRUPTED)
    start.parse()
    with start.stop.importing():
        from bouncing_disk_ros.nodes.studies.study_node import StudyNode
        from bouncing_disk_ros.ros.spin import run_node

    make = partial(StudyNode, tool)
    return run_node(tool.name, start.ros, make, StudyNode.present, start.stop)
