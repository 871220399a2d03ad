"""Lockstep for long: the same inputs whatever the machine does, and many gates without a deadlock.

make soak
"""

from __future__ import annotations

import math
import os
import sys
import time
from pathlib import Path

import pytest
from integration.test_lockstep_processes import EDGES, KILLED, VALUES, controller_of_the_page
from integration.test_lockstep_processes import GATES as GATES_HERE

from bouncing_disk_ros.run.gates import Gates, State
from bouncing_disk_ros.run.input_records import Record
from bouncing_disk_ros.units import NS
from support.digest import Digest
from support.lockstep_loop import Loop, digest
from support.processes import Starter
from support.ros_peer import Peer

CONTROLLER = str(Path(__file__).resolve().parents[1] / "support" / "lockstep_controller.py")
RUNS = int(os.environ.get("BOUNCING_DISK_LOCKSTEP_RUNS", "108"))
TRANSPORTS = {"shared memory": "SHM", "UDP": "UDPv4", "both": "DEFAULT"}
"""The transports of Fast DDS, as FASTDDS_BUILTIN_TRANSPORTS calls them."""
LOADS = (0.0, 0.002, 0.02)  # s that the controller sleeps at most before an answer
RUNS_EACH = -(-RUNS // 9)  # of each transport and executor
GATES = int(os.environ.get("BOUNCING_DISK_LOCKSTEP_GATES", "100000"))
SECONDS_PER_GATE = 150.0 / 100_000
INPUTS = 30
DIGESTS: dict[Digest, str] = {}
"""Of all runs, and which was the first with each."""
SIMULATOR = ("simulator", "--ros-args", "-p", "real_time_factor:=0.0", "-p")

pytestmark = [pytest.mark.soak, pytest.mark.timeout(3600)]


@pytest.fixture(params=list(TRANSPORTS))
def transport(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """The transport of the peer of the test, the simulator and the controller."""
    name = str(request.param)
    monkeypatch.setenv("FASTDDS_BUILTIN_TRANSPORTS", TRANSPORTS[name])
    return name


@pytest.mark.parametrize("executor", ["single", "multi", "events"])
def test_runs_under_varying_load_have_one_digest(
    start: Starter, transport: str, executor: str
) -> None:
    if executor == "events":
        pytest.importorskip("rclpy.experimental.events_executor")
    begin = time.monotonic()
    for k in range(RUNS_EACH):
        load = LOADS[k % len(LOADS)]
        DIGESTS.setdefault(digest_of_a_run(start, executor, load), f"{transport}, {executor}, {k}")
        assert len(DIGESTS) == 1, DIGESTS
    took = time.monotonic() - begin
    (digest,) = DIGESTS
    print(f"\n{RUNS_EACH} runs, {transport}, {executor}: {took:.1f} s, digest {digest.numbers}")


def digest_of_a_run(start: Starter, executor: str, load: float) -> Digest:
    """Of the first trajectories that a controller sends, and of all impacts up to the last."""
    peer = Peer()
    simulator = start(*SIMULATOR, "lockstep:=impact")
    peer.settle()  # simulated time stands until the controller is there: nothing is missed
    arguments = (CONTROLLER, "1", str(2 * INPUTS), executor, str(load))
    controller = start.command([sys.executable, "-P", *arguments])

    def inputs() -> list[Record]:
        return [one for one in peer.records if one["kind"] == "trajectory"][:INPUTS]

    def is_heard() -> bool:
        found = inputs()
        last = found[-1]["time_ns"] / NS if len(found) == INPUTS else math.inf
        return last < math.inf and len(peer.rows) > 0 and float(peer.rows["time"][-1]) > last

    peer.spin_until(is_heard, timeout=60.0)
    rows = peer.rows
    assert rows["index"].tolist() == list(range(len(rows)))
    assert len(rows) >= INPUTS
    found = digest(peer.records, rows, INPUTS)
    controller.end()
    assert simulator.end() == 0
    peer.close()
    return found


def test_many_gates_without_a_deadlock(start: Starter) -> None:
    start(*SIMULATOR, "lockstep:=tick", "-p", "axial_amplitude:=0.0")
    controller = start.command([sys.executable, "-P", CONTROLLER, "1", str(GATES), "single", "0"])
    found = controller.wait_for(r"answered (\d+) gates in ([\d.]+) s", timeout=600.0)
    print(found.group(0))
    assert float(found.group(2)) <= SECONDS_PER_GATE * GATES


# --- everything that can be killed, at every edge ------------------------------------------------
ENDS = int(os.environ.get("BOUNCING_DISK_LOCKSTEP_ENDS", "20"))
PAIRS = [(number, edge) for number in (1, 2) for edge in EDGES]
"""Which of two controllers is killed, and where."""


@pytest.mark.parametrize("first", ["simulator", "controllers"])
def test_of_two_controllers_either_is_killed_at_each_edge(
    start: Starter, tmp_path: Path, ros_domain: int, warm_kernels: None, first: str
) -> None:
    """The run is the same, or it stands because nobody can say whose an input is, and says so."""
    page = tmp_path / "controller.py"
    page.write_text(controller_of_the_page(), encoding="utf-8")
    found: dict[str, int] = {}
    expected: Digest | None = None
    for k in range(-1, ENDS):
        number, edge = PAIRS[k % len(PAIRS)]
        loop = Loop(0, numbers="1 2", autostart=first == "simulator", **VALUES)
        others = {one: [sys.executable, "-P", str(page), str(one)] for one in (1, 2)}
        started = [start.command(others[one]) for one in (1, 2) if k < 0 or one != number]
        gate = k % 7
        if k >= 0:
            victim = start.command(
                [sys.executable, "-P", KILLED, str(page), str(number), edge, str(gate)]
            )
        if first != "simulator":
            loop.node.trigger_configure()
            loop.watch()
            loop.node.trigger_activate()
        if k >= 0:
            loop.spin_until(lambda: not victim.running)  # noqa: B023
            started.append(start.command(others[number]))
        run = loop.node.run
        assert run is not None
        gates = run.gates
        assert gates is not None

        def stands(gates: Gates = gates) -> bool:
            return gates.state is State.SURPLUS and gates.is_overdue(time.monotonic_ns())

        loop.spin_until(lambda: loop.gate > GATES_HERE or stands())  # noqa: B023
        if loop.gate > GATES_HERE:
            digest_now = digest(loop.records, loop.rows, 2 * GATES_HERE)
            expected = expected or digest_now
            assert digest_now == expected, (k, number, edge)
            outcome = "same run"
        else:
            assert f"gate {gate}: 3 inputs have come, controllers 1 and 2 announced 2" in (
                run.read().waiting
            )
            outcome = "named"
        found[f"{edge}: {outcome}"] = found.get(f"{edge}: {outcome}", 0) + 1
        loop.close()
        for one in started:
            one.kill()
    print(found)
