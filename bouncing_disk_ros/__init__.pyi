"""Public names of the package, for type checkers and for `PublicNames`."""

from . import bag as bag
from . import plots as plots
from . import study as study
from .cases.comparison import Comparison as Comparison
from .cases.comparison import compare_with_case as compare_with_case
from .cases.files import ReferenceCase as ReferenceCase
from .cases.files import reference_case as reference_case
from .cases.files import reference_cases as reference_cases
from .core.simulation import Simulation as Simulation
from .errors import FailedError as FailedError
from .errors import InputError as InputError
from .maps.attractor_search import find_attractors as find_attractors
from .maps.attractors import Attractor as Attractor
from .maps.attractors import AttractorKind as AttractorKind
from .maps.attractors import Attractors as Attractors
from .maps.basin_labels import label_starts as label_starts
from .maps.basin_measures import basin_entropy as basin_entropy
from .maps.basin_measures import box_dimension as box_dimension
from .maps.basin_measures import uncertainty_exponent as uncertainty_exponent
from .maps.best_lag import best_lag as best_lag
from .maps.bifurcations import period_doublings as period_doublings
from .maps.next_collision import Impacts as Impacts
from .maps.next_collision import MapState as MapState
from .maps.next_collision import NextCollisionMap as NextCollisionMap
from .maps.next_collision import spread_starts as spread_starts
from .maps.periodic_orbit import PeriodicOrbit as PeriodicOrbit
from .maps.periodic_orbit import fixed_point as fixed_point
from .maps.periodic_orbit import periodic_orbit as periodic_orbit
from .maps.tosses import TossSetting as TossSetting
from .maps.tosses import toss as toss
from .measured.fit import fit_impacts as fit_impacts
from .measured.result import ImpactFit as ImpactFit
from .measured.sound import ImpactSound as ImpactSound
from .measured.sound import impact_times as impact_times
from .nodes.simulator.simulator_node import SimulatorNode as SimulatorNode
from .orbit_studies.curve_family import curve_family as curve_family
from .orbit_studies.edge_states import EdgeState as EdgeState
from .orbit_studies.edge_states import edge_state as edge_state
from .orbit_studies.edge_states import saddle_of as saddle_of
from .orbit_studies.fatal_changes import FatalRule as FatalRule
from .orbit_studies.fatal_changes import fatal_impulses as fatal_impulses
from .orbit_studies.fatal_changes import fatal_timing_errors as fatal_timing_errors
from .orbit_studies.manifold_growth import GrowthRule as GrowthRule
from .orbit_studies.manifold_growth import Manifold as Manifold
from .orbit_studies.manifold_growth import enclosed_share as enclosed_share
from .orbit_studies.manifold_growth import saddle_manifolds as saddle_manifolds
from .orbit_studies.orbit_branch import orbit_curve as orbit_curve
from .orbit_studies.orbit_curves import Curve as Curve
from .orbit_studies.orbit_curves import Window as Window
from .orbit_studies.orbit_instants import instants_of as instants_of
from .report.estimate import Estimate as Estimate
from .report.estimate import friction_of as friction_of
from .report.estimate import platform_velocities as platform_velocities
from .report.estimate import restitution_of as restitution_of
from .report.orbit import Orbit as Orbit
from .report.orbit import orbit_of as orbit_of
from .report.read_run import read_run as read_run
from .report.run_record import RunRecord as RunRecord
from .report.run_summary import summary_of as summary_of
from .ros.from_messages import impacts_from_msg as impacts_from_msg
from .run.presets import load_preset as load_preset
from .run.presets import preset_names as preset_names
from .run.programmes import load_programme as load_programme
from .run.programmes import programme_names as programme_names
from .run.simulate import Result as Result
from .run.simulate import simulate as simulate
from .study.by_name import figures as figures
from .study.runner import StudyFunction
from .study.runner import run_study as run_study
from .study.store import open_result as open_result

NEED_ROS: tuple[str, ...]
__all__: list[str]
__version__: str

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
