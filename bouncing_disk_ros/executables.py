"""The one table of executables: a name is that of the console script and of the node.

Read by `setup.py` (which may import nothing of the package, so this file imports nothing), by
`python -m bouncing_disk_ros` and by the tests.
"""

from __future__ import annotations

import importlib
from typing import Any

#: name of the study -> the module of its definition and executable, and what it does, in one line
STUDIES: dict[str, tuple[str, str]] = {
    "toss_paths": (
        "study.toss_paths.options",
        "draw the paths of the tossing hand (Fig. 1 of the paper)",
    ),
    "toss_map": (
        "study.toss_map.options",
        "map single tosses over phase lag and amplitude angle: airborne speed (Fig. 2)",
    ),
    "bifurcation": (
        "study.bifurcation.options",
        "follow an attractor along a parameter: bifurcation diagram (Fig. 3)",
    ),
    "parameter_map": (
        "study.parameter_map.options",
        "map attractors over two parameters: period, Lyapunov exponent, speed",
    ),
    "curves": (
        "orbit_studies.curves.options",
        "follow folds, doublings, grazes and onset of contact over two parameters",
    ),
    "motor": (
        "motor_study.options",
        "map speed, torque and efficiency of an ultrasonic motor over two parameters",
    ),
    "basins": (
        "study.basins.options",
        "map which attractor each start goes to: basins of attraction (Fig. 4)",
    ),
    "manifolds": (
        "orbit_studies.manifolds.options",
        "draw the saddles between basins and their manifolds over the basins",
    ),
    "basin_shares": (
        "study.basin_shares.options",
        "map the shares of the basins over a parameter, with the best phase lag",
    ),
    "resilience": (
        "orbit_studies.resilience.options",
        "measure fatal impulses and timing errors, times and shares of attractors",
    ),
    "juggling": (
        "juggling.options",
        "map which starts each strategy of control captures, under which errors",
    ),
}
#: name of the executable -> its module, and what it does, in one line
_TABLE: dict[str, tuple[str, str]] = {
    "simulator": (
        "nodes.simulator.simulator",
        "simulate the disk in real time: take platform commands, publish disk state and impacts",
    ),
    "perform": (
        "nodes.perform",
        "publish a programme of platform motions on the command topic",
    ),
    "echo_impacts": (
        "nodes.echo_impacts",
        "print the impacts of disk/impacts as readable rows",
    ),
    "juggle": (
        "juggling.juggle",
        "keep a multiple toss going: impacts in, offset trajectories of the platform out",
    ),
    "recorder": (
        "nodes.recorder.recorder",
        "record topics to an MCAP bag that every ROS 2 tool opens",
    ),
    "replay": (
        "nodes.replay.replay",
        "simulate a recorded run again from its inputs: bit-identical, or changed",
    ),
    "bag_recover": (
        "report.bag_recover",
        "repair a bag that is incomplete or damaged",
    ),
    "bag_report": (
        "report.bag_report",
        "report on a recorded run from its bag: summary, figures, a page of plots",
    ),
    **STUDIES,
    "reference_cases": (
        "cases.reference_cases",
        "list the reference cases: events of the rigid-impact law with certain bounds",
    ),
    "compare_with_case": (
        "cases.compare_with_case",
        "compare any simulator's events or samples with a reference case",
    ),
    "fit_impacts": (
        "measured.fit_impacts",
        "fit measured impacts: parameters with intervals, the impacts to come, a preset",
    ),
    "impact_times": (
        "measured.impact_times",
        "find the hits in the sound of impacts: their times with errors, a picture",
    ),
    "workbench": (
        "workbench.workbench",
        "see a run and touch it on a page in the browser: live, or of a bag",
    ),
    "demo": (
        "nodes.demo.demo",
        "show the paper's main result: a helical toss leads into the period-1 orbit",
    ),
}
#: name of the executable -> what it does, in one line
EXECUTABLES = {name: summary for name, (_, summary) in _TABLE.items()}


def module_of(name: str) -> str:
    """Return the module of the executable called `name` (one of `EXECUTABLES`)."""
    return f"bouncing_disk_ros.{_TABLE[name][0]}"


def entry_point(name: str) -> str:
    """Return `module:function` of the executable called `name` (one of `EXECUTABLES`)."""
    return f"{module_of(name)}:main"


PROVE_BAG = "bouncing_disk_ros.proof.bag_proof:prove_bag"
"""What `bag_report --prove` calls. It belongs to an extension, which the base never imports."""


def loaded(entry: str) -> Any:
    """What `module:name` names."""
    module, name = entry.split(":")
    return getattr(importlib.import_module(module), name)
