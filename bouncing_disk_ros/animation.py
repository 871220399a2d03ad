"""A moving picture of a run: the disk on its platform from the side and from above, and its path.

Colours and the window of the side view are those of the page.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, cast

import numpy as np
from matplotlib.patches import Circle, Rectangle, Wedge
from numpy.typing import NDArray

from bouncing_disk_ros.colours import DISK, PLATFORM, SKY
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.matplotlib_figures import new_figure
from bouncing_disk_ros.regular_file import replaced
from bouncing_disk_ros.side_window import side_window
from bouncing_disk_ros.units import NS, shown_unit

FRAME_SECONDS = 0.05
"""Between two frames, as watched."""
MOST_FRAMES = 2000
SLOWEST_PERIOD = 0.25
"""Seconds watched that a period of the platform lasts at least, where no factor is given."""
WIDTH, HEIGHT, DPI = 7.2, 2.7, 80.0
_TICK = 0.01  # GIF counts hundredths of a second
LONGEST_FRAME = 65535 * _TICK
"""Seconds watched: a GIF counts them in 16 bits."""
_SLICES = 8


def write_animation(
    file: Path,
    samples: NDArray[np.void],
    *,
    gyration_radius: float,
    frequency: float,
    real_time_factor: float | None,
) -> None:
    """Draw samples of a run (`core.model.SAMPLE_DTYPE`) frame by frame into a GIF.

    Raises InputError for too few samples, too many frames, another kind of file.
    """
    if file.suffix.lower() != ".gif":
        raise InputError("file", str(file), "a name that ends in .gif")
    if len(samples) < 2:
        given = f"{len(samples)} samples"
        raise InputError("animation", given, "2 or more", "Give simulate a sample_rate.")
    factor = min(1.0, 1.0 / (SLOWEST_PERIOD * frequency))
    if real_time_factor is not None:
        factor = _number(real_time_factor)
        if not 0.0 < factor < math.inf:
            raise InputError("real_time_factor", real_time_factor, "a number > 0")
    with np.errstate(over="ignore"):  # inf is refused below
        watched = (samples["time_ns"] - samples["time_ns"][0]) / NS / factor
    chosen = _frames(watched)
    if len(chosen) > MOST_FRAMES:
        hint = "Give a larger real_time_factor, or a shorter run."
        raise InputError("animation", f"{len(chosen)} frames", f"at most {MOST_FRAMES}", hint)
    longest = float(np.max(np.diff(watched[chosen]), initial=0.0))
    if longest > LONGEST_FRAME:
        hint = "Give a larger real_time_factor, or simulate a larger sample_rate."
        allowed = f"at most {LONGEST_FRAME:g} s"
        raise InputError("animation", f"a frame of {longest:.4g} s", allowed, hint)
    shown = _Picture(samples, 2.0 * math.sqrt(2.0) * gyration_radius, factor)
    ends = np.round(watched[chosen] / _TICK).astype(int)
    durations = [*np.diff(ends).tolist(), round(1.0 / _TICK)]  # the last one stays for a second
    replaced(file, lambda passing: _write(passing, shown, chosen, durations), "file")


def _frames(watched: NDArray[np.float64]) -> list[int]:
    """Samples that are drawn: the first one at or after each multiple of FRAME_SECONDS."""
    with np.errstate(over="ignore"):
        passed = np.floor((watched + 1e-9) / FRAME_SECONDS)  # multiples up to each sample
    return [0, *(np.flatnonzero(passed[1:] > passed[:-1]) + 1).tolist()]


def _number(given: object) -> float:
    try:
        return float(given)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        return math.nan


def _write(file: Path, shown: _Picture, chosen: list[int], durations: list[int]) -> None:
    from PIL import Image

    palette = shown.at(chosen[0]).quantize(64)
    images = [shown.at(i).quantize(palette=palette, dither=Image.Dither.NONE) for i in chosen]
    images[0].save(
        file, save_all=True, append_images=images[1:], loop=0, disposal=1,
        duration=[10 * hundredths for hundredths in durations],
    )  # fmt: skip


class _Picture:
    """The figure, whose parts move."""

    def __init__(self, samples: NDArray[np.void], diameter: float, factor: float) -> None:
        self._samples = samples
        disk, platform = samples["axial_position"], samples["platform_position"]
        low, high = float(min(disk.min(), platform.min())), float(max(disk.max(), platform.max()))
        self._figure = new_figure(WIDTH, HEIGHT, DPI)
        side, top, path = self._figure.subplots(1, 3, width_ratios=(1.0, 0.9, 1.4))
        self._side(side, diameter, low, high)
        self._top(top)
        self._path(path, disk, platform)
        path.set_ylim(side.get_ylim())
        slower = "in real time" if factor == 1.0 else f"at {factor:.3g} × real time"
        path.set_title(slower, fontsize=9)
        self._canvas = cast("Any", self._figure.canvas)
        self._parts = (self._platform, self._disk, *self._slices, self._mark, self._now)
        for part in self._parts:
            part.set_animated(True)
        self._canvas.draw()
        self._still = self._canvas.copy_from_bbox(self._figure.bbox)  # drawn once for all frames

    def _side(self, axes: Any, diameter: float, low: float, high: float) -> None:
        """The disk and the platform as two bars at their heights."""
        window = side_window(diameter, low, high, 1.0)
        self._size, unit = shown_unit("m", 0.4 * (window.high - window.low))
        wide, across = shown_unit("m", 0.8 * window.half_width)
        half = window.half_width / wide
        height = (window.high - window.low) / self._size
        axes.set_xlim(-half, half)
        axes.set_ylim(window.low / self._size, window.high / self._size)
        axes.set(xlabel=f"width ({across})", ylabel=f"height ({unit})")
        if window.magnification != 1.0:
            axes.set_title(f"heights × {window.magnification:,.0f}", fontsize=9)
        self._depth, radius = 0.05 * height, 0.5 * diameter / wide
        self._platform = axes.add_patch(
            Rectangle((-0.92 * half, 0.0), 1.84 * half, self._depth, color=PLATFORM)
        )
        self._disk = axes.add_patch(
            Rectangle((-radius, 0.0), 2.0 * radius, 0.03 * height, color=DISK)
        )

    def _top(self, axes: Any) -> None:
        """The disk in slices on the platform, whose mark is on its rim."""
        axes.set(xlim=(-1.5, 1.5), ylim=(-1.5, 1.5), aspect="equal")
        axes.set_axis_off()
        axes.add_patch(Circle((0.0, 0.0), 1.4, facecolor=PLATFORM, alpha=0.25))
        step = 360.0 / _SLICES
        self._slices = [
            axes.add_patch(
                Wedge((0.0, 0.0), 1.0, k * step, (k + 1) * step,
                      facecolor=(SKY, DISK)[k % 2], edgecolor="white")
            )
            for k in range(_SLICES)
        ]  # fmt: skip
        (self._mark,) = axes.plot([], [], color=PLATFORM, lw=5)

    def _path(self, axes: Any, disk: Any, platform: Any) -> None:
        """Both heights over time, and the instant shown."""
        self._seconds = self._samples["time_ns"] / NS
        scale, unit = shown_unit("s", float(self._seconds[-1]))
        self._seconds = self._seconds / scale
        axes.plot(self._seconds, platform / self._size, color=PLATFORM, lw=1.2, label="platform")
        axes.plot(self._seconds, disk / self._size, color=DISK, lw=1.2, label="disk")
        axes.set_xlim(self._seconds[0], self._seconds[-1])
        axes.set_xlabel(f"simulated time ({unit})")
        self._now = axes.axvline(self._seconds[0], color="black", lw=0.8)
        self._figure.legend(*axes.get_legend_handles_labels(), loc="outside upper left", ncols=2,
                            fontsize=8)  # fmt: skip

    def at(self, i: int) -> Any:
        """The image of a sample."""
        from PIL import Image

        one = self._samples[i]
        self._platform.set_y(one["platform_position"] / self._size - self._depth)
        self._disk.set_y(one["axial_position"] / self._size)
        angle, step = math.degrees(one["angle"]), 360.0 / _SLICES
        for k, part in enumerate(self._slices):
            part.set_theta1(angle + k * step)
            part.set_theta2(angle + (k + 1) * step)
        turned = float(one["platform_angle"])
        ends = np.array([1.05, 1.4])
        self._mark.set_data(ends * math.cos(turned), ends * math.sin(turned))
        now = self._seconds[i]
        self._now.set_xdata([now, now])
        self._canvas.restore_region(self._still)
        for part in self._parts:
            part.axes.draw_artist(part)
        return Image.fromarray(np.asarray(self._canvas.buffer_rgba())).convert("RGB")
