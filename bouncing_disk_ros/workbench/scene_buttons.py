"""The row of scenes on a page: a button each, what it is about, and its number when asked for."""

from __future__ import annotations

import html
import threading
from collections.abc import Callable
from functools import partial
from typing import Any

import xarray  # noqa: F401 (pandas with it: Bokeh must not meet it half imported by a thread)
from bokeh.document import Document
from bokeh.layouts import column, row
from bokeh.models import Button, Div

from bouncing_disk_ros.errors import FailedError, InputError
from bouncing_disk_ros.workbench.control_pane import ControlPane
from bouncing_disk_ros.workbench.page_style import GOOD
from bouncing_disk_ros.workbench.run_link import RunLink
from bouncing_disk_ros.workbench.scene_table import SCENES, Scene, shown_number


class SceneButtons:
    """The scenes of one page."""

    def __init__(self, document: Document, link: RunLink, controls: ControlPane) -> None:
        self._document, self._link, self._controls = document, link, controls
        self._scene: Scene | None = None
        self.buttons = {
            name: Button(label=scene.title, width=126, styles={"margin": "0"}, name=f"scene_{name}")
            for name, scene in SCENES.items()
        }
        for name, button in self.buttons.items():
            button.on_click(partial(self.begin, name))
        self.text = Div(
            text="<i>Scenes: small experiments, each with a number to find.</i>",
            sizing_mode="stretch_width",
            name="scene_text",
            styles={"font-size": "13px"},
        )
        self.answer = Button(label="Show the number", width=140, visible=False, name="show_number")
        self.answer.on_click(self.show)
        self.layout = column(
            row(*self.buttons.values(), styles={"flex-wrap": "wrap"}, sizing_mode="stretch_width"),
            row(self.text, self.answer, sizing_mode="stretch_width"),
            sizing_mode="stretch_width",
        )

    def begin(self, name: str) -> None:
        """Begin a scene: a run of its own."""
        self._scene = scene = SCENES[name]
        for other, button in self.buttons.items():
            button.button_type = "primary" if other == name else "default"
        self._controls.send(*scene.actions(self._link.history.own_values()))
        self.answer.visible = True
        self._write("")

    def _write(self, answer: str) -> None:
        scene = self._scene
        assert scene is not None
        self.text.text = (
            f"{html.escape(scene.text)} <b>Find {html.escape(scene.find)}.</b> "
            f"<b style='color:{GOOD}'>{html.escape(answer)}</b>"
        )

    def show(self) -> None:
        """Show the number, computed in a thread."""
        scene = self._scene
        if scene is None:
            return
        self._write("computing …")
        work: Callable[[], None] = partial(self._compute, scene)
        threading.Thread(target=work, name=f"number of {scene.name}", daemon=True).start()

    def _compute(self, scene: Scene) -> None:
        from bouncing_disk_ros.workbench.scene_numbers import number_of

        try:
            text = f"It is {shown_number(number_of(scene.name), scene.unit)}."
        except (InputError, FailedError) as error:
            text = str(error)
        self._document.add_next_tick_callback(partial(self._arrived, scene, text))

    def _arrived(self, scene: Scene, text: str) -> Any:
        if scene is self._scene:
            self._write(text)
