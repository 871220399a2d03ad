"""Pictures and lines of the studies: panels and labels, and the odd results that must not crash."""

from __future__ import annotations

import math
import re
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from matplotlib.figure import Figure
from numpy.typing import NDArray

from bouncing_disk_ros.maps import toss_paths as paths_of
from bouncing_disk_ros.maps.best_toss import Extreme, ridge
from bouncing_disk_ros.maps.bifurcation_diagram import Branch, begin, follow
from bouncing_disk_ros.maps.bifurcations import Doubling, period_doublings
from bouncing_disk_ros.maps.next_collision import MapState, NextCollisionMap
from bouncing_disk_ros.maps.periodic_orbit import fixed_point
from bouncing_disk_ros.maps.toss_paths import toss_trajectory
from bouncing_disk_ros.maps.tosses import PAPER as PAPER_TOSS
from bouncing_disk_ros.maps.tosses import toss
from bouncing_disk_ros.matplotlib_figures import edges_of, name_axis, new_figure
from bouncing_disk_ros.motor_study import options as motor
from bouncing_disk_ros.orbit_studies.curves import options as curves
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.study import named, run
from bouncing_disk_ros.study.basin_shares import options as basin_shares
from bouncing_disk_ros.study.basins import options as basins
from bouncing_disk_ros.study.bifurcation import options as bifurcation
from bouncing_disk_ros.study.bifurcation.picture import bifurcation_figure, density, phase_range
from bouncing_disk_ros.study.parameter_map import options as parameter_map
from bouncing_disk_ros.study.parameter_map.picture import mean_speed_picture
from bouncing_disk_ros.study.toss_map import options as toss_map
from bouncing_disk_ros.study.toss_map.compute import TossMap
from bouncing_disk_ros.study.toss_map.picture import maps_figure
from bouncing_disk_ros.study.toss_paths import options as toss_paths
from bouncing_disk_ros.study.toss_paths.picture import paths_figure, toss_title, trajectories_figure
from bouncing_disk_ros.units import in_pi
from support.checks import there
from support.figure_boxes import covered, flaws, ill_written
from support.shown import drawn, legend_of, result_of, shown, text_of, told, undrawn


def labels(figure: Figure) -> list[tuple[str, str]]:
    return [(axes.get_xlabel(), axes.get_ylabel()) for axes in figure.axes if axes.get_visible()]


