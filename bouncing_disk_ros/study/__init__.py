"""Long computations in chunks: stored as they grow, resumed, on all cores or on many machines.

A `Study` says what is computed; `run` computes what its store does not hold yet.
"""

from bouncing_disk_ros.study.definition import Arrays, Axis, Field, Region, Study
from bouncing_disk_ros.study.runner import Progress, run
from bouncing_disk_ros.study.store import export, open_result
from bouncing_disk_ros.study.study_by_name import named

__all__ = [
    "Arrays", "Axis", "Field", "Progress", "Region", "Study", "export", "named", "open_result",
    "run",
]  # fmt: skip
