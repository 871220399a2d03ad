"""A run read from its bag: several simulators and runs, lost rows, missing topics, damage."""

from __future__ import annotations

import math
import pickle
from collections.abc import Callable
from copy import deepcopy
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rclpy.serialization import serialize_message
from sensor_msgs.msg import PointCloud2
from trajectory_msgs.msg import JointTrajectory

from bouncing_disk_ros import bag
from bouncing_disk_ros.bag.reader import Message
from bouncing_disk_ros.core.model import IMPACT_DTYPE, Motion, MotionInForce, join_rows
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.nodes.replay.bag_streams import Recorded, replay_bag
from bouncing_disk_ros.nodes.replay.replay_text import verdict
from bouncing_disk_ros.report import read_run
from bouncing_disk_ros.report.message_order import Losses, RunOrder, Sign, in_order_of_sending
from bouncing_disk_ros.report.read_run import BagRun, ReadOptions
from bouncing_disk_ros.ros.to_messages import impacts_to_msg, motion_to_msg
from support.checks import refused, there
from support.recorded import NS, START_NS, RecordedRun, Sent, period_one_bag


def read(folder: Path, **options: Any) -> BagRun:
    with bag.open(folder) as opened:
        run = BagRun(opened, ReadOptions(**options))
        assert sum(1 for _ in run.read()) == run.total or run.source.remarks
        return run


