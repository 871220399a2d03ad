"""The record of inputs: one JSON object for each accepted input. Loads no kernels.

Every record has `index` (running), `time_ns` (whole nanosecond of simulated time at which it was
accepted) and `kind`. Floats are in round-trip form, so that applying the records of a run to the
core gives every impact again, bit for bit.

| kind | further fields |
|---|---|
| snapshot | `state`: all that the simulation needs to go on; `version`, `parameters` |
| motion | `points`: [[instant in ns, [A, Φ, f, θ]], ...], `crossfade_ns` |
| trajectory | `begin_ns`, `joints`: {joint: [[ns, degree, p, ṗ, p̈], ...]} |
| impulse | `at_ns`, `axial_impulse`, `angular_impulse` |
| parameters | `values`: what was set, `disk`: all disk parameters in force after it |
| pause | `paused` |
| reset | `initial`, `motion` |

What is read is checked field by field: types, shapes, ranges. The ranges are those of the parameter
table, so that what passes can be applied to the core. The state of a snapshot is left to
`Simulation.restore`, which alone knows its layout.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from bouncing_disk_ros import parameters
from bouncing_disk_ros.core.model import Disk, InitialState, Motion
from bouncing_disk_ros.core.offset import DEGREES
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.field_checks import (
    items,
    mapping,
    number,
    only_names,
    row,
    text,
    truth,
    whole,
    with_names,
)  # fmt: skip
from bouncing_disk_ros.parsing import read_json
from bouncing_disk_ros.run.command_validation import MAX_IMPULSE
from bouncing_disk_ros.run.time_map import FAR_NS
from bouncing_disk_ros.topics import OFFSET_JOINTS
from bouncing_disk_ros.units import NS

Record = dict[str, Any]
Check = Callable[[Mapping[str, Any]], Record]
_INDEX = 1 << 53
_FADE_NS = 10**6 * NS
_POINT = ("instant in ns", f"[{', '.join(Motion._fields)}]")
_KNOT = ("ns", "degree", "position", "velocity", "acceleration")
_LIMITS = ("offset_limit", "offset_speed_limit", "offset_acceleration_limit")
_INITIAL = {name: f"initial_{name}" for name in InitialState._fields}
"""The parameter that stands for each field of an initial state."""


def to_json(record: Mapping[str, Any]) -> str:
    """One line of JSON; NaN and infinity are refused because JSON has none."""
    return json.dumps(record, allow_nan=False, separators=(",", ":"), ensure_ascii=False)


def from_json(text: str) -> Record:
    """A record from its JSON line, its fields checked, or InputError."""
    return checked_record(read_json("input record", text))


def checked_record(record: object) -> Record:
    """A record with every field checked, numbers as floats; InputError names the first at fault."""
    fields = mapping("input record", record)
    kind = fields.get("kind")
    if not isinstance(kind, str) or kind not in CHECKS:
        raise InputError("input record kind", kind, "any of " + ", ".join(CHECKS))
    index = whole("input record, index", fields.get("index"), 0, _INDEX)
    time_ns = whole("input record, time_ns", fields.get("time_ns"), 0, FAR_NS)
    try:
        with_names("", fields, FIELDS[kind])
        return {**fields, **CHECKS[kind](fields), "index": index, "time_ns": time_ns}
    except InputError as error:
        raise error.inside(f"input record {index} ({kind}), ") from None


# --- the kinds ------------------------------------------------------------------------------------
def _snapshot(fields: Mapping[str, Any]) -> Record:
    values = _values("parameters", with_names("parameters", fields["parameters"], Disk._fields))
    _disk("parameters", {name: values[name] for name in Disk._fields})
    return {
        "state": mapping("state", fields["state"]),
        "held": truth("held", fields.get("held", False)),
        "version": text("version", fields.get("version", "")),
        "parameters": values,
    }


def _motion(fields: Mapping[str, Any]) -> Record:
    points, before = [], -1
    for point in items("points", fields["points"]):
        at, values = row("points", point, _POINT)
        at = whole("points, instant", at, before + 1, FAR_NS)
        named = zip(Motion._fields, row("points", values, Motion._fields), strict=True)
        points.append([at, [in_range(name, name, value) for name, value in named]])
        before = at
    crossfade = whole("crossfade_ns", fields["crossfade_ns"], 0, _FADE_NS)
    return {"points": points, "crossfade_ns": crossfade}


def _trajectory(fields: Mapping[str, Any]) -> Record:
    begin = whole("begin_ns", fields["begin_ns"], fields["time_ns"], FAR_NS)
    joints: Record = {}
    for joint, rows in mapping("joints", fields["joints"]).items():
        if joint not in OFFSET_JOINTS:
            raise InputError("joints", joint, ", ".join(OFFSET_JOINTS))
        before, joints[joint] = -1, []
        for knot in items(joint, rows):
            at, degree, *state = row(joint, knot, _KNOT)
            before = whole(f"{joint}, instant", at, before + 1, FAR_NS)
            if degree not in DEGREES:
                raise InputError(f"{joint}, degree", degree, "1, 3 or 5")
            limited = zip(_LIMITS, state, strict=True)
            values = [_within(f"{joint}, knot", limit, value) for limit, value in limited]
            joints[joint].append([before, degree, *values])
    return {"begin_ns": begin, "joints": joints}


def _within(field: str, limit: str, value: object) -> float:
    """A number of which the absolute value is in the range of a limit."""
    found = number(field, value)
    in_range(field, limit, abs(found))
    return found


def _impulse(fields: Mapping[str, Any]) -> Record:
    found: Record = {"at_ns": whole("at_ns", fields["at_ns"], fields["time_ns"], FAR_NS)}
    for name in ("axial_impulse", "angular_impulse"):
        found[name] = number(name, fields[name], -MAX_IMPULSE, MAX_IMPULSE)
    return found


def _parameters(fields: Mapping[str, Any]) -> Record:
    return {
        "values": _values("values", fields["values"]),
        "disk": _disk("disk", only_names("disk", fields["disk"], Disk._fields)),
    }


def _pause(fields: Mapping[str, Any]) -> Record:
    return {"paused": truth("paused", fields["paused"])}


def _reset(fields: Mapping[str, Any]) -> Record:
    initial = dict(only_names("initial", fields["initial"], InitialState._fields))
    for name, value in initial.items():
        if not (name == "axial_velocity" and value is None):  # None: that of the platform
            initial[name] = in_range(f"initial {name}", _INITIAL[name], value)
    motion = only_names("motion", fields["motion"], Motion._fields)
    return {
        "initial": initial,
        "motion": {name: in_range(f"motion {name}", name, motion[name]) for name in Motion._fields},
    }


CHECKS: Mapping[str, Check] = {
    "snapshot": _snapshot, "motion": _motion, "trajectory": _trajectory,
    "impulse": _impulse, "parameters": _parameters, "pause": _pause, "reset": _reset,
}  # fmt: skip
FIELDS: Mapping[str, Sequence[str]] = {
    "snapshot": ("state", "parameters"), "motion": ("points", "crossfade_ns"),
    "trajectory": ("begin_ns", "joints"), "impulse": ("at_ns", "axial_impulse", "angular_impulse"),
    "parameters": ("values", "disk"), "pause": ("paused",), "reset": ("initial", "motion"),
}  # fmt: skip
"""The fields that a record of each kind must have."""
KINDS = tuple(CHECKS)


def in_range(field: str, parameter: str, value: object) -> float:
    """A number in the range of a parameter."""
    number(field, value)
    return float(parameters.TABLE[parameter].checked(value, field))


def _disk(field: str, values: Mapping[str, Any]) -> dict[str, float]:
    disk = {name: in_range(f"{field} {name}", name, values[name]) for name in Disk._fields}
    parameters.check_together({**parameters.DEFAULTS, **disk})
    return disk


def _values(field: str, given: object) -> Record:
    """Values of parameters by name; those of other versions may be any number, truth or text."""
    found: Record = {}
    for name, value in mapping(field, given).items():
        where = f"{field} {name}"
        if type(value) in (int, float) and name in parameters.TABLE:
            found[name] = parameters.TABLE[name].checked(value)
        elif isinstance(value, str) and getattr(parameters.TABLE.get(name), "type", str) is str:
            found[name] = text(where, value)
        elif isinstance(value, bool) and getattr(parameters.TABLE.get(name), "type", bool) is bool:
            found[name] = value
        elif name in parameters.TABLE:
            raise InputError(where, value, parameters.TABLE[name].allowed)
        else:
            found[name] = number(where, value)
    return found
