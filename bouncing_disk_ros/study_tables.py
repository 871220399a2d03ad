"""The one table of the options of every study: for the nodes, --help, docs and Python alike.

Like `parameters`, it imports nothing heavy.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from types import MappingProxyType

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.parameters import TABLE, Spec, Value

_PAPER = "paper, Fig. 2"
_TOSS = (
    Spec("arc_amplitude", 0.25, "m", "amplitude of the path of the hand, c = √(A² + (a_e Φ)²)", "c",
         low=1e-9, high=1e6, source=_PAPER),
    Spec("gravity", 10.0, "m/s²", "acceleration of gravity", "g", low=1e-9, high=1e9,
         source=_PAPER),
    *(TABLE[name] for name in ("frequency", "mass", "friction", "friction_radius",
                               "gyration_radius", "preload", "load_torque")),
)  # fmt: skip
"""What the studies of single tosses share; the defaults are those of the paper."""

_TOSS_PATHS = (
    *_TOSS,
    Spec("phase_lags", "-0.5pi -0.25pi 0 -0.25pi -0.25pi -0.25pi", "rad",
         "phase lag of each path, separated by blanks; 0.25pi is π/4", "θ"),
    Spec("amplitude_angles", "0.25pi 0.25pi 0.25pi 0.125pi 0.25pi 0.375pi", "rad",
         "amplitude angle of each path, one for each phase lag", "φ_L"),
    Spec("points", 721, "", "points of each path", low=16, high=1_000_000),
)  # fmt: skip
_TOSS_MAP = (
    *_TOSS,
    Spec("phase_lag_begin", -math.pi, "rad", "least phase lag", "θ", low=-1e3, high=1e3),
    Spec("phase_lag_end", math.pi, "rad", "largest phase lag", "θ", low=-1e3, high=1e3),
    Spec("phase_lag_count", 721, "", "number of phase lags", low=2, high=1_000_000),
    Spec("amplitude_angle_begin", 0.0, "rad", "least amplitude angle", "φ_L", low=0.0,
         high=math.pi / 2),
    Spec("amplitude_angle_end", math.pi / 2, "rad", "largest amplitude angle", "φ_L", low=0.0,
         high=math.pi / 2),
    Spec("amplitude_angle_count", 361, "", "number of amplitude angles", low=2, high=1_000_000),
    Spec("initial_angular_velocity", 0.0, "rad/s", "angular velocity of the disk at the start, "
         "absolute", "α̇", low=-1e6, high=1e6),
    Spec("initial_forcing_phase", 1.5 * math.pi, "rad", "forcing phase at the start; 3π/2: the "
         "lowest point", "τ", low=-1e3, high=1e3),
    Spec("trajectory_lags", "0 0.5pi", "rad", "phase lags of the tosses drawn in time (Fig. 2d)"),
    Spec("trajectory_angle", math.pi / 4, "rad", "amplitude angle of these", "φ_L", low=0.0,
         high=math.pi / 2),
)  # fmt: skip
_BIFURCATION = (
    Spec("along", "axial_forcing", "", "the parameter of the axis: axial_forcing, restitution, "
         "phase_lag or angular_forcing"),
    Spec("begin", 0.335, "", "first value of it; 0 along axial_forcing, where the period-1 orbit "
         "is followed: just above where that orbit begins", low=-1e6, high=1e6, angle=True),
    Spec("end", 0.65, "", "last value of it; less than begin: downward", low=-1e6, high=1e6,
         angle=True),
    Spec("count", 1261, "", "number of values", low=1, high=10_000_000),
    Spec("axial_forcing", 0.45, "1", "axial forcing where it is not the axis", "Γ", low=0.0,
         high=1e3),
    Spec("restitution", 0.5, "1", "restitution where it is not the axis", "ε", low=0.0, high=1.0),
    Spec("phase_lag", 0.0, "rad", "phase lag where it is not the axis", "θ", low=-1e3, high=1e3),
    Spec("angular_forcing", 100.0, "1", "angular forcing where it is not the axis", "Γ_T",
         low=1e-9, high=1e12),
    Spec("initial_phase", 0.0, "rad", "forcing phase of the first impact, with initial_velocity",
         "τ", low=-1e3, high=1e3),
    Spec("initial_velocity", 0.0, "πg/ω", "w_A of the first impact; 0: start on the period-1 "
         "orbit", "w_A", low=-1e3, high=0.0),
    Spec("starts", 0, "", "initial conditions at each value, spread evenly over forcing phase and "
         "velocity, for all coexisting attractors; 0: one attractor is followed, each value "
         "starts from the last state of the one before", low=0, high=1_000_000),
    Spec("velocity_begin", -5.0, "πg/ω", "window of the starts: τ from 0 to 2π, w_A from this to "
         "0", "w_A", low=-1e3, high=0.0),
    Spec("settling", 1000, "", "impacts left out at each value; with starts above 0, speeds need "
         "more where impacts are weak: about 10000", low=0, high=100_000_000),
    Spec("measured", 2000, "", "impacts from which means and exponent are computed", low=1,
         high=100_000_000),
    Spec("kept", 300, "", "impacts kept at each value, the last ones measured", low=1,
         high=1_000_000),
    Spec("doublings", 5, "", "period doublings to compute by continuation; 0: none", low=0,
         high=12),
    Spec("marks", "", "", "values that the picture marks with a, b, c … where its axis has them"),
)  # fmt: skip
_PARAMETER_MAP = (
    Spec("x_axis", "axial_forcing", "", "the parameter of the horizontal axis: axial_forcing, "
         "restitution, phase_lag or angular_forcing"),
    Spec("x_begin", 0.3, "", "first value of it", low=-1e6, high=1e6, angle=True),
    Spec("x_end", 0.7, "", "last value of it", low=-1e6, high=1e6, angle=True),
    Spec("x_count", 300, "", "number of values", low=1, high=1_000_000),
    Spec("y_axis", "restitution", "", "the parameter of the vertical axis"),
    Spec("y_begin", 0.2, "", "first value of it", low=-1e6, high=1e6, angle=True),
    Spec("y_end", 0.8, "", "last value of it", low=-1e6, high=1e6, angle=True),
    Spec("y_count", 300, "", "number of values", low=1, high=1_000_000),
    Spec("axial_forcing", 0.45, "1", "axial forcing where it is not an axis", "Γ", low=0.0,
         high=1e3),
    Spec("restitution", 0.5, "1", "restitution where it is not an axis", "ε", low=0.0, high=1.0),
    Spec("phase_lag", 0.0, "rad", "phase lag where it is not an axis", "θ", low=-1e3, high=1e3),
    Spec("angular_forcing", 100.0, "1", "angular forcing where it is not an axis", "Γ_T",
         low=1e-9, high=1e12),
    Spec("start", "period-1", "", "where each point starts. period-1: beside the period-1 orbit, "
         "and as contact where there is none; contact: the disk lies on the platform; given: "
         "initial_phase and initial_velocity"),
    Spec("initial_phase", 0.0, "rad", "forcing phase of the first impact, with start:=given", "τ",
         low=-1e3, high=1e3),
    Spec("initial_velocity", 0.0, "πg/ω", "w_A of the first impact, with start:=given", "w_A",
         low=-1e3, high=0.0),
    Spec("settling", 10_000, "", "impacts left out at each point", low=0, high=100_000_000),
    Spec("measured", 2000, "", "impacts from which exponent, kind and speed are computed", low=256,
         high=100_000_000),
)  # fmt: skip
_CURVES = (
    Spec("axial_forcing", 0.45, "1", "the attractors at this axial forcing ...", "Γ", low=0.0,
         high=1e3),
    Spec("restitution", 0.5, "1", "... and this restitution are the orbits whose curves are drawn",
         "ε", low=0.0, high=1.0),
    Spec("doublings", 2, "", "how many times the orbits that these double into along the forcing "
         "are followed too", low=0, high=6),
    Spec("largest_step", 0.01, "", "largest distance between points of a curve, in Γ, ε and the "
         "phases of the impacts (rad) together", low=1e-5, high=0.1),
    Spec("axial_forcing_begin", 0.3, "1", "window: least axial forcing", low=0.0, high=1e3),
    Spec("axial_forcing_end", 0.8, "1", "window: largest axial forcing", low=0.0, high=1e3),
    Spec("axial_forcing_count", 240, "", "points of the map behind the curves along it", low=1,
         high=1_000_000),
    Spec("restitution_begin", 0.2, "1", "window: least restitution", low=0.0, high=1.0),
    Spec("restitution_end", 0.8, "1", "window: largest restitution", low=0.0, high=0.999),
    Spec("restitution_count", 180, "", "points of the map along it", low=1, high=1_000_000),
    Spec("settling", 2000, "", "impacts left out at each point of the map", low=0,
         high=100_000_000),
    Spec("measured", 512, "", "impacts that its kinds are found from", low=256, high=100_000_000),
)  # fmt: skip
_SWUM: Mapping[str, float] = MappingProxyType(
    {
        "axial_amplitude": 1.0e-6, "angular_amplitude": 4.0e-4, "frequency": 40000.0,
        "phase_lag": -0.7383651652519078, "mass": 5.0e-4, "restitution": 0.5, "friction": 0.2,
        "friction_radius": 2.5e-3, "gyration_radius": 2.8284271247461901e-3,
        "gravity": 9.80665, "preload": 22.3, "load_torque": 0.0,
        "brake_torque": 0.0, "load_inertia": 0.0,
    }
)  # fmt: skip
"""A motor, as in the preset swum."""
_LOADS = (
    "load_torque, brake_torque, preload, axial_amplitude, angular_amplitude, frequency, "
    "phase_lag, restitution or friction"
)
_MOTOR = (
    Spec("x_axis", "load_torque", "", f"the parameter of the horizontal axis: {_LOADS}"),
    Spec("x_begin", 0.0, "", "first value of it, in its unit", low=-1e12, high=1e12, angle=True),
    Spec("x_end", 0.016, "", "last value of it", low=-1e12, high=1e12, angle=True),
    Spec("x_count", 200, "", "number of values", low=1, high=1_000_000),
    Spec("y_axis", "preload", "", "the parameter of the vertical axis"),
    Spec("y_begin", 15.0, "", "first value of it, in its unit", low=-1e12, high=1e12, angle=True),
    Spec("y_end", 40.0, "", "last value of it", low=-1e12, high=1e12, angle=True),
    Spec("y_count", 200, "", "number of values", low=1, high=1_000_000),
    *(replace(TABLE[name], default=value, source="as in the preset swum",
              while_unconfigured=False) for name, value in _SWUM.items()),
    Spec("start", "period-1", "", "where each point starts. period-1: beside the period-1 orbit, "
         "and as rest where there is none; rest: the rotor lies on the stator; followed: along x, "
         "each from the last state of the one before, the first one as period-1"),
    Spec("settling", 300, "", "least number of periods of the stator left out where the motion "
         "does not repeat", low=0, high=100_000_000),
    Spec("measured", 512, "", "periods of the first stretch for the means, where the state does "
         "not repeat; if it is too short, one twice as long is added, and so on",
         low=32, high=100_000_000),
    Spec("longest", 20_000, "", "largest number of periods of the stator simulated at each point",
         low=64, high=1_000_000_000),
)  # fmt: skip
_BASINS = (
    Spec("axial_forcing", 0.45, "1", "axial forcing Γ = Aω²/(πg)", "Γ", low=0.0, high=1e3),
    Spec("restitution", 0.5, "1", "coefficient of restitution", "ε", low=0.0, high=1.0),
    Spec("width", 1000, "", "pixels along the forcing phase", low=1, high=1_000_000),
    Spec("height", 1000, "", "pixels along the velocity", low=1, high=1_000_000),
    Spec("phase_begin", 0.0, "rad", "window: least forcing phase", low=-100.0, high=100.0),
    Spec("phase_end", math.tau, "rad", "window: largest forcing phase", low=-100.0, high=100.0),
    Spec("velocity_begin", -5.0, "πg/ω", "window: least relative velocity", low=-1e3, high=0.0),
    Spec("velocity_end", 0.0, "πg/ω", "window: largest relative velocity", low=-1e3, high=0.0),
    Spec("velocity", "before", "", "which velocity the window shows: before (w_A, before the first "
         "impact) or after (−u, u = −ε w_A, after it)"),
    Spec("tolerance", 1e-4, "", "distance (rad and πg/ω) at which an orbit counts as on an "
         "attractor", low=1e-12, high=0.1),
    Spec("cap", 0, "", "impacts after which a start is unresolved; 0: enough for the slowest "
         "attractor", low=0, high=10_000_000),
    Spec("angular_velocities", "", "ωΦ", "initial angular velocities of the disk, separated by "
         "blanks: also compute the mean speed that each start reaches", "α̇/(ωΦ)"),
    Spec("phase_lag", 0.0, "rad", "phase lag, with angular_velocities", "θ", low=-1e3, high=1e3),
    Spec("angular_forcing", 100.0, "1", "angular forcing, with angular_velocities", "Γ_T",
         low=1e-9, high=1e12),
)  # fmt: skip
_MANIFOLDS = (
    *(replace(spec, default={"width": 500, "height": 500}.get(spec.name, spec.default))
      for spec in _BASINS[:-3]),
    Spec("pairs", 6, "", "pairs of starts of each two basins that edge tracking begins with", low=1,
         high=10_000),
    Spec("distance", 0.01, "", "largest distance of neighbouring points of a manifold (rad and "
         "πg/ω)", low=1e-6, high=1.0),
    Spec("angle", 0.1, "rad", "largest angle by which a manifold turns between points that are not "
         "very near", low=1e-4, high=3.0),
    Spec("repetitions", 40.0, "", "how often the map over one repetition of the saddle is applied, "
         "at most", low=1.0, high=1000.0),
    Spec("points", 50_000, "", "points of one branch, at most", low=100, high=10_000_000),
)  # fmt: skip
_BASIN_SHARES = (
    Spec("along", "axial_forcing", "", "the parameter of the axis: axial_forcing, restitution or "
         "angular_forcing"),
    Spec("begin", 0.30, "", "first value of it", low=0.0, high=1e6),
    Spec("end", 0.60, "", "last value of it", low=0.0, high=1e6),
    Spec("count", 121, "", "number of values", low=1, high=1_000_000),
    Spec("axial_forcing", 0.45, "1", "axial forcing where it is not the axis", "Γ", low=0.0,
         high=1e3),
    Spec("restitution", 0.5, "1", "restitution where it is not the axis", "ε", low=0.0, high=1.0),
    Spec("angular_forcing", 100.0, "1", "angular forcing where it is not the axis", "Γ_T",
         low=1e-9, high=1e12),
    Spec("samples", 200, "", "starts along each side of the window", low=2, high=100_000),
    Spec("velocity_begin", -5.0, "πg/ω", "window of starts: τ from 0 to 2π, w_A from this to 0",
         low=-1e3, high=0.0),
)  # fmt: skip
_RESILIENCE = (
    Spec("along", "axial_forcing", "", "the parameter of the axis: axial_forcing or restitution"),
    Spec("begin", 0.32, "", "first value of it", low=0.0, high=1e3),
    Spec("end", 0.58, "", "last value of it", low=0.0, high=1e3),
    Spec("count", 66, "", "number of values", low=1, high=1_000_000),
    Spec("axial_forcing", 0.45, "1", "axial forcing where it is not the axis", "Γ", low=0.0,
         high=1e3),
    Spec("restitution", 0.5, "1", "restitution where it is not the axis", "ε", low=0.0, high=1.0),
    Spec("samples", 300, "", "starts along each side of the window", low=2, high=100_000),
    Spec("velocity_begin", -5.0, "πg/ω", "window of starts: τ from 0 to 2π, w_A from this to 0",
         low=-1e3, high=0.0),
    Spec("instants", 32, "", "instants of one repetition at which impulses act, besides the limits "
         "at its impacts", low=1, high=100_000),
    Spec("periods", 1000.0, "", "periods of the platform within which an orbit must be reached "
         "again, or it is lost", low=1.0, high=1e9),
    Spec("largest_impulse", 5.0, "m πg/ω", "impulses up to this are looked at", "J", low=0.02,
         high=1e3),
    Spec("resolution", 0.01, "", "intervals of fatal impulses and timing errors wider than this "
         "part of them are found", low=1e-5, high=1.0),
    Spec("after", "5 10 20 50 100", "", "periods of the platform after which it is counted how "
         "many starts are on each attractor: a list with blanks between"),
    Spec("match", 0.3, "", "attractors at values in a row that are nearer than this (rad and πg/ω "
         "together) are one line", low=0.0, high=100.0),
    Spec("most_attractors", 8, "", "attractors kept at each value, those with the largest shares",
         low=1, high=1000),
    replace(TABLE["mass"], source="only for results in SI units", while_unconfigured=False),
    replace(TABLE["frequency"], default=3.0, source="as in the preset pizza_multiple_toss; only "
            "for results in SI units", while_unconfigured=False),
    replace(TABLE["gravity"], default=10.0, source="as in the preset pizza_multiple_toss; only "
            "for results in SI units", while_unconfigured=False),
)  # fmt: skip

_JUGGLING = (
    Spec("strategies", "none impact_time deadbeat", "", "strategies to be compared: any of none, "
         "impact_time, deadbeat, small"),
    Spec("conditions", "nominal", "", "cases to be compared, with ; between: nominal, or "
         "NAME=VALUE with commas between; names: axial_forcing, restitution_error, delay, jitter, "
         "missed, impulse, angular_forcing, start, target, phase_lag, learn"),
    Spec("axial_forcing", 0.45, "1", "axial forcing Γ = Aω²/(πg)", "Γ", low=1e-6, high=1e3),
    Spec("restitution", 0.5, "1", "coefficient of restitution", "ε", low=0.0, high=1.0),
    Spec("width", 60, "", "starts along the forcing phase", low=1, high=100_000),
    Spec("height", 60, "", "starts along the velocity", low=1, high=100_000),
    Spec("velocity_begin", -5.0, "πg/ω", "window of starts: τ from 0 to 2π, w_A from this",
         low=-1e3, high=0.0),
    Spec("velocity_end", 0.0, "πg/ω", "window of starts: largest relative velocity", low=-1e3,
         high=0.0),
    Spec("start", "window", "", "where the runs start. window: after the impacts of the window; "
         "rest: the disk lies on the platform; period-1, or another attractor by its name: on it"),
    Spec("target", "period-1", "", "the orbit to be reached: period-1, stable or not, or another "
         "periodic attractor by its name"),
    Spec("position_limit", 0.3, "A", "largest offset, of the platform's amplitude", low=1e-6,
         high=1e3),
    Spec("acceleration_limit", 2.0, "Aω²", "largest acceleration of the offset", low=1e-3,
         high=1e6),
    Spec("small_limit", 0.02, "A", "largest offset of the strategy small", low=1e-9, high=1e3),
    Spec("restitution_error", 0.0, "1", "error of the restitution that the controller believes, "
         "in parts of the true one", low=-0.9, high=0.9),
    Spec("learn", True, "", "whether the controller corrects its restitution by what it hears"),
    Spec("delay", 0.0, "2π/ω", "time from an impact until the controller knows it, in periods",
         low=0.0, high=10.0),
    Spec("jitter", 0.0, "2π/ω", "largest error of the instant that it is told, in periods",
         low=0.0, high=1.0),
    Spec("missed", 0.0, "1", "part of the impacts that it never hears of", low=0.0, high=1.0),
    Spec("impulse", 0.0, "πg/ω", "change of the disk's velocity by an impulse in the tenth period, "
         "which the controller is not told", low=-10.0, high=10.0),
    Spec("angular_forcing", 10.0, "1", "angular forcing: an impact changes the rotor speed by at "
         "most (1 + ε)|w_A|/Γ_T", "Γ_T", low=1e-6, high=1e6),
    Spec("phase_lag", "best", "rad", "phase lag: a number, or best: θ = −τ_imp on period-1, on "
         "another target the best one where each impact removes all slip", "θ"),
    Spec("deadline", 50.0, "2π/ω", "end of each run, in periods", low=1.0, high=1e6),
    Spec("tolerance", 0.05, "", "distance (rad and πg/ω) at which an impact counts as on the orbit",
         low=1e-12, high=1.0),
    Spec("streak", 5, "", "impacts on the orbit, up to the end, that count as captured", low=1,
         high=10_000),
    Spec("seed", 1, "", "of impulses, jitter and misses", low=0, high=2**31 - 1),
)  # fmt: skip

_BAG = (
    Spec("bag", "", "", "folder of a recorded run: parameters that are not given here are those "
         "of its last steady motion up and down, and of the disk then"),
    Spec("namespace", "", "", "of the simulator, where that bag has several"),
)  # fmt: skip
_PRESET = (
    Spec("preset", "", "", "name of a preset in share/bouncing_disk_ros/config, or a file: "
         "parameters that are not given here are taken from it"),
)  # fmt: skip
_RUN = (
    Spec("output", "", "", "folder for the result and the figures; a run continues the result "
         "there; empty: output/ and the name of the study with a digest of its parameters"),
    Spec("workers", 0, "", "threads that compute; 0: one for each core", low=0, high=4096),
    Spec("scheduler", "", "", "address of a Dask scheduler whose workers compute instead, such as "
         "tcp://host:8786"),
    Spec("figures", "png pdf", "", "kinds of figure files: any of png, pdf, svg, or none",
         listed=True),
    Spec("netcdf", True, "", "also export the whole result as result.nc"),
    Spec("hold", False, "", "keep running when done, until Ctrl-C, so that the latched topics can "
         "be read"),
)  # fmt: skip


def _by_name(*specs: Spec) -> Mapping[str, Spec]:
    return MappingProxyType({spec.name: spec for spec in specs})


STUDY_TABLES: Mapping[str, Mapping[str, Spec]] = MappingProxyType(
    {
        "toss_paths": _by_name(*_TOSS_PATHS),
        "toss_map": _by_name(*_TOSS_MAP),
        "bifurcation": _by_name(*_BIFURCATION),
        "parameter_map": _by_name(*_PARAMETER_MAP),
        "curves": _by_name(*_CURVES),
        "motor": _by_name(*_MOTOR),
        "basins": _by_name(*_BASINS),
        "manifolds": _by_name(*_MANIFOLDS),
        "basin_shares": _by_name(*_BASIN_SHARES),
        "resilience": _by_name(*_RESILIENCE),
        "juggling": _by_name(*_JUGGLING),
    }
)
"""Study -> what decides its result."""
COMMON: Mapping[str, Spec] = _by_name(*_PRESET, *_BAG, *_RUN)
"""Options of the nodes that say where and how, not what: no part of a study's parameters."""
LISTS = ("phase_lags", "amplitude_angles", "trajectory_lags", "angular_velocities", "after")
"""Texts that hold a list of numbers."""
TAKES_BAG = (
    "bifurcation",
    "parameter_map",
    "curves",
    "manifolds",
    "motor",
    "basins",
    "basin_shares",
    "resilience",
)

