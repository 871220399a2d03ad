"""The bifurcation figure: the raster counts right, the axes say what they show, files are small."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from bouncing_disk_ros.maps.bifurcation_diagram import Branch, begin, follow
from bouncing_disk_ros.maps.bifurcations import Doubling, period_doublings
from bouncing_disk_ros.maps.next_collision import MapState, NextCollisionMap
from bouncing_disk_ros.maps.periodic_orbit import fixed_point
from bouncing_disk_ros.matplotlib_figures import edges_of
from bouncing_disk_ros.study.bifurcation.picture import bifurcation_figure, density, phase_range
from support.figure_boxes import flaws

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
    legend = top.get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == [
        "period 1, theory: cos τ = (1 − ε)/((1 + ε) Γ)", "period 1 → 2 at 0.486003",
        "period 2 → 4 at 0.530664", "period 4 → 8 at 0.540102",
    ]  # fmt: skip
    ticks = [text.get_text() for text in top.get_yticklabels()]
    assert "π/2" in ticks, "phases are written as parts of π, as in all figures"
    lines = [np.asarray(line.get_xdata()) for line in bottom.lines]
    places = [float(x[0]) for x in lines if len(x) == 2][1:]
    assert places == [point.value for point in doublings]
    figure.savefig(tmp_path / "figure.pdf")
    assert 10_000 < (tmp_path / "figure.pdf").stat().st_size < 500_000
    bottom_of_legend = legend.get_window_extent().y0
    assert bottom_of_legend >= top.get_window_extent().y1, "the legend covers no branch"


def test_the_way_down_from_contact_and_rest() -> None:
    """Rest gives no points, contact no exponent; both are drawn without complaint."""
    section = NextCollisionMap(0.36, 0.5, -0.4)
    start = begin(section, MapState(1.0, -0.01))
    branch = follow(section, "axial_forcing", np.linspace(0.36, 0.30, 13), start, measured=300)
    figure = bifurcation_figure(branch, section, "axial_forcing")
    title = "Attractor followed downward in Γ; ε = 0.5, θ = −0.4, no friction"
    assert figure.get_suptitle() == title
    legend = figure.axes[-1].get_legend()
    assert legend is not None
    assert legend.texts[0].get_text() == "with contact: −∞"
    figure.draw_without_rendering()
    shares = density(branch, 0.0, math.tau)
    assert (shares.sum(axis=0) > 0).tolist() == (branch.values > 1 / math.pi).tolist()


def test_contact_has_its_colour_and_its_onset_a_name(upward: Branch) -> None:
    contacts = upward.contacts.copy()
    contacts[-10:] = 0.01
    figure = bifurcation_figure(
        upward._replace(contacts=contacts), PAPER, "axial_forcing", followed=True, onset=0.55
    )
    legend = figure.axes[0].get_legend()
    assert legend is not None
    texts = [text.get_text() for text in legend.get_texts()]
    assert texts[:2] == ["orbits without contact", "orbits with contact"]
    assert texts[-1] == "first contact at 0.550000: another attractor from here on"
    for axes in figure.axes:
        assert any(np.array_equal(line.get_xdata(), [0.55, 0.55]) for line in axes.lines)
    speeds = [line for line in figure.axes[1].lines if str(line.get_label()).startswith("mean")]
    colors = {str(line.get_color()) for line in speeds}
    assert len(colors) == 2
