"""Bags of other versions: rows of impacts with one field more, and with one field less."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import PointCloud2, PointField

from bouncing_disk_ros import bag
from bouncing_disk_ros.core.model import IMPACT_DTYPE
from bouncing_disk_ros.errors import ExitCode, InputError
from bouncing_disk_ros.nodes.replay.replay import main as replay
from bouncing_disk_ros.report.impact_text import csv_line
from bouncing_disk_ros.report.report_text import tables
from bouncing_disk_ros.ros.from_messages import impacts_from_msg, lacking_fields
from bouncing_disk_ros.topics import IMPACT_REQUIRED
from support import pinned_results
from support.digest import digest_of

LIVE = Path(__file__).parents[2] / "reference" / "version_0_2_0" / "live"
NAMES = IMPACT_DTYPE.names or ()
Change = Callable[[PointCloud2], None]


@pytest.fixture(autouse=True)
def own_handlers() -> Iterator[None]:
    """The executable `replay` sets handlers of signals: those of pytest come back."""
    kept = {one: signal.getsignal(one) for one in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    yield
    for one, handler in kept.items():
        signal.signal(one, handler)


def more(cloud: PointCloud2) -> None:
    """A field `spin` of 8 bytes behind those of each row."""
    rows = np.frombuffer(cloud.data, np.uint8).reshape(-1, cloud.point_step)
    wider = np.pad(rows, ((0, 0), (0, 8)), constant_values=7)
    field = PointField(name="spin", offset=cloud.point_step, datatype=8, count=1)
    cloud.fields = [*cloud.fields, field]
    cloud.point_step += 8
    cloud.row_step = cloud.width * cloud.point_step
    cloud.data = wider.tobytes()


def less(name: str) -> Change:
    """Without a field, where its bytes stay."""

    def change(cloud: PointCloud2) -> None:
        cloud.fields = [field for field in cloud.fields if field.name != name]

    return change


def changed(folder: Path, change: Change) -> Path:
    """The bag of a simulator with its clouds of impacts changed."""
    with bag.open(LIVE) as old, bag.Writer(folder) as new:
        for message in old.messages():
            data = message.data
            if message.topic == "/disk/impacts":
                cloud = deserialize_message(data, PointCloud2)
                change(cloud)
                data = serialize_message(cloud)
            new.add_topic(message.topic, old.topics[message.topic].type)
            new.write(message.topic, data, *message[1:4])
    return folder


def clouds(path: Path) -> list[PointCloud2]:
    with bag.open(path) as run:
        found = run.messages("/disk/impacts")
        return [deserialize_message(row.data, PointCloud2) for row in found]


def test_a_field_more_is_ignored(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = changed(tmp_path / "run", more)
    for cloud, before in zip(clouds(path), clouds(LIVE), strict=True):
        rows = impacts_from_msg(cloud)
        assert not lacking_fields(cloud)
        for name in NAMES:
            assert rows[name].tobytes() == impacts_from_msg(before)[name].tobytes()
    same = changed(tmp_path / "same", lambda _: None)
    first, second = (pinned_results.report(one) for one in (path, same))
    assert digest_of(pinned_results.table_numbers(first)) == digest_of(
        pinned_results.table_numbers(second)
    )
    assert replay([str(path)]) == ExitCode.REPLAY_DIFFERS
    said = capsys.readouterr().out
    assert "replay equal in what was compared: 25 impacts without spin" in said
    assert "identical" not in said


@pytest.mark.parametrize("name", ["x", "forcing_phase"])
def test_a_field_less_is_nan_and_named(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = changed(tmp_path / "run", less(name))
    for cloud in clouds(path):
        rows = impacts_from_msg(cloud)
        assert lacking_fields(cloud) == (name,)
        assert np.isnan(rows[name]).all()
        assert not any(np.isnan(rows[other]).any() for other in NAMES if other != name)
        assert "nan" in csv_line(rows[0])
    report = pinned_results.report(path)
    assert len(report.rows) == 25
    assert f"impacts without {name}" in str([table.rows for table in tables(report)])
    assert replay([str(path)]) == ExitCode.REPLAY_DIFFERS
    assert f"25 impacts without {name}" in capsys.readouterr().out


@pytest.mark.parametrize("name", IMPACT_REQUIRED)
def test_some_fields_must_be_there(name: str) -> None:
    (cloud, *_) = clouds(LIVE)
    less(name)(cloud)
    with pytest.raises(InputError, match="with count, index, time, kind"):
        impacts_from_msg(cloud)
