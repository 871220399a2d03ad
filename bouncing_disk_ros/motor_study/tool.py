"""The executable `motor`: speed, power and efficiency of a motor over two parameters."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING

from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.study.plane_lines import kind_shares, largest
from bouncing_disk_ros.study.study_tool import StudyTool
from bouncing_disk_ros.study.study_view import StudyView

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from bouncing_disk_ros.motor_study.compute import Motor

_ABOUT = """Ultrasonic motor over a plane of two of its parameters: mean speed, output power,
efficiency, losses, time in contact, impacts and wear; from these no-load speed, stall torque, best
efficiency and best phase lag. By default the parameters are those of the preset swum."""
_EXAMPLE = (
    "ros2 run bouncing_disk_ros motor --ros-args -p y_axis:=phase_lag -p y_begin:=-0.5pi "
    "-p y_end:=0.5pi"
)


def make_view() -> StudyView[Motor]:
    """The study with its pictures."""
    from bouncing_disk_ros.motor_study.compute import Motor

    return StudyView(Motor, _pictures, lines, from_bag=_from_bag, image="mean_speed")


def _from_bag(values: Mapping[str, Value]) -> list[str]:
    from bouncing_disk_ros.core.model import Disk, Motion

    return [
        name
        for name in (*Motion._fields, *Disk._fields)
        if name not in (values["x_axis"], values["y_axis"])
    ]


def _pictures(study: Motor, result: xr.Dataset) -> Mapping[str, Figure]:
    from bouncing_disk_ros.motor_study.picture import (
        motor_map_picture,
        speed_torque_picture,
        stall_picture,
    )

    found = {}
    load = next((name for name in (study.across, study.up) if name.endswith("_torque")), "")
    if load:
        found["speed_torque"] = speed_torque_picture(result, load)
    if "stall_torque" in result:
        found["stall"] = stall_picture(result)
    return {**found, "motor_map": motor_map_picture(result)}


def lines(result: xr.Dataset) -> list[str]:
    """Shares of the kinds of motion; the largest speed, power and efficiency, and where."""
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
    settled = result["kind"].attrs["flag_meanings"].split().index("not_settled")
    if count := int((result["kind"] == result["kind"].attrs["flag_values"][settled]).sum()):
        rows.append(f"  the speed has not settled within longest periods at {count} points, or "
                    "nothing settles it")  # fmt: skip
    rough = result["mean_speed_error"] > 1e-3 * abs(result["mean_speed"]).max()
    if count := int(rough.sum()):
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


TOOL = StudyTool("motor", _ABOUT, _EXAMPLE, make_view)
main = TOOL.main


if __name__ == "__main__":
    sys.exit(main())
