"""The study `manifolds`: saddles on the boundaries of basins, with their manifolds."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import ClassVar, NamedTuple

import numpy as np
import xarray as xr

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.attractors import Attractors
from bouncing_disk_ros.maps.basin_labels import label_starts
from bouncing_disk_ros.maps.basin_measures import UNRESOLVED, centres
from bouncing_disk_ros.maps.periodic_orbit import PeriodicOrbit
from bouncing_disk_ros.maps.window_basins import label_plane
from bouncing_disk_ros.orbit_studies.edge_states import boundary_pairs, edge_states
from bouncing_disk_ros.orbit_studies.manifold_growth import (
    GrowthRule,
    Manifold,
    Stability,
    Window,
    enclosed_part,
    saddle_manifolds,
    sides,
    why_open,
)
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.study.basins.compute import Basins, from_arrays
from bouncing_disk_ros.study.computation import Arrays, Row, variables

SEARCHED = 64
"""Neighbours with unlike ends are looked for on a grid of SEARCHED × SEARCHED starts."""
_STABILITIES = list(Stability)


class Enclosure(NamedTuple):
    """What the stable manifold of a saddle encloses of the window."""

    share: float  # nan: not known
    basin: int  # index of the attractor whose basin it is; UNRESOLVED: not known
    why: str  # why it is not known; empty: it is


class Manifolds(Basins):
    """Basins with saddles and manifolds; parameters as in the table of the executable."""

    name: ClassVar[str] = "manifolds"
    title: ClassVar[str] = "Saddles on basin boundaries and their manifolds"
    revision: ClassVar[int] = 2

    def __init__(self, parameters: Mapping[str, Value]) -> None:
        unused: dict[str, Value] = {
            "angular_velocities": "", "phase_lag": 0.0, "angular_forcing": 1.0,
        }  # fmt: skip
        super().__init__({**parameters, **unused})
        given = self.parameters
        if given["velocity"] != "before":
            raise InputError("velocity", given["velocity"], "before: manifolds are those of w_A")
        if self._map.restitution == 0.0:
            hint = "Nothing bounces there, and no state has a past."
            raise InputError("restitution", 0.0, "above 0", hint)

    def context(self) -> Arrays:
        """The attractors, the saddles between their basins, and the manifolds of these."""
        arrays = dict(super().context())
        known = from_arrays(arrays)
        given = self.parameters
        low, high = float(given["velocity_begin"]), float(given["velocity_end"])
        parts = centres(0.0, 1.0, SEARCHED)
        tau, w = math.tau * parts, low + (high - low) * parts
        labels = label_plane(known, self._map, tau, w).label
        pairs = boundary_pairs(labels, tau, w, int(given["pairs"]))
        saddles, lost = edge_states(self._map, known, pairs)
        rule = GrowthRule(
            distance=float(given["distance"]), angle=float(given["angle"]), lowest=low,
            most=int(given["points"]), repetitions=float(given["repetitions"]),
        )  # fmt: skip
        arrays |= manifolds_to_arrays(saddles, rule, lambda found: self._enclosure(known, found))
        arrays["edge_pairs"] = np.array([len(pairs), lost], np.int64)
        return arrays

    def _enclosure(self, known: Attractors, branches: list[Manifold]) -> Enclosure:
        """The basin that a stable manifold encloses, where it is the boundary of one alone."""
        names = ("velocity_begin", "velocity_end", "phase_begin", "phase_end")
        window = Window(*(float(self.parameters[name]) for name in names))
        why = next(filter(None, (why_open(one, window.lowest) for one in branches)), "")
        if not why:
            ends = [
                np.unique(label_starts(known, self._map, *states.T.copy()).label)
                for states in sides(branches, window.lowest)
            ]
            if all(len(labels) == 1 for labels in ends) and ends[0][0] != ends[1][0]:
                found = enclosed_part(branches, window)
                return Enclosure(found.share, int(ends[found.inside][0]), "")
            why = "it is not the boundary between two basins and nothing else"
        return Enclosure(math.nan, UNRESOLVED, why)

    def finish(self, result: xr.Dataset, context: Arrays) -> xr.Dataset:
        """As of basins, with the manifolds."""
        rows: dict[str, Row] = {
            name: (dims, context[name], units, about)
            for name, (dims, units, about) in _STORED.items()
            if name in context
        }
        return super().finish(result, context).assign(variables(rows))


_STORED = {
    "saddle_impacts": ("saddle", "1", "impacts of the saddle in one repetition"),
    "saddle_cycles": ("saddle", "1", "periods of the platform in one repetition"),
    "saddle_multiplier": ("saddle", "1", "multiplier outside of the unit circle"),
    "saddle_share": (
        "saddle", "1", "share of the window enclosed by its stable manifold; nan: not known"
    ),
    "saddle_basin": (
        "saddle", "1", "index of the attractor whose basin that is; −1: not known"
    ),
    "saddle_open": ("saddle", "1", "why the share is not known; empty: it is"),
    "saddle_point_saddle": ("saddle_point", "1", "index of the saddle of a point"),
    "saddle_point_forcing_phase": ("saddle_point", "rad", "forcing phase of its impacts"),
    "saddle_point_velocity": ("saddle_point", "pi g/omega", "w_A of its impacts"),
    "piece_saddle": ("piece", "1", "index of the saddle of a piece of a manifold"),
    "piece_stability": ("piece", "1", "0: stable manifold, 1: unstable manifold"),
    "manifold_piece": (
        "manifold_point", "1", "index of the piece of a point; cuts lie between pieces"
    ),
    "manifold_forcing_phase": (
        "manifold_point", "rad", "forcing phase along a piece, not wrapped"
    ),
    "manifold_velocity": ("manifold_point", "pi g/omega", "w_A along a piece"),
    "edge_pairs": (
        "edge_count", "1", "pairs that edge tracking began with; those without a saddle"
    ),
}  # fmt: skip
"""Arrays of saddles and manifolds -> dimension, unit and what they are; 0.2.0 lacks two."""


def manifolds_to_arrays(
    saddles: list[PeriodicOrbit],
    rule: GrowthRule,
    enclosure_of: Callable[[list[Manifold]], Enclosure],
) -> dict[str, np.ndarray]:
    """Saddles and their manifolds as arrays, to be stored."""
    pieces: list[np.ndarray] = []
    owners: list[tuple[int, int]] = []
    enclosed: list[Enclosure] = []
    for i, saddle in enumerate(saddles):
        for k, stability in enumerate(_STABILITIES):
            branches = saddle_manifolds(saddle, stability, rule)
            if stability is Stability.STABLE:
                enclosed.append(enclosure_of(branches))
            own = [piece for branch in branches for piece in branch.pieces]
            pieces += own
            owners += [(i, k)] * len(own)
    states = [np.stack((s.forcing_phase, s.axial_impact_velocity), axis=1) for s in saddles]
    points = np.concatenate([np.empty((0, 2)), *states])
    lines = np.concatenate([np.empty((0, 2)), *pieces])
    owner = np.array(owners, np.int64).reshape(-1, 2)
    counts = np.array([len(piece) for piece in pieces], np.int64)
    return {
        "saddle_impacts": np.array([s.impacts for s in saddles], np.int64),
        "saddle_cycles": np.array([s.cycles for s in saddles], np.int64),
        "saddle_multiplier": np.array([s.multipliers[0].real for s in saddles], float),
        "saddle_share": np.array([one.share for one in enclosed], float),
        "saddle_basin": np.array([one.basin for one in enclosed], np.int64),
        "saddle_open": np.array([one.why for one in enclosed], str),
        "saddle_point_saddle": np.repeat(np.arange(len(saddles)), [s.impacts for s in saddles]),
        "saddle_point_forcing_phase": points[:, 0],
        "saddle_point_velocity": points[:, 1],
        "piece_saddle": owner[:, 0],
        "piece_stability": owner[:, 1],
        "manifold_piece": np.repeat(np.arange(len(pieces)), counts),
        "manifold_forcing_phase": lines[:, 0],
        "manifold_velocity": lines[:, 1],
    }
