"""The queue before the writer, and the counting of what was lost."""

from __future__ import annotations

import os
import shutil
import threading
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from mcap.reader import make_reader

from bouncing_disk_ros import bag
from bouncing_disk_ros.bag.recording import Recording
from support.bags import messages, read, write
from support.processes import wait_until


def test_what_was_accepted_is_in_the_bag(tmp_path: Path) -> None:
    sent = list(messages(200))
    writer = bag.Writer(tmp_path / "run", bag.Options(chunk_size=3000))
    recording = Recording(writer, 10**9)
    recording.do(lambda: write(writer, []))
    for row in sent:
        assert recording.put(row.topic, row.data, *row[1:4])
    recording.close()
    assert recording.error is None
    assert recording.recorded.total() == 200
    assert not recording.unrecorded
    assert read(tmp_path / "run") == sent


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


class Broken(str):
    """A text that cannot be written."""

    __slots__ = ()

    def __str__(self) -> str:
        raise ValueError("broken")


@pytest.mark.parametrize("breaks", ["a task", "a message", "the end"])
def test_an_error_of_the_thread_that_writes_ends_in_a_bag(tmp_path: Path, breaks: str) -> None:
    writer = bag.Writer(tmp_path / "run", bag.Options(chunk_size=1000))
    recording = Recording(writer, 10**9)
    recording.do(lambda: writer.add_topic("/a", "std_msgs/msg/String"))
    for number in range(20):
        assert recording.put("/a", bytes(400), number, number, number)
    if breaks == "a task":
        recording.do(lambda: 1 // 0)
    elif breaks == "a message":
        assert recording.put("/a", bytes(400), -1, 0, 0)  # mcap has no time before 1970
    else:
        recording.do(lambda: recording.note({"a note": Broken()}))
    recording.close()
    assert recording.error is not None
    line = str(recording.error)
    assert "recording ended: an error of the recorder itself, " in line
    assert "The bag can be read up to that point" in line
    assert not recording.put("/a", bytes(400), 21, 21, 21)
    with bag.open(tmp_path / "run") as run:
        found = list(run.messages())
        assert run.complete == (breaks != "the end")  # its last notes cannot be written
        assert not run.complete or "rror" in run.notes["ended"]
    assert [row.sequence for row in found] == list(range(len(found)))
    assert len(found) == recording.recorded["/a"] >= 15
    accepted = 21 if breaks == "a message" else 20
    assert recording.unrecorded["/a"] == accepted + 1 - len(found)


@pytest.mark.parametrize("what", ["deleted", "moved", "replaced"])
def test_a_bag_that_is_gone_is_told_at_once_and_not_called_readable(
    tmp_path: Path, what: str
) -> None:
    """Also while nothing is written; nothing is put in its place."""
    folder = tmp_path / "run"
    recording = Recording(bag.Writer(folder), 10**9)
    recording.do(lambda: recording.writer.add_topic("/a", "std_msgs/msg/String"))
    for number in range(20):
        assert recording.put("/a", bytes(400), number, number, number)
    written = threading.Event()
    recording.do(written.set)
    assert written.wait(60.0)
    if what == "deleted":
        shutil.rmtree(folder)
    else:
        folder.rename(tmp_path / "elsewhere")
    if what == "replaced":
        folder.mkdir()
        (folder / "run_0.mcap").write_text("mine")
    wait_until(lambda: recording.error)
    line = str(recording.error)
    assert "run_0.mcap was deleted, moved or replaced; 20 messages that were received are" in line
    assert "can be read up to that point" not in line
    recording.close()
    assert recording.recorded.total() == 0
    assert recording.unrecorded["/a"] == 20
    there = sorted(str(file.relative_to(tmp_path)) for file in tmp_path.rglob("*.*"))
    if what == "replaced":
        assert there == ["elsewhere/run_0.mcap", "run/run_0.mcap"]
        assert (folder / "run_0.mcap").read_text() == "mine"
    if what != "deleted":  # whole, but for metadata.yaml
        with bag.open(tmp_path / "elsewhere" / "run_0.mcap") as run:
            assert run.message_count == 20


def test_a_full_disk_is_told_while_a_chunk_waits(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not only when it is closed: it may be kept for an hour."""
    real, full = os.fstatvfs, threading.Event()

    def measured(descriptor: int) -> Any:
        found = real(descriptor)
        free = 0 if full.is_set() else found.f_bfree
        return SimpleNamespace(f_blocks=found.f_blocks, f_bfree=free, f_bavail=free)

    monkeypatch.setattr(os, "fstatvfs", measured)
    recording = Recording(bag.Writer(tmp_path / "run", bag.Options(chunk_period=3600.0)), 10**9)
    recording.do(lambda: recording.writer.add_topic("/a", "std_msgs/msg/String"))
    full.set()
    assert recording.put("/a", bytes(400), 0, 0, 0)
    wait_until(lambda: recording.error)
    recording.close()
    assert "No space left on device" in str(recording.error)


def written(folder: Path, options: bag.Options, attached: int = 0) -> list[Path]:
    """The files of a bag of 230 messages, all of which are read again."""
    sent = list(messages(230))
    with bag.Writer(folder, options) as writer:
        write(writer, [])
        if attached:
            writer.attach("large", "text/plain", bytes(attached))
        write(writer, sent)
    assert read(folder) == sent
    return sorted(folder.glob("*.mcap"))


def test_no_file_holds_a_head_alone_and_a_large_index_is_closed_with_its_file(
    tmp_path: Path,
) -> None:
    """However small the size is, and whatever is attached later."""
    options = bag.Options(chunk_size=100, max_size=1)
    assert 1 <= len(written(tmp_path / "run", options, attached=10_000)) <= 10
    files = written(tmp_path / "large", bag.Options(chunk_size=500, max_chunks=10))
    assert len(files) > 5
    for file in files:
        with file.open("rb") as stream:
            summary = make_reader(stream).get_summary()
        assert summary is not None
        assert len(summary.chunk_indexes) <= 10
