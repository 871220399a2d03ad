"""The bifurcation pane and its diagram, driven as a browser would."""

from __future__ import annotations

import math

import numpy as np
import pytest
from bokeh.events import Tap

from bouncing_disk_ros.maps.bifurcation_diagram import from_starts
from bouncing_disk_ros.maps.next_collision import NextCollisionMap, spread_starts
from bouncing_disk_ros.maps.periodic_orbit import fixed_point
from bouncing_disk_ros.workbench import bifurcation_pane
from bouncing_disk_ros.workbench.bifurcation_pane import (
    KEPT,
    ROWS,
    SETTLING,
    STARTS,
    BifurcationPane,
    diagram,
    images,
)
from bouncing_disk_ros.workbench.start_plane import section_of
from support.bokeh_page import VALUES, OpenedPane
from support.checks import there

FULL = 80  # values of Γ in a view here: a quick one


def test_a_diagram_is_that_of_from_starts() -> None:
    shown = there(diagram(0.5, 0.42, 0.5, 200))
    assert shown.columns == 200
    values = 0.42 + (0.5 - 0.42) * (np.arange(200) + 0.5) / 200
    whole = from_starts(
        NextCollisionMap(0.42, 0.5), "axial_forcing", values, spread_starts(STARTS, -5.0),
        settling=SETTLING, measured=KEPT, kept=KEPT,
    )  # fmt: skip
    phases = np.concatenate([branch.forcing_phase for branch in shown.branches])
    np.testing.assert_array_equal(phases, whole.forcing_phase)
    kept = sum(array.nbytes for branch in shown.branches for array in branch)
    assert kept < 1.05 * 8 * 200 * STARTS * KEPT, "the cache of a workbench stays small"
    assert diagram(0.5, 0.42, 0.5, 200, lambda: True) is None, "no longer wanted"


def test_images_hold_the_period_1_orbit_and_the_starts_with_contact_apart() -> None:
    shown = there(diagram(0.5, 0.449, 0.451, 3))
    without, contact = images(shown, 0.0, math.tau)
    assert without.shape == contact.shape == (ROWS, 3)
    phase = float(fixed_point(0.45, 0.5).forcing_phase[0])
    rows = np.flatnonzero(np.isfinite(without[:, 1]))
    assert rows.tolist() == [int(phase / math.tau * ROWS)]
    shares = 10.0 ** without[rows[0], 1] + np.nansum(10.0 ** contact[:, 1].astype(float))
    assert shares == pytest.approx(1.0, abs=1e-5)  # of float32


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> OpenedPane:
    monkeypatch.setattr(bifurcation_pane, "COARSE", 20)
    monkeypatch.setattr(bifurcation_pane, "FULL", FULL)
    return OpenedPane(BifurcationPane)


def test_opening_it_shows_the_diagram_and_a_click_moves_the_cursor_and_the_run(
    opened: OpenedPane,
) -> None:
    (image,) = opened.pane._images[0].data["image"]
    assert image.shape == (ROWS, FULL)
    assert opened.pane._cursor.location == section_of(opened.values).axial_forcing
    assert "There: chattering (1 cycle); period-1, multiplier 0.5" in opened.texts
    assert opened.sent == []
    opened.trigger(Tap(opened.pane._figure, sx=1, sy=1, x=0.4, y=1.0))
    (sent,) = opened.sent
    assert section_of({**VALUES, **sent}).axial_forcing == pytest.approx(0.4, rel=1e-14)
    assert opened.pane._slider.value == opened.pane._cursor.location == 0.4
    assert "Cursor: Γ = 0.4000, " in opened.texts


@pytest.mark.parametrize("dragged", ["cursor", "slider"])
def test_a_drag_sends_only_where_it_is_when_its_time_has_come(
    opened: OpenedPane, dragged: str
) -> None:
    for place in (0.41, 0.42, 0.43):
        if dragged == "cursor":
            opened.pane._cursor.location = place
        else:
            opened.pane._slider.value = place
    opened.settle()
    (sent,) = opened.sent
    assert section_of({**VALUES, **sent}).axial_forcing == pytest.approx(0.43, rel=1e-14)
    assert opened.pane._slider.value == opened.pane._cursor.location == 0.43


def test_the_run_moves_its_own_line_not_the_cursor_and_another_restitution_the_diagram(
    opened: OpenedPane,
) -> None:
    before = opened.pane._cursor.location
    opened.changed(axial_amplitude=0.045)
    assert opened.pane._cursor.location == before
    assert opened.pane._in_force.location == section_of(opened.values).axial_forcing
    assert opened.sent == []
    far = OpenedPane(BifurcationPane, axial_amplitude=0.2)
    forcing = section_of(far.values).axial_forcing
    assert forcing > 2.0
    assert far.pane._figure.x_range.end > forcing, "a run far away is within the range"
    assert far.sent == []
    (image_before,) = opened.pane._images[0].data["image"]
    opened.changed(restitution=0.4)
    (after,) = opened.pane._images[0].data["image"]
    assert not np.array_equal(image_before, after, equal_nan=True)
    assert "ε = 0.4" in opened.pane._figure.title.text


def test_a_coarse_diagram_does_not_take_the_place_of_a_fine_one_which_a_zoom_does(
    opened: OpenedPane,
) -> None:
    pane = opened.pane
    across = pane._figure.x_range
    coarse = there(diagram(0.5, across.start, across.end, 20))
    pane._show((0.0, math.tau), (coarse, images(coarse, 0.0, math.tau)), 0.1)
    (image,) = pane._images[0].data["image"]
    assert image.shape == (ROWS, FULL)
    opened.pane._figure.x_range.update(start=0.52, end=0.56)
    opened.pane._figure.y_range.update(start=0.5, end=1.5)
    opened.settle()
    data = opened.pane._images[0].data
    places = [data[name][0] for name in ("x", "y", "dw", "dh")]
    assert places == pytest.approx([0.52, 0.5, 0.04, 1.0], abs=1e-15)
    assert opened.sent == []
    slider = opened.pane._slider
    assert slider.start <= slider.value <= slider.end


def test_parameters_without_a_diagram_are_said_in_one_line(opened: OpenedPane) -> None:
    opened.changed(restitution=1.0)
    assert "No diagram here: restitution" in opened.texts
    opened.trigger(Tap(opened.pane._figure, sx=1, sy=1, x=0.4, y=1.0))
    assert opened.sent == []
    opened.changed(restitution=0.5)
    assert "No diagram here" not in opened.texts
