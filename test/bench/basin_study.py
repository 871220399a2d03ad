"""The basin study that is measured."""

from __future__ import annotations

from bouncing_disk_ros.study.basins.compute import Basins
from bouncing_disk_ros.study.basins.options import DEFINITION


def basins(side: int, axial_forcing: float = 0.45) -> Basins:
    """The study of a square map, all else by default."""
    values = {name: spec.default for name, spec in DEFINITION.options.items()}
    return Basins({**values, "width": side, "height": side, "axial_forcing": axial_forcing})
