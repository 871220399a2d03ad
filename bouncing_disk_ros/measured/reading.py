"""Measured times from a text, a sound, a bag or an array; InputError where they cannot be used."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bouncing_disk_ros.errors import InputError, closest
from bouncing_disk_ros.measured.sound import SUFFIXES, ImpactSound, impact_times
from bouncing_disk_ros.parsing import number_of, read_table

Array = NDArray[np.float64]
MOST_IMPACTS = 20_000
"""Impacts of one fit."""
MOST_BYTES = 64 << 20
"""Of a text file."""
_TIME_NAMES = ("time", "t", "times", "seconds", "s")
_INCREASING = "increasing times in seconds"


@dataclass(frozen=True)
class Recording:
    """Times of impacts (s), their errors (s, or None), and half of the last digit of the times.

    `sound`: what they were heard in.
    """

    name: str
    times: Array
    errors: Array | None
    resolution: float
    sound: ImpactSound | None = None


def recording_of(
    source: str | Path | ArrayLike, column: str = "", namespace: str = ""
) -> Recording:
    """The impacts of an array, a text file, a sound file or a bag.

    `column`: of a text file, its name or its number from 1 on; default: a column called time or t,
    else the first. Errors are taken from a column called error.
    """
    if isinstance(source, (str, Path)):
        path = Path(source).expanduser()
        suffix = path.suffix.lower()
        if path.is_dir() or suffix == ".mcap":
            return _from_bag(path, namespace)
        if suffix in SUFFIXES:
            sound = impact_times(path)
            return replace(checked(path.name, sound.times, sound.errors, 0.0), sound=sound)
        return _from_text(path, column)
    return checked("times", _numbers(source), None, 0.0)


def _numbers(source: ArrayLike) -> Array:
    try:
        values = np.asarray(source, float)
    except (TypeError, ValueError):
        raise InputError("times", source, "numbers: times in seconds") from None
    if values.ndim != 1:
        given = f"an array of {values.ndim} axes"
        raise InputError("times", given, "one axis: times in seconds")
    return values


def checked(name: str, times: Array, errors: Array | None, resolution: float) -> Recording:
    """A recording whose times can be fitted, or InputError."""
    if len(times) > MOST_IMPACTS:
        hint = "Give a part of the recording."
        raise InputError("times", f"{len(times)} times", f"at most {MOST_IMPACTS}", hint)
    if len(times) < 3:
        what = ("no hits", "one hit", "two hits")[len(times)]
        raise InputError("times", what, "three or more", "A restitution takes two flights.")
    for wrong, what in ((~np.isfinite(times), "no finite number"), (abs(times) > 1e9, "too large")):
        if wrong.any():
            at = int(np.flatnonzero(wrong)[0])
            raise InputError("times", f"{times[at]:g} at place {at + 1}", _INCREASING, what + ".")
    if (np.diff(times) <= 0.0).any():
        at = int(np.flatnonzero(np.diff(times) <= 0.0)[0]) + 1
        given = f"{times[at]:.9g} after {times[at - 1]:.9g} at place {at + 1}"
        raise InputError("times", given, _INCREASING)
    if errors is not None and not (np.isfinite(errors) & (errors > 0.0)).all():
        at = int(np.flatnonzero(~(np.isfinite(errors) & (errors > 0.0)))[0])
        raise InputError("error", f"{errors[at]:g} at place {at + 1}", "errors > 0 in seconds")
    least = max(resolution, 4.0 * float(np.spacing(np.abs(times).max())))
    return Recording(name, times, errors, least)


# --- text -----------------------------------------------------------------------------------------
def _from_text(path: Path, column: str) -> Recording:
    names, table = read_table("recording", path, MOST_BYTES)
    if not (names or table):
        raise InputError("recording", str(path), "a column of times in seconds", "It is empty.")
    place = _place(column, names, len(table[0]) if table else len(names))
    times, decimals = _column(path, table, place)
    errors = None
    if "error" in names:
        errors, _ = _column(path, table, names.index("error"))
    return checked(path.name, times, errors, 0.5 * 10.0**-decimals)


def _place(column: str, names: list[str], count: int) -> int:
    """The place of the column that is asked for."""
    if column.isdecimal():
        if 1 <= int(column) <= count:
            return int(column) - 1
        raise InputError("column", column, f"a number from 1 to {count}, or a name")
    if column:
        if column.lower() in names:
            return names.index(column.lower())
        allowed = ", ".join(names) if names else f"a number from 1 to {count}: no names here"
        raise InputError("column", column, allowed, closest(column.lower(), names))
    return next((names.index(name) for name in _TIME_NAMES if name in names), 0)


def _column(path: Path, table: list[list[str]], place: int) -> tuple[Array, int]:
    """Numbers of one column, and the decimals that they are written with."""
    values, decimals = np.empty(len(table)), 0
    for i, cells in enumerate(table):
        value = number_of(cells[place]) if place < len(cells) else None
        if value is None:
            given = f"{' '.join(cells)[:40]!r} in line {i + 1} of the table"
            raise InputError("recording", given, "a text with a column of seconds",
                             f"{path.name} is no such text.")  # fmt: skip
        values[i] = value
        mantissa, _, power = cells[place].lower().partition("e")
        decimals = max(decimals, len(mantissa.partition(".")[2]) - int(power or 0))
    return values, decimals


# --- bags -----------------------------------------------------------------------------------------
def _from_bag(path: Path, namespace: str) -> Recording:
    """Times of the impacts of the last run, and nothing else of it."""
    from bouncing_disk_ros.bag import BagError
    from bouncing_disk_ros.report.read_run import read_run

    try:
        record = read_run(str(path), namespace=namespace or None)
    except (BagError, OSError) as error:
        raise InputError("recording", str(path), "a bag that can be read", str(error)) from None
    rows = record.rows
    times = np.asarray(rows["time"], float)[np.asarray(rows["count"]) == 1]
    return checked(path.name, np.unique(times), None, 0.5e-9)
