"""A disk that bounces and turns on a vibrating platform, simulated exactly and in real time.

What a user calls is a name of this package (`dir(bouncing_disk_ros)`), or in `bag`, `plots` and
`study`; none but `SimulatorNode` needs ROS:

>>> from bouncing_disk_ros import basins, fixed_point, simulate
>>> impacts = simulate(10.0, axial_forcing=0.45, frequency=3.0).impacts
>>> fixed_point(0.45, 0.5).multipliers
>>> basins(axial_forcing=0.34, width=60, height=60)["fraction"]

docs/architecture.md says which folder holds what, and which may import which.

Importing the package is cheap: what is named below is loaded when first used.
"""

from __future__ import annotations

import bouncing_disk_ros.safe_path  # before anything else is looked for

# isort: split
import bouncing_disk_ros.early_signals  # noqa: F401 (before what takes time)

# isort: split
import functools
import importlib
from typing import TYPE_CHECKING

from bouncing_disk_ros.executables import STUDIES as _STUDIES
from bouncing_disk_ros.kernel_cache import use_numba_cache as _use_numba_cache

if TYPE_CHECKING:
    from bouncing_disk_ros import bag, plots, study
    from bouncing_disk_ros.cases.comparison import Comparison, compare_with_case
    from bouncing_disk_ros.cases.files import ReferenceCase, reference_case, reference_cases
    from bouncing_disk_ros.core.simulation import Simulation
    from bouncing_disk_ros.errors import FailedError, InputError
    from bouncing_disk_ros.maps.attractor_search import find_attractors
    from bouncing_disk_ros.maps.attractors import Attractor, AttractorKind, Attractors
    from bouncing_disk_ros.maps.basin_labels import label_starts
    from bouncing_disk_ros.maps.continuation import period_doublings
    from bouncing_disk_ros.maps.label_maps import (
        basin_entropy,
        box_dimension,
        uncertainty_exponent,
    )
    from bouncing_disk_ros.maps.mean_speed import best_lag
    from bouncing_disk_ros.maps.next_collision import (
        Impacts,
        MapState,
        NextCollisionMap,
        spread_starts,
    )
    from bouncing_disk_ros.maps.periodic_orbit import (
        PeriodicOrbit,
        fixed_point,
        periodic_orbit,
    )
    from bouncing_disk_ros.maps.tosses import TossSetting, toss
    from bouncing_disk_ros.measured.fit import ImpactFit, fit_impacts
    from bouncing_disk_ros.measured.sound import ImpactSound, impact_times
    from bouncing_disk_ros.nodes.simulator.simulator_node import SimulatorNode as SimulatorNode
    from bouncing_disk_ros.report.estimate import (
        Estimate,
        friction_of,
        platform_velocities,
        restitution_of,
    )
    from bouncing_disk_ros.report.orbit import Orbit, orbit_of
    from bouncing_disk_ros.report.read_run import read_run
    from bouncing_disk_ros.report.run_record import RunRecord
    from bouncing_disk_ros.report.run_summary import summary_of
    from bouncing_disk_ros.resilience_studies.curve_family import curve_family
    from bouncing_disk_ros.resilience_studies.edge_states import (
        EdgeState,
        edge_state,
        saddle_of,
    )
    from bouncing_disk_ros.resilience_studies.fatal_changes import (
        FatalRule,
        fatal_impulses,
        fatal_timing_errors,
        instants_of,
    )
    from bouncing_disk_ros.resilience_studies.manifold_growth import (
        GrowthRule,
        Manifold,
        enclosed_share,
        saddle_manifolds,
    )
    from bouncing_disk_ros.resilience_studies.orbit_branch import orbit_curve
    from bouncing_disk_ros.resilience_studies.orbit_curves import Curve, Window
    from bouncing_disk_ros.ros.from_messages import impacts_from_msg
    from bouncing_disk_ros.run.presets import load_preset, preset_names
    from bouncing_disk_ros.run.programmes import load_programme, programme_names
    from bouncing_disk_ros.run.simulate import Result, simulate
    from bouncing_disk_ros.study.definition import figures
    from bouncing_disk_ros.study.runner import StudyFunction
    from bouncing_disk_ros.study.runner import run as run_study
    from bouncing_disk_ros.study.store import open_result

    basin_shares: StudyFunction
    basins: StudyFunction
    bifurcation: StudyFunction
    curves: StudyFunction
    manifolds: StudyFunction
    motor: StudyFunction
    parameter_map: StudyFunction
    resilience: StudyFunction
    toss_map: StudyFunction
    toss_paths: StudyFunction

