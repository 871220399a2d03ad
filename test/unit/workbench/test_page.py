"""The page in a document without a browser: what its controls send, what it shows."""

from __future__ import annotations

import math
import re
import sys
import threading
from collections.abc import Callable
from functools import partial
from importlib import import_module
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any
from urllib.parse import parse_qsl

import numpy as np
import pytest
from bokeh.document import Document
from bokeh.models import Div
from bokeh.plotting import figure

from bouncing_disk_ros import parameters
from bouncing_disk_ros.core.model import IMPACT_DTYPE, Motion, MotionInForce
from bouncing_disk_ros.run.presets import load_preset
from bouncing_disk_ros.topics import MOTION_NAMES
from bouncing_disk_ros.units import shown_unit
from bouncing_disk_ros.workbench import basin_pane, run_pane
from bouncing_disk_ros.workbench import page as page_module
from bouncing_disk_ros.workbench.actions import (
    RUN_NAMES,
    Call,
    Impulse,
    Juggle,
    Move,
    Perform,
    Set,
    StopJuggling,
    lines,
    new_run,
)
from bouncing_disk_ros.workbench.address import read
from bouncing_disk_ros.workbench.bag_link import BagLink
from bouncing_disk_ros.workbench.control_pane import (
    DISK_CONTROLS,
    FORCING,
    MOTION_CONTROLS,
    forcing_of,
)
from bouncing_disk_ros.workbench.page import TABS, TEXT_EVERY, Page, Pages, TabRow
from bouncing_disk_ros.workbench.run_history import SAMPLE_DTYPE, numbers
from bouncing_disk_ros.workbench.scene_table import SCENES
from bouncing_disk_ros.workbench.tab import TabPane
from support.bokeh_page import ListLink, change, click, model
from support.checks import refused
from support.recorded import period_one_bag


def filled(link: ListLink, preset: str = "pizza_multiple_toss") -> None:
    """Put a run of a preset into the history: a second of it."""
    values = parameters.complete(load_preset(preset))
    motion = Motion(*(float(values[name]) for name in MOTION_NAMES))
    link.history.add_record(
        {"kind": "snapshot", "index": 0, "time_ns": 0, "parameters": dict(values)}
    )
    link.history.add_motion(MotionInForce(0, 0, motion, motion, 0, 0.0))
    samples = np.zeros(101, SAMPLE_DTYPE)
    samples["time"] = np.arange(101) / 100.0
    samples["platform_position"] = motion.axial_amplitude * np.sin(17.0 * samples["time"])
    samples["disk_position"] = samples["platform_position"] + motion.axial_amplitude
    link.history.add_samples(samples)
    rows = np.zeros(3, IMPACT_DTYPE)
    rows["time"], rows["count"] = (0.2, 0.5, 0.9), 1
    rows["forcing_phase"], rows["axial_impact_velocity"] = 0.5 * math.pi, -1.0
    link.history.add_impacts(rows)
    link.history.add_speed(0.5, 20.0)
    link.history.phase = "flight"


@pytest.fixture
def link() -> ListLink:
    found = ListLink()
    filled(found)
    return found


@pytest.fixture
def document() -> Document:
    return Document()


@pytest.fixture
def page(document: Document, link: ListLink) -> Page:
    """The page in the document, after its first frame."""
    made = Page(document, link)
    made.update()
    return made


def of_preset(preset: str) -> tuple[ListLink, Document]:
    """A page that shows a run of a preset."""
    link, document = ListLink(), Document()
    filled(link, preset)
    Page(document, link).update()
    return link, document


def in_force(link: ListLink) -> dict[str, float]:
    return numbers(link.history.values_at())


