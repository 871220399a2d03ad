"""The executable `bifurcation`: attractors along a parameter (paper, Fig. 3)."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from bouncing_disk_ros.parameters import Spec, Value
from bouncing_disk_ros.study.command import main_of
from bouncing_disk_ros.study.definition import Idle, StudyDefinition
from bouncing_disk_ros.study.shared_options import map_options

if TYPE_CHECKING:
    import xarray as xr


_ABOUT = """Follow an attractor along a parameter, upward or downward: each value starts from the
last state of the one before. With starts:=24, so many starts are followed at each value instead:
that shows the attractors that coexist. Period doublings are computed by continuation. Fig. 3 of
the paper."""
_EXAMPLE = "ros2 run bouncing_disk_ros bifurcation --ros-args -p begin:=0.6 -p end:=0.45"

APART = 0.01
"""Mean speeds (ωΦ) further apart than this are not those of one orbit."""
_FUNCTION = """\
Attractors along a parameter: impacts, mean speed, Lyapunov exponent (paper, Fig. 3).

>>> bifurcation(begin=0.55, end=0.76, count=101, restitution=0.3)["mean_speed"]
"""
_SPECS = (
    Spec("along", "axial_forcing", "", "the parameter of the axis: axial_forcing, restitution, "
         "phase_lag or angular_forcing"),
    Spec("begin", 0.335, "", "first value of it; 0 along axial_forcing, where the period-1 orbit "
         "is followed: just above where that orbit begins", low=-1e6, high=1e6, angle=True),
    Spec("end", 0.65, "", "last value of it; less than begin: downward", low=-1e6, high=1e6,
         angle=True),
    Spec("count", 1261, "", "number of values", low=1, high=10_000_000),
    *map_options("where it is not the axis"),
    Spec("initial_phase", 0.0, "rad", "forcing phase of the first impact, with initial_velocity",
         "τ", low=-1e3, high=1e3),
    Spec("initial_velocity", 0.0, "πg/ω", "w_A of the first impact; 0: start on the period-1 "
         "orbit", "w_A", low=-1e3, high=0.0),
    Spec("starts", 0, "", "initial conditions at each value, spread evenly over forcing phase and "
         "velocity, to find all coexisting attractors; 0: one attractor is followed, each value "
         "starts from the last state of the value before", low=0, high=1_000_000),
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


def _idle(values: Mapping[str, Value]) -> Iterator[Idle]:
    if not values["starts"]:
        hint = "It is the window of the starts, and starts is 0."
        yield "velocity_begin", "none without starts", hint
        if values["initial_velocity"] == 0.0:
            hint = "The first value starts on the period-1 orbit, or at initial_velocity < 0."
            yield "initial_phase", "0 without initial_velocity", hint


def lines(result: xr.Dataset) -> list[str]:
    """Doublings with their ratios, the largest mean speed, where the exponent is above 0."""
    from bouncing_disk_ros.study.printed_lines import at_value

    rows = []
    axis = result["value"]
    pairs = zip(result["doubling"].values, result["doubling_impacts"].values, strict=True)
    for value, impacts in pairs:
        where = at_value(axis, float(value), ".10f")
        rows.append(f"  period {int(impacts)} → {2 * int(impacts)} at {where}")
    ratios = ", ".join(f"{float(ratio):.4f}" for ratio in result["feigenbaum_ratio"].values)
    if ratios:
        rows.append(f"  ratios of their distances {ratios} (tend to 4.6692)")
    rows += _first_doubling_lines(result)
    rows += _onset_lines(result)
    value = result["value"].values
    n = len(value)
    known = [
        (speed, i)
        for i, speeds in enumerate(result["mean_speed"].values.reshape(n, -1).tolist())
        for speed in speeds
        if not math.isnan(speed)
    ]
    if known:
        best, i = max(known, key=lambda pair: pair[0])
        rows.append(f"  largest mean speed {best:.4f} ωΦ at {at_value(axis, float(value[i]))}")
    chaotic = (result["lyapunov_exponent"].values > 1e-3).reshape(n, -1).any(axis=1).sum()
    rows.append(f"  Lyapunov exponent above 0.001 at {int(chaotic)} of {n} values")
    return rows + (_start_lines(result) if "start" in result.dims else [])


def _first_doubling_lines(result: xr.Dataset) -> list[str]:
    """Where the first doubling lies when Γ ends before it: the diagram shows none then."""
    from bouncing_disk_ros.maps.period_one import stability_limit

    if result.attrs["parameter_along"] != "axial_forcing" or len(result["doubling"]):
        return []
    restitution = float(result.attrs["parameter_restitution"])
    first, last = stability_limit(restitution), float(result["value"].max())
    if not result.attrs["parameter_doublings"] or last >= first:
        return []
    here = f"at ε = {restitution:g} the first is at Γ = {first:.6g}"
    return [f"  no period doubling up to Γ = {last:.6g}: {here}, so let the axis end beyond it"]


def _onset_lines(result: xr.Dataset) -> list[str]:
    """Where what was followed came to contact for the first time."""
    if "contact_onset" not in result:
        return []
    from bouncing_disk_ros.study.printed_lines import at_value

    onset, without = (float(result[f"contact_onset{end}"]) for end in ("", "_without"))
    chaotic = float(result["contact_onset_exponent"]) > 0.0
    what = "chaotic attractor (a crisis)" if chaotic else "attractor"
    between = f"{at_value(result['value'], without, '.7g')} and {onset:.7g}"
    return [f"  the {what} first comes to contact between {between}"]


def _start_lines(result: xr.Dataset) -> list[str]:
    """How many starts end with contact, and whether the speed has settled there.

    All contact leads to one orbit, so what is left of the start is its speed.
    """
    contact, speed = result["contacts"] > 0.0, result["mean_speed"]
    some, every = (int(found.sum()) for found in (contact.any("start"), contact.all("start")))
    n = result.sizes["value"]
    rows = [f"  contact from some starts at {some} of {n} values, from all at {every}"]
    after = speed.where(contact)
    apart = int((after.max("start") - after.min("start") > APART).sum())
    if apart:
        why = "increase settling, unless the motion is chaotic or friction keeps several speeds"
        rows.append(f"  after contact the mean speed depends on the start at {apart} values: {why}")
    return rows


DEFINITION = StudyDefinition(
    name="bifurcation",
    about=_ABOUT,
    example=_EXAMPLE,
    function=_FUNCTION,
    specs=_SPECS,
    study="bouncing_disk_ros.study.bifurcation.compute:Bifurcation",
    lines=lines,
    takes_run=True,
    idle=_idle,
)
main = main_of(DEFINITION)
