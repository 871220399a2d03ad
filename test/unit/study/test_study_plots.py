"""Pictures and lines of the studies: panels and labels, and the odd results that must not crash."""

from __future__ import annotations

import math
import re
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from matplotlib.figure import Figure

from bouncing_disk_ros.matplotlib_figures import name_axis, new_figure
from bouncing_disk_ros.motor_study import options as motor
from bouncing_disk_ros.orbit_studies.curves import options as curves
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.study import named, run
from bouncing_disk_ros.study.basin_shares import options as basin_shares
from bouncing_disk_ros.study.basins import options as basins
from bouncing_disk_ros.study.bifurcation import options as bifurcation
from bouncing_disk_ros.study.parameter_map import options as parameter_map
from bouncing_disk_ros.study.toss_map import options as toss_map
from bouncing_disk_ros.study.toss_paths import options as toss_paths
from support.figure_boxes import covered, flaws, ill_written
from support.shown import shown, text_of, told


def labels(figure: Figure) -> list[tuple[str, str]]:
    return [(axes.get_xlabel(), axes.get_ylabel()) for axes in figure.axes if axes.get_visible()]


def test_basins(tmp_path: Path) -> None:
    figures, lines, _ = shown(tmp_path, basins, axial_forcing=0.45, width=60, height=60,
                              angular_velocities="0 0.5 -1 2")  # fmt: skip
    assert list(figures) == ["basins", "mean_speeds"]
    text = text_of(figures["basins"])
    assert "Γ = 0.45, restitution ε = 0.5" in text
    assert "period-1: 3" in text
    assert "unresolved" not in text
    assert "relative velocity before it, $w_A$" in text
    assert "time until it is clear" in text
    assert any(line.startswith("  period-1") for line in lines)
    assert any("uncertainty exponent" in line for line in lines)
    titles = [axes.get_title() for axes in figures["mean_speeds"].axes if axes.get_title()]
    assert len(titles) == 4, "a panel for each slice"
    assert "−1" in titles[2]
    speeds = [label for pair in labels(figures["mean_speeds"]) for label in pair]
    assert any("mean speed at the end" in label for label in speeds)
    assert sum(line.startswith("  from α̇ = ") for line in lines) == 4


def test_basins_that_the_cap_leaves_open(tmp_path: Path) -> None:
    figures, lines, result = shown(tmp_path, basins, width=6, height=5, cap=1)
    open_ = 100.0 * float(result["unresolved_fraction"])
    assert open_ > 0.0
    assert f"unresolved: {open_:.2f} %" in text_of(figures["basins"])
    assert any("unresolved" in line and f"{open_:.3f} %" in line for line in lines)


def test_basins_of_one_attractor_that_is_rest(tmp_path: Path) -> None:
    figures, lines, _ = shown(tmp_path, basins, axial_forcing=0.2, width=50, height=50,
                              angular_velocities="0 1")  # fmt: skip
    assert "rest: 100.00 ± 0.00 %" in text_of(figures["basins"])
    assert "  no boundary in the window, or too short a one" in lines
    assert lines[-1] == "  from α̇ = +1 ωΦ: all come to rest"


def test_a_window_of_ones_own_keeps_its_axes(tmp_path: Path) -> None:
    """Impacts on attractors outside do not stretch them; narrow windows have ticks with labels."""
    figures, _, _ = shown(
        tmp_path, basins, axial_forcing=0.45, width=20, height=20, phase_begin=-0.1,
        phase_end=0.1, velocity_begin=-0.8, velocity_end=-0.6, velocity="after",
    )  # fmt: skip
    left = figures["basins"].axes[0]
    assert left.get_xlim() == pytest.approx((-0.1 / math.pi, 0.1 / math.pi))
    assert left.get_ylim() == pytest.approx((-0.8, -0.6))
    figures["basins"].draw_without_rendering()
    low, high = left.get_xlim()
    shown_ticks = [tick for tick in left.get_xticks() if low <= tick <= high]
    assert len(shown_ticks) >= 3
    assert "sign changed" in left.get_ylabel()