TAKES_PRESET = ("motor",)
_NO_ROTATION = (
    "Friction acts along the surface alone, so nothing that this study computes depends on the "
    "rotation: axial_forcing and restitution decide it"
)
_NOT_TAKEN: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "curves": ("phase_lag", "angular_forcing", "x_axis", "y_axis", "along"),
        "manifolds": ("phase_lag", "angular_forcing"),
        "resilience": ("phase_lag", "angular_forcing"),
    }
)


def why_not_taken(study: str, name: str) -> str:
    """Why a study has no such parameter; empty where there is nothing to say."""
    return _NO_ROTATION if name in _NOT_TAKEN.get(study, ()) else ""


def refuse_not_taken(study: str, names: Iterable[str]) -> None:
    """Refuse, with the reason, parameters that a study could be expected to have. InputError."""
    for name in names:
        if why := why_not_taken(study, name):
            raise InputError("parameter", name, ", ".join(STUDY_TABLES[study]), why)


def refuse_idle(study: str, values: Mapping[str, Value]) -> None:
    """Refuse options other than their defaults that do nothing beside the others. InputError."""
    for name, allowed, hint in _idle(study, values):
        if name in values and values[name] != STUDY_TABLES[study][name].default:
            raise InputError(name, values[name], allowed, hint)


