"""What follows from a map of the study `motor`: no-load speed, stall torque, best of each row."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import xarray as xr
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def derived(
    result: xr.Dataset, up: str, across: str, limits: Callable[[str], Floats]
) -> xr.Dataset:
    """The result with what its rows or columns amount to, arrays over the other axis.

    Their units and names are in study.described. `limits` gives the torque T* of friction along an
    axis.
    """
    found = dict(zip((up, across), (across, up), strict=True))
    added: dict[str, tuple[str, Floats]] = {}
    for name, other in found.items():
        speed = _along(result, "mean_speed", name)
        if name in ("load_torque", "brake_torque"):
            loads = result[name].values
            best, place = _best(_along(result, "efficiency", name), loads)
            added["best_efficiency"] = (other, best)
            added[f"best_{name}"] = (other, place)
            added["no_load_speed"] = (other, np.array([_at_zero(loads, row) for row in speed]))
        if name == "load_torque":
            rows = zip(speed, limits(other), strict=True)
            stalls = [stall(result[name].values, row, top) for row, top in rows]
            added["stall_torque"] = (other, np.array(stalls))
        if name == "phase_lag":
            # with its sign: a load that turns the rotor back can be faster than the stator forwards
            fastest, place = _best(speed, result[name].values)
            added["best_phase_lag"] = (other, place)
            added["best_speed"] = (other, fastest)
    return result.assign(added)


def _along(result: xr.Dataset, field: str, name: str) -> Floats:
    """A field with the axis called `name` last."""
    found: Floats = result[field].transpose(..., name).values
    return found


def _best(rows: Floats, places: Floats) -> tuple[Floats, Floats]:
    """The largest value of each row and where it is; nan where none is known."""
    known = np.isfinite(rows)
    at = np.where(known, rows, -math.inf).argmax(axis=1)
    any_known = known.any(axis=1)
    best = rows[np.arange(len(rows)), at]
    return np.where(any_known, best, math.nan), np.where(any_known, places[at], math.nan)


def _at_zero(loads: Floats, speed: Floats) -> float:
    """The speed at load 0, between the loads next to it; nan where the axis does not reach it."""
    if not loads[0] <= 0.0 <= loads[-1]:
        return math.nan
    return float(np.interp(0.0, loads, speed))


def stall(loads: Floats, speed: Floats, limit: float) -> float:
    """The load that brings a rotor to a stop: where the mean speed crosses 0, on a straight line.

    T* (`limit`) where friction gives way before, and nan where the axis ends before both.
    """
    begin = _at_zero(loads, speed)
    if not math.isfinite(begin):
        return math.nan
    if begin == 0.0:
        return 0.0
    sign = math.copysign(1.0, begin)
    ahead = loads * sign > 0.0
    places, values = (loads[ahead] * sign), (speed[ahead] * sign)
    if sign < 0.0:
        places, values = places[::-1], values[::-1]
    before, height = 0.0, abs(begin)
    for place, value in zip(places, values, strict=True):
        if not math.isfinite(value):
            return sign * limit if place >= limit else math.nan
        if value <= 0.0:
            return sign * float(before + (place - before) * height / (height - value))
        before, height = float(place), float(value)
    return math.nan