def test_points_of_attractors_are_in_the_window_wherever_it_begins(tmp_path: Path) -> None:
    """Period 1 at τ = 0.74: in a window from 2π on it is drawn one turn later."""
    figures, _, _ = shown(
        tmp_path, basins, axial_forcing=0.45, width=20, height=20, phase_begin=6.0,
        phase_end=8.0, velocity_begin=-2.0, velocity_end=-1.0,
    )  # fmt: skip
    axes = figures["basins"].axes[0]
    points = [line for line in axes.lines if line.get_label() == "impacts on the attractors"]
    places = [float(x) for line in points for x in np.asarray(line.get_xdata())]
    assert places == pytest.approx([(math.acos(1.0 / 1.35) + math.tau) / math.pi])
    legend = axes.get_legend()
    assert legend is not None
    assert "impacts on the attractors" in [text.get_text() for text in legend.get_texts()]


ONE = {"count": 1, "begin": 0.45, "end": 0.45}
TOSS: dict[str, Value] = {"amplitude_angle_count": 1, "amplitude_angle_begin": 0.7}
SHORT: dict[str, Value] = {"settling": 10, "measured": 20, "kept": 5}


@pytest.mark.parametrize(
    ("tool", "given"),
    [
        (basins, {"width": 1, "height": 1}),
        (
            curves,
            {
                "axial_forcing_count": 1,
                "axial_forcing_begin": 0.4,
                "axial_forcing_end": 0.5,
                "restitution_count": 1,
                "restitution_begin": 0.45,
                "restitution_end": 0.55,
                "doublings": 0,
                "largest_step": 0.05,
            },
        ),
        (parameter_map, {"x_count": 1, "x_end": 0.3, "y_count": 1, "y_end": 0.2}),
        (basin_shares, {**ONE, "samples": 6}),
        (bifurcation, {**ONE, **SHORT, "starts": 0}),
        (bifurcation, {**ONE, **SHORT, "starts": 3}),
        (
            toss_map,
            {**TOSS, "phase_lag_count": 1, "phase_lag_begin": 0.0, "phase_lag_end": 0.0},
        ),
    ],
)
def test_the_smallest_sizes_are_drawn(
    tmp_path: Path, tool: ModuleType, given: dict[str, Value]
) -> None:
    figures, lines, _ = shown(tmp_path, tool, **given)
    figure = figures[tool.DEFINITION.name]
    assert [*covered(figure), *ill_written(figure)] == []  # without a layout of its own
    for line in (line for axes in figure.axes for line in axes.get_lines()):
        known = np.isfinite(np.asarray(line.get_ydata(), float))
        places = set(np.asarray(line.get_xdata(), float)[known].tolist())
        assert len(places) != 1 or line.get_marker() not in {"", "None"}, "a point is seen"
    if tool is toss_map:
        low, high = figure.axes[0].get_ylim()
        assert low < 0.7 / math.pi < high
    if tool is parameter_map:
        assert lines == ["  rest         100.000 % of the points", "  period 1       0.000 %"]
    if "begin" in given:
        low, high = figure.axes[0].get_xlim()
        assert 0.4 < low < 0.45 < high < 0.5, "a single value is no range"


def test_shares(tmp_path: Path) -> None:
    figures, lines, _ = shown(tmp_path, basin_shares, begin=0.2, end=0.45, count=3, samples=12)
    figure = figures["basin_shares"]
    x, ys = labels(figure)[-1][0], [y for _, y in labels(figure)]
    assert x == "axial forcing Γ"
    assert [y.split()[0] for y in ys] == ["share", "best", "mean"]
    legend = text_of(figure)
    assert "rest" in legend
    assert "chaotic" not in legend, "a class that is nowhere is not in the legend"
    assert lines[0].startswith("  rest             at most 100.000 %, at 0.2")


