"""What is known of a run, and what a page shows of it frame by frame."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from std_msgs.msg import String

from bouncing_disk_ros import parameters
from bouncing_disk_ros.core.model import IMPACT_DTYPE, ImpactKind, Motion, MotionInForce
from bouncing_disk_ros.report.run_record import UNKNOWN_DISK, RunRecord
from bouncing_disk_ros.report.run_record_builder import Parsed, RunRecordBuilder
from bouncing_disk_ros.ros.to_messages import impacts_to_msg
from bouncing_disk_ros.run.session import Session
from bouncing_disk_ros.units import NS
from bouncing_disk_ros.workbench.history_reader import HistoryReader
from bouncing_disk_ros.workbench.run_history import KEPT_CHANGES, SAMPLE_DTYPE, RunHistory, Timeline
from bouncing_disk_ros.workbench.run_view import RunView

STILL, FAST = Motion(0.0, 0.0, 3.0, 0.0), Motion(0.1, 0.5, 4.0, 0.2)


def samples(*times: float) -> NDArray[np.void]:
    return np.array([(time, 0.1, 0.0, 1.0, 2.0, 3.0) for time in times], SAMPLE_DTYPE)


def impacts(*times: float, count: int = 1) -> NDArray[Any]:
    found = np.zeros(len(times), IMPACT_DTYPE)
    found["time"], found["count"], found["forcing_phase"] = times, count, 1.0
    found["axial_impact_velocity"] = -0.5
    return found


def steady(motion: Motion, begin: float) -> MotionInForce:
    return MotionInForce(round(begin * NS), round(begin * NS), motion, motion, 0, 0.0)


def test_a_timeline_says_what_held_when() -> None:
    line: Timeline[str] = Timeline()
    assert line.at(1.0) is None
    assert line.since(1.0) == -math.inf
    for time in range(2 * KEPT_CHANGES):
        line.add(float(time), f"from {time}")
    assert line.at(KEPT_CHANGES + 10.5) == f"from {KEPT_CHANGES + 10}"
    assert line.since(KEPT_CHANGES + 10.5) == KEPT_CHANGES + 10.0
    assert len(line.items) == KEPT_CHANGES
    assert line.at(-1.0) == f"from {KEPT_CHANGES}", "before all of them: the first that is kept"


def test_frames_bring_what_is_new_and_only_that() -> None:
    history = RunHistory()
    view = RunView(history, path_seconds=2.0)
    history.add_motion(steady(STILL, 0.0))
    history.add_samples(samples(0.0, 1.0, 2.0, 3.0))
    history.add_impacts(impacts(0.5, 2.5))
    first = view.frame()
    assert first.clear
    assert first.samples["time"].tolist() == [2.0, 3.0], "the path's seconds"
    assert first.points["time"].tolist() == [0.5, 2.5]
    assert view.frame().is_empty
    history.add_samples(samples(4.0))
    second = view.frame()
    assert (second.clear, second.clear_section) == (False, False)
    assert second.samples["time"].tolist() == [4.0]
    assert len(second.points) == 0


def test_the_section_begins_anew_with_another_motion_disk_or_start() -> None:
    history = RunHistory()
    view = RunView(history)
    history.add_samples(samples(0.0, 1.0))
    history.add_impacts(impacts(0.5))
    view.frame()
    history.add_motion(steady(FAST, 1.0))
    assert view.frame().clear_section
    history.add_values(2.0, {"restitution": 0.3})
    assert view.frame().clear_section
    history.add_values(2.5, {"restitution": 0.3})
    assert not view.frame().clear_section, "nothing has changed"
    history.add_record({"kind": "reset", "index": 7, "time_ns": 3 * NS})
    history.add_impacts(impacts(2.9, 3.5))
    frame = view.frame()
    assert frame.clear_section
    assert frame.points["time"].tolist() == [3.5]


def test_a_page_may_go_back_in_a_recorded_run() -> None:
    history = RunHistory()
    history.add_motion(steady(STILL, 0.0))
    history.add_motion(steady(FAST, 5.0))
    history.add_values(0.0, {"restitution": 0.4})
    history.add_values(6.0, {"restitution": 0.6})
    history.add_samples(samples(*range(10)))
    view = RunView(history, path_seconds=3.0)
    late = view.frame(7.5)
    assert late.pose is not None
    assert late.pose["time"] == 7.0
    assert late.values["restitution"] == 0.6
    assert late.values["axial_amplitude"] == FAST.axial_amplitude
    early = view.frame(4.0)
    assert early.clear
    assert early.samples["time"].tolist() == [2.0, 3.0, 4.0]
    assert early.values["restitution"] == 0.4
    assert early.values["axial_amplitude"] == STILL.axial_amplitude


def test_sums_of_impacts_are_no_points_and_what_no_simulator_says_is_left_out_with_a_notice() -> (
    None
):
    history = RunHistory()
    chatter = impacts(1.0, count=8)
    chatter["kind"] = ImpactKind.CHATTER_TAIL
    history.add_impacts(chatter)
    assert history.impacts_seen == 8
    assert len(history.points) == 0
    hear = HistoryReader(history).handlers
    wrong = impacts(1.0)
    wrong["axial_impact_velocity"] = math.nan
    for _ in range(2):
        hear["disk/inputs"](String(data="{}"))
        hear["disk/impacts"](impacts_to_msg(wrong, 0))
    assert [one.text.partition(":")[0] for one in history.notices_after(0)] == [
        "disk/inputs", "disk/impacts",
    ]  # fmt: skip
    assert len(history.points) == 0
    hear["disk/impacts"](impacts_to_msg(impacts(1.0), 0))
    assert len(history.points) == 1


def records_of_a_slowed_run() -> tuple[dict[str, Any], dict[str, Any]]:
    """Its first snapshot, and the record of a factor of 0.1 set at 20 s."""
    found: list[dict[str, Any]] = []
    session = Session(parameters.complete({}), found.append, paused=True)
    session.set_parameters({"real_time_factor": 0.1})
    return found[0], {**found[1], "time_ns": 20 * NS}


SNAPSHOT, SLOWER = records_of_a_slowed_run()
RECORDS = [("disk/inputs", Parsed(0, SNAPSHOT, 1)), ("disk/inputs", Parsed(0, SLOWER, 2))]
MOTION = ("platform/motion", Parsed(-180 * NS, steady(STILL, 0.0), 3))  # published after SLOWER
SPEED = ("disk/rotor_speed", Parsed(40 * NS, 5.0, 4))


@pytest.mark.parametrize("knows_sending", [True, False])
def test_times_do_not_depend_on_which_latched_message_comes_first(knows_sending: bool) -> None:
    """With the motion before the newest parameters, times had the factor before it."""
    for place in range(3):
        history, record = RunHistory(), RunRecord(UNKNOWN_DISK)
        readers = HistoryReader(history), RunRecordBuilder(record)
        for short, parsed in (*RECORDS[:place], MOTION, *RECORDS[place:], SPEED):
            for reader in readers:
                reader.take(short, parsed if knows_sending else parsed._replace(sent_ns=0))
        assert history.speeds.rows["time"].tolist() == [22.0]
        assert record.speeds == [(22.0, 5.0)]


def test_a_speed_sent_before_new_parameters_is_placed_by_those_before_them() -> None:
    history = RunHistory()
    reader = HistoryReader(history)
    first = ("platform/motion", Parsed(0, steady(STILL, 0.0), 1))
    speed = ("disk/rotor_speed", Parsed(19 * NS, 5.0, 1))
    for message in (first, *RECORDS, speed, MOTION, SPEED):
        reader.take(*message)
    assert history.speeds.rows["time"].tolist() == [19.0, 22.0]


def test_a_motion_sent_after_the_first_record_of_a_run_is_of_that_run() -> None:
    """With the motion before the record the page lost it, up to the next motion."""
    begun = ("platform/motion", Parsed(0, steady(FAST, 5.0), 9))
    for messages in ([begun, RECORDS[0]], [RECORDS[0], begun]):
        history = RunHistory()
        reader = HistoryReader(history)
        for message in (("disk/inputs", Parsed(0, {**SNAPSHOT, "index": 4}, 1)), *messages):
            short, parsed = message
            reader.take(short, parsed._replace(sent_ns=parsed.sent_ns + 4))
        assert history.motion_at() == FAST
        history.add_record(SNAPSHOT)
        assert history.motion_at() is None, "of a run that has ended"


def test_a_new_run_is_noticed_by_its_records_and_by_its_times() -> None:
    history = RunHistory()
    view = RunView(history)
    history.add_motion(steady(FAST, 3.0))
    snapshot = {"kind": "snapshot", "index": 0, "time_ns": 0, "parameters": {"restitution": 0.5}}
    history.add_record(snapshot)
    history.add_samples(samples(8.0, 9.0))
    view.frame()
    history.add_motion(steady(STILL, 0.0))  # of the new run; it may come first
    history.add_record({**snapshot, "parameters": {"restitution": 0.2}})
    assert history.motion_at() == STILL
    assert history.own_values()["restitution"] == 0.2
    history.add_samples(samples(0.0))
    frame = view.frame()
    assert frame.clear
    assert frame.samples["time"].tolist() == [0.0]
    history.add_samples(samples(5.0))
    history.add_samples(samples(1.0))
    assert view.frame().samples["time"].tolist() == [1.0], "time fell"