def test_the_page_shows_the_run_with_a_gap_where_samples_are_missing(
    page: Page, document: Document, link: ListLink
) -> None:
    path = model(document, "path").data
    assert path["time"].tolist() == (np.arange(101) / 100.0).tolist()
    assert np.allclose(path["disk"] - path["platform"], 39.788735772973836), "mm"
    section = model(document, "section").data
    assert section["phase"].tolist() == [0.5] * 3
    assert np.allclose(section["velocity"], -1.0 / (10.0 / 6.0)), "in units of πg/ω"
    assert model(document, "speed").data["speed"].tolist() == [20.0]
    assert len(model(document, "slices").data["start"]) == 8
    assert "flight" in model(document, "status").text
    titles = " ".join(plot.title.text for plot in document.select({"type": figure}))
    assert "eq. 4, 27.39 rad/s (stable)" in titles
    assert not np.isnan(model(document, "path").data["disk"]).any()
    link.history.add_values(1.5, {"state_rate": 10.0})
    samples = np.zeros(7, SAMPLE_DTYPE)
    samples["time"] = [1.01, 1.02, 1.05, 1.06, 1.5, 1.6, 1.7]
    for rows in (samples[:3], samples[3:]):
        link.history.add_samples(rows)
        page.update()
    path = model(document, "path").data
    times = path["time"][np.isnan(path["disk"])]
    assert times.tolist() == [1.05, 1.5]
    assert np.isnan(path["platform"]).sum() == 2


def test_each_slider_shows_and_sends_its_number(
    page: Page, document: Document, link: ListLink
) -> None:
    for control in (*MOTION_CONTROLS, *DISK_CONTROLS):
        slider = model(document, control.name)
        low, high = control.limits(in_force(link))
        size, unit = shown_unit(control.spec.shown_unit, 0.5 * max(abs(low), abs(high)))
        assert slider.value * size == pytest.approx(control.value(in_force(link)), rel=1e-12)
        assert slider.start <= slider.value <= slider.end
        assert unit in slider.title
        assert slider.html_attributes["title"].startswith(control.spec.spelled), "its word"
        given = slider.start + 0.75 * (slider.end - slider.start)
        change(document, control.name, "value_throttled", given)
        action = link.sent.pop()
        assert link.sent == []
        si = given * size
        if control.name == FORCING:
            assert isinstance(action, Move)
            reached = {**in_force(link), **action.values}
            assert forcing_of(reached) == pytest.approx(si, rel=1e-12)
        elif control.name in MOTION_NAMES:
            assert action == Move({control.name: si})
        else:
            assert action == Set({control.name: si})
            parameters.TABLE[control.name].checked(si)
        (line,) = lines(action, link.names)
        assert line.replace("'", "&#x27;") in model(document, "command_lines").text


@pytest.mark.parametrize("preset", ["pizza_multiple_toss", "swum"])
def test_each_slider_reaches_the_value_that_the_run_began_with(preset: str) -> None:
    """By a step of the slider: its steps hold that value of their own in few cases."""
    link, document = of_preset(preset)
    begun = in_force(link)
    for control in (*MOTION_CONTROLS, *DISK_CONTROLS):
        slider = model(document, control.name)
        steps = round((slider.value - slider.start) / slider.step)
        for nearest in (steps + 2, steps, steps + 2):
            given = slider.start + nearest * slider.step
            change(document, control.name, "value_throttled", given)
        back, away = link.sent[-2:]
        assert isinstance(back, (Move, Set))
        assert isinstance(away, (Move, Set))
        ((name, value),) = back.values.items()
        assert value == pytest.approx(begun[name], rel=1e-14), control.name
        assert away.values != back.values


def test_a_motor_fits_the_sliders_and_a_strobe() -> None:
    link, document = of_preset("swum")
    for control in (*MOTION_CONTROLS, *DISK_CONTROLS):
        slider, value = model(document, control.name), control.value(in_force(link))
        span = slider.end - slider.start
        if value > 0.0:
            assert 0.05 < (slider.value - slider.start) / span < 0.95, control.name
        assert 0.001 <= span <= 2000.0, f"{control.name}: numbers that can be read"
    click(document, "strobe")
    assert link.sent == [Set({"state_rate": 40_000.0 / (400.0 + 1.0 / 200.0)})]


