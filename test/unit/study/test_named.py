"""Studies by name: the defaults of the tables, and what is refused."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.executables import STUDIES
from bouncing_disk_ros.study import named
from bouncing_disk_ros.study.by_name import definition_of

ROOT = Path(__file__).resolve().parents[3]


@pytest.mark.parametrize("name", STUDIES)
def test_defaults_make_a_study_of_that_name(name: str) -> None:
    study = named(name)
    assert study.name == name
    for key, value in study.parameters.items():
        assert value == definition_of(name).options[key].default


def test_what_is_given_stays_and_integers_are_cast_and_the_file_of_figure_3_fits() -> None:
    parameters = named("basins", axial_forcing=1, width=7).parameters
    assert parameters["axial_forcing"] == 1.0
    assert isinstance(parameters["axial_forcing"], float)
    assert parameters["width"] == 7
    own = yaml.safe_load((ROOT / "config" / "fig3.yaml").read_text("utf-8"))
    values = own["/**/bifurcation"]["ros__parameters"]
    assert named("bifurcation", **values).parameters["begin"] == 0.335
    assert named("bifurcation", **{**values, "restitution": 0.3}).parameters["end"] == 0.65


@pytest.mark.parametrize(
    ("name", "given", "words"),
    [
        ("basin", {}, "Did you mean basins"),
        ("basins", {"forcing": 0.4}, "parameter: got 'forcing', allowed: axial_forcing, "),
        ("basins", {"width": 0}, "width: got 0, allowed: an integer >= 1"),
        ("basins", {"width": 2.5}, "width: got 2.5"),
        ("basins", {"output": "x"}, "parameter: got 'output'"),
        ("basins", {"phase_begin": 7.0}, "phase_begin: got 7.0, allowed: less than phase_end"),
        ("basins", {"velocity_begin": 0.0}, "The window is empty"),
        ("basins", {"velocity": "between"}, "velocity: got 'between', allowed: before or after"),
        ("basins", {"velocity": "after", "restitution": 0.0}, "Nothing bounces there"),
        ("basins", {"angular_velocities": "0 fast"}, "angular_velocities: got 'fast', allowed"),
        ("basins", {"phase_lag": 1.0}, "phase_lag: got 1.0, allowed: none without angular_vel"),
        ("basins", {"angular_forcing": 9.0}, "angular_forcing: got 9.0, allowed: none without an"),
        ("juggling", {"restitution": 0.0}, "restitution: got 0.0, allowed: a finite number >= 1"),
        ("juggling", {"small_limit": 0.1}, "small_limit: got 0.1, allowed: none without small"),
        ("juggling", {"start": "rest", "velocity_end": -1.0}, "none without start:=window"),
        ("juggling", {"conditions": "start=rest", "velocity_end": -1.0}, "without start:=window"),
        ("bifurcation", {"axial_forcing": 0.4}, "0.4, allowed: none with along:=axial_forcing"),
        ("bifurcation", {"count": 1, "end": 0.4}, "end: got 0.4, allowed: begin = 0.335 with co"),
        ("basin_shares", {"along": "restitution", "end": 0.9, "count": 1}, "begin = 0.3 with coun"),
        ("resilience", {"end": 0.4, "count": 1}, "end: got 0.4, allowed: begin = 0.32 with count"),
        ("parameter_map", {"restitution": 0.4}, "restitution: got 0.4, allowed: none with y_axis"),
        ("parameter_map", {"x_end": 0.6, "x_count": 1}, "x_end: got 0.6, allowed: x_begin = 0.3"),
        ("motor", {"load_torque": 0.002}, "got 0.002, allowed: none with x_axis:=load_torque"),
        ("motor", {"y_end": 30.0, "y_count": 1}, "y_end: got 30.0, allowed: y_begin = 15 with"),
        ("basin_shares", {"along": "phase_lag"}, "along: got 'phase_lag', allowed: one of"),
        ("basin_shares", {"along": "restitution", "end": 1.5}, "end: got 1.5, allowed: 0 to less"),
        ("basin_shares", {"restitution": 1.0}, "it has no attractors"),
        ("basins", {"restitution": 1.0}, "it has no attractors"),
        ("basin_shares", {"velocity_begin": 0.0}, "The window is empty"),
        ("juggling", {"strategies": "none mirror"}, "strategy: got 'mirror', allowed: none, "),
        ("juggling", {"strategies": "none none"}, "strategies: got 'none none', allowed: some of"),
        ("juggling", {"conditions": "delay=x"}, "delay: got 'x', allowed: a number from 0 to 10"),
        ("juggling", {"restitution": 0.8, "restitution_error": 0.5}, "up to 1/ε − 1 = 0.25"),
        ("juggling", {"conditions": "lag=1"}, "conditions: got 'lag=1', allowed: nominal, or"),
        ("juggling", {"axial_forcing": 0.3}, "There is no period-1 orbit"),
        ("bifurcation", {"along": "gravity"}, "along: got 'gravity', allowed: one of"),
        ("bifurcation", {"along": "epsilon"}, "Did you mean restitution?"),
        ("basin_shares", {"along": "axial"}, "Did you mean axial_forcing?"),
        ("resilience", {"along": "epsilon"}, "Did you mean restitution?"),
        ("bifurcation", {"begin": 0.4, "end": 0.4}, "The axis is empty"),
        ("basin_shares", {"begin": 0.4, "end": 0.4}, "The axis is empty"),
        ("resilience", {"begin": 0.4, "end": 0.4}, "The axis is empty"),
        ("resilience", {"gravity": 0.0}, "gravity: got 0.0, allowed: a finite number >= 1e-09"),
        (
            "bifurcation",
            {"begin": 0.3},
            "begin: got 0.3, allowed: Γ at least (1 − ε)/(1 + ε) = 0.3",
        ),
        (
            "bifurcation",
            {"along": "restitution", "begin": 0.1, "end": 0.6},
            "begin: got 0.1, allowed: ε at least (1 − Γ)/(1 + Γ) = 0.37931 at Γ = 0.45. The",
        ),
        (
            "bifurcation",
            {"along": "phase_lag", "begin": 0.1, "end": 0.6, "axial_forcing": 0.2},
            "axial_forcing: got 0.2, allowed: Γ at least (1 − ε)/(1 + ε) = 0.333333 at ε = 0.5",
        ),
        ("bifurcation", {"along": "restitution", "end": 1.5}, "end: got 1.5"),
        ("bifurcation", {"kept": 3000}, "kept: got 3000, allowed: at most measured = 2000"),
        ("bifurcation", {"starts": 5, "initial_velocity": -1.0}, "allowed: 0 with starts. The 5"),
        ("bifurcation", {"starts": 5, "initial_phase": 1.0}, "initial_phase: got 1.0, allowed: 0"),
        ("bifurcation", {"initial_phase": 1.0}, "initial_phase: got 1.0, allowed: 0 without"),
        ("bifurcation", {"starts": 5, "velocity_begin": 0.0}, "The window is empty"),
        ("bifurcation", {"velocity_begin": -3.0}, "velocity_begin: got -3.0, allowed: none with"),
        ("bifurcation", {"starts": -1}, "starts: got -1, allowed: an integer >= 0"),
        ("parameter_map", {"x_axis": "gravity"}, "x_axis: got 'gravity', allowed: one of axial"),
        ("parameter_map", {"y_axis": "axial_forcing"}, "allowed: another parameter than x_axis"),
        ("parameter_map", {"x_begin": 0.8}, "x_begin: got 0.8, allowed: less than x_end = 0.7"),
        ("parameter_map", {"x_begin": -0.1}, "x_begin: got -0.1, allowed: a number >= 0 (Γ)"),
        ("parameter_map", {"y_end": 1.0}, "y_end: got 1.0, allowed: less than 1. At 1 the map"),
        ("parameter_map", {"y_axis": "phase_lag", "restitution": 1.0}, "it has no attractors"),
        (
            "parameter_map",
            {"start": "orbit"},
            "start: got 'orbit', allowed: period-1, contact",
        ),
        ("parameter_map", {"initial_velocity": -1.0}, "allowed: 0 with start:=period-1. start is"),
        ("parameter_map", {"start": "given"}, "initial_velocity: got 0.0, allowed: < 0"),
        ("parameter_map", {"measured": 100}, "measured: got 100, allowed: an integer >= 256"),
        ("toss_map", {"phase_lag_begin": 4.0}, "The map is empty"),
        ("toss_paths", {"phase_lags": "0 x"}, "phase_lags: got 'x', allowed: angles in rad"),
        ("toss_paths", {"phase_lags": ""}, "phase_lags: got ''"),
        ("toss_paths", {"phase_lags": "0 0.1"}, "as many angles as phase_lags, 2"),
        ("motor", {"x_axis": "load_inertia"}, "x_axis: got 'load_inertia', allowed: one of load_t"),
        ("motor", {"x_axis": "torque"}, "load_torque"),
        ("motor", {"y_axis": "load_torque"}, "y_axis: got 'load_torque', allowed: another paramet"),
        ("motor", {"x_begin": 0.02}, "x_begin: got 0.02, allowed: less than x_end = 0.016"),
        ("motor", {"brake_torque": -1.0}, "brake_torque: got -1.0, allowed: a finite number >= 0"),
        ("motor", {"load_inertia": -1e-09}, "load_inertia: got -1e-09, allowed: a finite number >"),
        ("motor", {"x_axis": "brake_torque", "x_begin": -0.01}, "x_begin: got -0.01, allowed: a f"),
        ("motor", {"x_begin": 0.1, "x_end": 0.2}, "runs away at every point"),
        ("motor", {"x_axis": "restitution", "x_end": 0.5, "load_torque": -0.1}, "load_torque: got"),
        ("motor", {"axial_amplitude": 0.0, "angular_amplitude": 0.0, "x_end": 0.001}, "nothing mo"),
        ("motor", {"friction": 0.0, "x_axis": "brake_torque"}, "friction: got 0.0, allowed: > 0, "),
        ("motor", {"y_begin": 35.0, "y_end": 40.0, "brake_torque": 1.0}, "brake_torque: got 1.0,"),
        ("motor", {"y_begin": -1.0, "y_end": 40.0}, "y_begin: got -1.0, allowed: > −mass × gravit"),
        ("motor", {"restitution": 1.0}, "restitution"),
        ("motor", {"x_axis": "restitution", "x_end": 1.0}, "x_end: got 1.0, allowed: less than 1"),
        ("motor", {"start": "orbit"}, "start: got 'orbit', allowed: period-1, rest or f"),
        ("motor", {"longest": 500}, "longest: got 500, allowed: >= settling + 2 measured = 1324"),
        ("curves", {"restitution": 1.0, "restitution_end": 0.9}, "it has no attractors"),
        ("curves", {"axial_forcing_begin": 0.9}, "allowed: less than axial_forcing_end = 0.8"),
        ("curves", {"axial_forcing": 0.9}, "axial_forcing: got 0.9, allowed: within the window"),
        ("manifolds", {"velocity": "after"}, "before: manifolds are those of w_A"),
        ("manifolds", {"restitution": 0.0}, "no state has a past"),
        ("resilience", {"along": "phase_lag"}, "depends on the rotation"),
        ("resilience", {"along": "friction"}, "one of axial_forcing, restitution"),
        ("curves", {"phase_lag": 0.5}, "depends on the rotation"),
        ("curves", {"x_axis": "angular_forcing"}, "depends on the rotation"),
        ("manifolds", {"angular_forcing": 9.0}, "depends on the rotation"),
        ("resilience", {"along": "restitution", "end": 1.0}, "end: got 1.0, allowed: less than 1"),
        ("resilience", {"after": "5 -1"}, "numbers of periods above 0"),
        ("resilience", {"velocity_begin": 0.0}, "The window is empty"),
    ],
)
def test_what_cannot_be_used_is_one_line_before_any_work(
    name: str, given: dict[str, float | str], words: str
) -> None:
    with pytest.raises(InputError) as caught:
        named(name, **given)
    assert words in caught.value.line
    assert "\n" not in caught.value.line


@pytest.mark.parametrize(("restitution", "begin"), [(0.5, 0.335), (0.3, 0.541154), (0.7, 0.177353)])
def test_a_diagram_begins_by_itself_where_the_period_one_orbit_does(
    restitution: float, begin: float
) -> None:
    given = named("bifurcation", begin=0.0, restitution=restitution).parameters
    assert given["begin"] == begin
    assert named("bifurcation", starts=5, begin=0.0).parameters["begin"] == 0.0
