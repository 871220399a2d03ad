"""The controls of a recorded run: a time slider, play and pause, and what was in force."""

from __future__ import annotations

import html
import time
from collections.abc import Mapping
from typing import Any

from bokeh.layouts import column
from bokeh.models import Button, Div, RadioButtonGroup, Slider

from bouncing_disk_ros.units import with_prefix
from bouncing_disk_ros.workbench.actions import Action
from bouncing_disk_ros.workbench.control_pane import DISK_CONTROLS, MOTION_CONTROLS
from bouncing_disk_ros.workbench.run_history import numbers
from bouncing_disk_ros.workbench.run_link import RunLink

WIDTH = 320
SPEEDS = (0.02, 0.1, 0.5, 1.0, 5.0)
SHOWN_STEP = 0.1
"""The slider follows in steps of so many seconds of the wall clock."""


class PlayerPane:
    """Plays a recorded run on one page: `time` is what is shown, simulated s."""

    def __init__(self, link: RunLink) -> None:
        self._link = link
        history = link.history
        with history.lock:
            rows = history.samples.rows["time"]
            self.begin = float(rows[0]) if len(rows) else 0.0
            self.end = max(float(rows[-1]) if len(rows) else 1.0, self.begin + 1e-9)
        self.time = self.begin
        self.playing = True
        self._before = time.monotonic()
        self._shown = self._before
        self._text: Mapping[str, float] = {}
        self.slider = Slider(
            start=self.begin, end=self.end, value=self.begin, step=(self.end - self.begin) / 10000,
            title="simulated time (s)", width=WIDTH, format="0.000", name="time",
        )  # fmt: skip
        self.slider.on_change("value", self._on_slider)
        self.play = Button(label="Pause", button_type="primary", width=100, name="play")
        self.play.on_click(self._on_play)
        self.speed = RadioButtonGroup(labels=[f"×{one:g}" for one in SPEEDS], active=3)
        self._values = Div(text="", width=WIDTH)
        self.terminal = Div(text="")
        self.layout = column(self.slider, self.play, self.speed, self._values, width=WIDTH + 15)

    def advance(self) -> float:
        """The time to show now, s."""
        now = time.monotonic()
        passed, self._before = now - self._before, now
        if self.playing:
            self.time = min(self.time + passed * SPEEDS[self.speed.active or 0], self.end)
            if now - self._shown >= SHOWN_STEP:
                self._shown = now
                self.slider.value = self.time
            if self.time >= self.end:
                self._set_playing(False)
        return self.time

    def _on_slider(self, _attr: str, _old: Any, new: float) -> None:
        if new != self.time:  # not what this pane has set
            self.time = min(max(float(new), self.begin), self.end)

    def _on_play(self) -> None:
        if not self.playing and self.time >= self.end:
            self.time = self.begin
        self._set_playing(not self.playing)

    def _set_playing(self, playing: bool) -> None:
        self.playing = playing
        self.slider.value = self.time
        self.play.label = "Pause" if playing else "Play"

    def send(self, *actions: Action) -> None:
        """A recorded run takes nothing: the link says so."""
        self._link.send(*actions)

    def refresh(self, values: Mapping[str, Any], phase: str) -> None:
        """Show what was in force."""
        del phase  # of the end of the bag
        found = numbers(values)
        if found == self._text:
            return
        self._text = found
        rows = []
        for control in (*MOTION_CONTROLS, *DISK_CONTROLS):
            value = with_prefix(control.value(found), control.spec.shown_unit, 6)
            rows.append(
                f"<tr title='{html.escape(control.hover['title'])}'>"
                f"<td>{html.escape(control.label)}</td><td>{html.escape(value)}</td></tr>"
            )
        self._values.text = f"<table style='font-size:13px'>{''.join(rows)}</table>"
