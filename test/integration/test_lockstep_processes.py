"""Lockstep between processes: whoever is killed and started again, the run has the same bits.

The controller is the one of docs/closed_loops.md, as it stands there.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from std_srvs.srv import SetBool

from bouncing_disk_ros.run.input_records import Record
from support.digest import Digest
from support.lockstep_loop import Loop, digest
from support.processes import Process, Starter
from support.ros_peer import Peer

ROOT = Path(__file__).resolve().parents[2]
KILLED = str(ROOT / "test" / "support" / "killed_controller.py")
EDGES = ("before the input", "before the answer", "after the answer")
"""Where a controller may be killed at a gate: all of them in test/soak/test_lockstep_runs.py."""
GATES = 12
VALUES = {"lockstep": "tick", "state_rate": 50.0}


def controller_of_the_page() -> str:
    """The source of the controller in docs/closed_loops.md."""
    text = (ROOT / "docs" / "closed_loops.md").read_text("utf-8")
    found = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    (source,) = (block for block in found if "class Controller(Node)" in block)
    return str(source)


@pytest.fixture
def page(tmp_path: Path) -> str:
    path = tmp_path / "controller.py"
    path.write_text(controller_of_the_page(), encoding="utf-8")
    return str(path)


@pytest.fixture
def loop(ros_domain: int, warm_kernels: None) -> Iterator[Loop]:
    made = Loop(0, numbers="1", **VALUES)
    yield made
    made.close()


def end_of(loop: Loop) -> Digest:
    """The digest of a run until it has had so many gates."""
    loop.spin_until(lambda: loop.gate > GATES)
    return digest(loop.records, loop.rows, GATES)


@pytest.fixture(scope="module")
def expected(ros_domain: int, warm_kernels: None) -> Digest:
    """The digest of a run in one process, in which nobody is killed."""
    namespace: dict[str, Any] = {"__name__": "page"}
    exec(controller_of_the_page(), namespace)
    loop = Loop(0, numbers="1", **VALUES)
    try:
        loop.add(namespace["Controller"](1, context=loop.context))
        return end_of(loop)
    finally:
        loop.close()


def killed(start: Starter, page: str, edge: str, gate: int) -> Process:
    """Start a controller that kills itself at an edge of a gate."""
    return start.command([sys.executable, "-P", KILLED, page, "1", edge, str(gate)])


def test_whoever_ends_and_is_started_again_changes_nothing(
    start: Starter, page: str, loop: Loop, expected: Digest
) -> None:
    """A controller is killed between its input and its answer; then the simulator is another one.

    The second controller goes on with the new simulator, whose gates it has answered before. Every
    edge: test/soak/test_lockstep_runs.py.
    """
    process = killed(start, page, "before the answer", 3)
    loop.spin_until(lambda: not process.running)
    assert process.wait() == -9, process.output
    start.command([sys.executable, "-P", page, "1"])
    assert end_of(loop) == expected
    loop.close()
    again = Loop(0, numbers="1", **VALUES)
    try:
        assert end_of(again) == expected
    finally:
        again.close()


@pytest.mark.soak
def test_a_simulator_killed_at_a_gate_and_started_again_begins_anew(
    start: Starter, page: str, expected: Digest
) -> None:
    """The controller goes on with the new one, whose first gates it has answered before."""
    given = [part for name, value in VALUES.items() for part in ("-p", f"{name}:={value}")]
    start.command([sys.executable, "-P", page, "1"])
    for kill in (True, False):
        peer = Peer()
        try:
            simulator = start("simulator", "--ros-args", "-p", "start_paused:=true", *given)
            simulator.wait_for("paused at")
            peer.settle()
            peer.call(SetBool, "pause", SetBool.Request(data=False))

            def inputs() -> list[Record]:
                return [one for one in peer.records if one["kind"] == "trajectory"]  # noqa: B023

            peer.spin_until(lambda: len(inputs()) > GATES)
            assert digest(peer.records, peer.rows, GATES) == expected
            if kill:
                simulator.kill()
        finally:
            peer.close()
