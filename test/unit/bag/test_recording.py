"""The queue before the writer, and the counting of what was lost."""

from __future__ import annotations

import threading
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

from bouncing_disk_ros import bag
from bouncing_disk_ros.bag.loss import UNKNOWN, IndexLoss, SequenceLoss
from bouncing_disk_ros.bag.recording import Recording
from support.bags import TYPES, messages


def test_what_was_accepted_is_in_the_bag(tmp_path: Path) -> None:
    sent = list(messages(200))
    writer = bag.Writer(tmp_path / "run", bag.Options(chunk_size=3000))
    recording = Recording(writer, 10**9)
    for topic, kind in TYPES.items():
        recording.do(lambda topic=topic, kind=kind: writer.add_topic(topic, kind))  # type: ignore[misc]
    for row in sent:
        assert recording.put(row.topic, row.data, *row[1:4])
    recording.close()
    assert recording.error is None
    assert recording.recorded.total() == 200
    assert not recording.unrecorded
    with bag.open(tmp_path / "run") as run:
        assert [tuple(row) for row in run.messages()] == [tuple(row) for row in sent]


def test_what_the_queue_cannot_hold_is_counted(tmp_path: Path) -> None:
    writer, gate = bag.Writer(tmp_path / "run"), threading.Event()
    recording = Recording(writer, 1000)
    recording.do(lambda: writer.add_topic("/a", "std_msgs/msg/String"))
    recording.do(gate.wait)
    taken = [recording.put("/a", bytes(400), number, number, number) for number in range(10)]
    gate.set()
    recording.close()
    assert taken == [True, True, *[False] * 8]
    assert recording.recorded["/a"] == 2
    assert recording.unrecorded == {"/a": 8}


@given(st.sets(st.integers(1, 200), min_size=1))
def test_lost_and_received_make_what_was_sent(received: set[int]) -> None:
    loss = SequenceLoss()
    for number in sorted(received):
        loss.take(number)
    first, last = min(received), max(received)
    assert loss.lost + len(received) == last - first + 1


def test_a_new_publisher_begins_its_own_numbers() -> None:
    loss = SequenceLoss()
    for number in (7, 8, 10):
        loss.take(number)
    assert loss.gap(1) < 0
    loss.restart()
    assert loss.gap(500) == 0
    loss.take(500)
    loss.take(502)
    assert str(loss) == "2"
    loss.gap(UNKNOWN)
    assert str(loss) == "not countable: the middleware does not number messages"


def test_rows_are_counted_by_their_index() -> None:
    rows = IndexLoss()
    rows.take(0, 9, 10)
    rows.take(12, 15, 3)  # two before it, one within it
    rows.take(0, 4, 5)  # a new run
    rows.restart()
    rows.take(100, 100, 1)
    assert rows.lost == 3