@pytest.fixture(scope="module")
def period_one(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """A bag of period 1 over 12 s, without some topics; each is made once."""

    @cache
    def made(*without: str) -> Path:
        return period_one_bag(tmp_path_factory.mktemp("bags") / "run", without=without)

    return made


def test_a_bag_gives_what_was_simulated(tmp_path: Path) -> None:
    with bag.Writer(tmp_path / "run") as writer:
        made = RecordedRun(writer, preset="pizza_multiple_toss", lose=(2,)).run(6.0)
        disk = made.session.simulation.disk
    run = read(tmp_path / "run")
    record, source = run.record, run.source
    assert record.disk == disk
    assert len(record.states) == len(record.speeds) == 60
    assert record.states[-1].time == 6.0
    assert [report.simulated for report in record.health] == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    assert there(record.health[-1].energy).loss_impact_axial > 0.0
    assert record.lost == 1
    assert np.max(np.diff(record.rows["index"])) == 2.0
    lost = {count.topic: count.lost for count in source.topics}
    assert lost["/disk/impacts"] == "1"
    assert set(lost.values()) == {"0", "1"}
    assert source.missing == ("disk/phase",)
    assert (source.namespace, source.run, source.runs) == ("/", 1, 1)


class Twice(RecordedRun):
    """A run of which each message is recorded twice, as in two recordings that were joined."""

    def _write(self, sent: Sent, received_ns: int) -> None:
        super()._write(sent, received_ns)
        super()._write(sent, received_ns + 1000)


def test_messages_that_are_there_twice_count_once(tmp_path: Path) -> None:
    """Each began another run, because its number does not rise."""
    with bag.Writer(tmp_path / "run") as writer:
        made = Twice(writer, preset="pizza_multiple_toss").run(6.0)
    run = read(tmp_path / "run")
    assert run.source.runs == 1
    assert {count.lost for count in run.source.topics} == {"0"}
    assert run.record.rows.tobytes() == join_rows(made.rows).tobytes()
    assert [state.time for state in run.record.states] == [k / 10 for k in range(1, 61)]
    with bag.open(tmp_path / "run") as opened:
        found = replay_bag(Recorded(opened))
    assert verdict(found) == f"replay identical: {len(run.record.rows)} impacts"


def test_rows_that_no_snapshot_precedes_are_in_the_verdict(tmp_path: Path) -> None:
    with bag.Writer(tmp_path / "run") as writer:
        RecordedRun(writer, preset="pizza_multiple_toss").run(3.0)
        without = RecordedRun(writer, preset="pizza_multiple_toss", start_ns=START_NS + 9 * NS,
                              without=("disk/inputs",)).run(3.0)  # fmt: skip
    with bag.open(tmp_path / "run") as opened:
        found = replay_bag(Recorded(opened))
    left = len(join_rows(without.rows))
    assert verdict(found).endswith(f" impacts, {left} rows not compared")


def test_a_record_of_thinned_samples_is_copied_whole(
    period_one: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A copy appended them one by one, and left some out again."""
    monkeypatch.setattr(read_run, "MOST_SAMPLES", 8)
    record = read_run.read_run(period_one())
    assert 4 <= len(record.states) < 8
    assert deepcopy(record).states == pickle.loads(pickle.dumps(record)).states == record.states


def test_simulators_are_chosen_by_namespace(tmp_path: Path) -> None:
    with bag.Writer(tmp_path / "run") as writer:
        for namespace, restitution in (("", 0.5), ("/left", 0.4), ("/a/b", 0.3)):
            RecordedRun(writer, namespace, restitution=restitution).run(2.0)
    refused("a bag of 3 simulators', allowed: /, /a/b, /left", read, tmp_path / "run")
    with pytest.raises(InputError, match=r"allowed: /, /a/b, /left\. Did you mean /left"):
        read(tmp_path / "run", namespace="leftt")
    for namespace, restitution in (("/", 0.5), ("left", 0.4), ("/a/b/", 0.3)):
        run = read(tmp_path / "run", namespace=namespace)
        assert run.record.disk.restitution == restitution
        assert len(run.record.health) == 2  # those of others are on the same topic


def test_two_simulators_at_once_on_the_same_topics_are_named(tmp_path: Path) -> None:
    """The report counted 25000 lost messages in one of 77 runs, and said no more."""
    with bag.Writer(tmp_path / "run") as writer:
        made = [RecordedRun(writer, preset="pizza_multiple_toss", initial_height=height)
                for height in (0.0, 0.1)]  # fmt: skip
        for one in made:
            one.run(3.0)
    source = read(tmp_path / "run").source
    (mixed,) = [text for text in source.limits if "several simulators" in text]
    assert mixed.endswith("at once on /disk/impacts, /disk/rotor_speed, /joint_states")
    lost = {count.topic: count.lost for count in source.topics}
    assert lost["/joint_states"] == "not countable: several publishers on the topic"


def test_only_impacts_are_enough(period_one: Callable[..., Path]) -> None:
    others = ("disk/inputs", "platform/motion", "joint_states", "disk/rotor_speed", "/diagnostics")
    run = read(period_one(*others))
    assert len(run.record.rows) > 30
    assert math.isnan(run.record.disk.mass)
    assert set(run.source.missing) == {*others, "disk/phase"}
    # stamps are then related to simulated time by the impacts
    assert read(period_one("platform/motion")).record.states[-1].time == pytest.approx(
        12.0, abs=0.1
    )


def test_a_bag_without_a_simulator_is_one_clear_line(tmp_path: Path) -> None:
    with bag.Writer(tmp_path / "empty"):
        pass
    refused("got 'no messages', allowed: a bag with topics of a", read, tmp_path / "empty")
    with bag.Writer(tmp_path / "arm") as writer:
        writer.add_topic("/joint_states", "sensor_msgs/msg/JointState", [bag.OfferedQos()])
        writer.write("/joint_states", bytes(8), START_NS)
    refused("got '/joint_states'", read, tmp_path / "arm")


def rows_with(name: str, *values: float) -> PointCloud2:
    """A message of two impacts, of which one field has these values."""
    rows = np.zeros(2, IMPACT_DTYPE)
    rows["count"], rows["index"], rows["time"] = 1, (0, 1), (0.25, 0.5)
    rows[name] = values
    return impacts_to_msg(rows, START_NS)


def motion_with(**values: Any) -> JointTrajectory:
    """A message of a motion, some fields of which have these values."""
    motion = Motion(axial_amplitude=0.01, angular_amplitude=0.2, frequency=3.0, phase_lag=0.1)
    whole = MotionInForce(0, 0, motion, motion, 0, 0.0)
    return motion_to_msg(whole._replace(**values), START_NS)


@pytest.mark.parametrize(
    ("msg", "said"),
    [
        (rows_with("axial_impulse", 0.0, math.nan), "impacts, axial_impulse: got nan"),
        (rows_with("axial_impulse", 0.0, 1.1e30), "impacts, axial_impulse: got 1.1e\\+30"),
        (rows_with("index", 0.0, 0.5), "impacts, index: got 0.5, allowed: whole numbers"),
        (rows_with("index", 1.0, 1.0), "impacts, index: got 1.0, allowed: an index that rises"),
        (rows_with("cycles", 0.5, 1.0), "impacts, cycles: got 0.5, allowed: whole numbers"),
        (rows_with("cycles", 0.0, 2.0**54), "impacts, cycles: got 1.8.*e\\+16"),
        (rows_with("forcing_phase", -0.1, 0.0), "impacts, forcing_phase: got -0.1"),
        (rows_with("forcing_phase", 0.0, 6.3), "impacts, forcing_phase: got 6.3"),
        (rows_with("count", 1, 0), "impacts, count: got 0"),
        (rows_with("time", 0.5, 0.25), "impacts, time: got 0.25, allowed: times that do not fall"),
        (motion_with(forcing_phase=-0.1), "platform/motion forcing_phase: got -0.1"),
        (motion_with(forcing_phase=6.3), "platform/motion forcing_phase: got 6.3"),
        (motion_with(begin_ns=-1, end_ns=0), "simulated_time: got '-1 to 0 ns'"),
        (motion_with(begin_ns=5, end_ns=4), "simulated_time: got '5 to 4 ns'"),
        (motion_with(begin_ns=1 << 63, end_ns=1 << 63), "simulated_time: got '9.* to 9.* ns'"),
    ],
)
def test_a_message_that_no_simulator_sends_ends_in_one_line(
    tmp_path: Path, msg: Any, said: str
) -> None:
    is_motion = isinstance(msg, JointTrajectory)
    topic = "/platform/motion" if is_motion else "/disk/impacts"
    kind = "trajectory_msgs/msg/JointTrajectory" if is_motion else "sensor_msgs/msg/PointCloud2"
    with bag.Writer(tmp_path / "run") as writer:
        writer.add_topic(topic, kind)
        writer.write(topic, serialize_message(msg), START_NS, sequence=1)
    refused(said, read, tmp_path / "run")


def test_times_and_rows_are_limited_as_asked(period_one: Callable[..., Path]) -> None:
    folder = period_one()
    run = read(folder, begin=3.0, end=6.0)
    assert run.record.rows["time"].min() >= 3.0
    assert run.record.rows["time"].max() < 6.0
    assert [report.simulated for report in run.record.health] == [3.0, 4.0, 5.0]
    assert run.source.limits == ("all before 3 s and from 6 s on, as asked",)
    assert run.source.absence("/diagnostics") == "without messages within these times"
    assert run.source.absence("disk/phase") == "not in this bag"  # of a topic that is missing
    assert read(folder).source.absence("/diagnostics") == "without messages of this run"
    run = read(period_one(), most_rows=10)
    assert run.record.rows["index"].tolist() == list(range(26, 36))  # at 0, 1/3 ... 11 2/3 s
    assert run.record.lost == 0
    assert "the first 26 rows of impacts" in run.source.limits[0]


@pytest.mark.parametrize("without", [(), ("joint_states", "disk/rotor_speed", "/diagnostics")])
@pytest.mark.parametrize(
    ("limits", "given", "why"),
    [
        ({"begin": 100.0, "end": 200.0}, "from 100 s to 200 s", "This time is outside the run."),
        ({"begin": 13.0}, "from 13 s", "This time is outside the run."),
        ({"end": -1.0}, "to -1 s", "This time is outside the run."),
        (
            {"begin": 5.0001, "end": 5.0002},
            "from 5.0001 s to 5.0002 s",
            "There is no message in this time.",
        ),
    ],
)
def test_times_without_anything_say_where_the_run_is(
    period_one: Callable[..., Path], without: tuple[str, ...], limits: dict[str, float],
    given: str, why: str,
) -> None:  # fmt: skip
    folder = period_one(*without)
    times = read(folder).record.rows["time"]
    first = 0.0 if not without else times[0]  # else only the impacts tell
    last = 12.0 if not without else times[-1]
    with pytest.raises(InputError) as caught:
        read(folder, **limits)
    assert caught.value.given == given
    assert caught.value.allowed == f"times within the run, from {first:.3f} s to {last:.3f} s"
    assert caught.value.hint == why


def test_a_damaged_bag_is_reported_up_to_the_damage(tmp_path: Path) -> None:
    with bag.Writer(tmp_path / "run", bag.Options(chunk_size=2000)) as writer:
        RecordedRun(writer, preset="pizza_multiple_toss").run(10.0)
    (file,) = (tmp_path / "run").glob("*.mcap")
    data = bytearray(file.read_bytes())
    data[len(data) // 2] ^= 255
    file.write_bytes(data)
    run = read(tmp_path / "run")
    assert 0 < len(run.record.states) < 100
    assert "what follows is not in this report (bag_recover saves it)" in run.source.remarks[-1]


# --- order and numbers ----------------------------------------------------------------------------
def message(topic: str, received: float, sent: float, number: int = 1) -> Message:
    return Message(topic, round(received * NS), round(sent * NS), number, b"")


def test_messages_come_in_the_order_of_sending() -> None:
    rows = [
        message("b", 10.0, 9.9), message("a", 10.1, 9.8), message("a", 10.2, 9.7),
        message("b", 10.3, 99.0), message("a", 12.0, 11.9),
    ]  # fmt: skip
    order = [rows.index(row) for row in in_order_of_sending(rows)]
    # of one topic the order of reception stays; a sender's clock that is ahead does not count
    assert order == [1, 2, 0, 3, 4]
    latched = [message("motion", 30.0, 25.2), message("inputs", 30.1, 25.1), message("a", 40.0, 40)]
    order = [latched.index(row) for row in in_order_of_sending(latched)]
    assert order == [1, 0, 2]
    times = (100.0, 101.0, 102.0, 102.1, 102.2, 102.3)
    clocks = (100.0, 101.0, 2.0, 2.1, 2.2, 2.3)  # set back by 100 s
    rows = [message("ab"[k % 2], *both) for k, both in enumerate(zip(times, clocks, strict=True))]
    assert [*in_order_of_sending(rows)] == rows  # each topic had its last time before for all


@pytest.mark.parametrize(
    ("numbers", "lost"),
    [
        ((4, 5, 6), "0"),
        ((1, 2, 5, 6), "2"),
        ((1, 2, 1, 2, 4), "1"),
        ((1, 2, 1, 2, 3, 1, 2), "0"),
        ((1, 1, 2, 2, 3, 3), "not countable: several publishers on the topic"),
        ((1, 7, 2, 8, 3, 9), "not countable: several publishers on the topic"),
        ((40, 41, 1, 42, 2, 3, 43), "not countable: several publishers on the topic"),
        # of 300 and of 30 000, each started before the next one
        ((*range(900, 0, -3), 901), "not countable: several publishers on the topic"),
        ((*range(90_000, 0, -3), 90_001), "not countable: several publishers on the topic"),
        ((2**32 - 1,) * 4, "not countable: the middleware does not number messages"),
        ((0, 0, 0), "not countable: the recorder did not number them"),
    ],
)
def test_losses_by_number(numbers: tuple[int, ...], lost: str) -> None:
    losses = Losses()
    for place, number in enumerate(numbers):
        losses.note(message("a", place, place, number))
    assert losses.of("a") == lost


def test_a_gap_in_the_numbers_does_not_show_that_the_run_goes_on() -> None:
    """Late messages of a second run: of one topic the numbers rise, of the next one they fall."""
    order = RunOrder()
    begins, goes_on, nothing = Sign.BEGINS, Sign.GOES_ON, Sign.NOTHING
    signs = [order.take(*shown, []) for shown in (("a", 1), ("b", 1), ("b", 2), ("a", 4), ("b", 2))]
    assert signs == [begins, nothing, goes_on, nothing, begins]


@pytest.mark.parametrize("topic", ["platform/motion", "disk/phase"])
def test_the_next_number_of_a_latched_topic_does_not_show_that_the_run_goes_on(topic: str) -> None:
    """Few messages come on it: the newest one of another run may well have this number."""
    order = RunOrder()
    signs = [order.take(*shown, []) for shown in ((topic, 1), ("a", 9), (topic, 2), ("a", 8))]
    assert signs == [Sign.BEGINS, Sign.NOTHING, Sign.NOTHING, Sign.BEGINS]
