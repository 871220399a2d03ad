"""The executable `motor`: speed, power and efficiency of a motor over two parameters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING

from bouncing_disk_ros.parameters import Spec
from bouncing_disk_ros.study.command import main_of
from bouncing_disk_ros.study.definition import StudyDefinition
from bouncing_disk_ros.study.shared_options import of_simulator

if TYPE_CHECKING:
    import xarray as xr


_ABOUT = """Ultrasonic motor over a plane of two of its parameters: mean speed, output power,
efficiency, losses, time in contact, impacts and wear; from these no-load speed, stall torque, best
efficiency and best phase lag. By default the parameters are those of the preset swum."""
_EXAMPLE = (
    "ros2 run bouncing_disk_ros motor --ros-args -p y_axis:=phase_lag -p y_begin:=-0.5pi "
    "-p y_end:=0.5pi"
)
_FUNCTION = """\
Speed, torque, efficiency and stall of an ultrasonic motor over two of its parameters.

>>> motor(x_axis="load_torque", y_axis="preload", x_count=20, y_count=5)["stall_torque"]
"""
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
_SPECS = (
    Spec("x_axis", "load_torque", "", f"the parameter of the horizontal axis: {_LOADS}"),
    Spec("x_begin", 0.0, "", "first value of it, in its unit", low=-1e12, high=1e12, angle=True),
    Spec("x_end", 0.016, "", "last value of it", low=-1e12, high=1e12, angle=True),
    Spec("x_count", 200, "", "number of values", low=1, high=1_000_000),
    Spec("y_axis", "preload", "", "the parameter of the vertical axis"),
    Spec("y_begin", 15.0, "", "first value of it, in its unit", low=-1e12, high=1e12, angle=True),
    Spec("y_end", 40.0, "", "last value of it", low=-1e12, high=1e12, angle=True),
    Spec("y_count", 200, "", "number of values", low=1, high=1_000_000),
    *(replace(of_simulator(name), default=value, source="as in the preset swum")
      for name, value in _SWUM.items()),
    Spec("start", "period-1", "", "where each point starts. period-1: beside the period-1 orbit, "
         "and as rest where there is none; rest: the rotor lies on the stator; followed: along x, "
         "each from the last state of the one before, the first one as period-1",
         words=("period-1", "rest", "followed")),
    Spec("settling", 300, "", "least number of periods of the stator left out where the motion "
         "does not repeat", low=0, high=100_000_000),
    Spec("measured", 512, "", "periods of the first stretch for the means, where the state does "
         "not repeat; if it is too short, one twice as long is added, and so on",
         low=32, high=100_000_000),
    Spec("longest", 20_000, "", "largest number of periods of the stator simulated at each point",
         low=64, high=1_000_000_000),
)  # fmt: skip


def lines(result: xr.Dataset) -> list[str]:
    """Shares of the kinds of motion; the largest speed, power and efficiency, and where."""
    from bouncing_disk_ros.study.printed_lines import kind_shares, largest

    rows = kind_shares(result)
    rows += largest(result, "mean_speed", "mean speed", " rad/s", ".6g")
    rows += largest(result, "output_power", "output power", " W", ".6g")
    rows += largest(result, "efficiency", "efficiency", "", ".6g")
    rows += _range(result, "no_load_speed", "no-load speed", "rad/s")
    rows += _range(result, "stall_torque", "stall torque", "N·m")
    rows += _range(result, "best_phase_lag", "best phase lag", "rad")
    if "preload_contact_lasts" in result.attrs:
        names = ("doubling", "no_period_one", "contact_lasts")
        doubled, none, contact = (float(result.attrs[f"preload_{name}"]) for name in names)
        rows.append(f"  period 1 between preloads of {doubled:.6g} and {none:.6g} N; contact, "
                    f"once begun, never ends from {contact:.6g} N on")  # fmt: skip
        preloads = result["preload"].values
        if not ((preloads > doubled) & (preloads < none)).any():
            axis = "x" if result["mean_speed"].dims[1] == "preload" else "y"
            begin, end = f"{doubled:.3g}", f"{none:.3g}"
            shown = f": {axis}_begin:={begin} {axis}_end:={end} shows it" if begin != end else ""
            rows.append(f"  no preload of the axis lies in that range{shown}")
    settled = result["kind"].attrs["flag_meanings"].split().index("not_settled")
    if count := int((result["kind"] == result["kind"].attrs["flag_values"][settled]).sum()):
        rows.append(f"  the speed has not settled within longest periods at {count} points, or "
                    "nothing settles it")  # fmt: skip
    top = float(abs(result["mean_speed"]).max())
    if count := int((result["mean_speed_error"] > 1e-3 * top).sum()) if top > 0.0 else 0:
        rows.append(f"  the mean speed has a standard error of more than 1/1000 of the largest one "
                    f"at {count} points: increase longest to improve them")  # fmt: skip
    return rows


def _range(result: xr.Dataset, field: str, name: str, unit: str) -> list[str]:
    """Between which values one of the derived numbers lies."""
    if field not in result or not bool(result[field].notnull().any()):
        return []
    values = result[field]
    low, high = float(values.min()), float(values.max())
    path = f"from {low:.6g} to {high:.6g}" if low < high else f"{low:.6g}"
    return [f"  {name} {path} {unit} over {values.dims[0]}"]


DEFINITION = StudyDefinition(
    name="motor",
    about=_ABOUT,
    example=_EXAMPLE,
    function=_FUNCTION,
    specs=_SPECS,
    study="bouncing_disk_ros.motor_study.compute:Motor",
    lines=lines,
    image="mean_speed",
    takes_run=True,
)
main = main_of(DEFINITION)
