"""The page of the workbench for one browser: panes put together, and its clock."""

from __future__ import annotations

import html
import math
from collections.abc import Mapping
from importlib import import_module
from typing import Any, NamedTuple

from bokeh.document import Document
from bokeh.events import DocumentReady
from bokeh.layouts import column, row
from bokeh.models import CustomJS, Div, TabPanel, Tabs

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.topics import MOTION_NAMES
from bouncing_disk_ros.workbench.actions import Call, Move, Set, new_run
from bouncing_disk_ros.workbench.address import WRITES, read, written
from bouncing_disk_ros.workbench.control_pane import ControlPane
from bouncing_disk_ros.workbench.page_style import BAD, TEMPLATE, THEME, one_column
from bouncing_disk_ros.workbench.player_pane import PlayerPane
from bouncing_disk_ros.workbench.run_history import numbers
from bouncing_disk_ros.workbench.run_link import RunLink
from bouncing_disk_ros.workbench.run_pane import RunPane
from bouncing_disk_ros.workbench.scene_buttons import SceneButtons
from bouncing_disk_ros.workbench.tab import TabPane

TITLE = "Bouncing disk workbench"
FRAME_MS = 33
"""30 frames a second."""
TEXT_EVERY = 6
"""Frames between changes of texts."""


class TabRow(NamedTuple):
    """A tab beside that of the run: its title, and its pane, made when it is first seen.

    `pane`: module and class of a `TabPane`, which is given what gives the parameters in force
    and what sends others. `restarts`: whether the run begins anew with those sent.
    """

    title: str
    pane: str
    restarts: bool


TABS = (
    TabRow("Basins", "basin_pane.BasinPane", restarts=True),
    TabRow("Bifurcation", "bifurcation_pane.BifurcationPane", restarts=False),
)


class Pages:
    """Makes a page for each browser on one link; `open` are those that are there."""

    def __init__(self, link: RunLink) -> None:
        self._link = link
        self.open: list[Page] = []

    def make(self, document: Document) -> None:
        """Build a page in a new document; it is forgotten with its session."""
        page = Page(document, self._link, _asked_for(document))
        self.open.append(page)
        document.on_session_destroyed(lambda _context: self.open.remove(page))


def _asked_for(document: Document) -> dict[str, str]:
    """Names and texts in the address that a browser has asked for."""
    context = document.session_context
    given = context.request.arguments if context is not None and context.request else {}
    return {name: texts[-1].decode("utf-8", "replace") for name, texts in given.items()}


