"""Pages and panes of the workbench in a document, without a browser and without a run.

A test runs the callbacks, and changes models as a browser does.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from bokeh.document import Document
from bokeh.events import ButtonClick
from bokeh.models import Div

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.parameters import DEFAULTS
from bouncing_disk_ros.workbench.actions import Action, Names
from bouncing_disk_ros.workbench.run_history import RunHistory
from bouncing_disk_ros.workbench.run_link import RunLink


class ListLink(RunLink):
    """Keeps the actions in `sent`."""

    names = Names("/lab/bouncing_disk", "/lab")
    source = "a test"

    def __init__(self) -> None:
        self.history = RunHistory()
        self.sent: list[Action] = []

    def send(self, *actions: Action) -> None:
        self.sent += actions


def change(document: Document, name: str, attribute: str, value: Any) -> None:
    """Change a property of a model as a browser does: by a patch of the document."""
    event = {"kind": "ModelChanged", "model": model(document, name).ref, "attr": attribute}
    document.apply_json_patch({"events": [{**event, "new": value}]})


def model(document: Document, name: str) -> Any:
    """The model of the page with a name."""
    found = document.select_one({"name": name})
    assert found is not None, name
    return found


def click(document: Document, name: str) -> None:
    """Click a button as a browser does."""
    document.callbacks.trigger_event(ButtonClick(model=model(document, name)))


VALUES = {name: value for name, value in DEFAULTS.items() if isinstance(value, float)}
"""The numbers that a run begins with by default."""


class BokehPage:
    """A document with one pane; `settle` stands for the server's loop."""

    def __init__(self, pane: Any) -> None:
        self.pane, self.document = pane, Document()
        self.document.add_root(pane.layout)

    def settle(self) -> None:
        """Run callbacks and wait for the pane's threads until neither has anything to do."""
        while True:
            self.pane.join()
            callbacks = list(self.document.session_callbacks)
            if not callbacks:
                return
            for one in callbacks:
                one.callback()  # which removes itself

    def trigger(self, event: Any) -> None:
        """An event as a browser sends it, and what follows."""
        self.document.callbacks.trigger_event(event)
        self.settle()


class OpenedPane(BokehPage):
    """A pane of a run that a browser has just shown; what it sends is in `sent`, or refused."""

    def __init__(self, kind: type[Any], **changed: float) -> None:
        self.values, self.sent = {**VALUES, **changed}, list[Mapping[str, Any]]()
        self.refusal: InputError | None = None
        super().__init__(kind(lambda: self.values, self._send))
        self.changed()

    def _send(self, parameters: Mapping[str, Any]) -> None:
        if self.refusal:
            raise self.refusal
        self.sent.append(parameters)

    def changed(self, **values: float) -> None:
        """Let the run have other values."""
        self.values |= values
        self.pane.parameters_changed()
        self.settle()

    @property
    def texts(self) -> str:
        """All texts of the pane."""
        return "\n".join(one.text for one in self.document.select({"type": Div}))
