"""Curves of folds, doublings, grazes and onset of contact: closed forms and direct search."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.bifurcations import period_doublings
from bouncing_disk_ros.maps.next_collision import NextCollisionMap
from bouncing_disk_ros.maps.orbit_kernels import contact_return
from bouncing_disk_ros.maps.periodic_orbit import PeriodicOrbit, fixed_point
from bouncing_disk_ros.orbit_studies import curve_family as curve_family_module
from bouncing_disk_ros.orbit_studies.contact_curves import MOST_IMPACTS, contact_curves
from bouncing_disk_ros.orbit_studies.curve_family import curve_family
from bouncing_disk_ros.orbit_studies.orbit_branch import KINDS, add_curves, orbit_curve
from bouncing_disk_ros.orbit_studies.orbit_curves import Curve, SpecialKind, Window
from bouncing_disk_ros.orbit_studies.orbit_equations import CurveKind, OrbitSystem
from support.checks import refused

WIDE = Window((0.05, 1.2), (0.02, 0.98))
ROUNDING = 1e-12


@pytest.fixture(scope="module")
def period_one() -> list[Curve]:
    found: list[Curve] = []
    add_curves(found, fixed_point(0.45, 0.5), KINDS, WIDE, 0.04)
    return found


@pytest.fixture(scope="module")
def period_two() -> PeriodicOrbit:
    """At its own doubling along Γ, ε = 0.5."""
    return period_doublings(fixed_point(0.45, 0.5), "axial_forcing", 0.6, 2)[1].orbit


def of_kind(curves: list[Curve], kind: CurveKind) -> Curve:
    return next(curve for curve in curves if curve.kind is kind)


def test_the_fold_of_period_1_is_where_it_exists(period_one: list[Curve]) -> None:
    curve = of_kind(period_one, CurveKind.FOLD)
    e = curve.restitution
    assert np.max(np.abs(curve.axial_forcing - (1.0 - e) / (1.0 + e))) < ROUNDING
    assert len(e) > 25
    assert curve.restitution.min() == pytest.approx(0.02, abs=ROUNDING)


def test_the_saddle_grazes_for_small_restitution(period_one: list[Curve]) -> None:
    """At ε = 0.05 from Γ ≈ 0.92 on, before Γ₁: beyond, its flight is cut short."""
    curve = of_kind(period_one, CurveKind.GRAZE)
    at = float(np.interp(0.05, curve.restitution[::-1], curve.axial_forcing[::-1]))
    assert at == pytest.approx(0.92, abs=0.003)
    for shift, misses in ((-2e-3, True), (2e-3, False)):
        forcing = at + shift
        tau = math.tau - math.acos(0.95 / 1.05 / forcing)
        assert (
            bool(OrbitSystem(1, 1).clearances(np.array([tau, forcing, 0.05]))[0, 0] > 0.0) is misses
        )


def test_the_graze_of_the_saddle_ends_on_the_fold(period_one: list[Curve]) -> None:
    """Both curves find the point where saddle and node are one and graze."""
    found = [p for curve in period_one for p in curve.special]
    assert {p.kind for p in found} == {SpecialKind.GRAZE_AND_FOLD}
    assert len(found) == 2
    assert found[0][1:] == pytest.approx(found[1][1:], abs=1e-9)
    e = found[0].restitution
    assert found[0].axial_forcing == pytest.approx((1.0 - e) / (1.0 + e), abs=ROUNDING)


def test_a_generalised_flip_is_where_the_doubling_becomes_hard(period_two: PeriodicOrbit) -> None:
    """Its place does not depend on how the curve is cut into points."""
    window = Window((0.3, 0.7), (0.95, 0.995))
    places = []
    for step in (0.04, 0.026):
        curves: list[Curve] = []
        add_curves(curves, period_two, ["doubling"], Window(WIDE.axial_forcing, (0.45, 0.98)), step)
        flips = [p for c in curves for p in c.special if p.kind is SpecialKind.GENERALISED_FLIP]
        flips = [p for p in flips if window.restitution[0] < p.restitution < window.restitution[1]]
        places.append(flips[0][1:])
    assert places[0] == pytest.approx(places[1], abs=1e-8)


def test_contact_ends_on_the_onset_of_contact() -> None:
    """On one side the orbit from contact comes back to it after one period, on the other later."""
    (curve,) = contact_curves(0.45, 0.5, Window((0.35, 0.7), (0.25, 0.75)))
    assert curve.kind is CurveKind.CONTACT_ONSET
    for i in range(2, len(curve.restitution) - 2, 6):
        forcing, e = float(curve.axial_forcing[i]), float(curve.restitution[i])
        periods, contact, _ = contact_return(forcing - 1e-9, e, MOST_IMPACTS)
        assert round(periods) == 1
        assert 0.0 < contact < 1e-3
        assert round(contact_return(forcing + 1e-9, e, MOST_IMPACTS)[0]) != 1


def test_all_attractors_at_a_point_have_their_curves() -> None:
    found = curve_family(NextCollisionMap(0.45, 0.5), Window((0.4, 0.6), (0.4, 0.6)), doublings=1)
    kinds = {(curve.kind, curve.impacts) for curve in found}
    assert kinds >= {(CurveKind.DOUBLING, 1), (CurveKind.DOUBLING, 2)}
    assert any(curve.kind is CurveKind.CONTACT_ONSET for curve in found)


def test_points_far_apart_make_no_curve_of_one_twice() -> None:
    found: list[Curve] = []
    add_curves(found, fixed_point(0.45, 0.5), KINDS, Window((0.3, 0.8), (0.2, 0.8)), 0.1)
    assert sorted(curve.kind for curve in found) == ["doubling", "fold", "graze"]


def test_what_cannot_be_followed_is_said() -> None:
    orbit = fixed_point(0.45, 0.5)
    refused("kind: got 'node', allowed: fold, doubling, graze", orbit_curve, orbit, "node")
    with pytest.raises(InputError, match="This orbit has none there"):
        orbit_curve(orbit, "doubling", Window((0.44, 0.46), (0.49, 0.51)))
    refused(r"window: got \(0.5, 0.4\)", orbit_curve, orbit, "fold", Window((0.5, 0.4), (0.2, 0.8)))
    refused("largest_step: got 0", orbit_curve, orbit, "fold", largest_step=0.0)
    refused(r"axial_forcing: got 0\.2", contact_curves, 0.2, 0.5)
    refused("within the window", curve_family, NextCollisionMap(0.9, 0.5))


def test_an_orbit_lost_on_the_way_takes_nothing_with_it(monkeypatch: pytest.MonkeyPatch) -> None:
    def add(found: list[Curve], orbit: PeriodicOrbit, *given: object) -> None:
        if orbit.impacts == 2:
            raise InputError("orbit", repr(orbit), "one that can be followed")
        add_curves(found, orbit, *given)  # type: ignore[arg-type]

    monkeypatch.setattr(curve_family_module, "add_curves", add)
    lost: list[str] = []
    window = Window((0.4, 0.6), (0.4, 0.6))
    found = curve_family(NextCollisionMap(0.45, 0.5), window, doublings=1, lost=lost)
    assert any(curve.impacts == 1 for curve in found)
    assert len(lost) == 1
    assert lost[0].startswith("2 impacts in 2 periods: orbit: got")