class Page:
    """Builds the panes for a document and updates them; a link is shared by all pages.

    `asked`: names and texts of the address, which are shown once the run is known.
    """

    def __init__(
        self, document: Document, link: RunLink, asked: Mapping[str, str] | None = None
    ) -> None:
        self._link, self._history = link, link.history
        self._asked = dict(asked or {})
        self.run = RunPane(link.history)
        self.player = PlayerPane(link) if link.is_recorded else None
        self.scenes: SceneButtons | None = None
        self.controls: PlayerPane | ControlPane
        if self.player is None:
            self.controls = ControlPane(link)
            self.scenes = SceneButtons(document, link, self.controls)
        else:
            self.controls = self.player
        self._status = Div(text="", sizing_mode="stretch_width", name="status")
        write = CustomJS(args={"status": self._status}, code=WRITES)
        self._status.js_on_change("tags", write)
        document.js_on_event(DocumentReady, write)  # tags that were set before raise no event
        self._count = 0
        self._parameters: dict[str, float] = {}
        self._status_text = ""
        self._panes: dict[TabRow, TabPane] = {}
        self._holders = {tab: column(sizing_mode="stretch_width") for tab in TABS}
        self._behind = set(TABS)  # those that have not seen the parameters in force
        first = TabPanel(child=self.run.layout, title="The run")
        others = [TabPanel(child=self._holders[tab], title=tab.title) for tab in TABS]
        self.tabs = Tabs(tabs=[first, *others], sizing_mode="stretch_width")
        self.tabs.on_change("active", lambda _attr, _old, _new: self._follow())
        document.title = TITLE
        document.template = TEMPLATE
        document.theme = THEME
        document.add_root(self._layout())
        document.add_periodic_callback(self.update, FRAME_MS)

    def _pane(self, tab: TabRow) -> TabPane:
        module, name = tab.pane.split(".")
        make = getattr(import_module(f"{__package__}.{module}"), name)
        pane: TabPane = make(self.values, self.send_start if tab.restarts else self.set_values)
        return pane

    def _layout(self) -> Any:
        right = column(self.tabs, self.controls.terminal, sizing_mode="stretch_width")
        below = row(
            self.controls.layout, right, sizing_mode="stretch_width",
            stylesheets=[one_column("column-reverse")],  # the run, then controls
        )  # fmt: skip
        above = [self._status] if self.scenes is None else [self._status, self.scenes.layout]
        return column(*above, below, sizing_mode="stretch_width")

    def update(self) -> None:
        """One frame."""
        self._count += 1
        self._until = math.inf if self.player is None else self.player.advance()
        self.run.update(self._until)
        if self._count % TEXT_EVERY == 1:
            self._update_texts()

    _until = math.inf
    """Simulated time that is shown, s; inf: the newest."""

    def _follow(self) -> None:
        """Make the pane of the tab that is seen, and tell it of parameters that it has not seen."""
        if not self.tabs.active:
            return
        tab = list(self._holders)[self.tabs.active - 1]
        pane = self._seen(tab)
        if tab in self._behind and self._parameters:
            self._behind.remove(tab)
            pane.parameters_changed()

    def _seen(self, tab: TabRow) -> TabPane:
        """The pane of a tab, which is made when it is first needed."""
        if tab not in self._panes:
            self._panes[tab] = self._pane(tab)
            self._holders[tab].children = [self._panes[tab].layout]
        return self._panes[tab]

    # --- the address
    def _go_to(self, asked: Mapping[str, str]) -> None:
        """Show what an address asks for; what is wrong is refused in one line, nothing changes."""
        titles = [str(tab.title) for tab in self.tabs.tabs]
        try:
            wanted = read(asked, titles)
            active = titles.index(wanted.tab) if wanted.tab else 0
            if wanted.window:
                if not active:
                    raise InputError("address window", asked["window"], "one with a tab of a map")
                self._seen(list(self._holders)[active - 1]).show_window(wanted.window)
        except InputError as error:
            self._history.note(error.line, is_refusal=True)
            return
        values = self._history.values_at()
        if any(values[name] != value for name, value in wanted.parameters.items()):
            self.controls.send(*new_run(wanted.parameters, self._history.own_values()))
        self.tabs.active = active

    def _write_address(self) -> None:
        """Let the browser's address say what is shown."""
        active = int(self.tabs.active)
        values = {} if self.player else self._history.values_at()
        ends = self._seen(list(self._holders)[active - 1]).ends if active else ()
        text = written(values, str(self.tabs.tabs[active].title), ends)
        if self._status.tags != [text]:
            self._status.tags = [text]

    def _update_texts(self) -> None:
        history = self._history
        values = history.values_at(self._until)
        self.controls.refresh(values, history.phase)
        found = numbers(values)
        if found != self._parameters:
            self._parameters = found
            self._behind = set(self._holders)
        self._follow()
        if history.first_values or self.player:  # what is in force is known
            asked, self._asked = self._asked, {}
            if asked:
                self._go_to(asked)
            else:
                self._write_address()
        text = self._status_line()
        if text != self._status_text:
            self._status_text = self._status.text = text

    def _status_line(self) -> str:
        history = self._history
        time = min(self._until, history.latest)
        phase = "recorded" if self.player else history.phase
        parts = [f"{time:.2f} s", phase, f"{history.impacts_seen} impacts"]
        state = f"<b style='color:{BAD}'>{html.escape(history.state)}</b>" if history.state else ""
        return (
            f"<span style='font-size:15px'><b>{TITLE}</b> · {html.escape(self._link.source)} · "
            f"{html.escape(' · '.join(filter(None, parts)))} {state}</span>"
        )

    # --- for the panes of maps
    def values(self) -> dict[str, float]:
        """The parameters in force, by the names of the node."""
        return numbers(self._history.values_at(self._until))

    def send_start(self, values: Mapping[str, float]) -> None:
        """Let the run start from an initial state, with the motion and parameters in force."""
        inforce = self.values()
        motion = {name: inforce[name] for name in MOTION_NAMES}
        self.controls.send(Set({**motion, **values}), Call("reset"))

    def set_values(self, values: Mapping[str, float]) -> None:
        """Let the run follow: motions by command, other parameters by their names."""
        motion = {name: value for name, value in values.items() if name in MOTION_NAMES}
        others = {name: value for name, value in values.items() if name not in MOTION_NAMES}
        if motion:
            self.controls.send(Move(motion))
        if others:
            self.controls.send(Set(others))
