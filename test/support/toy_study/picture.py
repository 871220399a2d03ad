"""The picture of the study `toy`."""

from __future__ import annotations

from collections.abc import Mapping

import xarray as xr
from matplotlib.figure import Figure

from bouncing_disk_ros.study.computation import Study


def pictures(_: Study, result: xr.Dataset) -> Mapping[str, Figure]:
    """The squares."""
    figure = Figure()
    figure.subplots().plot(result["number"], result["square"])
    return {"toy": figure}
