"""The study `basins`: to which attractor each start (τ_imp, w_A) goes (paper, Fig. 4)."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from bouncing_disk_ros.angles import numbers_of
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.attractor_search import missed_attractors, window_attractors
from bouncing_disk_ros.maps.attractors import (
    Attractor,
    AttractorKind,
    Attractors,
    numbered,
    refuse_conservative,
)
from bouncing_disk_ros.maps.basin_labels import Floats, LabelRule
from bouncing_disk_ros.maps.basin_measures import (
    PIXELS,
    UNRESOLVED,
    BasinEntropy,
    LabelMap,
    PowerLaw,
    basin_entropy,
    box_dimension,
    centres,
    row_blocks,
    shares,
    uncertainty_exponent,
    unresolved_fraction,
)
from bouncing_disk_ros.maps.next_collision import NextCollisionMap
from bouncing_disk_ros.maps.settled_speed import settled_speeds
from bouncing_disk_ros.maps.window_basins import label_plane
from bouncing_disk_ros.niceness import give_way
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.study.computation import (
    Arrays,
    Axis,
    Field,
    Region,
    Row,
    Study,
    variables,
)

SIDES = (64, 1024)
"""Least and largest side of a region (pixels); the largest takes about a second of one core."""
REGIONS = 16
"""A map is cut into about so many regions, if their sides allow it."""
_KINDS = list(AttractorKind)
_INTERVAL = "half-width of the interval of 95 %, at these distances"


class Basins(Study):
    """Labels over the plane of starts; parameters as in the table of the executable."""

    name: ClassVar[str] = "basins"
    title: ClassVar[str] = "Basins of attraction of the next-collision map"
    revision: ClassVar[int] = 2

    def __init__(self, parameters: Mapping[str, Value]) -> None:
        super().__init__(parameters)
        given = self.parameters
        self._map = NextCollisionMap(float(given["axial_forcing"]), float(given["restitution"]))
        refuse_conservative(self._map.restitution)
        for low, high in (("phase_begin", "phase_end"), ("velocity_begin", "velocity_end")):
            if not float(given[low]) < float(given[high]):
                allowed = f"less than {high} = {float(given[high]):g}"
                raise InputError(low, given[low], allowed, "The window is empty.")
        before_impact(np.empty(0), self._map.restitution, after=self._after)
        text = str(given["angular_velocities"])
        self._speeds = np.empty(0)
        if text.strip():
            allowed = "numbers in units of ωΦ, such as '0 0.5 -1'"
            self._speeds = np.array(numbers_of("angular_velocities", text, allowed))
        else:
            for name in ("angular_velocities", "phase_lag", "angular_forcing"):
                del self.parameters[name]  # no part of what is computed

    @property
    def _after(self) -> bool:
        return self.parameters["velocity"] == "after"

    @property
    def whole_period(self) -> bool:
        """Whether the window holds each forcing phase once."""
        width = float(self.parameters["phase_end"]) - float(self.parameters["phase_begin"])
        return abs(width - math.tau) < 1e-9

    def _pixels(self, name: str, count: str) -> NDArray[np.float64]:
        """Centres of the pixels along an axis."""
        begin, end = (float(self.parameters[f"{name}_{side}"]) for side in ("begin", "end"))
        return centres(begin, end, int(self.parameters[count]))

    @property
    def axes(self) -> Mapping[str, Axis]:
        """Velocity (rows) and forcing phase (columns): centres of the pixels."""
        when = "after (its opposite)" if self._after else "before"
        axes = {
            "velocity": Axis(
                self._pixels("velocity", "height"), "pi g/omega",
                f"relative velocity {when} the first impact", "−u" if self._after else "w_A",
            ),
            "forcing_phase": Axis(
                self._pixels("phase", "width"), "rad", "forcing phase of the first impact", "τ_imp"
            ),
        }  # fmt: skip
        if len(self._speeds):
            axes["angular_velocity"] = Axis(
                self._speeds, "omega Phi", "angular velocity of the disk before the first impact"
            )
        return axes

    @property
    def fields(self) -> Mapping[str, Field]:
        """Labels, and how long each start takes until it is clear."""
        dims = ("velocity", "forcing_phase")
        fields = {
            "label": Field(dims, "int32", "1", "index of the attractor, −1: none", fill=UNRESOLVED),
            "impacts": Field(dims, "int32", "1", "impacts until it is clear", fill=0),
            "time": Field(dims, "float64", "rad", "time until it is clear", "ωt"),
        }  # fmt: skip
        if len(self._speeds):
            fields["mean_speed"] = Field(
                ("angular_velocity", *dims),
                "float64",
                "omega Phi",
                "mean speed it ends with; nan: at rest, or without a label",
            )
        return fields

    @property
    def chunks(self) -> Mapping[str, int]:
        """Squares."""
        pixels = int(self.parameters["width"]) * int(self.parameters["height"])
        side = min(max(SIDES[0], math.isqrt(pixels // REGIONS)), SIDES[1])
        return {"velocity": side, "forcing_phase": side}

    def context(self) -> Arrays:
        """The attractors of the window, with their speeds."""
        rows, columns = (self.axes[n].values.astype(float) for n in ("velocity", "forcing_phase"))
        found = window_attractors(self._map, columns, self._before(rows))
        arrays = dict(to_arrays(found))
        if len(self._speeds):
            lag, angular = (float(self.parameters[n]) for n in ("phase_lag", "angular_forcing"))
            section = replace(self._map, phase_lag=lag, angular_forcing=angular)
            arrays["mean_speed"] = settled_speeds(found, section, self._speeds)
        return arrays

    def _before(self, velocity: NDArray[np.float64]) -> NDArray[np.float64]:
        return before_impact(velocity, self._map.restitution, after=self._after)

    def compute(self, region: Region, context: Arrays, before: Arrays | None) -> Arrays:  # noqa: ARG002
        """Label the starts of one region."""
        rows = self._before(self.axes["velocity"].values[region.slices["velocity"]].astype(float))
        phases = self.axes["forcing_phase"].values[region.slices["forcing_phase"]].astype(float)
        given = self.parameters
        rule = LabelRule(float(given["tolerance"]), cap=int(given["cap"]))
        found = label_plane(from_arrays(context), self._map, phases, rows, rule)
        arrays: dict[str, NDArray[np.generic]] = dict(found._asdict())
        if len(self._speeds):
            unresolved = np.full((len(self._speeds), 1), math.nan)  # label −1: the last one
            speeds = np.concatenate((context["mean_speed"], unresolved), axis=1)
            arrays["mean_speed"] = speeds[:, found.label]
        return arrays

    def finish(self, result: xr.Dataset, context: Arrays) -> xr.Dataset:
        """Attractors with their shares, and the measures of the boundary."""
        found = from_arrays(context).found
        # A map that may be larger than memory is read in row blocks. A smaller map is one block,
        # and the result keeps no copy of it: to free the copy would hold up ticks.
        labels: LabelMap = result["label"]
        if result["label"].size <= PIXELS:
            labels = next(row_blocks(labels, 0, labels.shape[0]))
        # This thread does not give way, so it only waits: at work, it could take the processor from
        # a thread that holds the interpreter's lock.
        with ThreadPoolExecutor(os.cpu_count(), initializer=give_way) as threads:
            measures = self._measures(labels, threads)
            share = threads.submit(shares, labels, len(found), periodic=self.whole_period)
            missing = threads.submit(self._missed, from_arrays(context), result, labels)
            boundary = _boundary(*(one.result() for one in measures)) if measures else {}
            parts, missed = share.result(), missing.result()
        points = [(i, *p) for i, a in enumerate(found)
                  for p in zip(a.forcing_phases, a.velocities, strict=True)]  # fmt: skip
        owner, phase, speed = np.array(points).reshape(-1, 3).T
        speed = speed * (self._map.restitution if self._after else 1.0)
        added: dict[str, Row] = {
            "attractor_name": ("attractor", numbered([a.name for a in found]), "1",
                               "name of the attractor"),
            "attractor_kind": ("attractor", [str(a.kind) for a in found], "1",
                               "kind of the attractor"),
            "attractor_period": ("attractor", [_period_of(a) for a in found], "1",
                                 "impacts in one repetition of the attractor, 0: none"),
            "attractor_cycles": ("attractor", [a.cycles for a in found], "1",
                                 "periods of the platform in one repetition, 0: none"),
            "multiplier": ("attractor", [a.multiplier for a in found], "1",
                           "largest modulus of the Floquet multipliers of the attractor"),
            "fraction": ("attractor", [part.fraction for part in parts], "1",
                         "share of the window that goes to the attractor"),
            "fraction_uncertainty": ("attractor", [part.uncertainty for part in parts], "1",
                                     "standard error of the share"),
            "unresolved_fraction": ((), unresolved_fraction(labels), "1",
                                    "share of the window that is unresolved"),
            "point_attractor": ("point", owner.astype(np.int32), "1",
                                "attractor that the point belongs to"),
            "point_forcing_phase": ("point", phase, "rad", "forcing phase of the point"),
            "point_velocity": ("point", speed, "pi g/omega",
                               "relative velocity of the point, as on the axis velocity"),
        }  # fmt: skip
        return result.assign(variables(added | missed | boundary))

    def _missed(self, found: Attractors, result: xr.Dataset, labels: LabelMap) -> dict[str, Row]:
        """Attractors that the search did not find, but unresolved starts lead to."""
        rows, columns = self._unresolved_places(labels)
        if not len(rows):
            return {}
        w = self._before(result["velocity"].values[rows].astype(float))
        tau = result["forcing_phase"].values[columns].astype(float) % math.tau
        missed = missed_attractors(self._map, found, np.stack((tau, w), axis=1))
        if not missed:
            return {}
        about = "attractors the search missed; unresolved starts lead to them"
        return {"missed_attractor_name": ("missed", [one.name for one in missed], "1", about)}

    def _unresolved_places(self, labels: LabelMap) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Rows and columns of unresolved pixels, of the first block of rows that has some."""
        begin = 0
        for part in row_blocks(labels, 0, labels.shape[0]):
            rows, columns = np.nonzero(part == UNRESOLVED)
            if len(rows):
                return rows + begin, columns
            begin += len(part)
        return np.empty(0, np.intp), np.empty(0, np.intp)

    def _measures(self, labels: LabelMap, threads: Executor) -> list[Future[Any]]:
        """What `_boundary` takes, each computed in a thread; none of a small map."""
        if min(labels.shape) < 48:
            return []
        by_distance = (uncertainty_exponent, box_dimension)
        return [
            *(threads.submit(one, labels, periodic=self.whole_period) for one in by_distance),
            threads.submit(basin_entropy, labels),
        ]


