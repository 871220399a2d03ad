"""The demonstration where there is no ROS: the same story simulated in this process, no bag."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from bouncing_disk_ros.command_line.start import option_values
from bouncing_disk_ros.core.model import Disk
from bouncing_disk_ros.nodes.demo.demo_story import (
    OPENING,
    change_text,
    picture_of,
    show_summary,
    start_values,
    verdict,
)
from bouncing_disk_ros.parameters import Spec, Value
from bouncing_disk_ros.report.run_record import RunRecord, State
from bouncing_disk_ros.report.run_record_builder import Impacts, Parsed, RunRecordBuilder
from bouncing_disk_ros.run.programmes import FIRST_TOSS, load_programme, start_of
from bouncing_disk_ros.run.session import Session
from bouncing_disk_ros.run.simulate import Result, simulate
from bouncing_disk_ros.units import NS


def present_without_ros(table: Mapping[str, Spec], given: Mapping[str, object]) -> int:
    """Simulate the story, show it, draw it; the exit code. `given`: its options."""
    chosen = option_values(given, table)
    picture, duration = picture_of(chosen), float(chosen["duration"])
    print(
        f"{OPENING}\nWithout ROS: simulated in this process at once, and not recorded.", flush=True
    )
    record = _record_of(_simulated(start_values(), duration))
    for motion in record.motions:
        if motion.begin_ns < motion.end_ns:
            print(f"{motion.begin_ns / NS:6.2f} s  {change_text(motion, record.disk)}")
    return verdict(show_summary(record, picture), duration)


def _simulated(values: Mapping[str, Value], duration: float) -> Result:
    """The run of the programme, which begins when the platform's phase is as it asks."""
    at_rest = Session(values, lambda _: None).simulation.motion_in_force
    begin = start_of(load_programme(FIRST_TOSS), at_rest, 0) / NS
    rate = float(values["state_rate"])
    given: dict[str, Any] = dict(values)
    return simulate(begin + duration, programme=FIRST_TOSS, sample_rate=rate, **given)


def _record_of(run: Result) -> RunRecord:
    """The run as a record, as the topics of a simulator would give it."""
    record = RunRecord(Disk.of(run.parameters))
    builder = RunRecordBuilder(record)
    for one in run.inputs:
        builder.take("disk/inputs", Parsed(0, one))
    builder.take("disk/impacts", Parsed(0, Impacts(run.impacts, ())))
    samples, times = run.samples, run.samples["time_ns"] / NS
    names = ("axial_position", "platform_position", "angular_velocity")
    record.states += map(State, times, *(samples[name] for name in names))
    ratio = float(run.parameters["state_rate"]) / float(run.parameters["rotor_speed_rate"])
    angles, times = run.unwrapped_angle[:: round(ratio)], times[:: round(ratio)]
    record.speeds += zip(times[1:], np.diff(angles) / np.diff(times), strict=True)
    return record
