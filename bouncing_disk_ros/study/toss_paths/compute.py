"""The study `toss_paths`: the path of the hand for several motions (paper, Fig. 1)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from bouncing_disk_ros.angles import angles_of
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.toss_paths import toss_paths
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.study.computation import Arrays, Axis, Field, Region, Study
from bouncing_disk_ros.study.toss_map.compute import setting_of


class TossPaths(Study):
    """Closed paths (a_e β, s), one for each pair of a phase lag and an amplitude angle."""

    name: ClassVar[str] = "toss_paths"
    title: ClassVar[str] = "Paths of the hand"

    def __init__(self, parameters: Mapping[str, Value]) -> None:
        super().__init__(parameters)
        given = self.parameters
        self.lags = np.array(angles_of("phase_lags", str(given["phase_lags"])))
        self.angles = np.array(angles_of("amplitude_angles", str(given["amplitude_angles"])))
        if len(self.lags) != len(self.angles):
            allowed = f"as many angles as phase_lags, {len(self.lags)}"
            raise InputError("amplitude_angles", len(self.angles), allowed)
        self.setting = setting_of(given)
        toss_paths(self.lags, self.angles, self.setting, points=2)  # refuses what it cannot use

    @property
    def axes(self) -> Mapping[str, Axis]:
        """Paths, and the points of each."""
        points = int(self.parameters["points"])
        return {
            "path": Axis(np.arange(len(self.lags)), "1", "paths in the order given"),
            "forcing_phase": Axis(
                1.5 * math.pi + np.linspace(0.0, math.tau, points), "rad",
                "forcing phase, from the lowest point through one period", "τ",
            ),
        }  # fmt: skip

    @property
    def fields(self) -> Mapping[str, Field]:
        """As in `tosses.TossPaths`."""
        both, one = ("path", "forcing_phase"), ("path",)
        return {
            "arc": Field(both, "float64", "m", "arc along the circle of radius a_e", "a_e β"),
            "axial_position": Field(both, "float64", "m", "height of the hand", "s"),
            "phase_lag": Field(one, "float64", "rad", "phase lag", "θ"),
            "amplitude_angle": Field(one, "float64", "rad", "amplitude angle", "φ_L"),
            "separation_phase": Field(one, "float64", "rad", "phase of separation", "τ_sep"),
            "separation_arc": Field(one, "float64", "m", "arc at separation"),
            "separation_position": Field(one, "float64", "m", "height at separation"),
        }

    @property
    def chunks(self) -> Mapping[str, int]:
        """All at once."""
        return {"path": len(self.lags)}

    def compute(self, region: Region, context: Arrays, before: Arrays | None) -> Arrays:  # noqa: ARG002
        """All paths."""
        points = int(self.parameters["points"])
        found = toss_paths(self.lags, self.angles, self.setting, points=points)
        own = {"phase_lag": self.lags, "amplitude_angle": self.angles}
        return own | {name: getattr(found, name) for name in self.fields if name not in own}
