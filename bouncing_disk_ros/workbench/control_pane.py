"""The controls of the page, and the table of its sliders.

Each sends what a user would, and its command line is shown.
"""

from __future__ import annotations

import html
import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
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

from bouncing_disk_ros.core.model import Disk, Motion
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.period_one import refuse_unsettled
from bouncing_disk_ros.maps.scales import axial_forcing_of
from bouncing_disk_ros.parameters import AXIAL_FORCING, TABLE, Spec, amplitude_of
from bouncing_disk_ros.run.programmes import ANY_MOTION, FIRST_TOSS, load_programme
from bouncing_disk_ros.sliders import page_spans, slider_of
from bouncing_disk_ros.topics import MOTION_NAMES
from bouncing_disk_ros.units import shown_unit
from bouncing_disk_ros.workbench.actions import (
    Action,
    Call,
    Impulse,
    Move,
    Perform,
    Set,
    lines,
    typed_value,
)
from bouncing_disk_ros.workbench.juggling_controls import JugglingControls
from bouncing_disk_ros.workbench.page_style import BAD, USUAL, one_column
from bouncing_disk_ros.workbench.run_history import Notice, numbers
from bouncing_disk_ros.workbench.run_link import RunLink
from bouncing_disk_ros.workbench.strobe import strobe_rate

FORCING = AXIAL_FORCING.name
"""The slider of Γ, which stands for the axial amplitude that gives it."""
STEPS = 500
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


@dataclass(frozen=True)
class Control:
    """A slider: the parameter or forcing of its name, with a short label."""

    name: str
    label: str

    @property
    def spec(self) -> Spec:
        """Its row in the table of parameters."""
        return AXIAL_FORCING if self.name == FORCING else TABLE[self.name]

    @property
    def hover(self) -> dict[str, str]:
        """HTML attributes that show the word of its symbol under the pointer."""
        spec = self.spec
        said = f": {spec.description}" if spec.group == "disk" else ""  # others: of the start
        return {"title": f"{spec.spelled}{said}"}

    def value(self, values: Mapping[str, float]) -> float:
        """What it stands at, in SI units."""
        return forcing_of(values) if self.name == FORCING else values[self.name]

    def limits(self, values: Mapping[str, float]) -> tuple[float, float]:
        """What its slider goes from and to at these parameters: room to more than double it."""
        value = self.value(values)
        low, high = page_spans(values).get(self.name) or slider_of(self.name, value) or (0.0, 1.0)
        return min(low, 2.0 * value), max(high, 2.0 * value)

    def action(self, given: float, values: Mapping[str, float]) -> Action:
        """What setting it to a number (SI) sends."""
        if self.name == FORCING:
            return Move({"axial_amplitude": amplitude_of(given, values)})
        if self.name in MOTION_NAMES:
            return Move({self.name: given})
        return Set({self.name: given})


MOTION_CONTROLS = (
    Control("axial_amplitude", "A"),
    Control(FORCING, "Γ"),
    Control("frequency", "f"),
    Control("angular_amplitude", "Φ"),
    Control("phase_lag", "θ"),
)
DISK_CONTROLS = (
    Control("restitution", "ε restitution"),
    Control("friction", "μ friction"),
    Control("preload", "P preload"),
    Control("load_torque", "load torque"),
    Control("brake_torque", "brake torque"),
    Control("load_inertia", "load inertia"),
)


def forcing_of(values: Mapping[str, float]) -> float:
    """Γ of parameters by name, 1."""
    return axial_forcing_of(Motion.of(values), Disk.of(values))


