"""The controls of a page for juggling: a strategy, start and stop, and how the loop stands."""

from __future__ import annotations

import html
from collections.abc import Callable, Mapping
from typing import Any

from bokeh.layouts import column, row
from bokeh.models import Button, Div, RadioButtonGroup

from bouncing_disk_ros.workbench.actions import Action, Juggle, StopJuggling
from bouncing_disk_ros.workbench.page_style import BAD, GOOD, USUAL

STRATEGIES = {
    "none": "open loop",
    "impact_time": "impact times",
    "deadbeat": "deadbeat",
    "small": "small",
}
"""The strategies of `juggle`, with what is written on the buttons."""
_FIRST = "deadbeat"
_IDLE = "Keep the toss going; disturb it by an impulse."


class JugglingControls:
    """Buttons of one page; `send` gets their actions. Attribute: `layout`."""

    def __init__(self, send: Callable[[Action], None], width: int) -> None:
        self._send = send
        self._values: Mapping[str, float] = {}
        self._status = ""
        self._following = False
        self.strategy = RadioButtonGroup(
            labels=list(STRATEGIES.values()), active=list(STRATEGIES).index(_FIRST), width=width,
            name="strategy",
        )  # fmt: skip
        self.strategy.on_change("active", lambda _attr, _old, new: self._on_strategy(new))
        self.juggle = Button(label="Juggle", width=80, name="juggle")
        self.juggle.on_click(self._on_juggle)
        self.status = Div(text=_IDLE, width=width - 95, height=34, align="center", name="juggling")
        self.layout = column(self.strategy, row(self.juggle, self.status))

    @property
    def _is_running(self) -> bool:
        return bool(self._status)

    def _on_juggle(self) -> None:
        self._send(StopJuggling() if self._is_running else self._start())

    def _on_strategy(self, new: int | None) -> None:
        """Another strategy takes over at once where one runs."""
        if self._is_running and not self._following and new is not None:
            self._send(self._start())

    def _start(self) -> Juggle:
        return juggle_with(list(STRATEGIES)[self.strategy.active or 0], self._values)

    def refresh(self, values: Mapping[str, float], status: str) -> None:
        """Follow the parameters in force and the status of a loop, whoever has started it."""
        self._values = values
        if status == self._status:
            return
        self._status = status
        name, _, text = status.partition(": ")
        if name in STRATEGIES:
            self._following = True  # what is set here is no wish of somebody's
            self.strategy.active = list(STRATEGIES).index(name)
            self._following = False
        self.juggle.label = "Stop" if status else "Juggle"
        self.juggle.button_type = "primary" if status else "default"
        shown = html.escape(text if name in STRATEGIES else status)
        self.status.text = f"<b style='color:{_color(text)}'>{shown}</b>" if status else _IDLE


def juggle_with(strategy: str, values: Mapping[str, float]) -> Juggle:
    """The loop of a strategy that believes the parameters in force."""
    options = {
        "restitution": values["restitution"],
        "gravity": values["gravity"] + values["preload"] / values["mass"],
    }
    if values["real_time_factor"] != 1.0:
        options["real_time_factor"] = values["real_time_factor"]
    return Juggle(strategy, options)


def _color(text: str) -> Any:
    if text.startswith("captured"):
        return GOOD
    return BAD if text.startswith(("lost", "cannot")) else USUAL