@pytest.mark.parametrize("along", ["phase_lag", "angular_forcing"])
def test_a_diagram_along_any_parameter(tmp_path: Path, along: str) -> None:
    begin, end = {"phase_lag": (-1.0, 1.0), "angular_forcing": (1.0, 100.0)}[along]
    figures, lines, result = shown(
        tmp_path, bifurcation, along=along, begin=begin, end=end, count=4, settling=100,
        measured=50, kept=20, doublings=1,
    )  # fmt: skip
    ys = [y for _, y in labels(figures["bifurcation"])]
    assert [y.split()[0] for y in ys if y] == ["forcing", "mean", "impact", "Lyapunov"]
    name = {"phase_lag": "θ", "angular_forcing": r"$Γ_{\mathrm{T}}$"}[along]
    assert f"in {name};" in text_of(figures["bifurcation"])
    assert figures["bifurcation"].axes[-1].get_xlabel().startswith(along.replace("_", " "))
    scale = figures["bifurcation"].axes[0].get_xscale()
    assert (scale == "log") == (along == "angular_forcing")
    symbol, unit = {"phase_lag": ("θ", " rad"), "angular_forcing": ("Γ_T", "")}[along]
    at = float(result["value"].values[int(np.nanargmax(result["mean_speed"].values))])
    assert any(line.endswith(f" at {symbol} = {at:.6g}{unit}") for line in lines)


def test_a_diagram_that_ends_at_rest(tmp_path: Path) -> None:
    _, lines, result = shown(
        tmp_path, bifurcation, begin=0.3, end=0.2, count=3, initial_velocity=-1.0,
        settling=100, measured=50, kept=20,
    )  # fmt: skip
    assert np.isnan(result["mean_speed"].values).all()
    assert len(lines) == 2
    assert lines[0].startswith(
        "  no period doubling up to Γ = 0.3: at ε = 0.5 the first is at Γ = 0.486"
    )
    assert lines[1] == "  Lyapunov exponent above 0.001 at 0 of 3 values"


def test_a_diagram_of_starts_tells_those_with_contact(tmp_path: Path) -> None:
    figures, lines, _ = shown(
        tmp_path, bifurcation, begin=0.3, end=0.45, count=4, settling=50, measured=50,
        kept=20, starts=9,
    )  # fmt: skip
    figure = figures["bifurcation"]
    assert figure.get_suptitle().startswith("Attractors reached from 9 starts at each Γ; ε = 0.5")
    legend = figure.axes[0].get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == [
        "starts that end without contact", "starts that end with contact",
        "period 1, theory: cos τ = (1 − ε)/((1 + ε) Γ)",
    ]  # fmt: skip
    assert figure.axes[1].lines[0].get_linestyle() == "None", "points: no start is followed"
    assert "  contact from some starts at 3 of 4 values, from all at 0" in lines
    assert lines[-1].startswith("  after contact the mean speed depends on the start at 3 values")


def test_a_map_of_parameters(tmp_path: Path) -> None:
    figures, lines, result = shown(
        tmp_path, parameter_map, x_begin=0.25, x_end=0.56, x_count=12, y_begin=0.5, y_end=0.51,
        y_count=2, settling=1000, measured=300,
    )  # fmt: skip
    figure = figures["parameter_map"]
    left, right = figure.axes[:2]
    assert left.get_xlabel() == "axial forcing Γ"
    assert left.get_ylabel() == "restitution ε"
    start = "a start beside the period-1 orbit\nwhere there is none, from contact"
    title = f"What the disk settles on from {start}; θ = 0, $Γ_{{\\mathrm{{T}}}}$ = 100"
    assert figure.get_suptitle() == title
    legends = [[text.get_text() for text in axes.get_legend().get_texts()]  # type: ignore[union-attr]
               for axes in (left, right)]  # fmt: skip
    assert {"rest", "with contact", "period 1", "period 2", "chaotic"} <= set(legends[0])
    assert "period 5" not in legends[0], "a class that is nowhere is not in the legend"
    assert legends[1] == ["with contact: −∞", "rest"]
    speed = figures["mean_speed"].axes[0]
    assert speed.get_xlabel() == left.get_xlabel()
    for image in (right.images[1], speed.images[0]):
        low, high = image.get_clim()
        assert low == -high, "the colours are centred at 0"
    assert any(line.startswith("  rest ") for line in lines)
    assert any(line.startswith("  largest mean speed ") for line in lines)
    best = float(result["lyapunov_exponent"].where(np.isfinite).max())
    assert any(line.startswith(f"  largest Lyapunov exponent {best:.4f} at Γ = ") for line in lines)