def _idle(study: str, values: Mapping[str, Value]) -> Iterator[tuple[str, str, str]]:
    """The options that do nothing beside these values, what is allowed and why."""
    for axis, key in (("along", ""), ("x_axis", "x_"), ("y_axis", "y_")):
        if axis not in values:
            continue
        begin, end, count = (f"{key}{name}" for name in ("begin", "end", "count"))
        hint = f"{begin}, {end} and {count} give its values."
        yield str(values[axis]), f"none with {axis}:={values[axis]}", hint
        if values[count] == 1 and values[end] != values[begin]:
            yield end, f"{begin} = {values[begin]:g} with {count}:=1", f"The one value is {begin}."
    if study == "basins" and not str(values["angular_velocities"]).strip():
        for name in ("phase_lag", "angular_forcing"):
            yield name, "none without angular_velocities", "The basins themselves do not need it."
    if study == "juggling" and "small" not in str(values["strategies"]).replace(",", " ").split():
        yield "small_limit", "none without small", "Add small to strategies."
    if study == "juggling":
        starts, targets = (_of_conditions(values, name) for name in ("start", "target"))
        if "window" not in starts:
            yield "velocity_end", "none without start:=window", "The runs begin elsewhere."
            if starts <= {"rest", "period-1"} and targets == {"period-1"}:
                hint = "The runs begin elsewhere, and no attractor is searched for."
                yield "velocity_begin", "none without start:=window", hint


def _of_conditions(values: Mapping[str, Value], name: str) -> set[str]:
    """The values that a text has in the conditions of the study juggling."""
    found = set()
    for condition in str(values["conditions"]).split(";"):
        pairs = (part.partition("=") for part in condition.split(","))
        given = {key.strip(): value.strip() for key, _, value in pairs}
        found.add(given.get(name, str(values[name])))
    return found


def table_of(study: str) -> Mapping[str, Spec]:
    """The whole table of a study's node: what decides the result first."""
    bag = _BAG if study in TAKES_BAG else ()
    preset = _PRESET if study in TAKES_PRESET else ()
    return _by_name(*STUDY_TABLES[study].values(), *preset, *bag, *_RUN)
