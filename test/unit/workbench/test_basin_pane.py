"""Views of basins are those of the study, orbits those of simulate; their pane in a document."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
import pytest
from bokeh.events import MouseMove, Tap

from bouncing_disk_ros.colours import attractor_colours
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.attractors import numbered
from bouncing_disk_ros.maps.next_collision import NextCollisionMap
from bouncing_disk_ros.parameters import DEFAULTS, amplitude_of
from bouncing_disk_ros.run.input_records import Record
from bouncing_disk_ros.run.session import Session
from bouncing_disk_ros.run.simulate import simulate
from bouncing_disk_ros.study.basins.compute import Basins, from_arrays
from bouncing_disk_ros.study.basins.options import DEFINITION as BASINS
from bouncing_disk_ros.workbench import basin_pane
from bouncing_disk_ros.workbench.basin_pane import COARSE, BasinPane, label_of, share_text, view
from bouncing_disk_ros.workbench.start_plane import (
    IMPACT_PERIODS,
    NOT_DECIDED,
    PATH_PERIODS,
    SAMPLES,
    Window,
    is_distinct,
    orbit_of,
    pixel_centre,
    section_of,
    start_at,
    whole_window,
)
from support.bokeh_page import VALUES, BokehPage, OpenedPane
from support.checks import there

SIDE = 64


def study_of(axial_forcing: float, window: Window, side: int = SIDE) -> Basins:
    values = {name: spec.default for name, spec in BASINS.options.items()}
    values |= {"axial_forcing": axial_forcing, "width": side, "height": side}
    return Basins({**values, **window._asdict()})


def around(phase: float, velocity: float, half: float) -> Window:
    return Window(phase - half, phase + half, velocity - half, velocity + half)


def boundary(axial_forcing: float, phase: float) -> float:
    """A velocity at which the label changes, to the last bit but some."""
    low, high = -1.5, -0.2
    first = label_of(NextCollisionMap(axial_forcing, 0.5), phase, low)
    assert label_of(NextCollisionMap(axial_forcing, 0.5), phase, high) != first
    for _ in range(60):
        middle = 0.5 * (low + high)
        if label_of(NextCollisionMap(axial_forcing, 0.5), phase, middle) == first:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


@pytest.mark.parametrize(
    ("axial_forcing", "place", "coarse"),
    [
        (0.45, 1e-9, 1),
        (0.55, 0.1, 1),
        (0.5526, whole_window(), 1),
        (0.48, whole_window(), COARSE),
        (0.45, Window(-7.0, 8.0, -3.0, -0.5), COARSE),
    ],
)
def test_labels_are_those_of_the_study(
    monkeypatch: pytest.MonkeyPatch, axial_forcing: float, place: Window | float, coarse: int
) -> None:
    """In a window, or so near to a boundary; bit by bit.

    Attractors by their names: the study may find them anew, with other numbers. Views finer than
    `coarse` know a region about chaos; the others follow every start.
    """
    monkeypatch.setattr(basin_pane, "COARSE", coarse)
    window = (
        place if isinstance(place, Window) else around(2.0, boundary(axial_forcing, 2.0), place)
    )
    study = study_of(axial_forcing, window)
    context = study.context()
    names = np.array([*numbered([a.name for a in from_arrays(context).found]), NOT_DECIDED])
    expected = np.empty((SIDE, SIDE), np.int32)
    for region in study.regions():
        part = study.compute(region, context, None)["label"]
        expected[region.select(("velocity", "forcing_phase"))] = part
    found = there(view(NextCollisionMap(axial_forcing, 0.5), window, SIDE))
    own = np.array([*found.names, NOT_DECIDED])
    np.testing.assert_array_equal(own[found.labels], names[expected])
    assert len(np.unique(found.labels)) > 1, "a boundary is in view"
    assert sum(found.shares) == pytest.approx(1.0, abs=1e-12)


def test_pixels_and_the_label_of_one_start_are_those_of_the_study() -> None:
    window = Window(0.3, 1.7, -2.0, -0.25)
    axes = study_of(0.45, window).axes
    phases, speeds = axes["forcing_phase"].values, axes["velocity"].values
    for column, line in ((0, 0), (17, 40), (SIDE - 1, SIDE - 1)):
        start = float(phases[column]), float(speeds[line])
        assert pixel_centre(window, SIDE, *start) == start
    assert pixel_centre(window, SIDE, 1.7, -0.25) == (float(phases[-1]), float(speeds[-1]))
    found = there(view(NextCollisionMap(0.45, 0.5), whole_window(), 16))
    axes = study_of(0.45, whole_window(), 16).axes
    for column, line in ((1, 3), (5, 12), (9, 9), (15, 14)):
        phase = float(axes["forcing_phase"].values[column])
        velocity = float(axes["velocity"].values[line])
        expected = found.names[found.labels[line, column]]
        assert label_of(NextCollisionMap(0.45, 0.5), phase, velocity) == expected


def test_the_end_of_double_precision_is_seen_and_no_view_that_is_not_wanted() -> None:
    assert is_distinct(around(2.0, -1.0, 1e-12), 512)
    assert not is_distinct(around(2.0, -1.0, 1e-13), 512)  # 512 pixels, 900 doubles: some share
    found = there(view(NextCollisionMap(0.45, 0.5), around(2.0, -1.0, 1e-14), 64))
    assert not found.distinct
    assert view(NextCollisionMap(0.45, 0.5), whole_window(), SIDE, lambda: True) is None


def test_a_section_of_the_parameters_in_force() -> None:
    section = section_of(VALUES)
    assert section.axial_forcing == pytest.approx(0.4498, abs=1e-4)
    assert amplitude_of(section.axial_forcing, VALUES) == pytest.approx(0.039, rel=1e-14)
    doubled = section_of({**VALUES, "preload": 0.25 * 9.80665})
    assert doubled.axial_forcing == pytest.approx(0.5 * section.axial_forcing, rel=1e-14)
    assert section_of({**VALUES, "phase_lag": 1.0, "brake_torque": 0.1}) == section
    alone = section_of({**VALUES, "gravity": 0.0, "preload": 0.25 * 9.80665})
    assert alone.axial_forcing == pytest.approx(section.axial_forcing, rel=1e-15)


@pytest.mark.parametrize(
    ("changed", "line"),
    [
        ({"restitution": 1.0}, "the map keeps areas"),
        ({"gravity": 0.0}, "no impacts to map"),
        ({"axial_amplitude": 1e6}, "Γ <= 1000"),
    ],
)
def test_where_there_are_no_basins_one_line_says_why(changed: dict[str, float], line: str) -> None:
    with pytest.raises(InputError, match=line) as caught:
        section_of({**VALUES, **changed})
    assert "\n" not in str(caught.value)


# --- the pane -------------------------------------------------------------------------------------
FULL = 96  # pixels of a view here: a quick one
AMPLITUDE = 0.45 * math.pi * 9.80665 / (6.0 * math.pi) ** 2


class Opened(OpenedPane):
    def __init__(self) -> None:
        super().__init__(BasinPane, axial_amplitude=AMPLITUDE)
        self.plot = self.pane._map.figure

    @property
    def labels(self) -> np.ndarray:
        (image,) = self.pane._map._labels.data["image"]
        return np.asarray(image, int) - 1

    def zoom(self, window: Window) -> None:
        self.plot.x_range.update(start=window.phase_begin, end=window.phase_end)
        self.plot.y_range.update(start=window.velocity_begin, end=window.velocity_end)
        self.settle()

    def point(self, kind: type[MouseMove | Tap], phase: float, velocity: float) -> None:
        self.trigger(kind(self.plot, sx=1, sy=1, x=phase, y=velocity))


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> Opened:
    monkeypatch.setattr(basin_pane, "COARSE", 24)
    monkeypatch.setattr(basin_pane, "FULL", FULL)
    return Opened()


def test_the_whole_map_is_shown_with_its_colours_and_shares(opened: Opened) -> None:
    section = there(opened.pane._section)
    expected = there(view(section, whole_window(), FULL))
    np.testing.assert_array_equal(opened.labels, expected.labels)
    mapper = opened.pane._map._mapper
    assert mapper.palette[1:] == attractor_colours(["chattering (1 cycle)", "period-1"])
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
    assert len(opened.document.session_callbacks) == 1
    opened.settle()
    asked: list[object] = []
    monkeypatch.setattr(opened.pane._views, "ask", asked.append)
    opened.changed(phase_lag=0.3)  # the plane is the same
    assert asked == []
    opened.changed(restitution=0.6)
    assert len(asked) == 1


def test_the_start_under_the_pointer_is_named_and_a_click_shows_its_orbit(opened: Opened) -> None:
    opened.point(MouseMove, 1.0, -1.3)
    assert "τ = 1.000 rad, w_A = −1.300 πg/ω: period-1" in opened.texts
    opened.point(MouseMove, 1.0, -0.1)
    assert "w_A = −0.100 πg/ω: chattering (1 cycle)" in opened.texts
    opened.point(MouseMove, -3.0, -0.1)  # beside the map
    assert "πg/ω: " not in opened.texts
    opened.point(Tap, 1.0, -1.3)
    start = there(opened.pane.start)
    assert abs(start.forcing_phase - 1.0) <= math.pi / FULL
    assert abs(start.velocity + 1.3) <= 2.5 / FULL * (1.0 + 1e-9)
    whole: dict[str, Any] = {**opened.values, **start.parameters}
    result = simulate(PATH_PERIODS / 3.0, sample_rate=3.0 * SAMPLES, **whole)
    path = opened.pane._path
    assert path.figure.yaxis.axis_label == "height (mm)"
    np.testing.assert_array_equal(
        path._path.data["height"], result.samples["axial_position"] / 1e-3
    )
    assert "goes to: period-1" in opened.texts
    assert opened.sent == []


def test_a_second_click_on_the_start_or_the_button_sends_the_disk_there(opened: Opened) -> None:
    assert opened.pane._button.disabled
    opened.point(Tap, 1.0, -1.3)
    assert not opened.pane._button.disabled
    start = there(opened.pane.start)
    opened.point(Tap, 1.03, -1.31)
    assert opened.sent == [dict(start.parameters)]
    first = simulate(0.0, **{**opened.values, **opened.sent[0]}).impacts[0]
    assert first["forcing_phase"] == start.forcing_phase
    assert first["axial_impact_velocity"] == start.impact_velocity
    assert "Sent to" in opened.texts
    opened.point(Tap, 2.0, -2.3)  # another start: its orbit, nothing is sent
    assert len(opened.sent) == 1
    assert opened.pane._orbit.start != start
    opened.pane._send_start()  # the button
    assert len(opened.sent) == 2
    opened.refusal = InputError("initial_height", 0.0, "something <else>")
    opened.pane._send_start()
    assert "initial_height: got 0.0, allowed: something &lt;else&gt;" in opened.texts


def test_parameters_without_basins_are_said_in_one_line_and_others_make_another_map(
    opened: Opened,
) -> None:
    opened.point(Tap, 1.0, -1.3)
    opened.changed(restitution=1.0)
    assert "No basins here: restitution" in opened.texts
    assert opened.pane._map._labels.data["image"] == []
    opened.point(Tap, 1.0, -1.3)
    assert opened.sent == []
    opened.changed(restitution=0.5)
    assert "No basins here" not in opened.texts
    assert len(opened.labels) == FULL
    before = opened.labels
    opened.point(Tap, 1.0, -1.3)
    opened.changed(axial_amplitude=1.1 * AMPLITUDE)
    assert (opened.labels != before).any()
    assert opened.pane._button.disabled
    assert len(opened.pane._path._path.data["height"]) == 0


def test_basins_need_no_orbit_of_the_run() -> None:
    """At 1e-6 Hz the disk would have to begin faster than a start may be."""
    slow = OpenedPane(BasinPane, frequency=1e-6)
    assert "rest: 100.00 % in this window" in slow.texts


def test_neither_a_view_of_old_parameters_nor_a_coarse_one_takes_the_place_of_a_fine_one(
    opened: Opened,
) -> None:
    """A slow view arrives when its parameters are no longer in force, or after a finer one."""
    section = there(opened.pane._section)
    for of, side in ((NextCollisionMap(0.6, 0.5), 16), (section, 24)):
        late = there(view(of, whole_window(), side))
        opened.pane._show(of, late, 1.0)
        assert len(opened.labels) == FULL


def test_nothing_is_computed_before_a_browser_shows_it() -> None:
    pane = BasinPane(lambda: VALUES, lambda _: None)
    pane.parameters_changed()
    pane.join()
    page = BokehPage(pane)
    page.settle()
    assert pane._shown is None


# --- the orbit of a start -------------------------------------------------------------------------
LOADED = {**VALUES, "load_torque": 0.003, "brake_torque": 0.001, "phase_lag": -0.6,
          "friction": 0.2, "preload": 0.4, "initial_angular_velocity": 2.0,
          "initial_height": 0.3}  # fmt: skip


def starts(count: int) -> list[tuple[float, float]]:
    draw = np.random.default_rng(15)
    return [(draw.uniform(-1.0, 8.0), draw.uniform(-5.0, -1e-6)) for _ in range(count)]


@pytest.mark.parametrize("values", [VALUES, LOADED], ids=["default", "loaded"])
def test_an_orbit_is_what_simulate_gives_bit_by_bit(values: dict[str, float]) -> None:
    frequency = values["frequency"]
    for place in starts(6):
        start = start_at(values, *place)
        orbit = orbit_of(values, start)
        whole: dict[str, Any] = {**values, **start.parameters}
        path = simulate(PATH_PERIODS / frequency, sample_rate=SAMPLES * frequency, **whole)
        np.testing.assert_array_equal(orbit.height, path.samples["axial_position"])
        np.testing.assert_array_equal(orbit.platform, path.samples["platform_position"])
        np.testing.assert_array_equal(orbit.time, path.samples["time_ns"] * 1e-9)
        rows = simulate(IMPACT_PERIODS / frequency, **whole).impacts
        assert len(rows) > 3
        np.testing.assert_array_equal(orbit.impacts, rows)


@pytest.mark.parametrize("values", [VALUES, LOADED], ids=["default", "loaded"])
def test_a_run_begun_at_a_start_has_that_first_impact(values: dict[str, float]) -> None:
    for phase, velocity in starts(40):
        start = start_at(values, phase, velocity)
        whole: dict[str, Any] = {**values, **start.parameters}
        first = simulate(0.0, **whole).impacts[0]
        assert first["forcing_phase"] == start.forcing_phase == phase % math.tau
        assert first["axial_impact_velocity"] == start.impact_velocity
        # three roundings of numbers up to the sum of the platform's speed and the impact's
        size = abs(velocity) + math.pi * section_of(values).axial_forcing
        assert start.velocity == pytest.approx(velocity, abs=3.0 * 2.0**-53 * size)


def test_a_reset_in_a_run_goes_to_the_start() -> None:
    """As the node does it: parameters first, then ~/reset, at any instant."""
    records: list[Record] = []
    session = Session({**DEFAULTS, "start_paused": False}, records.append)
    session.advance(1_234_567_891)
    session.take_rows()
    moved = {**VALUES, "axial_amplitude": 0.05, "frequency": 2.5}
    start = start_at(moved, 4.0, -0.7)
    session.set_parameters(start.parameters)
    session.reset()
    session.advance(session.time_ns + 10**9)
    session.resolve_waiting()
    first = next(row for rows in session.take_rows() for row in rows if row["time"] > 1.2345)
    assert first["forcing_phase"] == start.forcing_phase
    assert first["axial_impact_velocity"] == start.impact_velocity
    assert session.simulation.latest_target.axial_amplitude == 0.05


def test_a_start_as_slow_as_roundings_begins_in_contact() -> None:
    """Where w_A is below the roundings of the platform's speed the disk starts with that."""
    start = start_at(VALUES, 0.1, -1e-300)
    assert -1e-14 < start.impact_velocity < 0.0
    whole: dict[str, Any] = {**VALUES, **start.parameters}
    assert simulate(1.0, **whole).impacts[0]["time"] > 0.0
