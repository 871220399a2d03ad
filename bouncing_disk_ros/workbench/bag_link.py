"""The link of the workbench to a recorded run: everything is there at once."""

from __future__ import annotations

from bouncing_disk_ros import bag
from bouncing_disk_ros.bag import BagError
from bouncing_disk_ros.bag.reader import walking
from bouncing_disk_ros.errors import FailedError
from bouncing_disk_ros.report.message_order import in_order_of_sending
from bouncing_disk_ros.report.read_run import choose, is_there
from bouncing_disk_ros.workbench.actions import Action, Names
from bouncing_disk_ros.workbench.history_reader import HistoryReader
from bouncing_disk_ros.workbench.run_history import RunHistory
from bouncing_disk_ros.workbench.run_link import RunLink

KEPT = 500_000
"""Samples held, the last ones: more than an hour at 100 Hz."""


class BagLink(RunLink):
    """A bag read once. Raises InputError where it has no run that can be shown, BagError."""

    is_recorded = True

    def __init__(self, path: str, namespace: str = "") -> None:
        self.history = RunHistory(KEPT)
        self.source = f"recorded run {path}"
        reader = HistoryReader(self.history)
        with walking("workbench") as watch:
            opened = bag.open(path, watch)
        with opened:
            found = choose(opened, namespace or None).rstrip("/")
            names = {f"{found}/{short}": short for short in reader.handlers}
            names = {name: short for name, short in names.items() if is_there(opened, name, short)}
            try:
                for message in in_order_of_sending(opened.messages(names)):
                    content = opened.decoder(message.topic)(message.data)
                    reader.handlers[names[message.topic]](content)
            except BagError as error:
                self.history.note(f"{error}; what follows is not shown", is_refusal=True)
        self.names = Names(namespace=found or "/")
        if not len(self.history.samples):
            raise FailedError(f"{path}: no joint_states with the motion to place them in time")

    def send(self, *actions: Action) -> None:
        """Say that nothing can be sent."""
        del actions
        self.history.note("a recorded run takes no commands", is_refusal=True)