def test_buttons_and_fields_send_their_actions_and_any_parameter_as_it_was_typed(
    page: Page, document: Document, link: ListLink
) -> None:
    """What is wrong is for the node to refuse, in its own words."""
    for name in ("pause", "step", "reset", "first_toss"):
        click(document, name)
    change(document, "axial", "value", 0.25)
    change(document, "angular", "value", -0.01)
    click(document, "impulse")
    change(document, "slow", "active", 3)  # with the samples of the wall clock
    assert link.sent == [
        Call("pause", True), Call("pause", True), Call("step"), Call("reset"),
        Perform("first_toss_to_period_1"), Impulse(0.25, -0.01),
        Set({"real_time_factor": 0.1, "state_rate": 1000.0}),
    ]  # fmt: skip
    link.sent.clear()
    change(document, "angular", "value", None)
    click(document, "impulse")
    assert link.sent == []
    assert "impulse: got 'no number'" in link.history.notices_after(0)[-1].text
    page.send_start({"initial_forcing_phase": 1.0})  # a reset goes back to parameters: set them
    page.set_values({"axial_amplitude": 0.05, "restitution": 0.4})
    motion = {name: in_force(link)[name] for name in MOTION_NAMES}
    assert link.sent == [
        Set({**motion, "initial_forcing_phase": 1.0}), Call("reset"),
        Move({"axial_amplitude": 0.05}), Set({"restitution": 0.4}),
    ]  # fmt: skip
    for name, text, value in (
        ("restitution", "0.4", 0.4),
        ("restitution", "lots", "lots"),
        ("step_periods", "3", 3),
        ("initial_with_platform", "true", True),
        ("gravity", "1e400", math.inf),
    ):
        change(document, "parameter", "value", name)
        title = model(document, "parameter").html_attributes["title"]
        assert title.startswith(parameters.TABLE[name].spelled)
        change(document, "given", "value", text)
        click(document, "set")
        assert link.sent.pop() == Set({name: value})


def test_a_first_toss_is_refused_where_the_disk_would_not_stay_in_period_1() -> None:
    """The programme is the pizza's: a motor of 40 kHz would be sent a motion of 3 Hz."""
    for preset, sent in (("pizza_multiple_toss", True), ("swum", False)):
        link, document = of_preset(preset)
        click(document, "first_toss")
        assert (Perform("first_toss_to_period_1") in link.sent) == sent, preset
        notices = [one for one in link.history.notices_after(0) if one.is_refusal]
        assert len(notices) == (not sent)
    assert (
        "first_toss_to_period_1: got 'Γ = 0.0001009', allowed: a disk for which" in notices[0].text
    )


def test_a_paused_run_is_resumed_and_stepped(document: Document, link: ListLink) -> None:
    link.history.phase = "paused"
    Page(document, link).update()
    assert model(document, "pause").label == "Resume"
    click(document, "pause")
    click(document, "step")
    assert link.sent == [Call("pause", False), Call("step")]


def test_a_refusal_is_shown_once_as_text_and_is_no_alarm_for_ever(
    page: Page, document: Document, link: ListLink
) -> None:
    """A node logs it and answers with it; the next action, or a new run, goes on from it."""

    def shown() -> str:
        for _ in range(6):
            page.update()
        return str(model(document, "messages").text)

    for goes_on in (partial(click, document, "reset"), partial(filled, link)):
        for text in ("real time: 2 s behind", "mass: got <b>", "mass: got <b>"):
            link.history.note(text, is_refusal=True)
        assert len(re.findall(r"\d\d:\d\d:\d\d mass: got &lt;b&gt;", shown())) == 1
        assert shown().count("#b00020") == 2
        link.history.settle("real time: ")
        assert shown().count("#b00020") == 1
        goes_on()
        assert "#b00020" not in shown()
        assert "mass: got &lt;b&gt;" in shown()