class ControlPane:
    """The controls of one page; `refresh` lets them follow what others have changed."""

    def __init__(self, link: RunLink) -> None:
        self._link = link
        self._values: dict[str, float] = {}
        self._sizes: dict[str, float] = {}  # of the units that sliders show
        self._lines: deque[str] = deque(maxlen=SHOWN_LINES)
        self._notices: tuple[Notice, ...] = ()
        self._paused = self._following = False
        self.sliders = {control.name: self._slider(control) for control in self._controls}
        self.command_lines = Div(text="", sizing_mode="stretch_width", name="command_lines")
        self.messages = Div(text="", sizing_mode="stretch_width", name="messages")
        self.terminal = row(
            column(Div(text="<b>The same from a terminal</b>"), self.command_lines,
                   sizing_mode="stretch_width"),
            column(Div(text="<b>What the simulator says</b>"), self.messages,
                   sizing_mode="stretch_width"),
            sizing_mode="stretch_width", stylesheets=[one_column()],
        )  # fmt: skip
        self.juggling = JugglingControls(self.send, WIDTH)
        self.layout = column(
            self._run_buttons(),
            self._slow_motion(),
            self._forcing_choice(),
            *(self.sliders[control.name] for control in MOTION_CONTROLS),
            self._impulse_fields(),
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
        self.pause = Button(label="Pause", button_type="primary", width=75, name="pause")
        self.step = Button(label="Step", width=60, name="step")
        self.reset = Button(label="Reset", width=60, name="reset")
        self.pause.on_click(lambda: self.send(Call("pause", not self._paused)))
        self.step.on_click(self._step)
        self.reset.on_click(lambda: self.send(Call("reset")))
        self.first_toss = Button(label="First toss", width=85, name="first_toss")
        self.first_toss.on_click(self._on_first_toss)
        return row(self.pause, self.step, self.reset, self.first_toss)

    def _slow_motion(self) -> Any:
        labels = [f"×{factor:g}" for factor in SLOWER]
        self.slow = RadioButtonGroup(labels=labels, active=0, width=240, name="slow")
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

    def _impulse_fields(self) -> Any:
        self.axial = Spinner(title="axial N·s", value=0.1, step=0.05, width=95, name="axial")
        self.angular = Spinner(
            title="angular N·m·s", value=0.0, step=0.01, width=95, name="angular"
        )
        self.impulse = Button(label="Give impulse", width=105, align="end", name="impulse")
        self.impulse.on_click(self._on_impulse)
        return row(self.axial, self.angular, self.impulse)

    def _any_parameter(self) -> Any:
        names = [name for name, spec in TABLE.items() if not spec.read_only]
        self.parameter = Select(
            title="any parameter", options=names, value="gravity", width=150, name="parameter"
        )
        self._explain_parameter()
        self.parameter.on_change("value", lambda _attr, _old, _new: self._explain_parameter())
        self.given = TextInput(title="value", width=75, name="given")
        self.set = Button(label="Set", width=60, align="end", name="set")
        self.set.on_click(self._on_set)
        return row(self.parameter, self.given, self.set)

    def _explain_parameter(self) -> None:
        spec = TABLE[self.parameter.value]
        self.parameter.html_attributes = {"title": f"{spec.spelled}: {spec.description}"}

    def _slider(self, control: Control) -> Slider:
        slider = Slider(
            start=0.0,
            end=1.0,
            value=0.0,
            step=0.002,
            title=control.label,
            width=WIDTH - 10,
            name=control.name,
            html_attributes=control.hover,
        )
        slider.on_change("value_throttled", partial(self._on_slider, control))
        return slider

    # --- what they do
    def send(self, *actions: Action) -> None:
        """Send actions and show their command lines."""
        for action in actions:
            self._lines.extendleft(reversed(lines(action, self._link.names)))
        shown = "<br>".join(html.escape(line) for line in self._lines)
        self.command_lines.text = f"<div style='{_TERMINAL}'>{shown}</div>"
        self._link.history.settle()
        self._link.send(*actions)

    def _on_slider(self, control: Control, _attr: str, _old: Any, new: float) -> None:
        if self._following:
            return
        given = float(new) * self._sizes.get(control.name, 1.0)
        self.send(control.action(self._near_start(control, given), self._values))

    def _near_start(self, control: Control, given: float) -> float:
        """The value that the run began with where a slider stands on the step nearest to it.

        Steps are of a slider, so that value may lie between two of them.
        """
        begun = _value(control, numbers(self._link.history.first_values))
        if begun is None:
            return given
        slider, size = self.sliders[control.name], self._sizes.get(control.name, 1.0)
        first, step = slider.start * size, slider.step * size
        is_nearest = math.floor((begun - first) / step + 0.5) == round((given - first) / step)
        return begun if is_nearest else given

    def _on_impulse(self) -> None:
        """Send it, or refuse a field without a number: a browser gives None for it."""
        given = [self.axial.value, self.angular.value]
        if None in given:
            error = InputError(
                "impulse", "no number", "numbers in N·s and N·m·s, such as 0.1 and 0"
            )
            self._link.history.note(error.line, is_refusal=True)
        else:
            self.send(Impulse(*map(float, given)))

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
        pause = () if self._paused else (Call("pause", True),)
        self.send(*pause, Call("step"))

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
        name = self.parameter.value
        self.send(Set({name: typed_value(name, self.given.value.strip())}))

    # --- following the run
    def refresh(self, values: Mapping[str, Any], phase: str) -> None:
        """Let the controls show what is in force, and what the node has said."""
        found = numbers(values)
        was_refused = self._show_notices()
        if found != self._values or was_refused:  # a slider goes back from what was refused
            self._values = found
            factor = found["real_time_factor"]
            self._following = True  # what is set here is no wish of somebody's
            for control in self._controls:
                self._follow(control)
            self.slow.active = SLOWER.index(factor) if factor in SLOWER else None
            self._following = False
        paused = phase == "paused"
        if paused != self._paused:
            self._paused = paused
            self.pause.label = "Resume" if paused else "Pause"
        self.juggling.refresh(found, self._link.history.juggling)

    def _follow(self, control: Control) -> None:
        slider, value = self.sliders[control.name], _value(control, self._values)
        if value is None:
            return
        low, high = control.limits(self._values)
        size, unit = shown_unit(control.spec.shown_unit, 0.5 * max(abs(low), abs(high)))
        shown = f" ({unit})" if unit else ""
        fits = self._sizes.get(control.name) == size and slider.start <= value / size <= slider.end
        if not fits or (slider.end - slider.start) * size > 3.0 * (high - low):
            self._sizes[control.name] = size
            step = (high - low) / size / STEPS
            slider.update(start=low / size, end=high / size, step=step, format=_format(step))
        slider.update(value=value / size, title=f"{control.label}{shown}")
        # else a browser says nothing of a move back to what it was moved to last, or to 0 at first
        slider.set_from_json("value_throttled", value / size)

    def _show_notices(self) -> bool:
        """Show what the node has said; whether a refusal is new."""
        newest = tuple(self._link.history.notices_after(0)[: -SHOWN_NOTICES - 1 : -1])
        if newest == self._notices:
            return False
        before, self._notices = self._notices, newest
        lines = [
            f"<div style='color:{BAD if one.is_refusal else USUAL}'>"
            f"{one.at} {html.escape(one.text)}</div>"
            for one in newest
        ]
        self.messages.text = f"<div style='{_TERMINAL}'>{''.join(lines)}</div>"
        return any(one.is_refusal for one in set(newest) - set(before))


def _value(control: Control, values: Mapping[str, float]) -> float | None:
    """What a slider stands at; None where the parameters are not known, or have none."""
    try:
        return control.value(values)
    except (KeyError, InputError, ZeroDivisionError):
        return None


def _format(step: float) -> str:
    """Digits for a slider, as numbro writes them: as many as its steps need."""
    decimals = 0
    while decimals < 6 and step < 0.999 and round(step * 10**decimals) == 0:
        decimals += 1
    return "0." + "0" * decimals if decimals else "0"
