"""The studies: nothing depends on how they are cut, and rare cases have their numbers.

test/reference/test_studies_by_simulation.py compares their numbers with the simulator's.
"""

from __future__ import annotations

import math
import pickle

import numpy as np
import pytest

from bouncing_disk_ros.juggling import compute as juggling_module
from bouncing_disk_ros.juggling.options import lines as juggling_lines
from bouncing_disk_ros.maps import attractor_search
from bouncing_disk_ros.maps.attractors import AttractorKind
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.study import named
from bouncing_disk_ros.study.attractor_lines import (
    MEMORY,
    Seen,
    attractor_distance,
    match_attractors,
)
from bouncing_disk_ros.study.basin_shares.compute import CLASSES
from bouncing_disk_ros.study.basin_shares.options import lines as share_lines
from bouncing_disk_ros.study.basins.options import lines as basin_lines
from bouncing_disk_ros.study.bifurcation import compute as bifurcation_module
from bouncing_disk_ros.study.bifurcation.compute import branch_of
from bouncing_disk_ros.study.bifurcation.options import lines
from support.shown import result_of


def test_loops_do_not_depend_on_how_they_are_cut(monkeypatch: pytest.MonkeyPatch) -> None:
    """Draws belong to a start; a condition sets what it names, another start and target too."""
    given: dict[str, Value] = {
        "axial_forcing": 0.48, "width": 4, "height": 4, "strategies": "none deadbeat",
        "conditions": "missed=0.3,jitter=0.002; start=period-2 in 1 cycle; start=rest",
    }  # fmt: skip
    whole = result_of("juggling", **given)
    rows = {"strategy": 1, "condition": 1, "velocity": 2}
    monkeypatch.setattr(juggling_module.Juggling, "chunks", property(lambda _: rows))
    cut = result_of("juggling", **given)
    for name in ("verdict", "impacts", "time", "largest_offset", "commands"):
        np.testing.assert_array_equal(whole[name].values, cut[name].values)
    captured = whole["captured"].values
    assert captured[1, 1] == captured[1, 2] == 1.0
    assert captured[1, 0] > captured[0, 0]
    assert captured[0, 1] == captured[0, 2] == 0.0
    assert float(whole["offset_used"].max()) <= 0.3
    assert float(whole["offset_used"][0].max()) == 0.0
    assert any("period-2" in line for line in juggling_lines(whole))


SPEEDS: dict[str, Value] = {
    "axial_forcing": 0.45, "width": 12, "height": 12, "angular_velocities": "0, -2",
    "phase_lag": 0.2, "angular_forcing": 20.0,
}  # fmt: skip
CASCADE: dict[str, Value] = {"begin": 0.4, "end": 0.56, "count": 9, "settling": 200,
                             "measured": 100, "kept": 40, "doublings": 2}  # fmt: skip
STARTS: dict[str, Value] = {"begin": 0.3, "end": 0.4, "count": 6, "settling": 300, "starts": 7,
                            "measured": 60, "kept": 20, "phase_lag": -0.4}  # fmt: skip
PLANE: dict[str, Value] = {"x_begin": 0.25, "x_end": 0.53, "x_count": 5, "y_begin": 0.4,
                           "y_end": 0.5, "y_count": 3, "settling": 3000,
                           "measured": 256}  # fmt: skip
MOTOR: dict[str, Value] = {
    "x_axis": "preload", "x_begin": 28.0, "x_end": 32.0, "x_count": 3, "y_axis": "phase_lag",
    "y_begin": -1.0, "y_end": 1.0, "y_count": 2,
}  # fmt: skip