_FUNCTIONS = tuple(
    name for name, (module, _) in _STUDIES.items() if not module.startswith(f"{name}.")
)
"""Studies that are functions of this package: those whose name is not that of a folder in it."""
#: module that has them -> public names
_PUBLIC = {
    "maps.attractor_search": "find_attractors",
    "maps.attractors": "Attractor AttractorKind Attractors",
    "maps.basin_labels": "label_starts",
    "maps.mean_speed": "best_lag",
    "maps.label_maps": "basin_entropy box_dimension uncertainty_exponent",
    "maps.continuation": "period_doublings",
    "resilience_studies.curve_family": "curve_family",
    "resilience_studies.edge_states": "EdgeState edge_state saddle_of",
    "resilience_studies.fatal_changes": "FatalRule fatal_impulses fatal_timing_errors instants_of",
    "resilience_studies.manifold_growth": "GrowthRule Manifold enclosed_share saddle_manifolds",
    "maps.next_collision": "Impacts MapState NextCollisionMap spread_starts",
    "resilience_studies.orbit_branch": "orbit_curve",
    "resilience_studies.orbit_curves": "Curve Window",
    "maps.periodic_orbit": "PeriodicOrbit fixed_point periodic_orbit",
    "measured.fit": "ImpactFit fit_impacts",
    "measured.sound": "ImpactSound impact_times",
    "report.estimate": "Estimate friction_of platform_velocities restitution_of",
    "report.orbit": "Orbit orbit_of",
    "report.run_record": "RunRecord",
    "report.run_summary": "summary_of",
    "maps.tosses": "TossSetting toss",
    "cases.comparison": "Comparison compare_with_case",
    "cases.files": "ReferenceCase reference_case reference_cases",
    "core.simulation": "Simulation",
    "errors": "FailedError InputError",
    "report.read_run": "read_run",
    "nodes.simulator.simulator_node": "SimulatorNode",
    "ros.from_messages": "impacts_from_msg",
    "run.presets": "load_preset preset_names",
    "run.programmes": "load_programme programme_names",
    "run.simulate": "Result simulate",
    "study.runner": " ".join(("run_study", *_FUNCTIONS)),
    "study.definition": "figures",
    "study.store": "open_result",
}
_MODULES = ("bag", "plots", "study")
NEED_ROS = ("SimulatorNode",)
"""Public names that cannot be had where ROS 2 is not installed: not in __all__."""
#: public name -> the module that has it
_HOMES = {name: module for module, names in _PUBLIC.items() for name in names.split()}
_RENAMED = {"run_study": "run"}
"""Public names that their module calls otherwise."""

__all__ = [
    "Attractor", "AttractorKind", "Attractors", "Comparison", "Curve", "EdgeState", "Estimate",
    "FailedError", "FatalRule", "GrowthRule", "ImpactFit", "ImpactSound", "Impacts", "InputError",
    "Manifold", "MapState",
    "NextCollisionMap", "Orbit", "PeriodicOrbit", "ReferenceCase", "Result", "RunRecord",
    "Simulation", "TossSetting", "Window", "__version__", "bag", "basin_entropy", "best_lag",
    "box_dimension", "compare_with_case", "curve_family", "edge_state", "enclosed_share",
    "fatal_impulses", "fatal_timing_errors", "figures", "find_attractors", "fit_impacts",
    "fixed_point",
    "friction_of", "impact_times", "impacts_from_msg", "instants_of", "label_starts", "load_preset",
    "load_programme", "open_result", "orbit_curve", "orbit_of", "period_doublings",
    "periodic_orbit", "platform_velocities", "plots", "preset_names", "programme_names",
    "read_run", "reference_case", "reference_cases", "restitution_of", "run_study",
    "saddle_manifolds", "saddle_of", "simulate", "spread_starts", "study", "summary_of", "toss",
    "uncertainty_exponent", *_FUNCTIONS,
]  # fmt: skip

_use_numba_cache()  # before anything here imports numba, which reads the setting once


def __getattr__(name: str) -> object:
    """Load a public name when it is first used (PEP 562)."""
    if name == "__version__":
        value: object = _version()
    elif name in _MODULES:
        value = importlib.import_module(f"{__name__}.{name}")
    elif name in _HOMES:
        value = _loaded(name)
    else:
        from bouncing_disk_ros.errors import closest

        hint = closest(name, [*__all__, *NEED_ROS])
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}. {hint}".rstrip(". "))
    globals()[name] = value
    return value


def _loaded(name: str) -> object:
    """A public name from its module, whose kernels may have to be compiled first."""
    if name in NEED_ROS:
        from bouncing_disk_ros.environment import ros_is_here

        if not ros_is_here():
            raise ImportError(f"{name} needs ROS 2, which is not installed here")
    module = f"{__name__}.{_HOMES[name]}"
    if _HOMES[name] != "errors":
        _announce_compilation()
    return getattr(importlib.import_module(module), _RENAMED.get(name, name))


@functools.cache
def _announce_compilation() -> None:
    """Let the first compilation of a kernel say on stderr what it is; once."""
    from bouncing_disk_ros.kernel_cache import announce_compilation

    announce_compilation(__name__, own_process=False)


def __dir__() -> list[str]:
    """List the public names, loaded or not."""
    return sorted({*__all__, *NEED_ROS, *(name for name in globals() if name.startswith("__"))})


def _version() -> str:
    """Return the version of the sources (package.xml beside them), else the installed one."""
    from importlib.metadata import version
    from pathlib import Path
    from xml.etree import ElementTree as ET

    manifest = Path(__file__).resolve().parent.parent / "package.xml"
    if manifest.is_file():
        return ET.parse(manifest).getroot().findtext("version") or ""  # noqa: S314 (our own file)
    return version("bouncing_disk_ros")