def _boundary(alpha: PowerLaw, dimension: PowerLaw, entropy: BasinEntropy) -> dict[str, Row]:
    return {
        "basin_entropy": ((), entropy.basin, "1",
                          "basin entropy, mean over squares of 5 × 5 pixels"),
        "boundary_basin_entropy": ((), entropy.boundary, "1",
                                   "basin entropy of the squares that hold several labels"),
        "uncertainty_exponent": ((), alpha.exponent, "1",
                                 "uncertainty exponent of the boundary"),
        "uncertainty_exponent_error": ((), alpha.uncertainty, "1", _INTERVAL),
        "box_dimension": ((), dimension.exponent, "1", "box dimension of the boundary"),
        "box_dimension_error": ((), dimension.uncertainty, "1", _INTERVAL),
        "boundary_distance": ("distance", alpha.sizes, "pixel",
                              "distance, and side of the squares"),
        "uncertain_fraction": ("distance", alpha.counts, "1",
                               "share of pixels with another label at the distance"),
    }  # fmt: skip


def _period_of(attractor: Attractor) -> int:
    """Impacts in one repetition; 0: it does not repeat, or has contact and no impacts alone."""
    periodic = attractor.kind is AttractorKind.PERIODIC
    return len(attractor.forcing_phases) if periodic else 0


