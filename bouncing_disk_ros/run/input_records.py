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
import math
from collections.abc import Callable, Collection, Mapping
from typing import Any

from bouncing_disk_ros import limits, parameters
from bouncing_disk_ros.core.model import Disk, InitialState, Motion
from bouncing_disk_ros.core.offset import DEGREES
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.parsing import read_json
from bouncing_disk_ros.run.command_validation import MAX_IMPULSE
from bouncing_disk_ros.run.time_map import FAR_NS
from bouncing_disk_ros.topics import OFFSET_JOINTS
from bouncing_disk_ros.units import NS

Record = dict[str, Any]
Check = Callable[[Mapping[str, Any]], Record]
_INDEX = 1 << 53
_FADE_NS = 10**6 * NS
_KNOT = 5  # numbers of a knot of a trajectory
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
    fields = _mapping("input record", record)
    kind = fields.get("kind")
    if not isinstance(kind, str) or kind not in CHECKS:
        raise InputError("input record kind", kind, "any of " + ", ".join(CHECKS))
    index = whole("input record, index", fields.get("index"), 0, _INDEX)
    time_ns = whole("input record, time_ns", fields.get("time_ns"), 0, FAR_NS)
    try:
        return {**fields, **CHECKS[kind](fields), "index": index, "time_ns": time_ns}
    except InputError as error:
        field = f"input record {index} ({kind}), {error.field}"
        raise InputError(field, error.given, error.allowed, error.hint) from None


# --- the kinds ------------------------------------------------------------------------------------
def _snapshot(fields: Mapping[str, Any]) -> Record:
    values = _values("parameters", _of(fields, "parameters"))
    missing = [name for name in Disk._fields if name not in values]
    if missing:
        raise InputError("parameters", f"without {missing[0]}", ", ".join(Disk._fields))
    _disk("parameters", {name: values[name] for name in Disk._fields})
    return {
        "state": _mapping("state", _of(fields, "state")),
        "held": _truth("held", fields.get("held", False)),
        "version": _text("version", fields.get("version", "")),
        "parameters": values,
    }


def _motion(fields: Mapping[str, Any]) -> Record:
    points, before = [], -1
    for row in _list("points", _of(fields, "points")):
        if len(_list("points", row)) != 2 or len(_list("points", row[1])) != len(Motion._fields):
            raise InputError("points", row, "[instant in ns, [" + ", ".join(Motion._fields) + "]]")
        at = whole("points, instant", row[0], before + 1, FAR_NS)
        named = zip(Motion._fields, row[1], strict=True)
        points.append([at, [in_range(name, name, value) for name, value in named]])
        before = at
    crossfade = whole("crossfade_ns", _of(fields, "crossfade_ns"), 0, _FADE_NS)
    return {"points": points, "crossfade_ns": crossfade}


def _trajectory(fields: Mapping[str, Any]) -> Record:
    begin = whole("begin_ns", _of(fields, "begin_ns"), fields["time_ns"], FAR_NS)
    joints: Record = {}
    for joint, rows in _mapping("joints", _of(fields, "joints")).items():
        if joint not in OFFSET_JOINTS:
            raise InputError("joints", joint, ", ".join(OFFSET_JOINTS))
        before, joints[joint] = -1, []
        for row in _list(joint, rows):
            if len(_list(joint, row)) != _KNOT:
                raise InputError(joint, row, "[ns, degree, position, velocity, acceleration]")
            before = whole(f"{joint}, instant", row[0], before + 1, FAR_NS)
            if row[1] not in DEGREES:
                raise InputError(f"{joint}, degree", row[1], "1, 3 or 5")
            names = ("offset_limit", "offset_speed_limit", "offset_acceleration_limit")
            state = [_within(f"{joint}, knot", n, v) for n, v in zip(names, row[2:], strict=True)]
            joints[joint].append([before, row[1], *state])
    return {"begin_ns": begin, "joints": joints}


def _within(field: str, limit: str, value: object) -> float:
    """A number of which the absolute value is in the range of a limit."""
    in_range(field, limit, abs(number(field, value)))
    return number(field, value)


