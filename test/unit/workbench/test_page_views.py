"""The parts of the page that know no browser: windows, strobe, flow of frames, work in a thread."""

from __future__ import annotations

import math
import threading
from itertools import pairwise
from types import SimpleNamespace

import pytest

from bouncing_disk_ros.side_window import nice_above, side_window
from bouncing_disk_ros.units import number_text, with_prefix
from bouncing_disk_ros.workbench.latest_work import IsObsolete, LatestWork
from bouncing_disk_ros.workbench.run_pane import fitted
from bouncing_disk_ros.workbench.run_view import LONGEST, MOST_AHEAD, PATIENCE, FlowControl
from bouncing_disk_ros.workbench.strobe import shown_motion, strobe_rate, text_of
from bouncing_disk_ros.workbench.tab import on_next_tick


# --- flow ---------------------------------------------------------------------------------------
def test_a_page_that_draws_gets_every_frame() -> None:
    flow = FlowControl()
    for k in range(100):
        assert flow.may_send(k / 30)
        flow.note_sent(k / 30, float(k))
        flow.note_drawn(float(k))
    assert flow.drawn == 100


def test_a_page_that_draws_nothing_gets_ever_fewer_frames_until_its_axis_begins_anew() -> None:
    """A hidden tab for ten minutes: MOST_AHEAD at once, then after 1, 2, 4 … 64 s."""
    flow = FlowControl()
    for k in range(30 * 600):
        if flow.may_send(k / 30):
            flow.note_sent(k / 30, float(k))
    doublings = int(math.log2(LONGEST / PATIENCE))
    assert flow.sent <= MOST_AHEAD + doublings + 600 / LONGEST + 1
    flow.note_drawn(float(30 * 600))
    assert flow.may_send(600.0)
    anew = FlowControl()
    for k in range(MOST_AHEAD):
        anew.note_sent(0.0, 10.0 + k)
    assert not anew.may_send(0.1)
    anew.restart()
    assert anew.may_send(0.1)


# --- window -------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("diameter", "low", "high"),
    [(0.3, -0.04, 0.17), (0.3, -0.04, 2.0), (8e-3, -1e-6, 4e-6), (0.3, 0.0, 0.0), (0.3, -1e3, 1e9)],
)
def test_a_window_holds_disk_and_motion(diameter: float, low: float, high: float) -> None:
    window = side_window(diameter, low, high, 1.2)
    assert window.low <= low
    assert window.high >= high
    assert 2.0 * window.half_width >= diameter
    scale = (window.high - window.low) / (2.0 * window.half_width * 1.2)
    assert scale == pytest.approx(1.0 / window.magnification, rel=1e-12)


def test_a_pizza_is_to_scale_and_a_motor_is_magnified_and_axes_have_even_numbers() -> None:
    assert side_window(0.3, -0.04, 0.17, 1.2).magnification == 1.0
    assert side_window(8e-3, -1e-6, 4e-6, 1.2).magnification >= 100.0
    assert side_window(0.3, 0.0, 1e-16, 1.2).magnification == 1.0, "at rest, but for rounding"
    assert [nice_above(x) for x in (0.11, 0.2, 3.0, 7e-7)] == pytest.approx([0.2, 0.2, 5.0, 1e-6])


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (40e3, "Hz", "40 kHz"), (3e-7, "m", "300 nm"), (0.0397887, "m", "39.79 mm"),
        (-0.005, "rad", "−5 mrad"), (1.4468, "rad", "1.447 rad"), (0.5, "kg", "500 g"),
        (9.80665, "m/s²", "9.807 m/s²"), (1e-7, "kg·m²", "1 g·cm²"), (0.0, "m", "0 m"),
        (0.99999e-3, "m", "1 mm"), (0.5, "", "0.5"), (1e-6, "", "10⁻⁶"),
        (-2.5e7, "1/s", "−2.5·10⁷ 1/s"),
    ],
)  # fmt: skip
def test_a_number_has_the_prefix_of_a_data_sheet(value: float, unit: str, text: str) -> None:
    assert with_prefix(value, unit) == text
    assert number_text(-1e-12, 3) == "−10⁻¹²"
    assert fitted(1.0, 2.0, 0.1, 0.8, 2.2) == (0.8, 2.2), "it fits still"
    low, high = fitted(1.0, 3.0, 0.1, 0.8, 2.2)
    assert low < 1.0
    assert high > 3.0


