"""What waits for a recorder's callbacks is not lost, and a node is asked until it answers."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import String

from bouncing_disk_ros import bag
from bouncing_disk_ros.command_line.stop import Stop
from bouncing_disk_ros.nodes.recorder import attachments, recorder_node
from bouncing_disk_ros.nodes.recorder.attachments import ASKED_TIMES, RunParameters
from bouncing_disk_ros.nodes.recorder.recorded_topic import ReceptionTimes, RecordedTopic
from bouncing_disk_ros.nodes.recorder.recorder_node import Recorder
from bouncing_disk_ros.units import NS
from support.processes import wait_until
from support.ros_peer import Talker

BEST_EFFORT = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)


@pytest.fixture
def topic(talker: Talker) -> Iterator[tuple[RecordedTopic, list[str]]]:
    """The recorded topic /mixed, and the text of each message that it has taken."""
    taken: list[str] = []

    def put(_topic: RecordedTopic, data: bytes, *_: int) -> bool:
        taken.append(data[8:].rstrip(b"\0").decode())
        return True

    node = talker.new_node("recording")
    made = RecordedTopic(node, "/mixed", "std_msgs/msg/String", put)
    made._wanted = (True, False)  # as of a reliable publisher
    made._subscribe()
    yield made, taken
    made.destroy()


def test_a_subscription_that_is_weakened_takes_what_waits_for_it(
    talker: Talker, topic: tuple[RecordedTopic, list[str]]
) -> None:
    recorded, taken = topic
    strong = talker.publisher("/mixed")
    strong.publish(String(data="strong"))
    strong.wait_for_all_acked()
    talker.node.create_publisher(String, "/mixed", BEST_EFFORT)
    wait_until(lambda: len(recorded.publishers()) == 2)
    recorded.follow()
    assert taken == ["strong"]


def test_times_of_reception_do_not_go_back_where_the_clock_is_set_back() -> None:
    """A bag is read in their order: messages of one run would be taken for many runs."""
    clocks = {"wall": 10**18, "steady": 5 * NS}
    times = ReceptionTimes(lambda: clocks["wall"], lambda: clocks["steady"])

    def later(wall_ns: int, steady_ns: int) -> None:
        clocks["wall"] += wall_ns
        clocks["steady"] += steady_ns

    def after(received: int) -> float:
        return (times.of(received) - 10**18) / NS

    later(NS, NS)
    waiting = clocks["wall"] - 10**6
    assert after(waiting) == 0.999
    later(-100 * NS, 0)
    assert after(waiting) == 1.0  # received before the clock was set, taken after
    later(NS, NS)
    assert after(clocks["wall"] - NS // 10) == 1.9
    assert after(0) == 2.0
    later(200 * NS, NS)  # set right again, or the machine has slept
    assert after(clocks["wall"] - 10**6) == 101.999
    later(-NS, NS)
    assert after(clocks["wall"]) == 103.0


def test_a_timer_that_is_due_at_the_end_hides_no_message(
    talker: Talker, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recorder_node, "LOOK_SECONDS", 0.0)  # due in every round
    monkeypatch.setattr(recorder_node, "SPIN_SECONDS", 0.0)  # on a stalled machine one round is all
    recorder = Recorder(
        str(tmp_path / "run"), context=talker.context, use_global_arguments=False,
        parameter_overrides=[Parameter("topics", value=["/words"])],
    )  # fmt: skip
    talker.nodes.append(recorder)
    publisher = talker.node.create_publisher(String, "/words", 100)
    wait_until(lambda: recorder.count_publishers("/words") > 0)
    recorder._look()
    wait_until(lambda: publisher.get_subscription_count() > 0)
    for number in range(20):
        publisher.publish(String(data=str(number)))
    publisher.wait_for_all_acked()
    stop = Stop()
    stop.asked = True
    assert recorder.record(stop) == 0
    with bag.open(tmp_path / "run") as run:
        assert run.topics["/words"].count == 20


@pytest.mark.parametrize("publishers", [0, 1])
def test_a_recorder_that_hears_nothing_says_where_it_listens_and_who_publishes(
    talker: Talker, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, publishers: int
) -> None:
    monkeypatch.setattr(recorder_node, "SILENT_SECONDS", 0.0)
    recorder = Recorder(
        str(tmp_path / "run"), context=talker.context, use_global_arguments=False,
        parameter_overrides=[Parameter("topics", value=["/words"])],
    )  # fmt: skip
    talker.nodes.append(recorder)
    if publishers:
        talker.node.create_publisher(String, "/words", 100)
        wait_until(lambda: recorder.count_publishers("/words") > 0)
        recorder._look()
    said = list[str]()
    logger = SimpleNamespace(info=said.append)
    monkeypatch.setattr(recorder, "get_logger", lambda: logger)
    stop = Stop()
    stop.asked = True
    assert recorder.record(stop) == 0
    domain = f"ROS_DOMAIN_ID {talker.context.get_domain_id()}"
    why = ("no node publishes them", "their publishers have sent nothing")[publishers]
    assert said == [f"waiting for the topics to record in {domain}: {why}"]


class _Futile:
    """A client whose service never answers."""

    def __init__(self) -> None:
        self.asked = 0

    def service_is_ready(self) -> bool:
        return True

    def call_async(self, _request: Any) -> Any:
        self.asked += 1
        return SimpleNamespace(add_done_callback=lambda _: None)


def test_a_node_that_gives_no_answer_is_asked_again_and_named(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    clients, warned = [_Futile(), _Futile()], list[str]()
    info = SimpleNamespace(node_namespace="/", node_name="silent")
    node: Any = SimpleNamespace(
        get_publishers_info_by_topic=lambda _: [info],
        resolve_topic_name=lambda name: name,
        create_client=lambda kind, _: clients["Get" in kind.__name__],
        get_logger=lambda: SimpleNamespace(warning=warned.append),
    )
    monkeypatch.setattr(attachments, "ANSWER_SECONDS", 0.0)
    parameters = RunParameters(node, "/disk/inputs", lambda *_: None)
    for _ in range(2 * ASKED_TIMES):
        parameters.look()
    assert clients[0].asked == ASKED_TIMES
    assert parameters.is_answer_due
    parameters.warn_of_missing()
    (line,) = warned
    assert line.startswith("the parameters of /silent are not attached: it gave no answer")