def test_a_map_says_what_is_given_and_shows_no_forcing_below_zero(tmp_path: Path) -> None:
    figures, _, _ = shown(
        tmp_path, parameter_map, x_axis="angular_forcing", x_begin=1.0, x_end=100.0, x_count=3,
        y_begin=0.0, y_count=3, settling=10, measured=256, start="given", initial_phase=0.5,
        initial_velocity=-2.0,
    )  # fmt: skip
    title = "What the disk settles on from τ = 0.5, $w_{\\mathrm{A}}$ = −2\nΓ = 0.45, θ = 0"
    assert figures["mean_speed"].get_suptitle() == title
    for figure in figures.values():
        assert figure.axes[0].get_xlim()[0] == figure.axes[0].get_ylim()[0] == 0.0


def test_toss_maps(tmp_path: Path) -> None:
    figures, lines, result = shown(tmp_path, toss_map, phase_lag_count=9, amplitude_angle_count=9,
                              trajectory_lags="0")  # fmt: skip
    assert list(figures) == ["toss_map", "trajectories"]
    assert [line.split(" at ")[0].strip() for line in lines] == [
        "largest airborne speed", "largest speed ratio", "largest efficiency"
    ]  # fmt: skip
    assert "phase lag" in labels(figures["toss_map"])[2][0]
    assert float(result["extreme_airborne_speed"][0]) == pytest.approx(27.18, abs=0.005)  # paper
    assert float(result["extreme_amplitude_angle"][0]) / math.pi == pytest.approx(0.2457, abs=2e-4)
    assert set(result["code"].attrs["flag_values"]) >= set(np.unique(result["code"].values))


def test_paths_of_which_one_never_lets_go(tmp_path: Path) -> None:
    figures, lines, _ = shown(tmp_path, toss_paths, phase_lags="0 0",
                              amplitude_angles="0.25pi 0.499pi", points=16)  # fmt: skip
    assert len(figures["toss_paths"].axes) >= 2
    assert "τ_sep = 0.1599 rad" in lines[0]
    assert lines[1].endswith("the disk never leaves")
    assert math.isfinite(float(lines[0].split("τ_sep = ")[1].split()[0]))


@pytest.mark.parametrize(
    ("given", "is_told"),
    [
        ({"restitution": 0.3, "begin": 0.6, "end": 0.65}, True),
        ({"restitution": 0.3, "begin": 0.6, "end": 0.69, "doublings": 1}, False),
        ({"restitution": 0.3, "begin": 0.6, "end": 0.65, "doublings": 0}, False),
        ({"along": "restitution", "begin": 0.5, "end": 0.52}, False),
    ],
)
def test_an_axis_that_ends_before_the_first_doubling_is_told(
    tmp_path: Path, given: dict[str, Value], is_told: bool
) -> None:
    result = run(named("bifurcation", **SHORT, **given, count=2), tmp_path / "r.zarr")
    assert result is not None
    line = "  no period doubling up to Γ = 0.65: at ε = 0.3 the first is at Γ = 0.677151, so let "
    said = [one for one in told(bifurcation, result) if "no period doubling" in one]
    assert said == [line + "the axis end beyond it"] * is_told


def test_a_motor_over_load_and_preload(tmp_path: Path) -> None:
    figures, lines, result = shown(
        tmp_path, motor, x_count=7, y_begin=19.0, y_end=33.0, y_count=8, longest=1500
    )
    assert list(figures) == ["speed_torque", "stall", "motor_map"]
    left, right = figures["speed_torque"].axes[:2]
    assert (left.get_xlabel(), left.get_ylabel()) == (
        r"load torque $T_{\mathrm{L}}$ (mN·m)", "mean speed of the rotor (rad/s)"
    )  # fmt: skip
    names = sorted(text.get_text() for text in left.texts)
    assert names == [f"{p:.4g}" for p in result["preload"].values if p < 30.2], "no contact alone"
    assert right.get_ylabel() == "preload P (N)"
    stall = figures["stall"].axes
    assert [axes.get_ylabel() for axes in stall] == ["no-load speed (rad/s)", "stall torque (mN·m)"]
    marked = [text.get_text().strip() for text in stall[0].texts]
    assert marked == ["doubling", "no period 1", "contact lasts"]
    assert "periodic" in text_of(figures["stall"])
    assert figures["motor_map"].axes[0].get_xlim()[0] == 0.0, "no half cell below 0"
    shown_kinds = text_of(figures["motor_map"])
    assert "runs away" in shown_kinds
    assert "unresolved" not in shown_kinds
    assert any(
        line.startswith("  period 1 between preloads of 20.6803 and 30.1544 N") for line in lines
    )
    assert any("; contact, once begun, never ends from 31.5778 N on" in line for line in lines)
    (best,) = (line for line in lines if line.startswith("  largest efficiency 0.1"))
    assert re.search(r" at T_L = [\d.]+ N·m, P = [\d.]+ N$", best)
    assert any(line.startswith("  stall torque from ") for line in lines)
    beyond = result.assign_coords(preload=result["preload"] + 20.0)
    hint = "  no preload of the axis lies in that range: y_begin:=20.7 y_end:=30.2 shows it"
    assert hint in motor.lines(beyond)
    assert hint not in lines


