"""The quadrature of the energy ledger is Gauss and Legendre's, digit by digit."""

from __future__ import annotations

from fractions import Fraction

import pytest

from bouncing_disk_ros.core.energy_ledger import NODES, WEIGHTS


@pytest.mark.parametrize("power", range(24))
def test_powers_up_to_23_are_integrated_to_rounding(power: int) -> None:
    found = sum(
        Fraction(weight) * Fraction(node) ** power
        for node, weight in zip(NODES, WEIGHTS, strict=True)
    )
    exact = Fraction(1 + (-1) ** power, power + 1)
    assert abs(found - exact) < 1e-15


def test_the_rule_does_not_reach_further() -> None:
    """Twelve points, no more: what the width of a panel is chosen for."""
    found = sum(weight * node**24 for node, weight in zip(NODES, WEIGHTS, strict=True))
    assert abs(found - 2.0 / 25.0) > 1e-8
