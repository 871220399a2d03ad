"""Attractors along an axis: lines go on through doublings, gaps and crossings."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bouncing_disk_ros.maps.attractors import AttractorKind
from bouncing_disk_ros.study.attractor_lines import (
    MEMORY,
    Seen,
    attractor_distance,
    match_attractors,
)


def periodic(*points: tuple[float, float]) -> Seen:
    return Seen(AttractorKind.PERIODIC, np.array(points))


CONTACT = Seen(AttractorKind.CHATTERING, np.array([[1.0, -3.0]]))


def test_the_distance_is_that_of_the_points() -> None:
    one, two = np.array([[0.1, -1.0]]), np.array([[math.tau - 0.1, -1.0]])
    assert attractor_distance(one, two) == pytest.approx(0.2)  # across 2π
    doubled = np.array([[0.1, -1.1], [0.1, -0.9]])
    assert attractor_distance(one, doubled) == pytest.approx(0.1)
    assert attractor_distance(one, np.empty((0, 2))) == math.inf


def test_a_line_goes_on_through_a_doubling() -> None:
    rows = [[periodic((1.0, -1.0))], [periodic((1.0, -1.05), (1.0, -0.95))]]
    assert match_attractors(rows) == [[0], [0]]


def test_order_does_not_matter_and_the_nearest_go_first() -> None:
    a, b = periodic((1.0, -1.0)), periodic((1.2, -1.0))
    near_a, near_b = periodic((1.04, -1.0)), periodic((1.17, -1.0))
    assert match_attractors([[a, b], [near_b, near_a]]) == [[0, 1], [1, 0]]


def test_a_new_attractor_is_a_new_line_and_a_missing_one_is_found_again() -> None:
    a, far = periodic((1.0, -1.0)), periodic((3.0, -2.0))
    rows = [[a], [a, far], [far], [far, a]]
    assert match_attractors(rows) == [[0], [0, 1], [1], [1, 0]]
    long = [[a], *([[far]] * (MEMORY + 1)), [a]]
    assert match_attractors(long)[-1] == [2]


def test_the_attractor_with_contact_is_one_line_however_it_moves() -> None:
    moved = Seen(AttractorKind.CHATTERING, np.array([[5.0, -0.5]]))
    rest = Seen(AttractorKind.REST, np.empty((0, 2)))
    a = periodic((1.0, -1.0))
    rows = [[rest], [CONTACT, a], *([[a]] * (MEMORY + 3)), [a, moved]]
    assert match_attractors(rows)[1] == [1, 2]
    assert match_attractors(rows)[-1] == [2, 1]
    near = Seen(AttractorKind.CHATTERING, np.array([[1.0, -1.0]]))
    assert match_attractors([[a], [near]]) == [[0], [1]]  # near, but with contact