def test_a_page_that_draws_nothing_is_not_sent_more(
    page: Page, document: Document, link: ListLink, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A browser that lies hidden acknowledges nothing; one that draws, the end of its axis."""
    clock = [0.0]
    monkeypatch.setattr(run_pane, "time", SimpleNamespace(monotonic=lambda: clock[0]))
    sent = []
    for k in range(60):
        clock[0] += 1 / 30
        row = np.zeros(1, SAMPLE_DTYPE)
        row["time"] = 1.01 + 0.01 * k
        link.history.add_samples(row)
        page.update()
        sent.append(page.run.flow.sent)
    assert sent[-1] <= 5
    change(document, "shown_time", "end", 2.0)
    page.update()
    assert page.run.flow.sent == sent[-1] + 1
    assert model(document, "path").data["time"][-1] == pytest.approx(1.6)


def test_pages_share_a_run_and_each_has_its_own_figures(link: ListLink) -> None:
    pages, documents = Pages(link), (Document(), Document())
    for document in documents:
        pages.make(document)
    for page in pages.open:
        page.update()
    first, second = (model(document, "path").data["time"] for document in documents)
    assert first.tolist() == second.tolist()
    change(documents[0], "restitution", "value_throttled", 0.3)
    link.history.add_values(1.0, {"restitution": 0.3})
    for page in pages.open:
        for _ in range(6):
            page.update()
    assert [model(document, "restitution").value for document in documents] == [0.3, 0.3]


def test_a_strategy_is_started_changed_and_stopped_and_a_scene_begins_with_its_number(
    page: Page, document: Document, link: ListLink
) -> None:
    """Its status is shown, and the strategy that runs, whoever has started it."""
    link.history.add_values(1.0, {"preload": 0.5, "real_time_factor": 0.1})

    def refresh(status: str) -> None:
        link.history.juggling = status
        for _ in range(6):
            page.update()

    refresh("")
    change(document, "strategy", "active", 1)
    assert link.sent == [], "nothing runs that another strategy could take over from"
    click(document, "juggle")
    believed = {"restitution": 0.5, "gravity": 12.0, "real_time_factor": 0.1}
    assert link.sent.pop() == Juggle("impact_time", believed)
    assert "ros2 run bouncing_disk_ros juggle" in model(document, "command_lines").text
    refresh("small: captured after 7 impacts")
    assert link.sent == [], "the page follows what runs"
    assert model(document, "strategy").active == 3
    assert model(document, "juggle").label == "Stop"
    assert "captured after 7 impacts" in model(document, "juggling").text
    change(document, "strategy", "active", 2)
    assert link.sent.pop() == Juggle("deadbeat", believed)
    click(document, "juggle")
    assert link.sent.pop() == StopJuggling()
    refresh("")
    assert model(document, "juggle").label == "Juggle"
    click(document, "scene_doubling")
    assert link.sent == SCENES["doubling"].actions(link.history.own_values())
    assert "Find the Γ of the first doubling" in model(document, "scene_text").text
    click(document, "show_number")
    for thread in threading.enumerate():
        if thread.name.startswith("number of"):
            thread.join(60.0)
    for callback in list(document.session_callbacks):
        if type(callback).__name__ == "NextTickCallback":
            callback.callback()
    assert "It is 0.486." in model(document, "scene_text").text


def test_a_bag_is_shown_with_a_time_slider(tmp_path: Path) -> None:
    document = Document()
    page = Page(document, BagLink(str(period_one_bag(tmp_path / "run", 4.0))))

    def path_end_at(time: float) -> float:
        change(document, "time", "value", time)
        page.update()
        return float(model(document, "path").data["time"][-1])

    page.update()
    click(document, "play")  # it plays from the start: the click holds it
    assert model(document, "play").label == "Play"
    assert path_end_at(2.05) == 2.0, "ten samples a second"
    assert path_end_at(1.1) == 1.1
    assert len(model(document, "section").data["phase"]) == 4  # at 0, T, 2T and 3T
    page.update()
    assert path_end_at(1.1) == 1.1, "it stands"
    shown = " ".join(div.text for div in document.select({"type": Div}))
    assert "title='axial amplitude A'" in shown
    assert "<td>39.7887 mm</td>" in shown


def address_of(document: Document) -> dict[str, str]:
    """Names and texts in the address that a page has given to its browser."""
    (text,) = model(document, "status").tags
    return dict(parse_qsl(text))


def opened(link: ListLink, asked: dict[str, str]) -> tuple[Page, Document]:
    """A page whose browser has asked for an address, some frames later."""
    page = Page(document := Document(), link, asked)
    for _ in range(2 * TEXT_EVERY):
        page.update()
    return page, document


def test_an_address_shows_another_the_same(link: ListLink, monkeypatch: pytest.MonkeyPatch) -> None:
    """Parameters, tab and window; sent to a page whose run is another one, and to its own."""
    monkeypatch.setattr(basin_pane, "COARSE", 8)
    monkeypatch.setattr(basin_pane, "FULL", 16)
    link.history.add_values(1.0, {"restitution": 0.45, "initial_with_platform": False})
    first, document = opened(link, {"token": "secret", "tab": "Basins", "window": "1,1.5,-2,-1.25"})
    first._panes[TABS[0]].show_window((1.0, 1.5, -2.0, -1.25))
    address = address_of(document)
    assert "token" not in address
    other = ListLink()
    filled(other, "swum")
    second, shown = opened(other, address)
    assert other.sent == new_run(held(link), other.history.own_values())
    assert second.tabs.active == 1
    assert second._panes[TABS[0]].ends == (1.0, 1.5, -2.0, -1.25)
    other.history.add_motion(link.history.motions.items[-1])
    other.history.add_values(1.0, held(link))
    for _ in range(TEXT_EVERY):
        second.update()
    assert address_of(shown) == address
    before = len(link.sent)
    opened(link, address)
    assert len(link.sent) == before, "a page that is loaded again goes on with the run"


def held(link: ListLink) -> dict[str, parameters.Value]:
    return {name: link.history.values_at()[name] for name in RUN_NAMES}


@pytest.mark.parametrize(
    ("wrong", "line"),
    [
        ({"restitution": "1.5"}, "restitution: got 1.5, allowed"),
        ({"restitution": "high"}, "restitution: got 'high', allowed"),
        ({"mass": "nan"}, "mass: got nan, allowed"),
        ({"restituton": "0.4"}, "address: got 'restituton', allowed: .* restitution"),
        ({"lockstep": "impact"}, "address: got 'lockstep', allowed"),
        ({"preload": "-1e3"}, "preload: got -1000.0, allowed: a finite number > "),
        ({"tab": "Basin"}, "address tab: got 'Basin', allowed: The run, Basins, Bifurcation"),
        ({"window": "0,1,2"}, "address window: got '0,1,2', allowed: four numbers"),
        ({"window": "0,1,nan,2"}, "address window: got '0,1,nan,2', allowed: four numbers"),
    ],
)
def test_a_wrong_address_is_refused_in_one_line(wrong: dict[str, str], line: str) -> None:
    refused(f"^{line}", read, RIGHT | wrong, ["The run", "Basins", "Bifurcation"])


RIGHT = {"restitution": "0.4", "tab": "Bifurcation", "window": "0.4,0.5,0,1"}


@pytest.mark.parametrize(
    ("wrong", "line"),
    [
        ({"restitution": "1.5"}, "restitution: got 1.5, allowed"),
        ({"window": "1,2,0,1e9"}, "address window: got .*1000000000.0.*, allowed: 0.001 to 1000 "),
        ({"tab": "The run", "window": "0,1,2,3"}, "address window: got '0,1,2,3', allowed: one"),
    ],
)
def test_a_wrong_address_changes_nothing(link: ListLink, wrong: dict[str, str], line: str) -> None:
    page, document = opened(link, RIGHT | wrong)
    (notice,) = link.history.notices_after(0)
    assert re.match(line, notice.text)
    assert notice.is_refusal
    assert link.sent == []
    assert page.tabs.active == 0
    assert "restitution" not in address_of(document), "it has its default"


class ToyPane(TabPane):
    def __init__(self, values: Callable[[], Any], send: Callable[[Any], None]) -> None:
        super().__init__()
        self.layout = Div(text="", name="toy")
        self.values, self.send = values, send

    def _ask(self) -> None:
        """Compute nothing."""

    def parameters_changed(self) -> None:
        self.layout.text += f"{self.values()['restitution']} "
        self.send({"restitution": 0.25})


def test_a_pane_is_its_file_and_one_line(
    document: Document, link: ListLink, monkeypatch: pytest.MonkeyPatch
) -> None:
    module = ModuleType("toy_pane")
    monkeypatch.setattr(module, "ToyPane", ToyPane, raising=False)
    monkeypatch.setitem(sys.modules, f"{page_module.__package__}.toy_pane", module)
    rows = [TabRow(title, "toy_pane.ToyPane", restarts=title == "Toy") for title in ("Toy", "Calm")]
    monkeypatch.setattr(page_module, "TABS", (*TABS, *rows))
    page = Page(document, link)
    page.update()
    titles = [tab.title for tab in page.tabs.tabs]
    assert titles == ["The run", "Basins", "Bifurcation", "Toy", "Calm"]
    assert document.get_model_by_name("toy") is None, "made when it is first seen"
    page.tabs.active = 3
    assert model(document, "toy").text == f"{in_force(link)['restitution']} "
    assert [type(one) for one in link.sent] == [Set, Call]
    page.tabs.active = 4
    assert [type(one) for one in link.sent] == [Set, Call, Set]


def test_each_line_of_tabs_names_a_pane() -> None:
    for tab in TABS:
        module, name = tab.pane.split(".")
        place = import_module(f"{page_module.__package__}.{module}")
        assert issubclass(getattr(place, name), TabPane)
