"""The health report: levels, factors and percentiles; and the log of refusals, a line a second."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from bouncing_disk_ros.core.model import Energy
from bouncing_disk_ros.core.schedule import Pending
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.limits import REASONS
from bouncing_disk_ros.run.health import STATES, Health, Level, Reading, Ticks, run_values
from bouncing_disk_ros.run.throttled_log import ThrottledLog
from bouncing_disk_ros.units import NS

BOOKS = Energy._make([0.0] * 11 + [1e-15, 1.0])
FIRST = Reading(0, 0, 0, 0, 0, 0, BOOKS, "running", 1.0, 0)
TICKS = {"ticks": 100.0, "p50": 1e-4, "p99": 2e-4, "max": 3e-4}


def report(
    now: Reading, health: Health | None = None
) -> dict[str, tuple[Level, str, dict[str, str]]]:
    rows = (health or Health()).report(now, TICKS)
    return {row.task: (row.level, row.message, dict(row.values)) for row in rows}


def test_a_good_second_is_ok() -> None:
    health = Health()
    report(FIRST, health)
    rows = report(replace(FIRST, steady_ns=NS, simulated_ns=NS, rows=40_000), health)
    assert all(level is Level.OK for level, _, _ in rows.values())
    assert rows["real time"][2]["real_time_factor reached"] == "1"
    assert rows["real time"][2]["lateness p99 (s)"] == "0.000200"
    assert rows["impacts"][1] == "40000 rows/s"
    rows = report(replace(FIRST, steady_ns=2 * NS, simulated_ns=NS // 2), health)  # another run
    assert rows["real time"][2]["real_time_factor reached"] == "0"


@pytest.mark.parametrize(
    ("lag", "level"),
    [(0.0, Level.OK), (0.099, Level.OK), (0.1, Level.WARN), (0.99, Level.WARN), (1.0, Level.ERROR)],
)
def test_falling_behind_is_said(lag: float, level: Level) -> None:
    row = report(replace(FIRST, lag_ns=round(lag * NS)))["real time"]
    assert row[0] is level
    assert ("behind" in row[1]) == (level is not Level.OK)


def test_skipped_samples_are_a_warning_until_no_more_are_skipped() -> None:
    health = Health()
    level, message, values = report(replace(FIRST, skipped=4600), health)["real time"]
    assert level is Level.WARN
    assert message == "running, 4600 samples of joint_states skipped: lower state_rate"
    assert values["samples skipped"] == "4600"
    assert report(replace(FIRST, skipped=4600), health)["real time"][0] is Level.OK
    assert report(replace(FIRST, skipped=4601), health)["real time"][0] is Level.WARN
    assert report(FIRST, health)["real time"][0] is Level.OK  # a new run counts from 0


@pytest.mark.parametrize(
    ("change", "task", "level", "said"),
    [
        ({"skipped": 4600, "factor": 0.0}, "real time", Level.OK, "running"),
        ({"skipped": 4600, "state": "stepping"}, "real time", Level.OK, "stepping"),
        ({"skipped": 1, "lag_ns": 2 * NS}, "real time", Level.ERROR, "2 s behind"),
        ({"energy": BOOKS._replace(residual=1e-6)}, "energy", Level.ERROR, "residual 1e-06"),
        ({"energy": None}, "energy", Level.OK, "no run"),
        ({"other_publishers": 1}, "inputs", Level.WARN, "another node publishes platform/motion"),
        (
            {"other_clock": True},
            "real time",
            Level.WARN,
            "running; another node publishes /clock: ",
        ),
    ],
)
def test_one_reading_has_its_level_and_words(
    change: dict[str, Any], task: str, level: Level, said: str
) -> None:
    found = report(replace(FIRST, **change))[task]
    assert found[0] is level
    assert said in found[1]


def test_commands_lost_on_the_way_are_a_warning_until_no_more_are_lost() -> None:
    health = Health()
    row = report(replace(FIRST, lost=3), health)["inputs"]
    assert row[0] is Level.WARN
    assert "3 commands were lost on the way" in row[1]
    assert row[2]["commands lost on the way"] == "3"
    row = report(replace(FIRST, lost=3, uncertain=["platform/command"]), health)["inputs"]
    assert row[0] is Level.OK
    assert row[2]["commands lost on the way"] == (
        "at least 3: several publishers on platform/command"
    )


def test_lateness_is_told_by_percentiles_since_the_last_call() -> None:
    ticks = Ticks()
    for late in (0, 0, 3, 0, 7, 40, 0):
        ticks.note(late)
    taken = ticks.take()
    assert taken == pytest.approx({"ticks": 7.0, "p50": 0.0, "p99": 38.02 / NS, "max": 40 / NS})
    assert ticks.take() == {"ticks": 0.0}


def test_what_is_pending_is_shown_and_refusals_are_counted_with_the_last_reason() -> None:
    assert report(FIRST)["inputs"][2]["pending"] == "none"
    pending = Pending(motions=2, impulses=0, waiting=1, next_ns=5 * NS)
    row = report(replace(FIRST, pending=pending))["inputs"]
    assert row[2]["pending"] == "2 motion(s), 1 waiting, the first at 5.000000000 s"
    row = report(replace(FIRST, pending=Pending(trajectories=3, next_ns=NS)))["inputs"]
    assert row[2]["pending"] == "3 offset(s), the first at 1.000000000 s"
    health = Health()
    health.count_refusal(InputError("first", 1, "2"))
    health.count_refusal(InputError("second", 1, "2"))
    row = report(FIRST, health)["inputs"]
    assert row[2]["refused"] == "2"
    assert row[2]["last refusal"] == "second: got 1, allowed: 2"


def test_a_reading_as_named_numbers() -> None:
    pending = Pending(motions=2, impulses=3, waiting=1, next_ns=5 * NS, trajectories=4)
    now = replace(FIRST, pending=pending, motion_index=7, rows=40, lost=2, state="stepping")
    values = run_values(now, refused=9)
    assert values["state"] == 4.0
    assert (values["motion_index"], values["refused_inputs"], values["lost_commands"]) == (7, 9, 2)
    assert (values["pending_motions"], values["pending_impulses"]) == (2, 3)
    assert values["next_input_time"] == 5.0
    assert (list(values)[26], values["pending_trajectories"]) == ("pending_trajectories", 4.0)
    assert values["energy_throughput"] == BOOKS.throughput
    empty = run_values(replace(now, energy=None, pending=Pending()), refused=9)
    assert list(empty) == list(values)
    assert math.isnan(empty["energy_residual"])
    assert math.isnan(empty["next_input_time"])


def test_the_page_lists_the_named_numbers_in_their_order() -> None:
    page = (Path(__file__).resolve().parents[3] / "docs" / "interfaces.md").read_text("utf-8")
    section = page.split("## The state of a run")[1].split("\n## ")[0]
    rows = [row.split("|")[1:3] for row in section.splitlines() if row.startswith("| ")][1:]
    names = [name for _, cell in rows for name in re.findall(r"`(\w+)`", cell)]
    assert names == list(run_values(FIRST, refused=0))
    for indices, cell in rows:
        first = int(re.split(r"\D", indices.strip())[0])
        assert names[first] == re.findall(r"`(\w+)`", cell)[0]
    for number, state in enumerate(STATES):
        assert f"{number} {state}" in section


# --- the log of refusals --------------------------------------------------------------------------
class Clock:
    """Seconds, set by hand."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


