"""Own sine and cosine, exact sums and products, and the law of restitution."""

from __future__ import annotations

import gc
from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import types
from numba.core.errors import TypingError
from numba.core.types.functions import BaseFunction

from bouncing_disk_ros.core import arithmetic as arithmetic_kernels
from bouncing_disk_ros.core import compilation, restitution
from bouncing_disk_ros.maps.lanes import lane_basics
from support.kernels import Kernels

arithmetic = Kernels(arithmetic_kernels)
lanes = Kernels(lane_basics)

NUMBERS = st.floats(-1e100, 1e100).filter(lambda x: x == 0 or abs(x) > 1e-100)


@given(st.floats(-1e15, 1e15) | st.floats(-10, 10) | st.floats(-1e6, 1e6))
def test_sine_and_cosine_are_good_to_two_ulp_of_one(x: float) -> None:
    s, c = arithmetic.sincos(x)
    with mpmath.workdps(40):
        assert abs(s - mpmath.sin(x)) < 2e-16
        assert abs(c - mpmath.cos(x)) < 2e-16


@given(st.floats(1e-12, 0.78))
def test_excesses_keep_their_digits(x: float) -> None:
    _, _, se, ce = arithmetic.sincos_excess(x)
    with mpmath.workdps(60):
        # sums of a few rounded terms: a handful of ulp
        assert abs(se / (mpmath.sin(x) - x) - 1) < 1e-15
        assert abs(ce / (mpmath.cos(x) - 1) - 1) < 1e-15


@given(NUMBERS, NUMBERS)
def test_two_sum_and_two_product_lose_nothing(a: float, b: float) -> None:
    s, e = arithmetic.two_sum(a, b)
    assert Fraction(s) + Fraction(e) == Fraction(a) + Fraction(b)
    if 1e-100 < abs(a * b) < 1e200:  # beyond, the error itself may underflow
        p, e = arithmetic.two_product(a, b)
        assert Fraction(p) + Fraction(e) == Fraction(a) * Fraction(b)


@given(NUMBERS, NUMBERS)
def test_the_fast_sum_has_the_bits_of_the_other_where_the_first_is_larger_or_0(
    a: float, b: float
) -> None:
    a, b = a + 0.0, b + 0.0  # no −0
    larger, smaller = sorted((a, b), key=abs, reverse=True)
    for pair in ((larger, smaller), (0.0, b), (a, a), (a, 0.0 - a)):
        fast, slow = arithmetic.fast_two_sum(*pair), arithmetic.two_sum(*pair)
        assert [x.hex() for x in fast] == [x.hex() for x in slow]


MODERATE = st.floats(-1e30, 1e30).filter(lambda x: x == 0 or abs(x) > 1e-30)


@given(MODERATE, MODERATE, MODERATE, MODERATE)
def test_products_and_quotients_of_pairs_keep_a_larger_first_part(
    a: float, b: float, c: float, d: float
) -> None:
    """So that the fast sum in them loses nothing."""
    first, second = arithmetic.two_sum(a, b), arithmetic.two_sum(c, d)
    product, e = arithmetic.two_product(first[0], second[0])
    rest = e + (first[0] * second[1] + first[1] * second[0])
    assert arithmetic.pair_product(*first, *second) == arithmetic.two_sum(product, rest)
    if c != 0.0:
        q = first[0] / c
        p, e = arithmetic.two_product(q, c)
        rest = ((first[0] - p) - e + first[1]) / c
        assert arithmetic.pair_quotient(*first, c) == arithmetic.two_sum(q, rest)


@given(st.floats(0, 1))
def test_arccosine_inverts_the_cosine(c: float) -> None:
    """To two ulp of π/2, also where the cosine hardly changes."""
    assert float(abs(arithmetic.arccosine(c) - mpmath.acos(c))) <= 2.0**-51


def test_an_inlined_kernel_that_returns_an_array_is_refused_and_numba_as_it_was() -> None:
    """It does not count who holds the array: memory in use would be freed."""
    returns_pair: Any = compilation.kernel(lambda table: (1.0, table))
    with pytest.raises(TypeError, match="declare it as rare_kernel"):
        returns_pair.compile((types.float64[::1],))
    returns_number: Any = compilation.kernel(lambda table: table[0])
    returns_number.compile((types.float64[::1],))
    find = BaseFunction.get_call_type
    with pytest.raises(TypingError):
        compilation.entry(types.float64(types.float64))(lambda x: x.unknown)
    assert BaseFunction.get_call_type is find
    assert gc.isenabled()


# --- the law of restitution -----------------------------------------------------------------------
law = Kernels(restitution)


def test_scalars_lanes_and_arrays_rebound_alike() -> None:
    rng = np.random.default_rng(3)
    w = -np.concatenate([10.0 ** rng.uniform(-300.0, 5.0, 500), [5e-324, 1.0, 1e300]])
    for epsilon in (0.0, 0.5, 1.0, float(rng.uniform()), 1.0 - 1e-6):
        of_array = restitution.rebounded(w, epsilon)
        assert [law.rebound(one, epsilon) for one in w] == of_array.tolist()
        assert [lanes.rebound(one, epsilon) for one in w] == of_array.tolist()


def test_impulse_and_loss_are_those_of_the_law() -> None:
    """u − w and 1 − u²/w², each of both sides rounded three times at most."""
    rng = np.random.default_rng(4)
    for w, epsilon in zip(
        -(10.0 ** rng.uniform(-9.0, 3.0, 200)), rng.uniform(size=200), strict=True
    ):
        u = law.rebound(w, epsilon)
        assert abs(law.axial_push(w, epsilon) - (u - w)) <= 6.0 * 2.0**-53 * (u - w)
        assert abs(law.lost_part(w, epsilon) - (1.0 - (u / w) ** 2)) <= 6.0 * 2.0**-53
