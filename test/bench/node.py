"""The simulator as a process: from its start to the first state, lateness of its ticks, its CPU."""

from __future__ import annotations

import signal
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from statistics import median
from typing import Any

import psutil
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectory

from bench.processor import work
from bench.table import Aim, Row, row
from bouncing_disk_ros.ros.numbered_subscription import WithInfo
from bouncing_disk_ros.ros.qos import subscription_to
from bouncing_disk_ros.topics import TOPICS
from support.processes import Process, Starter
from support.ros import Nodes
from support.ros_peer import Peer

CACHED_STARTS = 7
UNCACHED_STARTS = 2
PATIENCE = 180.0  # s, an uncached start on a loaded machine
RATES = (100.0, 500.0, 1000.0)  # Hz
SECONDS = 5  # reports of /diagnostics, one a second, at each rate
PRESET = "preset:=pizza_multiple_toss"


class FirstMessages(Nodes):
    """A node that waits for a simulator and notes when it published and when it was heard."""

    def __init__(self) -> None:
        super().__init__()
        node = self.new_node("waiter")
        self.published_ns = 0  # the latched motion, by the clock of its writer
        self.heard_ns = 0  # the first joint state, by the same clock
        subscription_to(node, "platform/motion", WithInfo(self._on_motion))
        subscription_to(node, "joint_states", self._on_state)

    def _on_motion(self, _: JointTrajectory, info: Mapping[str, Any]) -> None:
        self.published_ns = self.published_ns or info["source_timestamp"]

    def _on_state(self, _: JointState) -> None:
        self.heard_ns = self.heard_ns or time.time_ns()

    def wait(self) -> None:
        """Until both are known."""
        end = time.monotonic() + PATIENCE
        while not (self.published_ns and self.heard_ns):
            assert time.monotonic() < end, f"no state of the simulator within {PATIENCE:g} s"
            self.executor.spin_once(timeout_sec=0.5)  # polling would slow down what is measured


def end(process: Process) -> None:
    """End a simulator and insist that it ended well."""
    assert process.end(signal.SIGINT) == 0, process.output


def one_start(start: Starter, cache: Path | None) -> tuple[float, float, float]:
    """Seconds from a start to the first publication and to a state heard; CPU seconds used."""
    waiter = FirstMessages()
    try:
        begin = time.time_ns()
        env = {} if cache is None else {"NUMBA_CACHE_DIR": str(cache)}
        process = start("simulator", "--ros-args", "-p", PRESET, env=env)
        waiter.wait()
        cpu = sum(psutil.Process(process.pid).cpu_times()[:2])
        end(process)
    finally:
        waiter.close()
    return (waiter.published_ns - begin) * 1e-9, (waiter.heard_ns - begin) * 1e-9, cpu


def measure_starts(start: Starter, fresh: Callable[[], Path]) -> list[Row]:
    """Cold starts with the kernels cached, and with a new and empty cache folder each."""
    one_start(start, None)  # fills the cache, if it is empty
    rows = []
    for what, count, aim in (
        ("cached", CACHED_STARTS, Aim(at_most=work(0.8))),
        ("uncached", UNCACHED_STARTS, Aim(at_most=work(10.0))),
    ):
        caches = [fresh() if what == "uncached" else None for _ in range(count)]
        found = [one_start(start, cache) for cache in caches]
        published, heard, cpu = zip(*found, strict=True)
        rows.append(row("cold start", f"{what}, to the first publication", "s", published, aim))
        rows.append(row("cold start", f"{what}, to the first state received by a peer", "s", heard))
        rows.append(row("cold start", f"{what}, CPU time used until then", "s", cpu))
    return rows


def at_rate(start: Starter, rate: float) -> list[Row]:
    """Lateness and CPU at one state rate, with one subscriber on the other side."""
    topics = {name for name in TOPICS if name not in ("joint_states", "/diagnostics")}
    peer = Peer(without=tuple(topics))
    process = start("simulator", "--ros-args", "-p", PRESET, "-p", f"state_rate:={rate}")
    try:
        for _ in range(2):  # the first second holds the start
            peer.next_diagnostics()
        watched = psutil.Process(process.pid)
        before, begin = watched.cpu_times(), time.monotonic()
        states, reports = len(peer.heard["joint_states"]), []
        for _ in range(SECONDS):
            peer.next_diagnostics()
            reports.append(peer.diagnostic("real time")[2])
        after, elapsed = watched.cpu_times(), time.monotonic() - begin
        states = len(peer.heard["joint_states"]) - states
    finally:
        peer.close()
    end(process)
    used = sum(after[:2]) - sum(before[:2])
    rows = []
    for key in ("p50", "p99", "max"):
        values = [float(report[f"lateness {key} (s)"]) * 1e3 for report in reports]
        aim = Aim(at_most=1.0) if key == "p99" and rate == 1000.0 else None
        rows.append(row("lateness", f"{key} of each second, {rate:g} Hz", "ms", values, aim))
    reached = median(float(report["real_time_factor reached"]) for report in reports)
    rows += [
        row("CPU", f"of one core, {rate:g} Hz", "%", [100.0 * used / elapsed]),
        row("CPU", f"states received in a second, {rate:g} Hz", "1/s", [states / elapsed]),
        row("CPU", f"real-time factor reached, {rate:g} Hz", "1", [reached]),
    ]
    return rows


def of_machine(start: Starter, rate: float) -> list[Row]:
    """Lateness of a bare loop, right after: the share of the machine in that of the node."""
    script = str(Path(__file__).with_name("machine_lateness.py"))
    process = start.command([sys.executable, script, str(rate), str(SECONDS)])
    assert process.wait() == 0, process.output
    values = zip(("p50", "p99", "max"), process.stdout.split(), strict=True)
    return [
        row("lateness", f"{key} of a bare sleeping loop, {rate:g} Hz", "ms", [float(value)])
        for key, value in values
    ]


def measure_rates(start: Starter) -> list[Row]:
    """All rates in turn, each with what the machine does by itself."""
    return [r for rate in RATES for part in (at_rate, of_machine) for r in part(start, rate)]
