"""The study `toss_map`: single tosses over phase lag and amplitude angle (paper, Fig. 2a-c)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cached_property
from typing import ClassVar

import numpy as np
import xarray as xr

from bouncing_disk_ros.angles import angles_of
from bouncing_disk_ros.core.model import Disk
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.best_toss import Extreme, Ridge, bounded_measures, extreme, ridge
from bouncing_disk_ros.maps.tosses import (
    CODES,
    LOWEST,
    TossSetting,
    check_setting,
    separation_phase,
    toss,
)
from bouncing_disk_ros.parameters import DEFAULTS, Value
from bouncing_disk_ros.study.computation import Arrays, Axis, Field, Region, Row, Study, variables

ROWS = 64
"""Phase lags of one region."""


def setting_of(given: Mapping[str, Value]) -> TossSetting:
    """What all tosses have in common. Raises InputError."""
    # the restitution plays no part before the first impact
    disk = Disk.of({**DEFAULTS, **given})
    setting = TossSetting(float(given["arc_amplitude"]), float(given["frequency"]), disk)
    check_setting(setting)
    return setting


class TossMap(Study):
    """Airborne speed, speed ratio and efficiency of every toss of a map."""

    name: ClassVar[str] = "toss_map"
    title: ClassVar[str] = "Single tosses over phase lag and amplitude angle"

    def __init__(self, parameters: Mapping[str, Value]) -> None:
        super().__init__(parameters)
        given = self.parameters
        for name in ("phase_lag", "amplitude_angle"):
            low, high = float(given[f"{name}_begin"]), float(given[f"{name}_end"])
            is_one = low == high and int(given[f"{name}_count"]) == 1
            if not (low < high or is_one):
                allowed = f"less than {name}_end = {high:g}"
                raise InputError(f"{name}_begin", low, allowed, "The map is empty.")
        self.setting = setting_of(given)
        self.trajectory_lags = angles_of("trajectory_lags", str(given["trajectory_lags"]))

    def _line(self, name: str) -> np.ndarray:
        given = self.parameters
        count = int(given[f"{name}_count"])
        return np.linspace(float(given[f"{name}_begin"]), float(given[f"{name}_end"]), count)

    @property
    def axes(self) -> Mapping[str, Axis]:
        """θ (rows) and φ_L (columns)."""
        return {
            "phase_lag": Axis(self._line("phase_lag"), "rad", "phase lag", "θ"),
            "amplitude_angle": Axis(
                self._line("amplitude_angle"), "rad", "amplitude angle, tan φ_L = a_e Φ/A", "φ_L"
            ),
        }

    @property
    def fields(self) -> Mapping[str, Field]:
        """As in `tosses.Toss`."""
        dims = ("phase_lag", "amplitude_angle")
        return {
            "airborne_speed": Field(dims, "float64", "rad/s", "airborne speed", "α̇_f"),
            "speed_ratio": Field(dims, "float64", "1", "speed ratio", "ν"),
            "efficiency": Field(dims, "float64", "1", "efficiency", "η"),
            "delay": Field(dims, "float64", "s", "time until the disk leaves"),
            "code": Field(dims, "int8", "1", "how the toss ended", fill=-1, flags={
                code: text.replace(" ", "_").replace(",", "") for code, text in CODES.items()
            }),
        }  # fmt: skip

    @property
    def chunks(self) -> Mapping[str, int]:
        """Rows of equal θ."""
        return {"phase_lag": ROWS}

    def compute(self, region: Region, context: Arrays, before: Arrays | None) -> Arrays:  # noqa: ARG002
        """Toss every pixel of some rows."""
        lag = self.axes["phase_lag"].values[region.slices["phase_lag"]]
        angle = self.axes["amplitude_angle"].values
        found = toss(
            lag[:, None], angle[None, :], self.setting,
            angular_velocity=float(self.parameters["initial_angular_velocity"]),
            forcing_phase=float(self.parameters["initial_forcing_phase"]),
        )  # fmt: skip
        return {name: np.asarray(getattr(found, name)) for name in self.fields}

    def finish(self, result: xr.Dataset, context: Arrays) -> xr.Dataset:  # noqa: ARG002
        """Add the extremal points, found by refinement on the exact function."""
        best = self.extremes
        rows: dict[str, Row] = {
            f"extreme_{name}": ("extreme", [getattr(one, name) for one in best], *about)
            for name, about in _EXTREME.items()
        }
        return result.assign(variables(rows))

    @cached_property
    def extremes(self) -> list[Extreme]:
        """The largest airborne speed, speed ratio (where it is bounded) and efficiency."""
        if not self._throws:
            return []
        speed = float(self.parameters["initial_angular_velocity"])
        phase = float(self.parameters["initial_forcing_phase"])
        return [
            extreme(measure, self.setting, angular_velocity=speed, forcing_phase=phase)
            for measure in bounded_measures(self.setting, speed)
        ]

    def ridge(self) -> Ridge | None:
        """θ = −τ_sep, for a disk at rest at the lowest point that friction turns."""
        given = self.parameters
        starts = float(given["initial_angular_velocity"]), float(given["initial_forcing_phase"])
        still = starts[0] == 0.0 and math.remainder(starts[1] - LOWEST, math.tau) == 0.0
        turns = self._throws and self.setting.disk.friction > 0.0
        return ridge(self.setting) if still and turns else None

    @property
    def _throws(self) -> bool:
        """Whether the axial motion alone, of the largest amplitude, throws the disk."""
        return math.isfinite(separation_phase(0.0, self.setting))


_EXTREME = {
    "measure": ("1", "what is largest there"),
    "phase_lag": ("rad", "phase lag of the extreme"),
    "amplitude_angle": ("rad", "amplitude angle of the extreme"),
    "airborne_speed": ("rad/s", "airborne speed at the extreme"),
    "speed_ratio": ("1", "speed ratio at the extreme"),
    "efficiency": ("1", "efficiency at the extreme"),
}
"""Fields of `Extreme` -> unit and what they are."""