@pytest.mark.parametrize(
    ("name", "given", "sizes"),
    [
        ("basins", SPEEDS, {"basins.compute.SIDES": (5, 5)}),
        ("bifurcation", CASCADE, {"bifurcation.compute.VALUES_OF_A_REGION": 2}),
        ("bifurcation", STARTS, {"bifurcation.compute.LEAST_OF_A_REGION": 1,
                                 "bifurcation.compute.KEPT_OF_A_REGION": 1}),
        ("parameter_map", PLANE, {"parameter_map.compute.SIDES": (2, 2)}),
        *[("motor", {**MOTOR, "start": start}, {"SIDE": 2, "POINTS_OF_A_REGION": 4})
          for start in ("period-1", "followed")],
    ],
)  # fmt: skip
def test_no_result_depends_on_how_it_is_cut(
    monkeypatch: pytest.MonkeyPatch, name: str, given: dict[str, Value],
    sizes: dict[str, object],
) -> None:  # fmt: skip
    whole = result_of(name, **given)
    for place, size in sizes.items():
        module = "study." + place if "." in place else "motor_study.compute." + place
        monkeypatch.setattr("bouncing_disk_ros." + module, size)
    cut = result_of(name, **given)
    assert cut["region_done"].size > whole["region_done"].size
    for field in named(name, **given).fields:
        np.testing.assert_array_equal(whole[field].values, cut[field].values)


def test_starts_that_come_to_rest_have_no_speed() -> None:
    given: dict[str, Value] = {
        "axial_forcing": 0.25, "restitution": 0.7, "width": 20, "height": 20,
        "angular_velocities": "0", "phase_lag": 1.0,
    }  # fmt: skip
    found = result_of("basins", **given)
    speed, label = found["mean_speed"].values[0], found["label"].values
    assert found["attractor_name"].values.tolist() == ["rest", "period-1"]
    expected = math.cos(math.acos(0.3 / 1.7 / 0.25) + 1.0)
    np.testing.assert_allclose(speed[label == 1], expected, rtol=1e-9)
    assert np.isnan(speed[label != 1]).all()
    assert 0.1 < np.mean(label == 0) < 0.9


def test_the_best_lag_does_not_depend_on_how_slow_friction_is() -> None:
    found = result_of("basin_shares", along="angular_forcing", begin=10.0, end=1e5,
                      count=2, samples=4)  # fmt: skip
    np.testing.assert_allclose(found["best_speed"].values, 1.0, rtol=1e-12)
    np.testing.assert_allclose(found["best_phase_lag"].values, -math.acos(1.0 / 1.35), atol=1e-7)


def test_a_diagram_has_the_first_doubling_of_the_closed_form() -> None:
    whole = result_of("bifurcation", **CASCADE)
    # eq. of the doubling in closed form
    first = math.sqrt(1.0 / 9.0 + (2.0 * 1.25 / (math.pi * 2.25)) ** 2)
    assert float(whole["doubling"][0]) == pytest.approx(first, abs=1e-9)
    branch = branch_of(whole)
    assert branch.forcing_phase.shape == (9, 1, 40)
    assert branch.contact.dtype == bool
    phase = math.acos(1.0 / 3.0 / 0.4)
    np.testing.assert_allclose(branch.forcing_phase[0], phase, rtol=1e-9)


def test_the_crisis_of_the_chaotic_attractor_is_found_between_the_values() -> None:
    """From the period-1 orbit on, in steps of 0.01: contact begins at Γ = 0.56075 (5e6 impacts)."""
    given: dict[str, Value] = {"begin": 0.45, "end": 0.58, "count": 14, "settling": 1000,
                               "measured": 1000, "kept": 5, "doublings": 1}  # fmt: skip
    found = result_of("bifurcation", **given)
    onset, without = (float(found[f"contact_onset{end}"]) for end in ("", "_without"))
    assert 0.0 < onset - without <= 1e-6
    assert 0.5607507 <= onset < 0.56076
    assert float(found["contact_onset_exponent"]) > 0.0
    assert any("a crisis" in line for line in lines(found))
    alone = result_of("bifurcation", **given | {"end": 0.55})
    assert "contact_onset" not in alone


def test_the_first_contact_is_found_where_the_impacts_measured_missed_it() -> None:
    """ε = 0.8: at 0.3995 the 1120th impact of the next 1e7 comes to contact, at 0.39925 none."""
    given: dict[str, Value] = {
        "restitution": 0.8, "begin": 0.335, "end": 0.405, "count": 281, "settling": 1000,
        "measured": 1000, "kept": 5, "doublings": 0,
    }  # fmt: skip
    found = result_of("bifurcation", **given)
    with_contact = found["value"].values[found["contacts"].values > 0.0]
    assert 0.39925 < float(found["contact_onset"]) < with_contact[0]