# --- strobe -------------------------------------------------------------------------------------
@pytest.mark.parametrize("frequency", [40_000.0, 25_000.0, 1234.5, 400.0, 60.0, 0.3])
@pytest.mark.parametrize("factor", [1.0, 0.1])
def test_a_strobe_shows_one_period_in_two_seconds(frequency: float, factor: float) -> None:
    wanted = 100.0 / factor
    rate = strobe_rate(frequency, wanted, factor)
    if frequency * 8 <= wanted:
        assert rate == wanted, "it is seen as it is"
        return
    assert 0.6 * min(wanted, frequency) <= rate <= 1.5 * wanted
    shown = shown_motion(frequency, rate, factor)
    assert shown.is_strobed
    assert shown.step > 0.0, "forward"
    # m of f T/n, a whole number of 8 or more: half of one off, and by the 1/m that samples are late
    assert shown.seconds == pytest.approx(2.0, abs=1.0 / (rate * factor) + 2.0 * shown.step)
    # the phase of sample k is k/m of a period, to the rounding of ns
    phases = [round(1e9 * k / rate) / 1e9 * frequency % 1.0 for k in range(20)]
    steps = [(b - a + 0.5) % 1.0 - 0.5 for a, b in pairwise(phases)]
    assert max(abs(step - shown.step) for step in steps) < 2e-9 * frequency


def test_the_page_says_what_it_shows() -> None:
    assert text_of(shown_motion(3.0, 100.0, 1.0), 3.0) == ""
    still = shown_motion(40_000.0, 100.0, 1.0)
    assert math.isinf(still.seconds)
    assert "400 periods" in text_of(still, 40_000.0)
    assert "it seems to stand" in text_of(still, 40_000.0)
    moving = shown_motion(40_000.0, strobe_rate(40_000.0, 100.0), 1.0)
    assert "moves on by 1/200" in text_of(moving, 40_000.0)
    assert "backward" in text_of(shown_motion(99.0, 100.0, 1.0), 99.0)


# --- work in a thread -----------------------------------------------------------------------------
def test_newer_work_makes_older_work_obsolete() -> None:
    latest, begun, done = LatestWork(), threading.Event(), []
    asked = threading.Event()

    def first(is_obsolete: IsObsolete) -> None:
        begun.set()
        assert not is_obsolete()
        assert asked.wait(60.0)
        done.append(("first", is_obsolete()))

    latest.ask(first)
    assert begun.wait(60.0)
    latest.ask(lambda _: done.append(("never", False)))
    latest.ask(lambda is_obsolete: done.append(("last", is_obsolete())))
    asked.set()
    latest.join()
    assert done == [("first", True), ("last", False)]


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_an_error_ends_one_piece_of_work_alone() -> None:
    latest, done = LatestWork(), []

    def fail(_: IsObsolete) -> None:
        raise RuntimeError("of the test")

    latest.ask(fail)
    latest.join()
    latest.ask(lambda _: done.append(1))
    latest.join()
    assert done == [1]


def test_a_page_that_is_gone_is_left_alone() -> None:
    called: list[object] = []
    for destroyed in (True, False):
        session = SimpleNamespace(destroyed=destroyed)
        page = SimpleNamespace(session_context=session, add_next_tick_callback=called.append)
        on_next_tick(page, test_a_page_that_is_gone_is_left_alone)
    assert called == [test_a_page_that_is_gone_is_left_alone]
