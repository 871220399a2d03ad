"""`ros2 bag` reads our bags, and its bags are read here.

Needs a shell in which a ROS 2 installation with ros2bag and rosbag2_storage_mcap is sourced; run it
there with `python3 -m pytest -m interop test/interop/test_ros2_bag.py`. Skipped elsewhere: there
are no wheels of rosbag2.
"""

from __future__ import annotations

import shutil
import signal
from pathlib import Path

import pytest
from std_msgs.msg import String

from bouncing_disk_ros import bag
from support.bags import TYPES, Sent, make, messages
from support.processes import Starter, finished, wait_until
from support.ros import wait_for_message
from support.ros_peer import Talker

pytestmark = pytest.mark.interop


def ros2_bag(*arguments: str) -> str:
    """Run `ros2 bag arguments`; all it printed."""
    done = finished("ros2", "bag", *arguments)
    return done.stdout + done.stderr


@pytest.fixture(scope="module", autouse=True)
def _needs_the_command(ros_domain: int) -> None:
    if shutil.which("ros2") is None:
        pytest.skip("no `ros2` on the PATH: source a ROS 2 installation first")
    done = finished("ros2", "bag", "list", "storage", code=None)
    if done.returncode or "mcap" not in done.stdout:
        pytest.skip("no `ros2 bag` with MCAP: apt install ros-jazzy-ros2bag and -storage-mcap")


@pytest.fixture(params=[False, True], ids=["one file", "split"])
def folder(request: pytest.FixtureRequest, tmp_path: Path, sent: list[Sent]) -> Path:
    return make(tmp_path / "run", sent, max_duration=0.05 if request.param else 0.0)


@pytest.fixture
def sent() -> list[Sent]:
    return list(messages(200))


def test_info_counts_our_messages(folder: Path, sent: list[Sent]) -> None:
    printed = ros2_bag("info", str(folder))
    assert f"Messages: {len(sent)}" in " ".join(printed.split())
    for topic, kind in TYPES.items():
        count = sum(row.topic == topic for row in sent)
        assert f"Topic: {topic} | Type: {kind} | Count: {count}" in " ".join(printed.split())


def test_our_bag_is_played(folder: Path, start: Starter) -> None:
    process = start.command(["ros2", "bag", "play", str(folder), "--loop"])
    heard = wait_for_message(String, "/disk/phase", latched=True)
    assert heard.data.startswith("flight ü")
    process.end(signal.SIGINT)


def test_its_bag_is_read(start: Starter, talker: Talker, tmp_path: Path) -> None:
    target = tmp_path / "its"
    command = ["ros2", "bag", "record", "-s", "mcap", "-o", str(target), "--topics", "/text"]
    process = start.command(command)
    publisher = talker.node.create_publisher(String, "/text", 100)
    wait_until(publisher.get_subscription_count, told=lambda: process.output)
    for number in range(50):
        publisher.publish(String(data=str(number)))
    publisher.wait_for_all_acked()
    process.end(signal.SIGINT)
    with bag.open(target) as run:
        assert run.complete
        assert run.columns("/text", ["data"])["data"].tolist() == [str(n) for n in range(50)]
