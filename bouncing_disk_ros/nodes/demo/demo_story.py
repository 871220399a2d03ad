"""The story of the demonstration: where it starts, what is said of it, how it ends."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from bouncing_disk_ros import parameters
from bouncing_disk_ros.command_line.start import check_figure_file
from bouncing_disk_ros.core.model import Disk, MotionInForce
from bouncing_disk_ros.errors import ExitCode, FailedError
from bouncing_disk_ros.maps.scales import axial_forcing_of
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.report.run_record import RunRecord
from bouncing_disk_ros.report.run_summary import Summary, lines, summary_of
from bouncing_disk_ros.run.presets import AT_REST, load_preset
from bouncing_disk_ros.run.programmes import FIRST_TOSS

PRESET = "pizza_multiple_toss"
SETTLING_SECONDS = 12.0
"""So long after the programme's beginning the orbit must have been found."""
OPENING = f"A disk at rest on its platform (preset {PRESET}). Programme: {FIRST_TOSS}."


def start_values() -> dict[str, Value]:
    """The parameters of the start."""
    return parameters.complete({**load_preset(PRESET), **AT_REST})


def picture_of(chosen: Mapping[str, Value]) -> Path:
    """The file of the picture; InputError for a kind that cannot be drawn."""
    picture = Path(str(chosen["picture"]))
    check_figure_file("picture", picture)
    return picture


def change_text(motion: MotionInForce, disk: Disk) -> str:
    """What a change of the platform's motion is called."""
    target = motion.target
    if target.axial_amplitude == 0.0:
        return "the platform is brought to rest"
    shape = "helical" if target.phase_lag == 0.0 else "semi-elliptical"
    return (
        f"the platform changes to a {shape} motion: A {1e3 * target.axial_amplitude:.1f} mm, "
        f"Φ {target.angular_amplitude:.3f} rad, θ {target.phase_lag:.3f} rad, "
        f"Γ {axial_forcing_of(target, disk):.3f}"
    )


def show_summary(record: RunRecord, picture: Path) -> Summary:
    """Print the summary and draw the picture."""
    from bouncing_disk_ros.matplotlib_figures import save_picture
    from bouncing_disk_ros.report.run_picture import run_picture

    summary = summary_of(record)
    known = [line for line in lines(summary) if "nan" not in line.split()]
    print("\nSummary\n" + "\n".join(known), flush=True)
    title = "From rest to the period-1 orbit: a helical toss, then the semi-elliptical motion"
    save_picture(run_picture(record, title), picture)
    print(f"Picture: {picture}", flush=True)
    return summary


def verdict(summary: Summary, duration: float) -> int:
    """Say whether the orbit is the one that the programme is for; the exit code."""
    if summary.orbit.is_period_one:
        print("Verified: the orbit found is period-1.", flush=True)
        return ExitCode.DONE
    found = f"the orbit found is {summary.orbit.name}, not period-1"
    if summary.inputs > 1:
        others = summary.inputs - 1
        print(f"Not verified: {found}; other nodes sent {others} input(s).", flush=True)
        return ExitCode.DONE
    if duration < SETTLING_SECONDS and not summary.orbit.impacts:
        print(f"Not verified: {found}; {duration:g} s are too short to reach it.", flush=True)
        return ExitCode.DONE
    raise FailedError(found)
