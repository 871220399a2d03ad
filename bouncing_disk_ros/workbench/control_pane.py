"""The controls on a page: each sends what a user would, and its command line is shown."""

from __future__ import annotations

import html
from collections import deque
from collections.abc import Mapping
from functools import partial
from typing import Any

from bokeh.layouts import column, row
from bokeh.models import (
    Button,
    Div,
    RadioButtonGroup,
    Select,
    Slider,
    Spinner,
    TextInput,
)

from bouncing_disk_ros.core.model import Disk
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.scales import refuse_unsettled
from bouncing_disk_ros.parameters import TABLE, spec_of
from bouncing_disk_ros.run.programmes import ANY_MOTION, FIRST_TOSS, load_programme
from bouncing_disk_ros.workbench.actions import (
    Action,
    Call,
    Impulse,
    Perform,
    Sequel,
    Set,
    lines,
)
from bouncing_disk_ros.workbench.control_table import (
    DISK_CONTROLS,
    FORCING,
    MOTION_CONTROLS,
    STEPS,
    Control,
    shown_unit,
)
from bouncing_disk_ros.workbench.juggling_controls import JugglingControls
from bouncing_disk_ros.workbench.run_link import RunLink, numbers
from bouncing_disk_ros.workbench.strobe import strobe_rate

WIDTH = 320
SLOWER = (1.0, 0.5, 0.2, 0.1, 0.02)
"""Real-time factors of the buttons."""
RATE = 100.0
"""Samples of joint_states in one second of the wall clock, Hz; slow motion needs more in one
simulated second."""
SHOWN_LINES, SHOWN_NOTICES = 40, 8
_TERMINAL = (
    "font:11px monospace;background:#f4f4f4;padding:6px;max-height:130px;overflow:auto;"
    "overflow-wrap:anywhere;user-select:text"
)


