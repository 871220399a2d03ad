"""The page of the workbench for one browser: panes put together, and its clock."""

from __future__ import annotations

import html
import math
from collections.abc import Callable, Mapping
from typing import Any

from bokeh.document import Document
from bokeh.layouts import column, row
from bokeh.models import Div, TabPanel, Tabs

from bouncing_disk_ros.topics import MOTION_NAMES
from bouncing_disk_ros.workbench.actions import Call, Move, Sequel, Set
from bouncing_disk_ros.workbench.computed_pane import ComputedPane
from bouncing_disk_ros.workbench.control_pane import ControlPane
from bouncing_disk_ros.workbench.player_pane import PlayerPane
from bouncing_disk_ros.workbench.run_link import RunLink, numbers
from bouncing_disk_ros.workbench.run_pane import RunPane
from bouncing_disk_ros.workbench.scene_pane import ScenePane

TITLE = "Bouncing disk workbench"
FRAME_MS = 33
"""30 frames a second."""
TEXT_EVERY = 6
"""Frames between changes of texts."""


class Pages:
    """Makes a page for each browser on one link; `open` are those that are there."""

    def __init__(self, link: RunLink) -> None:
        self._link = link
        self.open: list[Page] = []

    def make(self, document: Document) -> None:
        """Build a page in a new document; it is forgotten with its session."""
        page = Page(document, self._link)
        self.open.append(page)
        document.on_session_destroyed(lambda _context: self.open.remove(page))


class Page:
    """Builds the panes for a document and updates them; a link is shared by all pages."""

    def __init__(self, document: Document, link: RunLink) -> None:
        self._link, self._history = link, link.history
        self.run = RunPane(link.history)
        self.player = PlayerPane(link) if link.is_recorded else None
        self.scenes: ScenePane | None = None
        self.controls: PlayerPane | ControlPane
        if self.player is None:
            self.controls = ControlPane(link)
            self.scenes = ScenePane(document, link, self.controls)
        else:
            self.controls = self.player
        self._status = Div(text="", sizing_mode="stretch_width", name="status")
        self._count = 0
        self._parameters: dict[str, float] = {}
        self._status_text = ""
        # by the tab
        self._makers: dict[int, Callable[[], ComputedPane]] = {
            1: self._basins,
            2: self._bifurcation,
        }
        self._panes: dict[int, ComputedPane] = {}
        self._holders = {tab: column(sizing_mode="stretch_width") for tab in self._makers}
        self._behind = set(self._makers)  # tabs that have not seen the parameters in force
        self.tabs = Tabs(
            tabs=[
                TabPanel(child=self.run.layout, title="The run"),
                TabPanel(child=self._holders[1], title="Basins"),
                TabPanel(child=self._holders[2], title="Bifurcation"),
            ],
            sizing_mode="stretch_width",
        )
        self.tabs.on_change("active", lambda _attr, _old, _new: self._follow())
        document.title = TITLE
        document.add_root(self._layout())
        document.add_periodic_callback(self.update, FRAME_MS)

    def _basins(self) -> ComputedPane:
        from bouncing_disk_ros.workbench.basin_pane import BasinPane

        return BasinPane(self.values, self.send_start)

    def _bifurcation(self) -> ComputedPane:
        from bouncing_disk_ros.workbench.bifurcation_pane import BifurcationPane

        return BifurcationPane(self.values, self.set_values)

    def _layout(self) -> Any:
        right = column(self.tabs, self.controls.terminal, sizing_mode="stretch_width")
        below = row(self.controls.layout, right, sizing_mode="stretch_width")
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
        active = self.tabs.active
        if active not in self._makers:
            return
        if active not in self._panes:
            self._panes[active] = self._makers[active]()
            self._holders[active].children = [self._panes[active].layout]
        if active in self._behind and self._parameters:
            self._behind.remove(active)
            self._panes[active].parameters_changed()

    def _update_texts(self) -> None:
        history = self._history
        values = history.values_at(self._until)
        self.controls.refresh(values, history.phase)
        found = numbers(values)
        if found != self._parameters:
            self._parameters = found
            self._behind = set(self._makers)
        self._follow()
        text = self._status_line()
        if text != self._status_text:
            self._status_text = self._status.text = text

    def _status_line(self) -> str:
        history = self._history
        time = min(self._until, history.latest)
        phase = "recorded" if self.player else history.phase
        parts = [f"{time:.2f} s", phase, f"{history.impacts_seen} impacts"]
        state = (
            f"<b style='color:#b00020'>{html.escape(history.state)}</b>" if history.state else ""
        )
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
        self.controls.send(Sequel((Set({**motion, **values}), Call("reset"))))

    def set_values(self, values: Mapping[str, float]) -> None:
        """Let the run follow: motions by command, other parameters by their names."""
        motion = {name: value for name, value in values.items() if name in MOTION_NAMES}
        others = {name: value for name, value in values.items() if name not in MOTION_NAMES}
        if motion:
            self.controls.send(Move(motion))
        if others:
            self.controls.send(Set(others))
