"""The platform's offset trajectories at recorded instants, from the record of inputs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.core.offset import Coefficients, Lane, Offset, Segment, coefficients
from bouncing_disk_ros.core.offset import derivative as derivative_of
from bouncing_disk_ros.units import NS

Column = NDArray[np.float64]
Offsets = Sequence[tuple[int, Offset | None]]
"""Offsets of a run: the simulated instant (ns) of each acceptance, and all that was accepted then;
None: the platform was moved by an offset that is not known."""

_LAST_NS = 2**63 - 1
_ROUNDED = 1e-12  # s: so far from a knot the time of an impact may be rounded to its other side


def axial_offset(times: Column, offsets: Offsets, order: int = 0) -> Column:
    """The axial offset p (m; order 1: its velocity, m/s) at simulated times (s), shape (n,).

    nan where it is not known, and of the velocity where it jumps. Without any entry it is 0.
    """
    values = np.zeros(len(times))
    if not offsets or not len(times):
        return values
    pieces = list(_pieces(offsets))
    begins = np.array([begin for begin, _ in pieces]) / NS
    places = np.searchsorted(begins, times, side="right") - 1
    values[places < 0] = np.nan
    order_of_places = np.argsort(places, kind="stable")
    found, first = np.unique(places[order_of_places], return_index=True)
    for place, rows in zip(found, np.split(order_of_places, first[1:]), strict=True):
        if place >= 0:
            values[rows] = _values(pieces[place][1], times[rows], order)
    if order == 1:
        values[_jumping(pieces, begins, times, places)] = np.nan
    return values


def _pieces(offsets: Offsets) -> Iterator[tuple[int, Segment | None]]:
    """When each piece begins (ns), and its segment; None: not known."""
    ends = [*(begin for begin, _ in offsets[1:]), _LAST_NS]
    before: Segment | None = None
    for (since, offset), end in zip(offsets, ends, strict=True):
        if offset is None:
            yield since, None
            before = None
            continue
        for begin, segment in _followed(offset.axial, since, end):
            if segment != before:
                yield begin, segment
            before = segment


def _followed(lane: Lane, since: int, end: int) -> Iterator[tuple[int, Segment]]:
    now = since
    while now < end:
        yield now, lane.segment_at(now)
        now = lane.boundary_after(now)


def _values(segment: Segment | None, times: Column, order: int) -> Column:
    if segment is None:
        return np.full(len(times), np.nan)
    c: Coefficients = coefficients(segment)
    scale = float(segment.duration)
    x = (times - segment.begin_ns / NS) / scale
    for _ in range(order):
        c = tuple(value / segment.duration for value in derivative_of(c))
    total = np.zeros(len(times))
    for value in reversed(c):
        total = total * x + float(value)
    return total


def _jumping(
    pieces: Sequence[tuple[int, Segment | None]],
    begins: Column,
    times: Column,
    places: NDArray[np.int64],
) -> NDArray[np.bool_]:
    """Which times are those of a jump of the velocity, up to rounding."""
    close = _ROUNDED + 4.0 * np.spacing(times)
    found = np.zeros(len(times), bool)
    for neighbour in (places, places + 1):
        i = np.clip(neighbour, 0, len(pieces) - 1)
        near = np.flatnonzero(np.abs(times - begins[i]) <= close)
        jumps = {place: _jumps(pieces, place) for place in np.unique(i[near]).tolist()}
        found[near] |= np.array([jumps[place] for place in i[near].tolist()], bool)
    return found


def _jumps(pieces: Sequence[tuple[int, Segment | None]], i: int) -> bool:
    """Whether the velocity jumps where piece i begins."""
    begin, segment = pieces[i]
    before = pieces[i - 1][1] if i else None
    if segment is None or before is None:
        return False
    return segment.velocity_after(begin) != before.velocity_before(begin)
