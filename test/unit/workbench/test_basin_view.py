"""Views of basins are those of the study, in every zoom."""

from __future__ import annotations

import numpy as np
import pytest

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.attractors import numbered
from bouncing_disk_ros.maps.next_collision import NextCollisionMap
from bouncing_disk_ros.parameters import DEFAULTS, amplitude_of
from bouncing_disk_ros.study.basins.compute import Basins, from_arrays
from bouncing_disk_ros.study.basins.options import DEFINITION as BASINS
from bouncing_disk_ros.workbench import basin_pane
from bouncing_disk_ros.workbench.basin_pane import COARSE, label_of, view
from bouncing_disk_ros.workbench.start_plane import (
    NOT_DECIDED,
    Window,
    is_distinct,
    pixel_centre,
    section_of,
    whole_window,
)

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
    found = view(NextCollisionMap(axial_forcing, 0.5), window, SIDE)
    assert found is not None
    own = np.array([*found.names, NOT_DECIDED])
    np.testing.assert_array_equal(own[found.labels], names[expected])
    assert len(np.unique(found.labels)) > 1, "a boundary is in view"
    assert sum(found.shares) == pytest.approx(1.0, abs=1e-12)


def test_a_view_that_is_no_longer_wanted_is_not_computed() -> None:
    assert view(NextCollisionMap(0.45, 0.5), whole_window(), SIDE, lambda: True) is None


def test_pixels_are_those_of_the_study() -> None:
    window = Window(0.3, 1.7, -2.0, -0.25)
    axes = study_of(0.45, window).axes
    phases, speeds = axes["forcing_phase"].values, axes["velocity"].values
    for column, line in ((0, 0), (17, 40), (SIDE - 1, SIDE - 1)):
        start = float(phases[column]), float(speeds[line])
        assert pixel_centre(window, SIDE, *start) == start
    assert pixel_centre(window, SIDE, 1.7, -0.25) == (float(phases[-1]), float(speeds[-1]))


def test_the_label_of_one_start_is_that_of_its_pixel() -> None:
    found = view(NextCollisionMap(0.45, 0.5), whole_window(), 16)
    assert found is not None
    axes = study_of(0.45, whole_window(), 16).axes
    for column, line in ((1, 3), (5, 12), (9, 9), (15, 14)):
        phase = float(axes["forcing_phase"].values[column])
        velocity = float(axes["velocity"].values[line])
        expected = found.names[found.labels[line, column]]
        assert label_of(NextCollisionMap(0.45, 0.5), phase, velocity) == expected


def test_the_end_of_double_precision_is_seen() -> None:
    assert is_distinct(around(2.0, -1.0, 1e-12), 512)
    assert not is_distinct(around(2.0, -1.0, 1e-13), 512)  # 512 pixels, 900 doubles: some share
    found = view(NextCollisionMap(0.45, 0.5), around(2.0, -1.0, 1e-14), 64)
    assert found is not None
    assert not found.distinct


def test_a_section_of_the_parameters_in_force() -> None:
    values = {name: value for name, value in DEFAULTS.items() if isinstance(value, float)}
    section = section_of(values)
    assert section.axial_forcing == pytest.approx(0.4498, abs=1e-4)
    assert amplitude_of(section.axial_forcing, values) == pytest.approx(0.039, rel=1e-14)
    doubled = section_of({**values, "preload": 0.25 * 9.80665})
    assert doubled.axial_forcing == pytest.approx(0.5 * section.axial_forcing, rel=1e-14)
    assert section_of({**values, "phase_lag": 1.0, "brake_torque": 0.1}) == section
    alone = section_of({**values, "gravity": 0.0, "preload": 0.25 * 9.80665})
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
    values = {name: value for name, value in DEFAULTS.items() if isinstance(value, float)}
    with pytest.raises(InputError, match=line) as caught:
        section_of({**values, **changed})
    assert "\n" not in str(caught.value)
