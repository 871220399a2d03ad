"""The log of refusals: one line a second for each reason, and nothing uncounted."""

from __future__ import annotations

import re

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.limits import REASONS
from bouncing_disk_ros.run.throttled_log import RefusalLog


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


def made() -> tuple[RefusalLog, list[str], Clock]:
    lines: list[str] = []
    clock = Clock()
    return RefusalLog(lines.append, clock), lines, clock


def test_a_flood_is_a_line_a_second_that_counts_the_rest() -> None:
    log, lines, clock = made()
    for number in range(3000):
        log.note(error(given=number))
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
        log.note(error("amplitude"))
        log.note(error(f"platform/command points[{number}] frequency (Hz)"))
    assert len(lines) == 2


def test_reasons_without_end_are_counted_together() -> None:
    log, lines, clock = made()
    for number in range(10 * REASONS):
        log.note(error(f"field {number}"))
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
        log.note(InputError("field", 1, "2", hint))
    assert len(hints) == 1
