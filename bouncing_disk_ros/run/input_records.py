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
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from bouncing_disk_ros.parsing import read_json
from bouncing_disk_ros.run.record_fields import CHECKS, checked_record

Record = dict[str, Any]
KINDS = tuple(CHECKS)


def to_json(record: Mapping[str, Any]) -> str:
    """One line of JSON; NaN and infinity are refused because JSON has none."""
    return json.dumps(record, allow_nan=False, separators=(",", ":"), ensure_ascii=False)


def from_json(text: str) -> Record:
    """A record from its JSON line, its fields checked, or InputError."""
    return checked_record(read_json("input record", text))
