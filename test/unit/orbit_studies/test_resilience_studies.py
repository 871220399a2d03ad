"""The studies curves, manifolds and resilience at small sizes: numbers, lines, pictures."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import xarray as xr

from bouncing_disk_ros.orbit_studies.curves import options as curves
from bouncing_disk_ros.orbit_studies.manifolds import options as manifolds
from bouncing_disk_ros.orbit_studies.resilience import options as resilience
from bouncing_disk_ros.orbit_studies.resilience.picture import impulse_picture, resilience_picture
from bouncing_disk_ros.study import named, run
from support.checks import there
from support.shown import Shown, shown

SMALL_RESILIENCE: dict[str, Any] = {
    "begin": 0.2, "end": 0.45, "count": 3, "samples": 40, "instants": 4, "resolution": 0.1,
}  # fmt: skip


@pytest.fixture(scope="module")
def resilient() -> Shown:
    return shown(resilience, **SMALL_RESILIENCE)


def test_curves_are_stored_with_the_map_behind_them() -> None:
    small: dict[str, Any] = {
        "axial_forcing_count": 6, "restitution_count": 5, "settling": 50, "doublings": 1,
        "axial_forcing_begin": 0.4, "axial_forcing_end": 0.6, "restitution_begin": 0.4,
        "restitution_end": 0.6, "largest_step": 0.04,
    }  # fmt: skip
    _, lines, result = shown(curves, **small)
    kinds = result["curve_kind"].values.tolist()
    assert {"doubling", "contact onset"} <= set(kinds)
    own = result["point_curve"].values == kinds.index("doubling")
    e, forcing = (result[f"point_{n}"].values[own] for n in ("restitution", "axial_forcing"))
    exact = np.hypot((1 - e) / (1 + e), 2.0 * (1 + e * e) / (math.pi * (1 + e) ** 2))
    np.testing.assert_allclose(forcing, exact, rtol=0.0, atol=1e-12)
    assert any("doubling of 2 impacts in 2 periods" in line for line in lines)
    assert result["period"].shape == (5, 6)


def test_manifolds_are_stored_over_the_basins() -> None:
    _, lines, result = shown(manifolds, axial_forcing=0.34, width=40, height=40,
                          distance=0.05)  # fmt: skip
    assert result["saddle_impacts"].values.tolist() == [1]
    tau = float(result["saddle_point_forcing_phase"][0])
    assert math.cos(tau) == pytest.approx(1.0 / (3.0 * 0.34), abs=1e-9)
    assert math.sin(tau) < 0.0
    assert float(result["saddle_share"][0]) == pytest.approx(0.11643, abs=1e-5)
    assert int(result["saddle_basin"][0]) == 1
    assert any(line.endswith("encloses 11.64261 % of the window") for line in lines)
    nothing = result.assign(saddle_share=result["saddle_share"] * math.nan,
                            saddle_open=("saddle", ["its points ran out"]))  # fmt: skip
    text = "; what its stable manifold encloses is not known: its points ran out"
    assert any(line.endswith(text) for line in manifolds.lines(nothing))
    # had a piece of the branch been missed, or were there another boundary, the starts would differ
    wrong = manifolds.lines(result.assign(saddle_share=result["saddle_share"] + 0.05))
    assert any("16.64261 % of the window, but 1" in line and "% of the starts go to period-1: this "
               "is not the whole boundary of its basin" in line for line in wrong)  # fmt: skip
    capped = result.assign(label=0 * result["label"] - 1, fraction=0.0 * result["fraction"])
    assert not any("of the starts go to" in line for line in manifolds.lines(capped)), "unresolved"
    assert set(result["piece_stability"].values.tolist()) == {0, 1}


def test_the_window_of_an_enclosed_share_is_the_one_asked_for() -> None:
    given: dict[str, Any] = {
        "phase_begin": 1.0, "phase_end": 3.0, "velocity_begin": -5.0, "velocity_end": -1.0,
        "width": 40, "height": 40, "axial_forcing": 0.34, "distance": 0.05, "pairs": 1,
    }  # fmt: skip
    _, lines, result = shown(manifolds, **given)
    share, counted = float(result["saddle_share"][0]), float(result["fraction"][1])
    assert share == pytest.approx(0.0861518, abs=1e-6)
    assert share == pytest.approx(counted, abs=4.0 * float(result["fraction_uncertainty"][1]))
    assert not any("but" in line for line in lines)


def test_a_window_of_one_basin_has_no_boundary_and_one_without_an_orbit_no_curves() -> None:
    _, lines, _ = shown(manifolds, axial_forcing=0.2, width=8, height=8)
    assert lines[-1] == "  no boundary in this window: all starts on its grid have one end"
    small: dict[str, Any] = {
        "axial_forcing": 0.2, "axial_forcing_begin": 0.1, "axial_forcing_end": 0.3,
        "axial_forcing_count": 2, "restitution_count": 2, "settling": 9,
    }  # fmt: skip
    _, lines, _ = shown(curves, **small)
    assert lines == ["  no curves: no attractor at this point has one within the window"]


def test_resilience_of_a_few_values(resilient: Shown) -> None:
    _, lines, result = resilient
    names = result["line_name"].values.tolist()
    assert names == ["rest", "chattering", "period-1"]
    share = result["line_share"].values
    np.testing.assert_allclose(np.nansum(share, axis=0) + result["unresolved"].values, 1.0)
    one = names.index("period-1")
    assert float(share[one, -1]) == pytest.approx(0.347, abs=0.02)
    least = result["line_least_fatal_impulse"].values[one, -1]
    assert least == pytest.approx([0.17880, 0.33922], abs=1e-4)  # up at 0.45, down
    late, early = result["line_fatal_timing_error"].values[one, -1]
    assert (late, early) == pytest.approx((0.86477, 1.47325), abs=1e-4)
    # the multiplier of period 1 at 0.45 is 1/2 in magnitude: e^{-1} after 1/ln 2 periods
    assert result["line_convergence_time"].values[one, -1] == pytest.approx(1.0 / math.log(2.0))
    in_time = result["line_share_in_time"].values[one, -1]
    assert np.all(np.diff(in_time) >= 0.0)
    assert in_time[-1] == pytest.approx(share[one, -1])
    assert "  period-1, at Γ = 0.45" in lines
    assert "  chattering, from Γ = 0.325 to 0.45" in lines
    assert "    hardest to lose by an impulse at Γ = 0.45: 0.1788 m πg/ω = 0.074501 N·s" in lines
    assert "    hardest to lose by a timing error at Γ = 0.45: 0.86477 rad = 45.878 ms" in lines
    assert np.isinf(result["line_least_fatal_impulse"].values[0, 0]).all()
    assert float(result["line_share"].values[0, 0]) == 1.0


def test_where_no_impulse_is_fatal_an_attractor_is_hardest_to_lose_and_named(
    resilient: Shown,
) -> None:
    """At one value of two: the other, with its finite one, is not the hardest."""
    _, _, result = resilient
    one = result["line_name"].values.tolist().index("period-1")
    two = result.copy()
    for name in result.data_vars:
        if result[name].dims[:2] == result["line_kind"].dims[:2]:
            two[name] = result[name].copy()
            two[name].values[one, -2] = result[name].values[one, -1]
    two["line_least_fatal_impulse"].values[one, -2] = math.inf
    text = f"at 1 of 2 values, Γ = {float(result['value'].values[-2]):.6g}"
    assert f"    no impulse looked at, up to 5 m πg/ω, is fatal {text}" in resilience.lines(two)
    (legend,) = impulse_picture(result).legends
    absent = "the attractor is not there, or its size is not decided"
    assert [text.get_text() for text in legend.get_texts()] == [absent]
    endless = result.assign(line_fatal_impulse=result["line_fatal_impulse"] * math.inf)
    (legend,) = impulse_picture(endless).legends
    assert legend.get_texts()[0].get_text() == "no impulse up to 5 is fatal"
    endless["line_least_fatal_impulse"] = endless["line_least_fatal_impulse"] * math.inf
    said = [[text.get_text() for text in axes.texts] for axes in resilience_picture(endless).axes]
    assert said[1:3] == [["none is fatal, or none is known"], []], "a panel without lines"


def test_the_picture_of_impulses_is_of_a_line_that_has_fatal_ones(resilient: Shown) -> None:
    """A larger line that no impulse ends, as where it is the only attractor, would be empty."""
    _, _, result = resilient
    one = result["line_name"].values.tolist().index("period-1")
    two = result.isel(line=[one, one]).copy(deep=True)
    two["line_name"].values[1] = "period-2"
    two["line_share_without_contact"].values[1, -1] = 1.0
    two["line_fatal_impulse"].values[1] *= math.inf
    assert impulse_picture(two).get_suptitle().endswith(": period-1")


def test_attractors_that_are_not_named_are_counted(resilient: Shown) -> None:
    _, _, result = resilient
    six = result.isel(line=[0, 0, 0, 0, 0, 0])
    assert "  and 1 other" in resilience.lines(six)


def test_values_at_which_nothing_is_fatal_are_told_each_with_the_reason() -> None:
    """As ranges of neighbours: from first to last would name values where an impulse is fatal."""
    x = xr.DataArray([0.32, 0.33, 0.34, 0.5, 0.56], attrs={"symbol": "Γ", "units": "1"})
    safe = np.array([math.inf, math.inf, 0.2, 0.1, math.inf])
    unit = ("impulse", "up to 5 m πg/ω", "m πg/ω", 0.4, "N·s")
    text = "no impulse looked at, up to 5 m πg/ω, is fatal at 3 of 5 values, Γ = 0.32 to 0.33, 0.56"
    for only, why in (
        ([1, 1, 0, 0, 1], ": it is the only attractor there"),
        ([1, 1, 0, 0, 0], ": it is the only attractor at 2"),
        ([0] * 5, ""),
    ):
        told = resilience._hardest_to_lose(x, safe, np.array(only, bool), *unit)
        assert told == text + why


def test_resilience_does_not_depend_on_how_it_is_cut(resilient: Shown) -> None:
    _, _, whole = resilient
    given = {**SMALL_RESILIENCE, "begin": 0.45, "count": 1}
    alone = there(run(named("resilience", **given), workers=2))
    for name in ("share", "fatal_impulse", "fatal_timing_error", "median_time"):
        np.testing.assert_array_equal(alone[name].values[0], whole[name].values[-1])
