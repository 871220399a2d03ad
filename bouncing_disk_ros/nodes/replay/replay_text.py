"""What a replay found, and how two runs compare, as lines for people and as a picture."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

import bouncing_disk_ros
from bouncing_disk_ros.errors import InputError, counted
from bouncing_disk_ros.report.orbit import orbit_of
from bouncing_disk_ros.run.input_replay import Gap
from bouncing_disk_ros.units import NS

if TYPE_CHECKING:
    from bouncing_disk_ros.nodes.replay.bag_streams import Recorded, ReplayedBag
    from bouncing_disk_ros.run.replay import Replay
    from bouncing_disk_ros.run.what_if import Changes, Trace, TwoRuns


def run_lines(number: int, run: Replay) -> list[str]:
    """One run of a bag."""
    if run.start_ns is None:
        rows = f", {run.not_compared} rows" if run.not_compared else ""
        return [f"run {number}: {run.records} records without a snapshot{rows}: not replayed"]
    build = f"version {run.version or 'unknown'}"
    if run.is_other_build:
        build += f" (this is {bouncing_disk_ros.__version__}: another build)"
    span = f"{run.start_ns / NS:.3f} s to {run.end_ns / NS:.3f} s of simulated time"
    lines = [
        f"run {number}: {span}, recorded by {build}",
        f"  {run.records} records, {run.snapshots} snapshots in mid-run equal",
        f"  {run.impacts} impacts in {run.rows} rows equal, {run.missing} rows missing in the bag",
    ]
    if run.first_row:
        lines.append(f"  the bag begins with row {run.first_row}")
    if run.not_compared:
        lines.append(f"  {run.not_compared} rows not compared: they are from before the first "
                     "snapshot, or from after a lost record")  # fmt: skip
    return lines + [_gap_line(gap) for gap in run.gaps]


def _gap_line(gap: Gap) -> str:
    if gap.first == gap.last:
        missing = f"record {gap.first} is missing"
    else:
        missing = f"records {gap.first} to {gap.last} are missing"
    after = "no snapshot follows" if gap.until_ns is None else (
        f"replayed again from the snapshot at {gap.until_ns / NS:.3f} s"
    )  # fmt: skip
    return f"  {missing} after {gap.from_ns / NS:.3f} s; {after}"


def verdict(found: ReplayedBag) -> str:
    """The last line of a replay; a comparison of what if follows it."""
    if found.identical:
        rest = f", {counted(found.not_compared, 'row')} not compared" if found.not_compared else ""
        return f"replay identical: {found.impacts} impacts{rest}"
    differing = [(n, run) for n, run in enumerate(found.runs, 1) if run.difference is not None]
    if not differing:
        names = ", ".join(dict.fromkeys(name for run in found.runs for name in run.other_fields))
        return f"replay equal in what was compared: {found.impacts} impacts without {names}"
    number, run = differing[0]
    of_run = f"run {number}, " if len(found.runs) > 1 else ""
    if run.is_other_build:
        ours = bouncing_disk_ros.__version__
        return (
            f"replay differs, another build (recorded by {run.version}, this is {ours}; "
            f"that is no other physics): {of_run}{run.difference}"
        )
    return f"replay differs: {of_run}{run.difference}"


def comparison_lines(runs: TwoRuns, label: str) -> list[str]:
    """The recorded run and the changed one, which `label` names, beside each other."""
    from bouncing_disk_ros.run.what_if import SPEED_SECONDS

    both = runs.first, runs.second
    rows = [
        ("", "recorded", label),
        ("impacts", *(str(one.impacts) for one in both)),
        ("orbit at the end", *(orbit_of(one.steady_rows).name for one in both)),
        (f"rotor speed, last {SPEED_SECONDS:g} s", *map(_speed, both)),
    ]
    widths = [max(len(row[column]) for row in rows) for column in range(3)]
    lines = ["  ".join(f"{c:{w}}" for c, w in zip(r, widths, strict=True)).rstrip() for r in rows]
    span = f"{runs.start_ns / NS:.3f} s to {runs.end_ns / NS:.3f} s"
    return [f"what if, {span} of simulated time:", *(f"  {line}" for line in lines), _parting(runs)]


def _speed(trace: Trace) -> str:
    return "unknown" if math.isnan(trace.rotor_speed) else f"{trace.rotor_speed:.6g} rad/s"


def _parting(runs: TwoRuns) -> str:
    divergence = runs.divergence
    if divergence is None or runs.divergence_time_ns is None:
        return _alike(runs)
    values = " and ".join(map(_value, (divergence.recorded, divergence.replayed)))
    where = f"{divergence.where}: {divergence.field} {values}"
    return f"  they differ from {runs.divergence_time_ns / NS:.9f} s on, {where}"


def _alike(runs: TwoRuns) -> str:
    """Two runs without a row that differs: then their samples tell, where there are any."""
    first, second = runs.first.samples, runs.second.samples
    rows = counted(runs.first.impacts, "impact")
    differ = np.flatnonzero(first != second)
    if len(differ):
        time = first["time_ns"][differ[0]] / NS
        return f"  they differ, though no impact does ({rows}): by samples from {time:.3f} s on"
    return f"  the two never differ: {rows} and {counted(len(first), 'sample')} are equal"


def _value(value: object) -> str:
    if value is None:
        return "no such row"
    return f"{value:.9g}" if isinstance(value, float) else str(value)


# ------------------------------------------------------------------------------------------------
# The part of `replay` that shows a recorded run and a changed one over each other.


def compare(
    recorded: Recorded, found: ReplayedBag, changes: Changes, number: int | None,
    figure: Path | None,
) -> None:  # fmt: skip
    """Print how a run of the bag and the changed one compare, and draw both.

    Raises InputError when `number` names no run of the bag that can be replayed, or is needed.
    """
    from bouncing_disk_ros.run.what_if import what_if

    number = _chosen(found, number)
    end_ns = found.runs[number - 1].end_ns
    runs = what_if(recorded.run(number).records, changes, end_ns)
    print("\n".join(comparison_lines(runs, changes.label)))
    if figure is not None:
        from bouncing_disk_ros.matplotlib_figures import save_picture
        from bouncing_disk_ros.report.comparison_picture import two_runs_picture

        title = f"{recorded.bag.path.name}: what if {changes.label}"
        picture = two_runs_picture(runs, changes.label, title)
        save_picture(picture, figure)
        print(f"figure: {figure}")


def _chosen(found: ReplayedBag, number: int | None) -> int:
    able = [n for n, run in enumerate(found.runs, 1) if run.start_ns is not None]
    if number is None and len(able) == 1:
        return able[0]
    if number not in able:
        given = "none, but the bag holds several runs" if number is None else number
        raise InputError("--run", given, "one of " + ", ".join(map(str, able)))
    return number