def test_basins() -> None:
    figures, lines, _ = shown(basins, axial_forcing=0.45, width=60, height=60,
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


def test_basins_that_the_cap_leaves_open() -> None:
    figures, lines, result = undrawn(basins, width=6, height=5, cap=1)
    open_ = 100.0 * float(result["unresolved_fraction"])
    assert open_ > 0.0
    assert f"unresolved: {open_:.2f} %" in text_of(figures["basins"])
    assert any("unresolved" in line and f"{open_:.3f} %" in line for line in lines)


def test_basins_of_one_attractor_that_is_rest() -> None:
    figures, lines, _ = shown(basins, axial_forcing=0.2, width=50, height=50,
                              angular_velocities="0 1")  # fmt: skip
    assert "rest: 100.00 ± 0.00 %" in text_of(figures["basins"])
    assert "  no boundary in the window, or too short a one" in lines
    assert lines[-1] == "  from α̇ = +1 ωΦ: all come to rest"


def test_a_window_of_ones_own_keeps_its_axes() -> None:
    """Impacts on attractors outside do not stretch them; narrow windows have ticks with labels."""
    figures, _, _ = undrawn(
        basins, axial_forcing=0.45, width=20, height=20, phase_begin=-0.1,
        phase_end=0.1, velocity_begin=-0.8, velocity_end=-0.6, velocity="after",
    )  # fmt: skip
    left = figures["basins"].axes[0]
    assert left.get_xlim() == pytest.approx((-0.1 / math.pi, 0.1 / math.pi))
    assert left.get_ylim() == pytest.approx((-0.8, -0.6))
    drawn(figures["basins"])
    low, high = left.get_xlim()
    shown_ticks = [tick for tick in left.get_xticks() if low <= tick <= high]
    assert len(shown_ticks) >= 3
    assert "sign changed" in left.get_ylabel()


def test_points_of_attractors_are_in_the_window_wherever_it_begins() -> None:
    """Period 1 at τ = 0.74: in a window from 2π on it is drawn one turn later."""
    figures, _, _ = undrawn(
        basins, axial_forcing=0.45, width=20, height=20, phase_begin=6.0,
        phase_end=8.0, velocity_begin=-2.0, velocity_end=-1.0,
    )  # fmt: skip
    axes = figures["basins"].axes[0]
    points = [line for line in axes.lines if line.get_label() == "impacts on the attractors"]
    places = [float(x) for line in points for x in np.asarray(line.get_xdata())]
    assert places == pytest.approx([(math.acos(1.0 / 1.35) + math.tau) / math.pi])
    assert "impacts on the attractors" in legend_of(axes)


ONE = {"count": 1, "begin": 0.45, "end": 0.45}
SHORT: dict[str, Value] = {"settling": 10, "measured": 20, "kept": 5}


@pytest.mark.parametrize(
    ("tool", "given"),
    [
        (basins, {"width": 1, "height": 1}),
        (curves, {"axial_forcing_count": 1, "axial_forcing_begin": 0.4, "axial_forcing_end": 0.5,
                  "restitution_count": 1, "restitution_begin": 0.45, "restitution_end": 0.55,
                  "doublings": 0, "largest_step": 0.05}),
        (parameter_map, {"x_count": 1, "x_end": 0.3, "y_count": 1, "y_end": 0.2}),
        (basin_shares, {**ONE, "samples": 6}),
        (bifurcation, {**ONE, **SHORT, "starts": 0}),
        (bifurcation, {**ONE, **SHORT, "starts": 3}),
        (toss_map, {"amplitude_angle_count": 1, "amplitude_angle_begin": 0.7,
                    "phase_lag_count": 1, "phase_lag_begin": 0.0, "phase_lag_end": 0.0}),
    ],
)  # fmt: skip
def test_the_smallest_sizes_are_drawn(tool: ModuleType, given: dict[str, Value]) -> None:
    figures, lines, _ = undrawn(tool, **given)
    figure = figures.pop(tool.DEFINITION.name)
    for other in figures.values():
        drawn(other)
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


def test_shares() -> None:
    figures, lines, _ = shown(basin_shares, begin=0.2, end=0.45, count=3, samples=12)
    figure = figures["basin_shares"]
    x, ys = labels(figure)[-1][0], [y for _, y in labels(figure)]
    assert x == "axial forcing Γ"
    assert [y.split()[0] for y in ys] == ["share", "best", "mean"]
    legend = text_of(figure)
    assert "rest" in legend
    assert "chaotic" not in legend, "a class that is nowhere is not in the legend"
    assert lines[0].startswith("  rest             at most 100.000 %, at Γ = 0.2")


@pytest.mark.parametrize(
    ("along", "begin", "end", "name", "symbol", "unit"),
    [("phase_lag", -1.0, 1.0, "θ", "θ", " rad"),
     ("angular_forcing", 1.0, 100.0, r"$Γ_{\mathrm{T}}$", "Γ_T", "")],
)  # fmt: skip
def test_a_diagram_along_any_parameter(
    along: str, begin: float, end: float, name: str, symbol: str, unit: str
) -> None:
    figures, lines, result = shown(
        bifurcation, along=along, begin=begin, end=end, count=4, settling=100,
        measured=50, kept=20, doublings=1,
    )  # fmt: skip
    ys = [y for _, y in labels(figures["bifurcation"])]
    assert [y.split()[0] for y in ys if y] == ["forcing", "mean", "impact", "Lyapunov"]
    assert f"in {name};" in text_of(figures["bifurcation"])
    assert figures["bifurcation"].axes[-1].get_xlabel().startswith(along.replace("_", " "))
    scale = figures["bifurcation"].axes[0].get_xscale()
    assert (scale == "log") == (along == "angular_forcing")
    at = float(result["value"].values[int(np.nanargmax(result["mean_speed"].values))])
    assert any(line.endswith(f" at {symbol} = {at:.6g}{unit}") for line in lines)


def test_a_diagram_that_ends_at_rest() -> None:
    _, lines, result = shown(
        bifurcation, begin=0.3, end=0.2, count=3, initial_velocity=-1.0,
        settling=100, measured=50, kept=20,
    )  # fmt: skip
    assert np.isnan(result["mean_speed"].values).all()
    assert len(lines) == 2
    assert lines[0].startswith(
        "  no period doubling up to Γ = 0.3: at ε = 0.5 the first is at Γ = 0.486"
    )
    assert lines[1] == "  Lyapunov exponent above 0.001 at 0 of 3 values"


def test_a_diagram_of_starts_tells_those_with_contact() -> None:
    figures, lines, _ = undrawn(
        bifurcation, begin=0.3, end=0.45, count=4, settling=50, measured=50,
        kept=20, starts=9,
    )  # fmt: skip
    figure = figures["bifurcation"]
    assert figure.get_suptitle().startswith("Attractors reached from 9 starts at each Γ; ε = 0.5")
    assert legend_of(figure.axes[0]) == [
        "starts that end without contact", "starts that end with contact",
        "period 1, theory: cos τ = (1 − ε)/((1 + ε) Γ)",
    ]  # fmt: skip
    assert figure.axes[1].lines[0].get_linestyle() == "None", "points: no start is followed"
    assert "  contact from some starts at 3 of 4 values, from all at 0" in lines
    assert lines[-1].startswith("  after contact the mean speed depends on the start at 3 values")


def test_a_map_of_parameters() -> None:
    figures, lines, result = shown(
        parameter_map, x_begin=0.25, x_end=0.56, x_count=12, y_begin=0.5, y_end=0.51,
        y_count=2, settling=1000, measured=300,
    )  # fmt: skip
    figure = figures["parameter_map"]
    left, right = figure.axes[:2]
    assert left.get_xlabel() == "axial forcing Γ"
    assert left.get_ylabel() == "restitution ε"
    start = "a start beside the period-1 orbit\nwhere there is none, from contact"
    title = f"What the disk settles on from {start}; θ = 0, $Γ_{{\\mathrm{{T}}}}$ = 100"
    assert figure.get_suptitle() == title
    legends = legend_of(left), legend_of(right)
    assert {"rest", "with contact", "period 1", "period 2", "chaotic"} <= set(legends[0])
    assert "period 5" not in legends[0], "a class that is nowhere is not in the legend"
    assert legends[1] == ["with contact: −∞", "rest"]
    speed = figures["mean_speed"].axes[0]
    assert speed.get_xlabel() == left.get_xlabel()
    for image in (right.images[1], speed.images[1]):
        low, high = image.get_clim()
        assert low == -high, "the colours are centred at 0"
    assert legend_of(speed) == ["rest"]
    unknown = result["mean_speed"].where(result["kind"] != 1)  # as where rounding decides
    unsure = mean_speed_picture(result.assign(mean_speed=unknown)).axes[0]
    assert legend_of(unsure) == ["rest", "not known"], "a disk with contact is not at rest"
    assert any(line.startswith("  rest ") for line in lines)
    assert any(line.startswith("  largest mean speed ") for line in lines)
    best = float(result["lyapunov_exponent"].where(np.isfinite).max())
    assert any(line.startswith(f"  largest Lyapunov exponent {best:.4f} at Γ = ") for line in lines)


def test_a_map_says_what_is_given_and_shows_no_forcing_below_zero() -> None:
    figures, _, _ = undrawn(
        parameter_map, x_axis="angular_forcing", x_begin=1.0, x_end=100.0, x_count=3,
        y_begin=0.0, y_count=3, settling=10, measured=256, start="given", initial_phase=0.5,
        initial_velocity=-2.0,
    )  # fmt: skip
    title = "What the disk settles on from τ = 0.5, $w_{\\mathrm{A}}$ = −2\nΓ = 0.45, θ = 0"
    assert figures["mean_speed"].get_suptitle() == title
    for figure in figures.values():
        assert figure.axes[0].get_xlim()[0] == figure.axes[0].get_ylim()[0] == 0.0


@pytest.mark.parametrize("given", [{"gravity": 1e3}, {"frequency": 1e-6}])
def test_a_map_of_tosses_that_never_leave_is_nan_and_says_why(given: dict[str, float]) -> None:
    figures, lines, result = shown(toss_map, phase_lag_count=3, amplitude_angle_count=3, **given)
    assert list(figures) == ["toss_map", "trajectories"]
    assert lines == ["  the disk never leaves the platform: axial forcing at most 1/π"]
    assert np.isnan(result["airborne_speed"]).all()


def test_a_toss_that_is_drawn_need_not_leave() -> None:
    figures, _, _ = shown(
        toss_map, phase_lag_count=3, amplitude_angle_count=3, trajectory_angle=1.57
    )
    assert list(figures) == ["toss_map", "trajectories"]


def test_toss_maps() -> None:
    figures, lines, result = shown(toss_map, phase_lag_count=9, amplitude_angle_count=9,
                              trajectory_lags="0")  # fmt: skip
    assert list(figures) == ["toss_map", "trajectories"]
    assert [line.split(" at ")[0].strip() for line in lines] == [
        "largest airborne speed", "largest speed ratio", "largest efficiency"
    ]  # fmt: skip
    assert "phase lag" in labels(figures["toss_map"])[2][0]
    assert float(result["extreme_airborne_speed"][0]) == pytest.approx(27.18, abs=0.005)  # paper
    assert float(result["extreme_amplitude_angle"][0]) / math.pi == pytest.approx(0.2457, abs=2e-4)
    assert set(result["code"].attrs["flag_values"]) >= set(np.unique(result["code"].values))


def test_paths_of_which_one_never_lets_go() -> None:
    figures, lines, _ = shown(toss_paths, phase_lags="0 0",
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
    given: dict[str, Value], is_told: bool
) -> None:
    result = result_of("bifurcation", **SHORT, **given, count=2)
    line = "  no period doubling up to Γ = 0.65: at ε = 0.3 the first is at Γ = 0.677151, so let "
    said = [one for one in told(bifurcation, result) if "no period doubling" in one]
    assert said == [line + "the axis end beyond it"] * is_told


def test_a_motor_over_load_and_preload() -> None:
    figures, lines, result = shown(
        motor, x_count=7, y_begin=19.0, y_end=33.0, y_count=8, longest=1500
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
    none = beyond.assign_attrs({name: 0.0 for name in beyond.attrs if name.startswith("preload_")})
    assert "  no preload of the axis lies in that range" in motor.lines(none)
    still = result.assign(mean_speed=0.0 * result["mean_speed"])
    assert not any("1/1000" in line for line in motor.lines(still))


def test_the_efficiency_at_two_preloads_is_drawn_wherever_there_is_one() -> None:
    """Contours end where the first of two lines does; cells show each point."""
    figures, _, result = undrawn(motor, x_count=7, y_begin=22.0, y_end=28.0, y_count=2)
    right = figures["speed_torque"].axes[1]
    (image,) = right.images
    assert right.get_ylim() == (19.0, 31.0), "whole cells"
    known = np.isfinite(result["efficiency"].transpose("preload", "load_torque").values)
    assert (known.sum(axis=1) > 1).all()
    assert known[0].sum() < known[1].sum(), "friction gives way at a smaller torque"
    drawn = there(image.get_array())
    np.testing.assert_array_equal(~np.ma.getmaskarray(drawn), known)


def test_a_motor_under_a_brake_has_no_stall_torque() -> None:
    figures, lines, _ = shown(
        motor, x_axis="brake_torque", x_count=3, y_axis="phase_lag", y_begin=-1.0,
        y_end=1.0, y_count=2,
    )  # fmt: skip
    assert list(figures) == ["speed_torque", "motor_map"]
    assert not any("stall" in line for line in lines)
    assert "  best phase lag -1 rad over brake_torque" in lines, "the same for each"


def test_a_motor_at_one_point() -> None:
    figures, lines, _ = shown(motor, x_end=0.0, x_count=1, y_begin=33.0, y_end=33.0, y_count=1)
    assert "no efficiency anywhere" in [t.get_text() for t in figures["speed_torque"].axes[1].texts]
    assert lines[0] == "  contact_only 100.000 % of the points"


def test_a_motor_without_means_has_no_empty_pictures() -> None:
    figures, _, _ = undrawn(motor, x_count=2, y_count=2, friction=0.0)
    panels = figures["speed_torque"].axes[0], *figures["stall"].axes
    names = "mean speed", "no-load speed", "stall torque"
    for axes, name in zip(panels, names, strict=True):
        assert f"no {name} anywhere" in [text.get_text() for text in axes.texts]


def test_a_motor_without_loads_on_its_axes() -> None:
    figures, _, _ = undrawn(
        motor, x_axis="phase_lag", x_begin=-1.0, x_end=1.0, x_count=3,
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


# --- the bifurcation diagram ----------------------------------------------------------------------
PAPER = NextCollisionMap(0.335, 0.5, 0.0, 100.0)


@pytest.fixture(scope="module")
def upward() -> Branch:
    return follow(PAPER, "axial_forcing", np.linspace(0.335, 0.56, 120), measured=1000, kept=500)


@pytest.fixture(scope="module")
def doublings() -> list[Doubling]:
    return period_doublings(fixed_point(0.335, 0.5), "axial_forcing", 0.6, 3)


def test_the_density_counts_every_impact(upward: Branch) -> None:
    low, high = phase_range(upward)
    assert -0.5 < low < -0.2  # the band of chaos begins before 0
    assert 1.6 < high < 1.8
    shares = density(upward, low, high)
    np.testing.assert_allclose(shares.sum(axis=0), 1.0, atol=1e-12)
    rows = low + (np.arange(len(shares)) + 0.5) / len(shares) * (high - low)
    i = int(np.argmin(np.abs(upward.values - 0.45)))
    assert (shares[:, i] > 0).sum() == 1  # period 1: one cell
    phase = math.acos(1 / 3 / upward.values[i])
    assert rows[np.argmax(shares[:, i])] == pytest.approx(phase, abs=(high - low) / len(shares))
    assert (shares[:, -1] > 0).sum() > 100  # chaos: a band


def test_phases_all_around_are_cut_where_they_are_fewest(upward: Branch) -> None:
    phases = np.linspace(0.0, math.tau, 500, endpoint=False)
    phases = np.where((phases > 3.5) & (phases < 4.5) & (np.arange(500) % 3 > 0), 1.0, phases)
    everywhere = np.broadcast_to(phases, upward.forcing_phase.shape)
    branch = upward._replace(forcing_phase=everywhere)
    low, high = phase_range(branch)
    assert high - low == pytest.approx(math.tau)
    assert 3.5 < low + math.tau < 4.5
    np.testing.assert_allclose(density(branch, low, high).sum(axis=0), 1.0, atol=1e-12)


def test_edges_lie_half_way() -> None:
    assert edges_of(np.array([1.0, 2.0, 4.0])).tolist() == [0.5, 1.5, 3.0, 5.0]
    assert edges_of(np.array([0.5])).tolist() == [0.475, 0.525], "a single value is no range"
    assert edges_of(np.array([0.0])).tolist() == [-0.5, 0.5]


def test_the_figure_says_what_it_shows(
    upward: Branch, doublings: list[Doubling], tmp_path: Path
) -> None:
    figure = bifurcation_figure(upward, PAPER, "axial_forcing", doublings, marks=[0.34, 0.45, 9.0])
    top, middle, hits, bottom = figure.axes
    assert flaws(figure) == []
    assert hits.get_ylabel() == "impact speed\n|$w_{\\mathrm{A}}$| (πg/ω)"
    assert [text.get_text() for text in top.texts] == ["(a)", "a", "b"]
    assert [axes.texts[0].get_text() for axes in (middle, hits)] == ["(b)", "(c)"]
    assert bottom.get_xlabel() == "axial forcing Γ"
    assert top.get_ylabel() == "forcing phase at impact τ (rad)"
    assert middle.get_ylabel() == "mean speed\nα̇ / (ωΦ)"
    assert (
        figure.get_suptitle()
        == r"Attractor followed upward in Γ; ε = 0.5, θ = 0, $Γ_{\mathrm{T}}$ = 100"
    )
    assert legend_of(top) == [
        "period 1, theory: cos τ = (1 − ε)/((1 + ε) Γ)", "period 1 → 2 at 0.486003",
        "period 2 → 4 at 0.530664", "period 4 → 8 at 0.540102",
    ]  # fmt: skip
    ticks = [text.get_text() for text in top.get_yticklabels()]
    assert "π/2" in ticks, "phases are written as parts of π, as in all figures"
    lines = [np.asarray(line.get_xdata()) for line in bottom.lines]
    places = [float(x[0]) for x in lines if len(x) == 2][1:]
    assert places == [point.value for point in doublings]
    figure.set_layout_engine("none")  # as `flaws` has left it
    figure.savefig(tmp_path / "figure.pdf")
    assert 10_000 < (tmp_path / "figure.pdf").stat().st_size < 500_000
    bottom_of_legend = there(top.get_legend()).get_window_extent().y0
    assert bottom_of_legend >= top.get_window_extent().y1, "the legend covers no branch"


def test_the_way_down_from_contact_and_rest() -> None:
    """Rest gives no points, contact no exponent; both are drawn without complaint."""
    section = NextCollisionMap(0.36, 0.5, -0.4)
    start = begin(section, MapState(1.0, -0.01))
    branch = follow(section, "axial_forcing", np.linspace(0.36, 0.30, 13), start, measured=300)
    figure = bifurcation_figure(branch, section, "axial_forcing")
    title = "Attractor followed downward in Γ; ε = 0.5, θ = −0.4, no friction"
    assert figure.get_suptitle() == title
    assert legend_of(figure.axes[-1])[0] == "with contact: −∞"
    drawn(figure)
    shares = density(branch, 0.0, math.tau)
    assert (shares.sum(axis=0) > 0).tolist() == (branch.values > 1 / math.pi).tolist()


def test_contact_has_its_colour_and_its_onset_a_name(upward: Branch) -> None:
    contacts = upward.contacts.copy()
    contacts[-10:] = 0.01
    figure = bifurcation_figure(
        upward._replace(contacts=contacts), PAPER, "axial_forcing", followed=True, onset=0.55
    )
    texts = legend_of(figure.axes[0])
    assert texts[:2] == ["orbits without contact", "orbits with contact"]
    assert texts[-1] == "first contact at 0.550000: another attractor from here on"
    for axes in figure.axes:
        assert any(np.array_equal(line.get_xdata(), [0.55, 0.55]) for line in axes.lines)
    speeds = [line for line in figure.axes[1].lines if str(line.get_label()).startswith("mean")]
    colors = {str(line.get_color()) for line in speeds}
    assert len(colors) == 2


# --- single tosses --------------------------------------------------------------------------------
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
    paths = paths_of.toss_paths(-math.pi / 4, np.array(ANGLES))
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
    drawn(figure)


def small_maps() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    return np.linspace(-0.5, 1.5, 41) * math.pi, np.linspace(0.0, 0.5, 31) * math.pi


def test_maps() -> None:
    lags, angles = small_maps()
    figure = maps_figure(
        lags, angles, toss(lags[:, None], angles), [FASTEST, SIDEWAYS], ridge(points=20)
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
    drawn(figure)


def test_a_map_of_large_speeds_has_few_lines() -> None:
    """There was one for every 5 rad/s: at 10¹³ rad/s they did not fit into the memory."""
    lags, angles = small_maps()
    pulled = PAPER_TOSS._replace(disk=PAPER_TOSS.disk._replace(load_torque=1e12))
    figure = maps_figure(lags, angles, toss(lags[:, None], angles, pulled))
    lines = [one for axes in figure.axes for one in axes.collections if hasattr(one, "levels")]
    assert lines
    assert all(len(one.levels) <= 41 for one in lines)


@pytest.mark.parametrize("given", [{"friction": 0.0}, {"initial_angular_velocity": -30.0}])
def test_any_map_can_be_drawn(given: dict[str, Value]) -> None:
    """Nothing turns; two points a side; the extremes are those of η itself, not of |η|."""
    study = named("toss_map", phase_lag_count=2, amplitude_angle_count=2, **given)
    assert isinstance(study, TossMap)
    result = there(run(study))
    assert set(toss_map.DEFINITION.pictures(study, result)) == {"toss_map", "trajectories"}
    best = {one.measure: one for one in study.extremes}
    if "friction" in given:
        assert not best
        assert study.ridge() is None
    else:
        assert best["efficiency"].efficiency == pytest.approx(0.4984, abs=1e-4)
        assert toss_map.lines(result)[-1].endswith("η = 0.4984")


def test_the_line_of_speed_ratio_1_is_that_of_a_start_at_the_lowest_point() -> None:
    for phase, is_there in ((1.5 * math.pi, True), (-0.5 * math.pi, True), (0.0, False)):
        study = named("toss_map", initial_forcing_phase=phase)
        assert isinstance(study, TossMap)
        assert (study.ridge() is not None) == is_there


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
    drawn(figure)