def test_starts_show_what_coexists() -> None:
    """Below 1/π rest; at Γ = 0.4 the period-1 orbit beside a chattering one (Fig. 4)."""
    study = named("bifurcation", **STARTS)
    assert not study.sequential
    assert "initial_velocity" not in study.parameters
    sent = pickle.loads(pickle.dumps(study))
    assert not sent.sequential
    whole = result_of("bifurcation", **STARTS)
    assert whole["forcing_phase"].dims == ("value", "start", "impact")
    assert np.isnan(whole["mean_speed"].values[0]).all()
    contact = whole["contacts"].values[-1] > 0.0
    assert 0 < contact.sum() < 7
    period_1 = math.acos(1.0 / 3.0 / 0.4)
    phases = whole["forcing_phase"].values[-1, ~contact]
    np.testing.assert_allclose(phases, period_1, rtol=1e-9)
    speeds = whole["mean_speed"].values[-1, ~contact]
    np.testing.assert_allclose(speeds, math.cos(period_1 - 0.4), rtol=1e-9)
    branch = branch_of(whole)
    assert branch.forcing_phase.shape == (6, 7, 20)


def test_attractors_that_the_search_missed_are_found_from_open_starts() -> None:
    """Γ = 0.5275: the period-4 orbit beside period 2 and chattering has 0.3 % of the starts."""
    found = result_of("basin_shares", begin=0.5275, end=0.5275, count=1, samples=64)
    assert int(found["missed"][0]) == 1
    assert int(found["attractors"][0]) == 3
    share = dict(zip(CLASSES, found["fraction"].values[0].tolist(), strict=True))
    assert share["unresolved"] == 0.0
    assert any("missed" in line and "0.5275" in line for line in share_lines(found))
    fine = result_of("basin_shares", begin=0.45, end=0.45, count=1, samples=16)
    assert int(fine["missed"][0]) == 0
    assert not any("missed" in line for line in share_lines(fine))


def test_a_map_names_attractors_that_the_search_missed(monkeypatch: pytest.MonkeyPatch) -> None:
    given: dict[str, Value] = {"axial_forcing": 0.5275, "width": 64, "height": 64}
    assert "missed_attractor_name" not in result_of("basins", **given)
    monkeypatch.setattr(attractor_search, "SEARCHED", 4)
    whole = result_of("basins", **given)
    assert whole["missed_attractor_name"].values.tolist() == ["period-4"]
    assert any("missed: period-4" in line for line in basin_lines(whole))


@pytest.mark.parametrize("begin", [0.3, 0.39, 0.45])
def test_doublings_along_the_restitution_are_found_from_any_begin(begin: float) -> None:
    study = named("bifurcation", along="restitution", axial_forcing=0.5, begin=begin, end=0.6,
                  doublings=1, initial_velocity=-1.0)  # fmt: skip
    assert isinstance(study, bifurcation_module.Bifurcation)
    (point,) = study.doublings
    # Γ₁(ε) = Γ in closed form (paper: 0.486 at ε = 0.5)
    e = point.value
    first = ((1.0 - e) / (1.0 + e)) ** 2 + (2.0 * (1.0 + e * e) / (math.pi * (1.0 + e) ** 2)) ** 2
    assert math.sqrt(first) == pytest.approx(0.5, abs=1e-9)


def test_a_toss_that_turns_itself_has_no_speed_ratio_and_a_late_axis_no_doublings() -> None:
    study = named("bifurcation", begin=0.5, end=0.6)
    assert isinstance(study, bifurcation_module.Bifurcation)
    assert study.doublings == []
    found = result_of("toss_map", phase_lag_count=4, amplitude_angle_count=3,
                      load_torque=0.001)  # fmt: skip
    assert list(found["extreme_measure"].values) == ["airborne_speed", "efficiency"]


# --- attractors along an axis ---------------------------------------------------------------------
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
