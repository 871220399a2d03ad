"""A pane of the workbench in a document, without a browser: a test runs its callbacks."""

from __future__ import annotations

from typing import Any

from bokeh.document import Document


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
