"""Derivatives of the map against differences and its determinant."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.typing import NDArray

from bouncing_disk_ros.maps.map_tangent import axial_tangent, flight_tangents

Array = NDArray[np.float64]


def followed(
    tau: float, w: float, forcing: float, restitution: float, n: int
) -> tuple[Array, Array, int]:
    states, tangent = np.zeros((n + 1, 3)), np.zeros((2, 4))
    contacts = axial_tangent(tau, w, forcing, restitution, n, states, tangent)
    return states, tangent, contacts


def at(arguments: Array, n: int) -> tuple[Array, Array, int]:
    tau, w, forcing, restitution = (float(v) for v in arguments)
    return followed(tau, w, forcing, restitution, n)


@given(
    tau=st.floats(0, 6.28),
    w=st.floats(-3, -0.01),
    forcing=st.floats(0.33, 1.0),
    restitution=st.floats(0.05, 1.0),
    n=st.integers(1, 3),
)
def test_derivatives_are_the_limit_of_differences(
    tau: float, w: float, forcing: float, restitution: float, n: int
) -> None:
    """Central differences with steps h and h/2 bound the truncation; a graze in between is left."""
    here = np.array([tau, w, forcing, restitution])
    assume(restitution < 0.999)
    states, tangent, contacts = at(here, n)
    assume(contacts == 0 and np.all(states[1:, 1] < -0.05))
    for k in range(4):
        slopes = []
        for h in (2e-6, 1e-6):
            step = h * np.eye(4)[k]
            ends = [at(here + sign * step, n)[0][-1, :2] for sign in (1, -1)]
            change = ends[0] - ends[1]
            slopes.append(np.array([math.remainder(change[0], math.tau), change[1]]) / (2 * h))
        noise = 1e-8 * (1.0 + np.abs(tangent).max())
        truncation = 4.0 * np.abs(slopes[1] - slopes[0])
        assume(truncation.max() < 1e-3 * (1.0 + np.abs(tangent).max()))
        assert np.all(np.abs(tangent[:, k] - slopes[1]) < noise + truncation)


@given(tau=st.floats(0, 6.28), w=st.floats(-3, -0.01), forcing=st.floats(0.33, 1.0))
def test_the_determinant_of_a_flight_is_its_area_contraction(
    tau: float, w: float, forcing: float
) -> None:
    restitution = 0.7
    states, tangent, contacts = followed(tau, w, forcing, restitution, 1)
    assume(contacts == 0)
    matrix = tangent[:, :2]
    products = abs(matrix[0, 0] * matrix[1, 1]) + abs(matrix[0, 1] * matrix[1, 0])
    exact = restitution**2 * w / states[1, 1]
    assert np.linalg.det(matrix) == pytest.approx(exact, rel=1e-13, abs=1e-14 * products)


def test_contact_forgets_the_start_and_rest_is_told() -> None:
    _, tangent, contacts = followed(0.3, -2.0, 0.37, 0.2, 60)
    assert contacts > 0
    assert (followed(0.3, -2.0, 0.37, 0.2, 60)[1] == tangent).all()
    first = next(n for n in range(1, 60) if followed(0.3, -2.0, 0.37, 0.2, n)[2] == 1)
    assert (followed(0.3, -2.0, 0.37, 0.2, first)[1] == 0.0).all()
    assert (followed(0.3, -2.0, 0.37, 0.2, first - 1)[1] != 0.0).all()
    assert followed(0.3, -2.0, 0.3, 0.5, 200)[2] == -1


def test_flights_have_the_derivatives_of_single_steps() -> None:
    states, _, contacts = followed(0.9, -1.3, 0.6, 0.5, 6)
    assert contacts == 0
    flights = np.column_stack((states[:-1, :2], states[1:, 2], states[1:, 1]))
    out = np.empty((6, 2, 2))
    flight_tangents(flights, 0.6, 0.5, out)
    for i, (tau, w) in enumerate(states[:-1, :2]):
        assert (out[i] == followed(tau, w, 0.6, 0.5, 1)[1][:, :2]).all()
