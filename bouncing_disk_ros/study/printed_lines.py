"""Lines that several studies print of their results."""

from __future__ import annotations

import math

import xarray as xr


def kind_shares(result: xr.Dataset) -> list[str]:
    """At which share of the points each kind of motion is."""
    kind = result["kind"]
    rows = []
    for number, name in zip(kind.attrs["flag_values"], kind.attrs["flag_meanings"].split(),
                            strict=True):  # fmt: skip
        share = 100.0 * float((kind == number).mean())
        if share > 0.0:
            rows.append(f"  {name:12} {share:7.3f} % of the points")
    return rows


def largest(result: xr.Dataset, field: str, name: str, unit: str, digits: str) -> list[str]:
    """Where a field is largest, written with `digits`; nothing where it is nowhere finite."""
    values = result[field]
    known = values.where(abs(values) < math.inf)
    if not bool(known.notnull().any()):
        return []
    best = known.isel(known.argmax(...))
    at = ", ".join(at_value(known[axis], float(best[axis])) for axis in reversed(known.dims))
    return [f"  largest {name} {float(best):{digits}}{unit} at {at}"]


def at_value(axis: xr.DataArray, value: float, digits: str = ".6g") -> str:
    """A value of the axis, with the symbol and the unit of its parameter."""
    unit = axis.attrs["units"]
    return f"{axis.attrs['symbol']} = {value:{digits}}{'' if unit == '1' else f' {unit}'}"