def test_the_efficiency_at_two_preloads_is_drawn_wherever_there_is_one(tmp_path: Path) -> None:
    """Contours end where the first of two lines does; cells show each point."""
    figures, _, result = shown(tmp_path, motor, x_count=7, y_begin=22.0, y_end=28.0, y_count=2)
    right = figures["speed_torque"].axes[1]
    (image,) = right.images
    assert right.get_ylim() == (19.0, 31.0), "whole cells"
    known = np.isfinite(result["efficiency"].transpose("preload", "load_torque").values)
    assert (known.sum(axis=1) > 1).all()
    assert known[0].sum() < known[1].sum(), "friction gives way at a smaller torque"
    drawn = image.get_array()
    assert drawn is not None
    np.testing.assert_array_equal(~np.ma.getmaskarray(drawn), known)


def test_a_motor_under_a_brake_has_no_stall_torque(tmp_path: Path) -> None:
    figures, lines, _ = shown(
        tmp_path, motor, x_axis="brake_torque", x_count=3, y_axis="phase_lag", y_begin=-1.0,
        y_end=1.0, y_count=2,
    )  # fmt: skip
    assert list(figures) == ["speed_torque", "motor_map"]
    assert not any("stall" in line for line in lines)
    assert "  best phase lag -1 rad over brake_torque" in lines, "the same for each"


def test_a_motor_at_one_point(tmp_path: Path) -> None:
    figures, lines, _ = shown(
        tmp_path, motor, x_end=0.0, x_count=1, y_begin=33.0, y_end=33.0, y_count=1
    )
    assert "no efficiency anywhere" in [t.get_text() for t in figures["speed_torque"].axes[1].texts]
    assert lines[0] == "  contact_only 100.000 % of the points"


def test_a_motor_without_loads_on_its_axes(tmp_path: Path) -> None:
    figures, _, _ = shown(
        tmp_path, motor, x_axis="phase_lag", x_begin=-1.0, x_end=1.0, x_count=3,
        y_axis="axial_amplitude", y_begin=0.9e-6, y_end=1e-6, y_count=2, load_torque=0.002,
    )  # fmt: skip
    assert list(figures) == ["motor_map"]
    assert r"$T_{\mathrm{L}}$ = 2 mN·m" in figures["motor_map"].get_suptitle()


@pytest.mark.parametrize(
    ("about", "ends", "label"),
    [
        (("frequency", "f", "Hz"), (40_000.0, 40_000.001), "frequency f (kHz)"),
        (("axial amplitude", "A", "m"), (0.0, 1e-6), "axial amplitude A (µm)"),
        (("phase lag", "θ", "rad"), (-math.pi, math.pi), "phase lag θ (rad)"),
        (("phase lag", "θ", "rad"), (0.7, 0.701), "phase lag θ (rad)"),
        (("restitution", "ε", "1"), (0.0, 1.0), "restitution ε"),
    ],
)
def test_an_axis_is_named_in_the_unit_that_fits(
    about: tuple[str, str, str], ends: tuple[float, float], label: str
) -> None:
    figure = new_figure(6.0, 3.0)
    axes = figure.subplots()
    axes.set_xlim(ends)
    name_axis(axes.xaxis, dict(zip(("long_name", "symbol", "units"), about, strict=True)))
    assert flaws(figure) == []
    assert axes.get_xlabel() == label
    ticks = [text.get_text() for text in axes.get_xticklabels()]
    assert len(set(ticks)) == len(ticks) > 2
    assert any("π" in tick for tick in ticks) == (about[2] == "rad")