def error(field: str = "frequency", given: object = 0) -> InputError:
    return InputError(field, given, "more")


def total(lines: list[str]) -> int:
    """Refusals that lines tell of."""
    more = [re.search(r"and (\d+) more", line) for line in lines]
    return len(lines) + sum(int(match[1]) for match in more if match)


def made() -> tuple[ThrottledLog, list[str], Clock]:
    lines: list[str] = []
    clock = Clock()
    return ThrottledLog(lines.append, clock), lines, clock


def test_a_flood_is_a_line_a_second_that_counts_the_rest() -> None:
    log, lines, clock = made()
    for number in range(3000):
        log.note_refusal(error(given=number))
        clock.now += 1e-3
    assert len(lines) == 3
    assert lines[0] == "refused: frequency: got 0, allowed: more"
    assert lines[1].startswith("refused: frequency: got 1000, allowed: more (and 999 more")
    clock.now += 1.0
    log.flush()
    log.flush()
    assert lines[3].startswith("refused: frequency: got 2999")
    assert len(lines) == 4
    assert total(lines) == 3000


def test_each_reason_has_its_own_second_and_the_index_of_a_point_is_none() -> None:
    log, lines, _ = made()
    for number in range(50):
        log.note_refusal(error("amplitude"))
        log.note_refusal(error(f"platform/command points[{number}] frequency (Hz)"))
    assert len(lines) == 2


def test_reasons_without_end_are_counted_together() -> None:
    log, lines, clock = made()
    for number in range(10 * REASONS):
        log.note_refusal(error(f"field {number}"))
    assert len(lines) == REASONS + 1
    clock.now += 1.0
    log.flush()
    assert total(lines) == 10 * REASONS


def test_a_line_is_made_only_when_it_is_logged() -> None:
    log, _, _ = made()
    hints = []

    def hint() -> str:
        hints.append(1)
        return "Do this."

    for _ in range(100):
        log.note_refusal(InputError("field", 1, "2", hint))
    assert len(hints) == 1
