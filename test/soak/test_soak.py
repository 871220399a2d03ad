"""The simulator for minutes at 40 kHz: nothing grows, nothing lags, no row is missing.

make soak                                      # ten minutes
BOUNCING_DISK_SOAK_MINUTES=60 make soak
"""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterator
from typing import Any

import psutil
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from sensor_msgs.msg import PointCloud2

from bouncing_disk_ros import impacts_from_msg
from bouncing_disk_ros.ros.qos import profile_of
from bouncing_disk_ros.topics import TOPICS
from support.processes import PATIENCE, Process, Starter
from support.ros import Nodes

MINUTES = float(os.environ.get("BOUNCING_DISK_SOAK_MINUTES", "10"))
#: s; by then Fast DDS holds its history of 1000 messages (about 150 MB), 15 s were measured
SETTLING = 30.0
#: B; what allocators may still take afterwards
SLACK = 16 * 2**20

pytestmark = [pytest.mark.soak, pytest.mark.timeout(60 * MINUTES + SETTLING + 120)]


class Listener(Nodes):
    """Counts the rows of disk/impacts and keeps the newest diagnostics."""

    def __init__(self) -> None:
        super().__init__()
        node = self.new_node("soak_listener")
        self.received = 0
        self.missing = 0
        self.next_index: int | None = None
        self.values: dict[str, str] = {}
        for kind, name, callback in (
            (PointCloud2, "disk/impacts", self.count),
            (DiagnosticArray, "/diagnostics", self.keep),
        ):
            node.create_subscription(kind, name, callback, profile_of(TOPICS[name]))

    def count(self, cloud: Any) -> None:
        """Add the rows of one message; within a message none may be missing."""
        index = impacts_from_msg(cloud)["index"]
        first, last = int(index[0]), int(index[-1])
        assert last - first + 1 == len(index)
        if self.next_index is not None:
            assert first >= self.next_index, "a row came twice or too late"
            self.missing += first - self.next_index
        self.received += len(index)
        self.next_index = last + 1

    def keep(self, message: Any) -> None:
        """Keep what the simulator says of itself."""
        for status in message.status:
            self.values.update({pair.key: pair.value for pair in status.values})


@pytest.fixture
def listener(ros_domain: int) -> Iterator[Listener]:
    made = Listener()
    yield made
    made.close()


def hear(listener: Listener, node: Process, seconds: float) -> None:
    """Listen for so long; the first row must come in time, and the simulator must go on."""
    begin = time.monotonic()
    while time.monotonic() < begin + seconds:
        listener.executor.spin_once(timeout_sec=0.2)
        assert node.running, node.output
        assert listener.received or time.monotonic() < begin + PATIENCE, "no impacts arrive"


def test_forty_kilohertz_for_minutes(start: Starter, listener: Listener) -> None:
    node = start("simulator", "--ros-args", "-p", "preset:=swum")
    process = psutil.Process(node.pid)
    hear(listener, node, SETTLING)
    before, rows_before = process.memory_info().rss, listener.received
    hear(listener, node, 60 * MINUTES)
    growth = process.memory_info().rss - before
    rows = listener.received - rows_before
    print(f"\n{listener.received} rows, {listener.missing} missing, {growth / 2**20:.1f} MiB grown")
    print("\n".join(f"  {key}: {value}" for key, value in listener.values.items()))
    assert growth < SLACK + rows, "grows by more than a byte for each impact: a leak"
    assert listener.missing == 0
    assert float(listener.values["real_time_factor reached"]) == pytest.approx(1.0, rel=0.01)
    assert node.end(signal.SIGINT) == 0
    assert node.complaints == []
