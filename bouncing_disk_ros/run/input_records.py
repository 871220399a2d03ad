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
from collections.abc import Callable, Mapping
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
Check = Callable[[str, Any], Any]
"""Name of a field and its value -> the value, checked; InputError."""
_INDEX = 1 << 53
_FADE_NS = 10**6 * NS
_POINT = ("instant in ns", f"[{', '.join(Motion._fields)}]")
_KNOT = ("ns", "degree", "position", "velocity", "acceleration")
_LIMITS = ("offset_limit", "offset_speed_limit", "offset_acceleration_limit")


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
    if not isinstance(kind, str) or kind not in SCHEMA:
        raise InputError("input record kind", kind, "any of " + ", ".join(SCHEMA))
    index = whole("input record, index", fields.get("index"), 0, _INDEX)
    time_ns = whole("input record, time_ns", fields.get("time_ns"), 0, FAR_NS)
    checks = {**SCHEMA[kind], **dict.fromkeys(_AHEAD & SCHEMA[kind].keys(), _whole(time_ns))}
    try:
        given = with_names("", {**_OPTIONAL.get(kind, {}), **fields}, checks)
        found = {name: check(name, given[name]) for name, check in checks.items()}
    except InputError as error:
        raise error.inside(f"input record {index} ({kind}), ") from None
    return {**fields, **found, "index": index, "time_ns": time_ns}


# --- checks of a field ----------------------------------------------------------------------------
def _whole(low: int, high: int = FAR_NS) -> Check:
    return lambda field, value: whole(field, value, low, high)


def _impulse(field: str, value: object) -> float:
    return number(field, value, -MAX_IMPULSE, MAX_IMPULSE)


def _parameter(name: str) -> Check:
    """A number in the range of a parameter."""
    spec = parameters.TABLE[name]

    def check(field: str, value: object) -> float:
        number(field, value)
        return float(spec.checked(value, field))

    return check


def _unless_none(check: Check) -> Check:
    return lambda field, value: None if value is None else check(field, value)


def _mapping_of(checks: Mapping[str, Check]) -> Check:
    """A mapping that has the names of the checks and no others."""

    def check(field: str, given: object) -> Record:
        found = only_names(field, given, checks)
        return {name: one(f"{field} {name}", found[name]) for name, one in checks.items()}

    return check


_MOTION = {name: _parameter(name) for name in Motion._fields}
_INITIAL = {name: _parameter(f"initial_{name}") for name in InitialState._fields}
_INITIAL["axial_velocity"] = _unless_none(_INITIAL["axial_velocity"])  # None: of the platform
_disk_numbers = _mapping_of({name: _parameter(name) for name in Disk._fields})


def _disk(field: str, given: object) -> Record:
    disk = _disk_numbers(field, given)
    parameters.check_together({**parameters.DEFAULTS, **disk})
    return disk


def _points(field: str, given: object) -> list[Any]:
    points, before = [], -1
    for point in items(field, given):
        at, values = row(field, point, _POINT)
        before = whole(f"{field}, instant", at, before + 1, FAR_NS)
        named = zip(_MOTION.items(), row(field, values, _MOTION), strict=True)
        points.append([before, [check(name, value) for (name, check), value in named]])
    return points


def _joints(field: str, given: object) -> Record:
    joints: Record = {}
    for joint, rows in mapping(field, given).items():
        if joint not in OFFSET_JOINTS:
            raise InputError(field, joint, ", ".join(OFFSET_JOINTS))
        before, joints[joint] = -1, []
        for knot in items(joint, rows):
            at, degree, *state = row(joint, knot, _KNOT)
            before = whole(f"{joint}, instant", at, before + 1, FAR_NS)
            if degree not in DEGREES:
                raise InputError(f"{joint}, degree", degree, "1, 3 or 5")
            values = [number(f"{joint}, knot", value) for value in state]
            for limit, value in zip(_LIMITS, values, strict=True):
                _parameter(limit)(f"{joint}, knot", abs(value))
            joints[joint].append([before, degree, *values])
    return joints


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


def _snapshot_values(field: str, given: object) -> Record:
    values = _values(field, with_names(field, given, Disk._fields))
    _disk(field, {name: values[name] for name in Disk._fields})
    return values


# --- the kinds ------------------------------------------------------------------------------------
SCHEMA: Mapping[str, Mapping[str, Check]] = {
    "snapshot": {
        "state": mapping, "held": truth, "version": text, "parameters": _snapshot_values,
    },
    "motion": {"points": _points, "crossfade_ns": _whole(0, _FADE_NS)},
    "trajectory": {"begin_ns": _whole(0), "joints": _joints},
    "impulse": {"at_ns": _whole(0), "axial_impulse": _impulse, "angular_impulse": _impulse},
    "parameters": {"values": _values, "disk": _disk},
    "pause": {"paused": truth},
    "reset": {"initial": _mapping_of(_INITIAL), "motion": _mapping_of(_MOTION)},
}  # fmt: skip
"""The fields of a record of each kind."""
_AHEAD = {"at_ns", "begin_ns"}
"""Fields that are no instant before the record's own."""
_OPTIONAL: Mapping[str, Mapping[str, Any]] = {"snapshot": {"held": False, "version": ""}}
KINDS = tuple(SCHEMA)