def to_arrays(attractors: Attractors) -> Arrays:
    """Attractors as arrays, to be stored and sent to workers."""
    found = attractors.found
    lengths = np.array([len(a.forcing_phases) for a in found], np.int64)
    return {
        "kind": np.array([_KINDS.index(a.kind) for a in found], np.int64),
        "cycles": np.array([a.cycles for a in found], np.int64),
        "multiplier": np.array([a.multiplier for a in found], float),
        "length": lengths,
        "forcing_phase": np.concatenate([np.empty(0), *(a.forcing_phases for a in found)]),
        "velocity": np.concatenate([np.empty(0), *(a.velocities for a in found)]),
        "after_contact": np.array(attractors.after_contact),
        "unresolved": np.array(attractors.unresolved),
    }


def from_arrays(arrays: Arrays) -> Attractors:
    """The attractors again."""
    ends = np.cumsum(arrays["length"].astype(int))
    phases = np.split(arrays["forcing_phase"].astype(float), ends)[:-1]
    speeds = np.split(arrays["velocity"].astype(float), ends)[:-1]
    rows = zip(arrays["kind"], phases, speeds, arrays["cycles"], arrays["multiplier"], strict=True)
    found = tuple(
        Attractor(_KINDS[int(kind)], phase, speed, int(cycles), float(multiplier))
        for kind, phase, speed, cycles, multiplier in rows
    )
    return Attractors(found, int(arrays["after_contact"]), int(arrays["unresolved"]))


def before_impact(velocity: Floats, restitution: float, *, after: bool) -> Floats:
    """w_A of starts given by the velocity before the impact, or (`after`) by −u, u = −ε w_A.

    Both are negative, so that both windows read alike. InputError: after an impact at ε = 0 the
    disk has no velocity.
    """
    if not after:
        return velocity
    if restitution == 0.0:
        raise InputError("velocity", "after", "before, at restitution 0", "Nothing bounces there.")
    return velocity / restitution
