"""Pinned studies, bags and analyses of recorded runs."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

from bouncing_disk_ros.executables import loaded
from bouncing_disk_ros.study.by_name import definition_of
from reference import test_version_0_2_0
from support import pinned_results as results
from support.pinned_draws import PinnedRun, Runs, plain

SIZE = {"width": 16, "height": 12}
FEW = {"settling": 200, "measured": 300}
TOSSES = {"phase_lag_count": 9, "amplitude_angle_count": 7, "phase_lag_begin": -1.5}
STUDIES: dict[str, tuple[dict[str, Any], ...]] = {
    "basins": (
        *({"axial_forcing": one, **SIZE} for one in (0.3, 0.34, 0.45, 0.49, 0.55, 0.6)),
        {"axial_forcing": 0.45, "restitution": 0.3, **SIZE},
        {"axial_forcing": 0.45, "velocity": "after", "velocity_begin": -2.5, **SIZE},
        {"axial_forcing": 0.45, "angular_velocities": "0 -2", "phase_lag": 0.2,
         "angular_forcing": 20.0, **SIZE},
    ),
    "bifurcation": (
        {"count": 20, "kept": 20, "doublings": 2, "initial_velocity": -1.3, **FEW},
        {"begin": 0.6, "end": 0.4, "count": 9, "kept": 10, "doublings": 0, "initial_phase": 1.0,
         "initial_velocity": -1.0, **FEW},
        {"along": "restitution", "begin": 0.45, "end": 0.6, "count": 9, "kept": 5,
         "doublings": 1, "initial_velocity": -1.3, **FEW},
        {"along": "phase_lag", "begin": -1.0, "end": 1.0, "count": 9, "kept": 5,
         "initial_velocity": -1.3, **FEW},
        {"along": "angular_forcing", "begin": 5.0, "end": 50.0, "count": 9, "kept": 5,
         "initial_velocity": -1.3, **FEW},
        {"starts": 7, "count": 5, "kept": 5, "doublings": 0, **FEW},
        {"starts": 5, "count": 3, "kept": 3, "along": "restitution", "begin": 0.1, "end": 0.9,
         "doublings": 0, **FEW},
    ),
    "parameter_map": (
        {"x_count": 9, "y_count": 7, "x_end": 0.47, "y_begin": 0.45, "y_end": 0.6,
         "settling": 2000, "measured": 300},
        {"x_count": 5, "y_count": 4, "start": "contact", **FEW},
        {"x_axis": "phase_lag", "x_begin": -1.0, "x_end": 1.0, "y_axis": "angular_forcing",
         "y_begin": 2.0, "y_end": 60.0, "x_count": 5, "y_count": 4, **FEW},
        {"x_count": 5, "y_count": 4, "start": "given", "initial_phase": 1.0,
         "initial_velocity": -1.2, **FEW},
    ),
    "basin_shares": (
        {"count": 2, "samples": 10, "begin": 0.34, "end": 0.45},
        {"count": 2, "samples": 10, "along": "restitution", "begin": 0.3, "end": 0.5},
        {"count": 2, "samples": 8, "along": "angular_forcing", "begin": 5.0, "end": 50.0},
    ),
    "toss_map": (
        TOSSES,
        {"friction": 0.2, "preload": 0.5, "initial_forcing_phase": 4.5, **TOSSES},
    ),
    "toss_paths": (
        {"points": 33},
        {"points": 17, "phase_lags": "0 0.3pi", "amplitude_angles": "0.1pi 0.2pi"},
        {"points": 16, "phase_lags": "1", "amplitude_angles": "0.7", "friction_radius": 0.2},
    ),
    **{
        name: (test_version_0_2_0.STUDIES[name],)
        for name in ("curves", "motor", "manifolds", "resilience", "juggling")
    },
}  # fmt: skip

MULTIPLE = {"preset": "pizza_multiple_toss"}
INPUTS = (
    (0.5, "command", (0.4, 0.02, 0.8, 4.0, 0.3)),
    (1.0, "impulse", (0.05, 0.002)),
    (1.2, "change", (("restitution", 0.3), ("friction", 0.2))),
    (1.5, "pause", (False,)),
    (1.8, "snapshot", ()),
    (2.0, "impulse", (-0.1, 0.0)),
    (2.2, "pause", (True,)),
    (2.5, "reset", ()),
    (2.6, "change", (("preload", 0.5),)),
)
BAGS: dict[str, dict[str, Any]] = {
    "period-1": {"seconds": 4.0, **MULTIPLE},
    "defaults": {"seconds": 3.0},
    "inputs of every kind": {"seconds": 4.0, "acts": INPUTS},
    "inputs to period-1": {"seconds": 4.0, "acts": INPUTS, **MULTIPLE},
    "a namespace": {"seconds": 1.0, "namespaces": ("/stage/left",)},
    "two simulators": {"seconds": 1.0, "namespaces": ("/left", "/right")},
    "started again": {"seconds": 1.0, "namespaces": ("", ""), "apart": 5.0},
    "lost rows": {"seconds": 3.0, "lose": (3, 4, 9), **MULTIPLE},
    "few topics": {"seconds": 2.0, "without": ("joint_states", "/diagnostics")},
    "chatter": {"seconds": 2.0, "axial_amplitude": 0.02, "initial_height": 0.1},
    "one row for each impact": {"seconds": 2.0, "axial_amplitude": 0.02, "initial_height": 0.1,
                                "chatter_report_speed": 0.0},
    "chaos": {"seconds": 4.0, "axial_amplitude": 0.055},
    "lz4": {"seconds": 2.0, "options": {"compression": "lz4"}},
    "not compressed": {"seconds": 2.0, "options": {"compression": "none"}},
    "small chunks": {"seconds": 2.0, "options": {"chunk_size": 2000}},
    "split": {"seconds": 4.0, "options": {"max_duration": 1.0}},
}  # fmt: skip
RUNS: dict[str, dict[str, Any]] = {
    "period-1": {"seconds": 20.0, **MULTIPLE},
    "chaos": {"seconds": 60.0, "axial_amplitude": 0.0475, "angular_amplitude": 1.0,
              "friction": 0.15},
    "chatter": {"seconds": 20.0, "axial_amplitude": 0.035, "angular_amplitude": 0.6},
}  # fmt: skip


def studied(name: str, given: dict[str, Any], folder: Path) -> Any:
    return results.studied(folder, name, **given)


def a_bag(given: dict[str, Any], folder: Path) -> Path:
    return results.recorded(folder, **given)


def bag_content(given: dict[str, Any], folder: Path) -> Any:
    return results.content(a_bag(given, folder))


def recovered(given: dict[str, Any], folder: Path) -> Any:
    return results.content(results.recovered(a_bag(given, folder)))


def replayed_bag(given: dict[str, Any], folder: Path) -> Any:
    return results.replayed_bag(a_bag(given, folder))


def reported(given: dict[str, Any], wish: dict[str, Any], folder: Path) -> Any:
    found = results.report(a_bag(given, folder), **wish)
    return [results.report_numbers(found), results.table_numbers(found)]


def observed(name: str, what: str) -> Any:
    return getattr(results.Observed(**RUNS[name]), what)()


OTHERS = ("basins 0", "basins 3", "basins 5", "bifurcation 4", "bifurcation 6", "basin_shares 2",
          "toss_map 1")  # fmt: skip
"""Studies that take the way of another one with other numbers."""


def runs() -> Runs:
    """All of this file."""
    for name, many in STUDIES.items():
        for number, given in enumerate(many):
            work = partial(studied, name, given)
            in_lanes = name not in ("bifurcation", "toss_paths") or "starts" in given
            title = f"{name} {number}"
            is_another = title in OTHERS
            revision = loaded(definition_of(name).study).revision
            yield PinnedRun("study", f"{title}, revision {revision}", work, in_lanes, is_another)
    for name, given in BAGS.items():
        yield PinnedRun("bag", name, partial(bag_content, given))
    for name in ("defaults", "inputs of every kind"):
        yield PinnedRun("bag", f"{name}, cut and mended", partial(recovered, BAGS[name]))
    for name in ("inputs of every kind", "started again"):
        yield PinnedRun("bag", f"{name}, replayed", partial(replayed_bag, BAGS[name]))
    long = {"seconds": 12.0, **MULTIPLE}  # of less, the fit of the transient is ill-conditioned
    yield PinnedRun("analysis", "report on period-1", partial(reported, long, {}))
    for name in ("inputs of every kind", "inputs to period-1", "chaos", "chatter",
                 "lost rows"):  # fmt: skip
        yield PinnedRun("analysis", f"report on {name}", partial(reported, BAGS[name], {}))
    cut = {"begin": 1.0, "end": 2.5, "choice": "last"}
    yield PinnedRun("analysis", "report on a part", partial(reported, BAGS["chaos"], cut))
    for name in RUNS:
        # on the period-1 orbit nothing is left of the transient but roundings to fit
        more = () if name == "period-1" else ("transient",)
        for what in ("estimates", "section", "orbit", "energy", *more):
            yield plain("analysis", f"{what} of {name}", observed, name, what)