class ControlPane:
    """The controls of one page; `refresh` lets them follow what others have changed."""

    def __init__(self, link: RunLink) -> None:
        self._link = link
        self._values: dict[str, float] = {}
        self._sizes: dict[str, float] = {}  # of the units that sliders show
        self._lines: deque[str] = deque(maxlen=SHOWN_LINES)
        self._notice = 0
        self._notices: deque[str] = deque(maxlen=SHOWN_NOTICES)
        self._paused = self._following = False
        self.sliders = {control.name: self._slider(control) for control in self._controls}
        self.command_lines = Div(text="", sizing_mode="stretch_width", name="command_lines")
        self.messages = Div(text="", sizing_mode="stretch_width", name="messages")
        self.terminal = row(
            column(Div(text="<b>The same from a terminal</b>"), self.command_lines,
                   sizing_mode="stretch_width"),
            column(Div(text="<b>What the simulator says</b>"), self.messages,
                   sizing_mode="stretch_width"),
            sizing_mode="stretch_width",
        )  # fmt: skip
        self.juggling = JugglingControls(self.send, WIDTH)
        self.layout = column(
            self._run_buttons(),
            self._slow_motion(),
            self._forcing_choice(),
            *(self.sliders[control.name] for control in MOTION_CONTROLS),
            self._tosses(),
            self.juggling.layout,
            *(self.sliders[control.name] for control in DISK_CONTROLS),
            self._any_parameter(),
            width=WIDTH + 15,
        )

    @property
    def _controls(self) -> tuple[Control, ...]:
        return (*MOTION_CONTROLS, *DISK_CONTROLS)

    # --- what is on the page
    def _run_buttons(self) -> Any:
        self.pause = Button(label="Pause", button_type="primary", width=100, name="pause")
        self.step = Button(label="Step", width=90, name="step")
        self.reset = Button(label="Reset", width=90, name="reset")
        self.pause.on_click(lambda: self.send(Call("pause", not self._paused)))
        self.step.on_click(self._step)
        self.reset.on_click(lambda: self.send(Call("reset")))
        return row(self.pause, self.step, self.reset)

    def _slow_motion(self) -> Any:
        labels = [f"×{factor:g}" for factor in SLOWER]
        self.slow = RadioButtonGroup(labels=labels, active=0, width=WIDTH - 80, name="slow")
        self.slow.on_change("active", self._on_slow)
        self.strobe = Button(label="Strobe", width=70, name="strobe")
        self.strobe.on_click(self._on_strobe)
        return row(self.slow, self.strobe)

    def _forcing_choice(self) -> Any:
        self.choice = RadioButtonGroup(
            labels=["amplitude A", "forcing Γ"], active=1, width=WIDTH, name="choice"
        )
        self.choice.on_change("active", lambda _attr, _old, _new: self._show_choice())
        self._show_choice()
        return self.choice

    def _show_choice(self) -> None:
        self.sliders["axial_amplitude"].visible = self.choice.active == 0
        self.sliders[FORCING].visible = self.choice.active == 1

    def _tosses(self) -> Any:
        self.axial = Spinner(title="impulse N·s", value=0.1, step=0.05, width=95, name="axial")
        self.angular = Spinner(title="N·m·s", value=0.0, step=0.01, width=85, name="angular")
        self.impulse = Button(label="Give impulse", width=105, align="end", name="impulse")
        self.impulse.on_click(
            lambda: self.send(Impulse(float(self.axial.value or 0), float(self.angular.value or 0)))
        )
        self.first_toss = Button(label="First toss", width=WIDTH, name="first_toss")
        self.first_toss.on_click(self._on_first_toss)
        return column(self.first_toss, row(self.axial, self.angular, self.impulse))

    def _any_parameter(self) -> Any:
        names = [name for name, spec in TABLE.items() if not spec.read_only]
        self.parameter = Select(
            title="any parameter", options=names, value="gravity", width=150, name="parameter"
        )
        self.given = TextInput(title="value", width=75, name="given")
        self.set = Button(label="Set", width=60, align="end", name="set")
        self.set.on_click(self._on_set)
        return row(self.parameter, self.given, self.set)

    def _slider(self, control: Control) -> Slider:
        slider = Slider(
            start=0.0,
            end=1.0,
            value=0.0,
            step=0.002,
            title=control.label,
            width=WIDTH,
            name=control.name,
        )
        slider.on_change("value_throttled", partial(self._on_slider, control))
        return slider

    # --- what they do
    def send(self, action: Action | Sequel) -> None:
        """Send an action and show its command lines."""
        self._lines.extendleft(reversed(lines(action, self._link.names)))
        shown = "<br>".join(html.escape(line) for line in self._lines)
        self.command_lines.text = f"<div style='{_TERMINAL}'>{shown}</div>"
        self._link.send(action)

    def _on_slider(self, control: Control, _attr: str, _old: Any, new: float) -> None:
        given = float(new) * self._sizes.get(control.name, 1.0)
        self.send(control.action(given, self._values))

    def _on_first_toss(self) -> None:
        """Send it, or say why the disk in force would not stay in the orbit that it is for."""
        try:
            if set(Disk._fields) <= self._values.keys():  # before they are known nothing is refused
                toss = load_programme(FIRST_TOSS)
                refuse_unsettled(FIRST_TOSS, toss.targets(ANY_MOTION)[-1][1], Disk.of(self._values))
        except InputError as error:
            self._link.history.note(error.line, is_refusal=True)
            return
        self.send(Perform(FIRST_TOSS))

    def _step(self) -> None:
        pause: tuple[Action, ...] = () if self._paused else (Call("pause", True),)
        self.send(Sequel((*pause, Call("step"))))

    def _on_slow(self, _attr: str, _old: Any, new: int | None) -> None:
        if not self._following and new is not None:
            factor = SLOWER[new]
            self.send(Set({"real_time_factor": factor, "state_rate": RATE / factor}))

    def _on_strobe(self) -> None:
        values = self._values
        factor = values["real_time_factor"]
        rate = strobe_rate(values["frequency"], RATE / (factor or 1.0), factor)
        self.send(Set({"state_rate": rate}))

    def _on_set(self) -> None:
        """Send what was typed as it is; a text that is no number goes as a text, to be refused."""
        name, text = self.parameter.value, self.given.value.strip()
        kind = spec_of(name).type
        value: Any = text
        if kind is bool and text.lower() in ("true", "false"):
            value = text.lower() == "true"
        elif kind in (int, float):
            try:
                value = kind(text)
            except ValueError:
                value = text
        self.send(Set({name: value}))

    # --- following the run
    def refresh(self, values: Mapping[str, Any], phase: str) -> None:
        """Let the controls show what is in force, and what the node has said."""
        found = numbers(values)
        if found != self._values:
            self._values = found
            for control in self._controls:
                self._follow(control)
            factor = found["real_time_factor"]
            self._following = True  # what is set here is no wish of somebody's
            self.slow.active = SLOWER.index(factor) if factor in SLOWER else None
            self._following = False
        paused = phase == "paused"
        if paused != self._paused:
            self._paused = paused
            self.pause.label = "Resume" if paused else "Pause"
        self.juggling.refresh(found, self._link.history.juggling)
        self._show_notices()

    def _follow(self, control: Control) -> None:
        slider = self.sliders[control.name]
        try:
            value = control.value(self._values)
        except (InputError, ZeroDivisionError):
            return
        low, high = control.limits(self._values)
        size, unit = shown_unit(control.unit, max(abs(low), abs(high)))
        shown = f" ({unit})" if unit else ""
        fits = self._sizes.get(control.name) == size and slider.start <= value / size <= slider.end
        if not fits or (slider.end - slider.start) * size > 3.0 * (high - low):
            self._sizes[control.name] = size
            step = (high - low) / size / STEPS
            slider.update(start=low / size, end=high / size, step=step, format=_format(step))
        slider.update(value=value / size, title=f"{control.label}{shown}")

    def _show_notices(self) -> None:
        new = self._link.history.notices_after(self._notice)
        if not new:
            return
        self._notice = new[-1].number
        for notice in new:
            color = "#b00020" if notice.is_refusal else "#444"
            self._notices.appendleft(f"<div style='color:{color}'>{html.escape(notice.text)}</div>")
        self.messages.text = f"<div style='{_TERMINAL}'>{''.join(self._notices)}</div>"


def _format(step: float) -> str:
    """Digits for a slider, as numbro writes them: as many as its steps need."""
    decimals = 0
    while decimals < 6 and step < 0.999 and round(step * 10**decimals) == 0:
        decimals += 1
    return "0." + "0" * decimals if decimals else "0"
