"""When the workbench starts a simulator."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from bouncing_disk_ros.workbench import workbench_node
from bouncing_disk_ros.workbench.workbench_node import SimulatorKeeper


class FakeChild:
    """A process that runs until `code` is set."""

    def __init__(self, *command: str) -> None:
        self.command = command
        self.code: int | None = None
        self.last_line = ""


@pytest.fixture
def started(monkeypatch: pytest.MonkeyPatch) -> list[FakeChild]:
    """The processes that are started, without a wait for simulators of others."""
    children: list[FakeChild] = []

    def start(*command: str) -> FakeChild:
        children.append(FakeChild(*command))
        return children[-1]

    monkeypatch.setattr(workbench_node, "Child", start)
    monkeypatch.setattr(workbench_node, "SEARCH_SECONDS", -1.0)
    monkeypatch.setattr(workbench_node, "LONG_ENOUGH", 0.0)
    return children


def test_a_simulator_of_somebody_else_that_falls_silent_is_not_replaced(
    started: list[FakeChild],
) -> None:
    link: Any = SimpleNamespace(is_alive=True)
    keeper = SimulatorKeeper(link, "/", "")
    keeper.tick()
    link.is_alive = False
    keeper.tick()
    assert started == []


def test_a_simulator_of_ones_own_is_started_again(started: list[FakeChild]) -> None:
    """Also while its last messages are younger than those that count as silence."""
    notes = SimpleNamespace(note=lambda *_, **__: None)
    link: Any = SimpleNamespace(is_alive=False, history=notes)
    keeper = SimulatorKeeper(link, "/lab", "swum")
    keeper.tick()
    (first,) = started
    assert first.command[0] == "simulator"
    assert {"__ns:=/lab", "preset:=swum"} < {*first.command}
    link.is_alive, first.code = True, -9
    keeper.tick()
    keeper.tick()
    link.is_alive = False
    keeper.tick()
    assert len(started) == 2
