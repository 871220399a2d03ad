"""Figures of single tosses: axes in parts of π with units, marks where the extremes are."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from bouncing_disk_ros.maps.best_toss import Extreme, ridge
from bouncing_disk_ros.maps.toss_paths import toss_paths, toss_trajectory
from bouncing_disk_ros.maps.tosses import toss
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.study import named, run
from bouncing_disk_ros.study.toss_map import options as toss_map
from bouncing_disk_ros.study.toss_map.compute import TossMap
from bouncing_disk_ros.study.toss_map.picture import maps_figure
from bouncing_disk_ros.study.toss_paths.picture import paths_figure, toss_title, trajectories_figure
from bouncing_disk_ros.units import in_pi

ANGLES = (math.pi / 8, math.pi / 4, 3 * math.pi / 8, math.pi / 2)
FASTEST = Extreme("airborne_speed", 0.0, 0.2456 * math.pi, 27.18, 0.99, 0.344)
SIDEWAYS = Extreme("efficiency", 0.3, 0.2 * math.pi, 20.0, 0.9, 0.2)


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.0, "0"), (1.0, "π"), (-0.5, "−π/2"), (0.375, "3π/8"), (-2.0, "−2π"), (0.1, "0.1π"),
     (0.33, "0.33π")],
)  # fmt: skip
def test_parts_of_pi(value: float, text: str) -> None:
    assert in_pi(value) == text


def test_paths() -> None:
    paths = toss_paths(-math.pi / 4, np.array(ANGLES))
    titles = [toss_title(-math.pi / 4, angle) for angle in ANGLES]
    figure = paths_figure(paths, titles)
    shown = [axes for axes in figure.axes if axes.get_visible()]
    assert [axes.get_title() for axes in shown[:2]] == [
        r"(a) $\theta$ = −π/4, $\phi_L$ = π/8", r"(b) $\theta$ = −π/4, $\phi_L$ = π/4",
    ]  # fmt: skip
    assert len(shown) == 4
    assert all(axes.get_aspect() == 1.0 for axes in shown)
    whole, riding = shown[0].lines[:2]
    assert np.max(np.asarray(whole.get_ydata())) == pytest.approx(250.0 * math.cos(math.pi / 8))
    x, y = np.asarray(riding.get_xdata()), np.asarray(riding.get_ydata())
    assert y[0] == pytest.approx(-250.0 * math.cos(math.pi / 8))
    assert y[-1] <= 1e3 * paths.separation_position[0] < y[-1] + 5.0
    assert x[0] == 1e3 * paths.arc[0, 0]
    assert len(np.asarray(shown[3].lines[1].get_xdata())) == 0  # never leaves: no ride to a toss
    figure.draw_without_rendering()


def small_maps() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    return np.linspace(-0.5, 1.5, 41) * math.pi, np.linspace(0.0, 0.5, 31) * math.pi


def test_maps(tmp_path: Path) -> None:
    lags, angles = small_maps()
    figure = maps_figure(
        lags, angles, toss(lags[:, None], angles), [FASTEST, SIDEWAYS], ridge(points=40)
    )
    speed, ratio, efficiency = figure.axes[:3]
    assert efficiency.get_xlabel() == r"phase lag $\theta$ (rad)"
    assert all(axes.get_ylabel() == r"amplitude angle $\phi_L$ (rad)" for axes in figure.axes[:3])
    bars = [axes.get_ylabel() for axes in figure.axes[3:]]
    assert bars[0].endswith("(rad/s)")
    assert not any("(1)" in bar for bar in bars)
    legends = [axes.get_legend() for axes in figure.axes[:3]]
    texts = [legend.get_texts()[0].get_text() for legend in legends if legend]
    assert texts[0] == r"27.18 rad/s at $\phi_L$ = 0.2456π, $\theta$ = 0, π"
    assert "0.2069π" in texts[1]
    assert texts[2] == r"0.2 at $\phi_L$ = 0.2000π, $\theta$ = 0.0955π, 1.0955π"
    cross = speed.lines[0]
    assert {0.0, 1.0} <= set(np.asarray(cross.get_xdata()).tolist())
    assert np.asarray(cross.get_ydata()) == pytest.approx(0.2456)
    assert any("never leaves" in text.get_text() for text in ratio.texts)
    assert efficiency.get_xlim() == (-0.5, 1.5)
    figure.savefig(tmp_path / "figure.pdf")
    assert 5_000 < (tmp_path / "figure.pdf").stat().st_size < 1_000_000


@pytest.mark.parametrize("given", [{"friction": 0.0}, {"initial_angular_velocity": -30.0}])
def test_any_map_can_be_drawn(tmp_path: Path, given: dict[str, Value]) -> None:
    """Nothing turns; two points a side; the extremes are those of η itself, not of |η|."""
    study = named("toss_map", phase_lag_count=2, amplitude_angle_count=2, **given)
    assert isinstance(study, TossMap)
    result = run(study, tmp_path / "map.zarr")
    assert result is not None
    assert set(toss_map.DEFINITION.pictures(study, result)) == {"toss_map", "trajectories"}
    best = {one.measure: one for one in study.extremes}
    if "friction" in given:
        assert not best
        assert study.ridge() is None
    else:
        assert best["efficiency"].efficiency == pytest.approx(0.4984, abs=1e-4)
        assert toss_map.lines(result)[-1].endswith("η = 0.4984")


def test_the_line_of_speed_ratio_1_is_that_of_a_start_at_the_lowest_point() -> None:
    for phase, there in ((1.5 * math.pi, True), (-0.5 * math.pi, True), (0.0, False)):
        study = named("toss_map", initial_forcing_phase=phase)
        assert isinstance(study, TossMap)
        assert (study.ridge() is not None) == there


def test_trajectories() -> None:
    runs = [toss_trajectory(lag, math.pi / 4, samples=101) for lag in (0.0, math.pi / 2)]
    sticking = toss_trajectory(-0.1, 0.3, samples=101)
    rest = toss_trajectory(0.0, 1.55, duration=0.5, samples=101)
    titles = [toss_title(lag, math.pi / 4) for lag in (0.0, math.pi / 2)] + ["sticks", "stays"]
    figure = trajectories_figure([*runs, sticking, rest], titles, "the same for two")
    heights, first = figure.axes[:2]
    assert heights.get_title() == "the same for two"
    assert first.get_title().endswith("26.93 rad/s")
    assert figure.axes[4].get_title() == "stays"
    assert heights.get_ylabel() == "height $s$, $x$ (mm)"
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels[0] == r"disk $x$, $\dot{\alpha}$"
    assert labels[-2:] == ["disk sliding", "disk sticking"]
    figure.draw_without_rendering()
