"""YAML texts that version 1.1 reads as nobody means them: refused, or taken as they are meant."""

from __future__ import annotations

from typing import Any

import pytest

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.parsing import read_yaml

REFUSED = (
    "mass: 1:30",  # 90
    "gravity: 1_0",  # 10
    "gravity: 9_81.0",
    "frequency: 0o10",
    "frequency: 010",  # 8
    "frequency: 0x10",
    "frequency: 0b11",
    "mass: 1\nmass: 2",
    "mass: &a 1\nfriction: *a",
    "<<: {mass: 1}",
    "mass: !!python/name:os.system x",
)
ALREADY = {"mass: 1\nmass: 2", "mass: &a 1\nfriction: *a", "<<: {mass: 1}",
           "mass: !!python/name:os.system x", "frequency: 0o10"}  # fmt: skip
"""Those that are refused today, or are texts, which the table of parameters refuses."""
TAKEN: tuple[tuple[str, Any], ...] = (
    ("mass: 1e-3", 0.001),
    ("mass: 1.0e-3", 0.001),
    ("mass: .5", 0.5),
    ("mass: 5.", 5.0),
    ("offset_limit: .inf", float("inf")),
    ("mass: 010.5", 10.5),
    ("name: 'yes'", "yes"),
    ("date: 2026-01-31", "2026-01-31"),
)
NOT_TAKEN = {"mass: 1e-3"}
"""Read as a text today: the parser asks for a point in it."""


def cases(texts: Any, good: Any) -> list[Any]:
    mark = pytest.mark.xfail(reason="read by the rules of YAML 1.1", strict=True)
    return [pytest.param(one, id=repr(one), marks=[] if good(one) else [mark]) for one in texts]


@pytest.mark.parametrize("text", cases(REFUSED, lambda text: text in ALREADY))
def test_what_nobody_means_is_no_number(text: str) -> None:
    try:
        found = read_yaml("parameters", text)
    except InputError:
        return
    assert all(isinstance(value, str) for value in found.values()), found


@pytest.mark.parametrize("case", cases(TAKEN, lambda case: case[0] not in NOT_TAKEN))
def test_what_is_meant_is_taken(case: tuple[str, Any]) -> None:
    text, value = case
    assert next(iter(read_yaml("parameters", text).values())) == value
