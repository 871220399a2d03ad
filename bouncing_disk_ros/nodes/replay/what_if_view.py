"""The part of `replay` that shows a recorded run and a changed one over each other."""

from __future__ import annotations

from pathlib import Path

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.nodes.replay.bag_streams import Recorded, ReplayedBag
from bouncing_disk_ros.nodes.replay.replay_text import comparison_lines
from bouncing_disk_ros.regular_file import replaced
from bouncing_disk_ros.report.run_comparison import Shown
from bouncing_disk_ros.run.changed_run import Changes, what_if
from bouncing_disk_ros.run.run_pair import Trace
from bouncing_disk_ros.units import NS


def compare(
    recorded: Recorded, found: ReplayedBag, changes: Changes, number: int | None,
    figure: Path | None,
) -> None:  # fmt: skip
    """Print how a run of the bag and the changed one compare, and draw both.

    Raises InputError when `number` names no run of the bag that can be replayed, or is needed.
    """
    number = _chosen(found, number)
    end_ns = found.runs[number - 1].end_ns
    runs = what_if(recorded.run(number).records, changes, end_ns)
    first, second = _shown("recorded", runs.first), _shown(changes.label, runs.second)
    print("\n".join(comparison_lines(runs, first, second)))
    if figure is not None:
        from bouncing_disk_ros.folders import use_matplotlib_folder

        use_matplotlib_folder()
        from bouncing_disk_ros.report.comparison_picture import two_runs_picture
        from bouncing_disk_ros.report.run_picture import save_picture

        diverged = None if runs.divergence_time_ns is None else runs.divergence_time_ns / NS
        title = f"{recorded.bag.path.name}: what if {changes.label}"
        picture = two_runs_picture(first, second, diverged, title)
        replaced(figure, lambda path: save_picture(picture, path), "--figure")
        print(f"figure: {figure}")


def _chosen(found: ReplayedBag, number: int | None) -> int:
    able = [n for n, run in enumerate(found.runs, 1) if run.start_ns is not None]
    if number is None and len(able) == 1:
        return able[0]
    if number not in able:
        given = "none, but the bag holds several runs" if number is None else number
        raise InputError("--run", given, "one of " + ", ".join(map(str, able)))
    return number


def _shown(label: str, trace: Trace) -> Shown:
    return Shown(label, trace.impacts, trace.rows, trace.samples, trace.detail, trace.rotor_speed,
                 trace.steady_since)  # fmt: skip
