"""What arrives from a run, checked before it counts: rows of impacts, samples, motions.

Everything here comes from outside (a topic, a bag) and raises InputError where it cannot be what a
simulator publishes.
"""

from __future__ import annotations

import math
from collections.abc import Container, Iterable

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros import limits, parameters
from bouncing_disk_ros.core.model import IMPACT_DTYPE, Motion, MotionInForce
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.field_checks import number

Rows = NDArray[np.void]
LARGEST_INDEX = 2.0**53
"""Whole numbers in rows are exact up to here."""
LATEST_NS = 1 << 62
"""No simulated time lies beyond this."""
_NUMBERS = tuple(name for name in IMPACT_DTYPE.names or () if IMPACT_DTYPE[name] == np.dtype("<f8"))


def checked_rows(rows: Rows, lacking: Container[str] = ()) -> Rows:
    """The same rows of `impacts_from_msg`, one or more, in the order of their index.

    x, y and z, which only draw, are not looked at, nor are fields that the message is `lacking`.
    """
    for name in _NUMBERS:
        if name in lacking:
            continue
        _all(name, rows, np.abs(rows[name]) <= limits.LARGEST, f"numbers up to {limits.LARGEST:g}")
    for name in ("index", "cycles"):
        if name in lacking:
            continue
        values = rows[name]
        whole = (np.abs(values) <= LARGEST_INDEX) & (values == np.floor(values))
        _all(name, rows, whole, "whole numbers")
    phase = rows["forcing_phase"]
    if "forcing_phase" not in lacking:
        _all("forcing_phase", rows, (phase >= 0.0) & (phase <= math.tau), "angles from 0 to 2π rad")
    _all("count", rows, rows["count"] >= 1, "1 or more")
    _all("index", rows[1:], np.diff(rows["index"]) > 0.0, "an index that rises")
    return checked_times(rows)


def checked_times(rows: Rows) -> Rows:
    """The same rows in the order of their index; InputError where their time falls."""
    _all("time", rows[1:], np.diff(rows["time"]) >= 0.0, "times that do not fall")
    return rows


def _all(name: str, rows: Rows, good: NDArray[np.bool_], allowed: str) -> None:
    if not np.all(good):
        raise InputError(f"impacts, {name}", rows[name][int(np.argmin(good))].item(), allowed)


def checked_number(field: str, value: float) -> float:
    """A finite number of a size that means something."""
    return number(field, value, -limits.LARGEST, limits.LARGEST)


def checked_motion(motion: MotionInForce) -> MotionInForce:
    """A motion in force whose values are those of a platform."""
    for one in (motion.start, motion.target):
        for name, value in zip(Motion._fields, one, strict=True):
            parameters.TABLE[name].checked(float(value), f"platform/motion {name}")
    if not 0.0 <= motion.forcing_phase <= math.tau:
        raise InputError("platform/motion forcing_phase", motion.forcing_phase, "0 to 2π rad")
    if not 0 <= motion.begin_ns <= motion.end_ns <= LATEST_NS:
        given = f"{motion.begin_ns} to {motion.end_ns} ns"
        raise InputError("platform/motion simulated_time", given, f"0 to {LATEST_NS} ns, rising")
    return motion


def checked_numbers(field: str, values: Iterable[float]) -> None:
    """InputError unless all of them are finite and of a size that means something."""
    for value in values:
        checked_number(field, value)
