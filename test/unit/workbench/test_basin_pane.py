"""The basin pane, driven as a browser would."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from bokeh.events import MouseMove, Tap
from bokeh.models import Div

from bouncing_disk_ros.colours import attractor_colors
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.next_collision import NextCollisionMap
from bouncing_disk_ros.parameters import DEFAULTS
from bouncing_disk_ros.run.simulate import simulate
from bouncing_disk_ros.workbench import basin_pane
from bouncing_disk_ros.workbench.basin_pane import BasinPane, share_text, view
from bouncing_disk_ros.workbench.start_plane import PATH_PERIODS, SAMPLES, Window, whole_window
from support.bokeh_page import BokehPage

FULL = 96  # pixels of a view here: a quick one
VALUES = {name: value for name, value in DEFAULTS.items() if isinstance(value, float)}


class Opened:
    """A pane on a page that a browser has just shown."""

    def __init__(self) -> None:
        self.values: dict[str, float] = {**VALUES, "axial_amplitude": AMPLITUDE}
        self.sent: list[Mapping[str, Any]] = []
        self.refusal: InputError | None = None
        self.pane = BasinPane(lambda: self.values, self.send)
        self.page = BokehPage(self.pane)
        self.pane.parameters_changed()
        self.page.settle()

    def send(self, parameters: Mapping[str, Any]) -> None:
        if self.refusal:
            raise self.refusal
        self.sent.append(parameters)

    @property
    def plot(self) -> Any:
        return self.pane._map.figure

    @property
    def labels(self) -> dict[str, Any]:
        return dict(self.pane._map._labels.data)

    @property
    def path(self) -> dict[str, Any]:
        return dict(self.pane._path._path.data)

    @property
    def texts(self) -> str:
        return "\n".join(one.text for one in self.page.document.select({"type": Div}))

    def zoom(self, window: Window) -> None:
        self.plot.x_range.update(start=window.phase_begin, end=window.phase_end)
        self.plot.y_range.update(start=window.velocity_begin, end=window.velocity_end)
        self.page.settle()

    def tap(self, phase: float, velocity: float) -> None:
        self.page.trigger(Tap(self.plot, sx=1, sy=1, x=phase, y=velocity))

    def move(self, phase: float, velocity: float) -> None:
        self.page.trigger(MouseMove(self.plot, sx=1, sy=1, x=phase, y=velocity))


AMPLITUDE = 0.45 * math.pi * 9.80665 / (6.0 * math.pi) ** 2


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> Opened:
    monkeypatch.setattr(basin_pane, "COARSE", 24)
    monkeypatch.setattr(basin_pane, "FULL", FULL)
    return Opened()


def shown(opened: Opened) -> np.ndarray:
    (image,) = opened.labels["image"]
    return np.asarray(image, int) - 1


def test_the_whole_map_is_shown_with_its_colours_and_shares(opened: Opened) -> None:
    section = opened.pane._section
    assert section is not None
    expected = view(section, whole_window(), FULL)
    assert expected is not None
    np.testing.assert_array_equal(shown(opened), expected.labels)
    mapper = opened.pane._map._mapper
    assert mapper.palette[1:] == attractor_colors(["chattering (1 cycle)", "period-1"])
    assert (mapper.low, mapper.high) == (-0.5, 2.5)  # a colour to each of −1, 0 and 1, plus 1
    assert re.search(r"period-1, multiplier 0.5: 34.\d\d % in this window", opened.texts)
    assert f"{FULL} × {FULL} starts" in opened.texts
    opened.zoom(Window(1.0, 1.1, -1.4, -1.3))
    assert "chattering (1 cycle): none in this window" in opened.texts
    opened.zoom(Window(2.0, 2.0 + 2e-14, -1.0 - 2e-14, -1.0))
    assert "Double precision ends here" in opened.texts
    assert [share_text(one) for one in (1.0, 1e-6)] == ["100.00 %", "less than 0.01 %"]


def test_what_is_in_view_already_is_not_computed_again(
    opened: Opened, monkeypatch: pytest.MonkeyPatch
) -> None:
    for begin in (0.1, 0.2, 0.3):  # several changes make one view
        opened.plot.x_range.start = begin
        opened.pane.parameters_changed()
    assert len(opened.page.document.session_callbacks) == 1
    opened.page.settle()
    asked: list[object] = []
    monkeypatch.setattr(opened.pane._views, "ask", asked.append)
    opened.values["phase_lag"] = 0.3  # the plane is the same
    opened.pane.parameters_changed()
    opened.page.settle()
    assert asked == []
    opened.values["restitution"] = 0.6
    opened.pane.parameters_changed()
    opened.page.settle()
    assert len(asked) == 1


def test_the_start_under_the_pointer_is_named(opened: Opened) -> None:
    opened.move(1.0, -1.3)
    assert "τ = 1.000 rad, w_A = −1.300 πg/ω: period-1" in opened.texts
    opened.move(1.0, -0.1)
    assert "w_A = −0.100 πg/ω: chattering (1 cycle)" in opened.texts
    opened.move(-3.0, -0.1)  # beside the map
    assert "πg/ω: " not in opened.texts


def test_a_click_shows_the_orbit_that_simulate_gives(opened: Opened) -> None:
    opened.tap(1.0, -1.3)
    start = opened.pane.start
    assert start is not None
    assert abs(start.forcing_phase - 1.0) <= math.pi / FULL
    assert abs(start.velocity + 1.3) <= 2.5 / FULL * (1.0 + 1e-9)
    whole: dict[str, Any] = {**opened.values, **start.parameters}
    result = simulate(PATH_PERIODS / 3.0, sample_rate=3.0 * SAMPLES, **whole)
    data = opened.path
    assert opened.pane._path.figure.yaxis.axis_label == "height (mm)"
    np.testing.assert_array_equal(data["height"], result.samples["axial_position"] / 1e-3)
    assert "goes to: period-1" in opened.texts
    assert opened.sent == []


def test_a_second_click_on_the_start_or_the_button_sends_the_disk_there(opened: Opened) -> None:
    assert opened.pane._button.disabled
    opened.tap(1.0, -1.3)
    assert not opened.pane._button.disabled
    start = opened.pane.start
    assert start is not None
    opened.tap(1.03, -1.31)
    assert opened.sent == [dict(start.parameters)]
    first = simulate(0.0, **{**opened.values, **opened.sent[0]}).impacts[0]
    assert first["forcing_phase"] == start.forcing_phase
    assert first["axial_impact_velocity"] == start.impact_velocity
    assert "Sent to" in opened.texts
    opened.tap(2.0, -2.3)  # another start: its orbit, nothing is sent
    assert len(opened.sent) == 1
    assert opened.pane._orbit.start != start  # type: ignore[union-attr]
    opened.pane._send_start()  # the button
    assert len(opened.sent) == 2
    opened.refusal = InputError("initial_height", 0.0, "something <else>")
    opened.pane._send_start()
    assert "initial_height: got 0.0, allowed: something &lt;else&gt;" in opened.texts


def test_parameters_without_basins_are_said_in_one_line(opened: Opened) -> None:
    opened.tap(1.0, -1.3)
    opened.values["restitution"] = 1.0
    opened.pane.parameters_changed()
    opened.page.settle()
    assert "No basins here: restitution" in opened.texts
    assert opened.labels["image"] == []
    opened.tap(1.0, -1.3)
    assert opened.sent == []
    opened.values["restitution"] = 0.5
    opened.pane.parameters_changed()
    opened.page.settle()
    assert "No basins here" not in opened.texts
    assert len(shown(opened)) == FULL


def test_other_parameters_make_another_map_and_forget_the_orbit(opened: Opened) -> None:
    before = shown(opened)
    opened.tap(1.0, -1.3)
    opened.values["axial_amplitude"] = 1.1 * AMPLITUDE
    opened.pane.parameters_changed()
    opened.page.settle()
    assert (shown(opened) != before).any()
    assert opened.pane._button.disabled
    assert len(opened.path["height"]) == 0


def test_neither_a_view_of_old_parameters_nor_a_coarse_one_takes_the_place_of_a_fine_one(
    opened: Opened,
) -> None:
    """A slow view arrives when its parameters are no longer in force, or after a finer one."""
    section = opened.pane._section
    assert section is not None
    for of, side in ((NextCollisionMap(0.6, 0.5), 16), (section, 24)):
        late = view(of, whole_window(), side)
        assert late is not None
        opened.pane._show(of, late, 1.0)
        assert len(shown(opened)) == FULL


def test_nothing_is_computed_before_a_browser_shows_it() -> None:
    pane = BasinPane(lambda: VALUES, lambda _: None)
    pane.parameters_changed()
    pane.join()
    page = BokehPage(pane)
    page.settle()
    assert pane._shown is None
