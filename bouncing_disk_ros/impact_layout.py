"""The layout of a row of impacts, for who writes and who reads them; imports nothing heavy."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

IMPACT_LAYOUT: Mapping[str, object] = MappingProxyType(
    {
        "names": ["x", "y", "z", "count", "index", "time", "cycles", "forcing_phase",
                  "axial_impact_velocity", "angular_impact_velocity", "axial_impulse",
                  "angular_impulse", "axial_position", "axial_velocity", "angular_velocity",
                  "kind"],
        "formats": [*["<f4"] * 3, "<u4", *["<f8"] * 11, "u1"],
        "offsets": [0, 4, 8, 12, *range(16, 104, 8), 104],
        "itemsize": 112,
    }
)  # fmt: skip
"""Layout of a row of disk/impacts and of the impact log (`core.model.IMPACT_DTYPE`), for numpy."""