def _impulse(fields: Mapping[str, Any]) -> Record:
    found: Record = {"at_ns": whole("at_ns", _of(fields, "at_ns"), fields["time_ns"], FAR_NS)}
    for name in ("axial_impulse", "angular_impulse"):
        value = number(name, _of(fields, name))
        if abs(value) > MAX_IMPULSE:
            raise InputError(name, value, f"a finite impulse up to {MAX_IMPULSE:g}")
        found[name] = value
    return found


def _parameters(fields: Mapping[str, Any]) -> Record:
    return {
        "values": _values("values", _of(fields, "values")),
        "disk": _disk("disk", _named("disk", _of(fields, "disk"), Disk._fields)),
    }


def _pause(fields: Mapping[str, Any]) -> Record:
    return {"paused": _truth("paused", _of(fields, "paused"))}


def _reset(fields: Mapping[str, Any]) -> Record:
    initial = dict(_named("initial", _of(fields, "initial"), InitialState._fields))
    for name, value in initial.items():
        if not (name == "axial_velocity" and value is None):  # None: that of the platform
            initial[name] = in_range(f"initial {name}", _INITIAL[name], value)
    motion = _named("motion", _of(fields, "motion"), Motion._fields)
    return {
        "initial": initial,
        "motion": {name: in_range(f"motion {name}", name, motion[name]) for name in Motion._fields},
    }


CHECKS: Mapping[str, Check] = {
    "snapshot": _snapshot, "motion": _motion, "trajectory": _trajectory,
    "impulse": _impulse, "parameters": _parameters, "pause": _pause, "reset": _reset,
}  # fmt: skip
KINDS = tuple(CHECKS)


# --- values ---------------------------------------------------------------------------------------
def whole(field: str, value: object, low: int, high: int) -> int:
    """A whole number within bounds."""
    if type(value) is not int or not low <= value <= high:
        raise InputError(field, value, f"a whole number from {low} to {high}")
    return value


def number(field: str, value: object) -> float:
    """A finite number."""
    if type(value) not in (int, float) or not math.isfinite(value):  # type: ignore[arg-type]
        raise InputError(field, value, "a finite number")
    return float(value)  # type: ignore[arg-type]


def in_range(field: str, parameter: str, value: object) -> float:
    """A number in the range of a parameter."""
    try:
        return float(parameters.TABLE[parameter].checked(number(field, value)))
    except InputError as error:
        raise InputError(field, value, error.allowed) from None


def _disk(field: str, values: Mapping[str, Any]) -> dict[str, float]:
    disk = {name: in_range(f"{field} {name}", name, values[name]) for name in Disk._fields}
    parameters.check_together({**parameters.DEFAULTS, **disk})
    return disk


def _values(field: str, given: object) -> Record:
    """Values of parameters by name; those of other versions may be any number, truth or text."""
    found: Record = {}
    for name, value in _mapping(field, given).items():
        where = f"{field} {name}"
        if type(value) in (int, float) and name in parameters.TABLE:
            found[name] = parameters.TABLE[name].checked(value)
        elif isinstance(value, str) and getattr(parameters.TABLE.get(name), "type", str) is str:
            found[name] = _text(where, value)
        elif isinstance(value, bool) and getattr(parameters.TABLE.get(name), "type", bool) is bool:
            found[name] = value
        elif name in parameters.TABLE:
            raise InputError(where, value, parameters.TABLE[name].allowed)
        else:
            found[name] = number(where, value)
    return found


def _of(fields: Mapping[str, Any], name: str) -> Any:
    if name not in fields:
        raise InputError(name, "nothing", "a value")
    return fields[name]


def _mapping(field: str, value: object) -> Mapping[str, Any]:
    if not isinstance(value, dict) or not all(isinstance(key, str) for key in value):
        raise InputError(field, value, "a JSON object")
    return value


def _named(field: str, value: object, names: Collection[str]) -> Mapping[str, Any]:
    found = _mapping(field, value)
    if found.keys() != {*names}:
        raise InputError(field, ", ".join(found), ", ".join(names))
    return found


def _list(field: str, value: object) -> list[Any]:
    if not isinstance(value, (list, tuple)):
        raise InputError(field, value, "a list")
    return list(value)


def _truth(field: str, value: object) -> bool:
    if not isinstance(value, bool):
        raise InputError(field, value, "true or false")
    return value


def _text(field: str, value: object) -> str:
    if not isinstance(value, str) or len(value) > limits.NAME:
        raise InputError(field, value, f"a text of at most {limits.NAME} letters")
    return value
