"""A run cut into segments: where its motion is steady and nothing else drives it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from bouncing_disk_ros.core.model import IMPACT_DTYPE, Disk, Motion, MotionInForce
from bouncing_disk_ros.report.run_record import UNKNOWN_DISK, Change, RunRecord
from bouncing_disk_ros.report.spans import FIRST, Segment, known, spans_of
from bouncing_disk_ros.report.spans import segments_of as segments_of_record

NS = 1_000_000_000
SLOW, FAST = Motion(0.01, 0.0, 3.0, 0.0), Motion(0.02, 0.5, 3.0, 0.0)
SOFT = Disk(0.25, 0.5, 0.6, 0.12, 0.1, 9.81)
HARD = SOFT._replace(restitution=0.8)


def steady(at: float, motion: Motion) -> MotionInForce:
    return MotionInForce(round(at * NS), round(at * NS), motion, motion, 0, 0.0)


def fade(begin: float, end: float, start: Motion, target: Motion) -> MotionInForce:
    return MotionInForce(round(begin * NS), round(end * NS), start, target, 0, 0.0)


def segments_of(motions: list[MotionInForce], begin: float = 0.0, **known: Any) -> list[Segment]:
    return segments_of_record(RunRecord(UNKNOWN_DISK, motions=motions, **known), begin, 9.0)


MOTIONS = [steady(0.0, SLOW), fade(4.0, 5.0, SLOW, FAST), steady(5.0, FAST)]


def test_times_of_segments_about_fades() -> None:
    """A fade at once after another leaves none between them; a bag may begin within a fade."""
    motions = [*MOTIONS[:2], fade(5.0, 6.0, FAST, SLOW), steady(6.0, SLOW)]
    for found, times in (
        (segments_of(motions), [(0.0, 4.0), (6.0, 9.0)]),
        (segments_of(MOTIONS[1:], 4.5), [(5.0, 9.0)]),
    ):
        assert [(row.begin, row.end) for row in found] == times
    assert segments_of(MOTIONS[:2]) == segments_of(MOTIONS), "the end of a fade was not heard"


def test_what_is_not_recorded_is_not_known() -> None:
    """Records lost in between, and a motion that does not lead on to the next one."""
    span = ((0.0, 2.0), (6.0, math.inf))
    found = segments_of(MOTIONS, disks=[(0.0, SOFT), (6.0, HARD)], known=[*span])
    assert [(row.begin, row.end, row.motion, known(row.disk)) for row in found] == [
        (0.0, 2.0, SLOW, True), (2.0, 4.0, None, False), (5.0, 6.0, None, False),
        (6.0, 9.0, FAST, True),
    ]  # fmt: skip
    lost = [steady(0.0, SLOW), steady(5.0, FAST)]
    assert [row.motion for row in segments_of(lost)] == [None, FAST]
    again = [steady(0.0, SLOW), steady(5.0, SLOW)]
    found = segments_of(again)
    assert [(row.began_by, row.motion) for row in found] == [
        (FIRST, SLOW), ("change of motion or reset", SLOW)
    ]  # fmt: skip


def test_a_reset_is_told_as_one_where_nothing_else_can_have_been() -> None:
    """Without disk/inputs: what ends a cross-fade before its time; else it may have been a fade."""
    words = [
        segments_of(motions)[-1].began_by
        for motions in (
            [*MOTIONS[:2], steady(4.5, SLOW)], [*MOTIONS[:2], steady(4.5, FAST)],
            [steady(0.0, SLOW), steady(4.5, FAST)], [*MOTIONS[:2], steady(7.0, SLOW)], MOTIONS,
        )
    ]  # fmt: skip
    either = "change of motion or reset"
    assert words == ["reset", "reset", either, either, "change of motion"]


def test_a_span_says_from_when_on_the_ledger_counts() -> None:
    changes = [Change(3.0, "reset"), Change(5.0, "parameters")]
    record = RunRecord(SOFT, changes=changes, known=[(0.0, 8.0), (9.0, math.inf)])
    record.speeds += [(0.0, 1.0), (12.0, 1.0)]
    spans = spans_of(record, np.zeros(0, IMPACT_DTYPE))
    assert [spans.origin(time) for time in (2.0, 4.0, 8.5, 10.0)] == [0.0, 3.0, None, None]
    assert [spans.unchanged_since(time) for time in (2.0, 4.0, 6.0, 8.5, 10.0)] == [
        0.0, 3.0, 5.0, math.inf, 9.0
    ]  # fmt: skip
    assert spans.knows_inputs(1.0, 7.0)
    assert not spans.knows_inputs(1.0, 9.5)
    assert spans.reset_within(2.0, 3.0)
    assert not spans.reset_within(3.0, 4.0)
