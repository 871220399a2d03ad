"""Hostile records of inputs: JSON that does not fit, and values that no simulator takes."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from typing import Any

from bouncing_disk_ros.run.input_records import from_json, to_json
from support.hostile.base import INPUTS, enter_forged, messages, text_data
from support.mcap_bytes import Sent

Fields = Mapping[str, Any]


@functools.cache
def records() -> list[dict[str, Any]]:
    """The records of inputs of the run."""
    texts = (row.data[8:].rstrip(b"\0").decode() for row in messages() if row.topic == INPUTS)
    return [from_json(text) for text in texts]


def with_record(place: int, text: str) -> list[Sent]:
    """The messages, one record of inputs among them another text."""
    rows, count = [], 0
    for row in messages():
        is_it = row.topic == INPUTS and count == place
        count += row.topic == INPUTS
        rows.append(row._replace(data=text_data(text)) if is_it else row)
    return rows


def enter_text(name: str, text: str) -> None:
    """Enter a bag whose first record of inputs is another text."""
    enter_forged(f"record: {name}", {}, messages=lambda: with_record(0, text))


def enter_snapshot(name: str, change: Callable[[Fields], Fields]) -> None:
    """Enter a bag whose first record has other fields."""

    def rows() -> list[Sent]:
        first = records()[0]
        return with_record(0, to_json({**first, **change(first)}))

    enter_forged(f"snapshot: {name}", {}, messages=rows)


def enter_record(name: str, record: Fields) -> None:
    """Enter a bag whose second record is another."""
    enter_forged(f"record: {name}", {}, messages=lambda: with_record(1, to_json(record)))


TEXTS = {
    "index overflows": '{"kind":"snapshot","index":1e400,"time_ns":0}',
    "index a float": '{"kind":"pause","index":0.5,"time_ns":0,"paused":true}',
    "index too large": '{"kind":"pause","index":' + "9" * 18 + ',"time_ns":0,"paused":true}',
    "digits": '{"kind":"pause","index":' + "9" * 100_000 + ',"time_ns":0,"paused":true}',
    "time too late": '{"kind":"pause","index":0,"time_ns":9223372036854775807,"paused":true}',
    "deep": '{"kind":"pause","index":0,"time_ns":0,"paused":' + "[" * 100_000 + "]" * 100_000 + "}",
    "NaN": '{"kind":"pause","index":NaN,"time_ns":0,"paused":true}',
    "infinity": '{"kind":"pause","index":0,"time_ns":-Infinity,"paused":true}',
    "a key twice": '{"kind":"pause","index":0,"index":1,"time_ns":0,"paused":true}',
    "quotes": '"' + '\\"' * 100_000,
    "no object": "[1, 2, 3]",
    "nothing": "",
    "a kind of a list": '{"kind":["pause"],"index":0,"time_ns":0}',
    "no kind": '{"index":0,"time_ns":0}',
    "too large": '{"kind":"pause","index":0,"time_ns":0,"x":"' + "x" * 5_000_000 + '"}',
}  # fmt: skip
for _name, _text in TEXTS.items():
    enter_text(_name, _text)


def _in_state(**changes: Any) -> Callable[[Fields], Fields]:
    return lambda first: {"state": {**first["state"], **changes}}


def _in_engine(name: str, **changes: Any) -> Callable[[Fields], Fields]:
    def change(first: Fields) -> Fields:
        engine = first["state"]["engine"]
        return {
            "state": {**first["state"], "engine": {**engine, name: {**engine[name], **changes}}}
        }

    return change


def _in_parameters(**changes: Any) -> Callable[[Fields], Fields]:
    return lambda first: {"parameters": {**first["parameters"], **changes}}


_STOPPED = [0.1, 0.1, 0.0, 0.0]
SNAPSHOTS: dict[str, Callable[[Fields], Fields]] = {
    "without a state": lambda _: {"state": None},
    "state a list": lambda _: {"state": []},
    "without parameters": lambda _: {"parameters": {}},
    "no mass": _in_parameters(mass=0.0),
    "gravity a text": _in_parameters(gravity="9.81"),
    "preload that lifts": _in_parameters(preload=-1e9),
    "another format": _in_state(format=99),
    "no frequency": _in_state(initial_motion=_STOPPED, start=_STOPPED, target=_STOPPED),
    "no frequency of the engine": _in_engine("motion", f=0.0, omega=0.0),
    "a tiny frequency of the engine": _in_engine("motion", f=1e-300, omega=1e-300),
    "an engine without sums": lambda first: {
        "state": {**first["state"], "engine": {**first["state"]["engine"], "books": [[0.0] * 3]}}
    },
    "an engine of words": lambda first: {"state": {**first["state"], "engine": "words"}},
    "a huge gap": _in_engine("state", gap=1e300),
    "a phase of 7": _in_engine("state", phase=7),
    "an event of 99": _in_engine("state", event=99),
    "an event long ago": _in_engine("state", event=2, event_ns=-(2**63)),
    "far away": lambda first: {
        "time_ns": 4 * 10**18, "state": {**first["state"], "time_ns": 4 * 10**18}
    },
    "a million impulses": _in_state(kicks=[[5, 0.0, 0.0]] * 110_000),
    "held rows of words": _in_state(held=["row"]),
}  # fmt: skip
for _name, _change in SNAPSHOTS.items():
    enter_snapshot(_name, _change)
_motion = {"index": 1, "time_ns": 10**9, "kind": "motion", "crossfade_ns": 0}
_impulse = {"index": 1, "time_ns": 10**9, "kind": "impulse", "angular_impulse": 0.0}
RECORDS: dict[str, Fields] = {
    "frequency 0": {**_motion, "points": [[2 * 10**9, [0.1, 0.1, 0.0, 0.0]]]},
    "frequency too high": {**_motion, "points": [[2 * 10**9, [0.1, 0.1, 1e30, 0.0]]]},
    "negative amplitude": {**_motion, "points": [[2 * 10**9, [-0.1, 0.1, 1.0, 0.0]]]},
    "points that fall": {**_motion, "points": [[5, [0.1, 0.1, 1.0, 0.0]], [4, [0.1, 0.1, 1, 0]]]},
    "a point of three": {**_motion, "points": [[5, [0.1, 0.1, 1.0]]]},
    "no points": {**_motion, "points": 5},
    "a fade before": {**_motion, "crossfade_ns": -5, "points": []},
    "an impulse of the past": {**_impulse, "at_ns": 5, "axial_impulse": 0.1},
    "an impulse too large": {**_impulse, "at_ns": 10**9, "axial_impulse": 1e300},
    "a reset to nothing": {**_motion, "kind": "reset", "initial": {}, "motion": {}},
    "a truth of 1": {**_motion, "kind": "pause", "paused": 1},
    "values a list": {**_motion, "kind": "parameters", "values": [], "disk": {}},
}
for _name, _record in RECORDS.items():
    enter_record(_name, _record)
