"""A link of the workbench's page to no run: it keeps what is sent, and a history to be filled."""

from __future__ import annotations

from typing import Any

from bokeh.document import Document
from bokeh.events import ButtonClick

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
