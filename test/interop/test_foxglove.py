"""Foxglove's own libraries read our bags (Node.js) and know the settings of our layout (Python).

Bags: every message is that which was sent. The packages for it come from the npm registry into a
temporary folder; without Node.js, npm or a network this is skipped and says so.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import re
import shutil
from pathlib import Path
from typing import Any

import pytest
from rclpy.serialization import deserialize_message

from bouncing_disk_ros.ros.qos import message_class
from support.bags import TYPES, Sent, make, messages
from support.npm import install
from support.processes import finished

pytestmark = [pytest.mark.interop, pytest.mark.timeout(300)]

HERE = Path(__file__).parent
LAYOUT = HERE.parents[1] / "config" / "foxglove_layout.json"


@pytest.fixture(scope="module")
def reader(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The script, with the packages that it needs beside it."""
    folder = tmp_path_factory.mktemp("node")
    install(HERE / "package.json", folder)
    return Path(shutil.copy(HERE / "read_bag.mjs", folder))


@pytest.fixture
def sent() -> list[Sent]:
    return list(messages(200))


def read(reader: Path, files: list[Path]) -> list[dict[str, Any]]:
    """What the script prints of files."""
    return [json.loads(line) for line in finished("node", reader, *files).stdout.splitlines()]


def agree(expected: Any, found: Any, where: str) -> None:
    """AssertionError unless a decoded message is that of ROS, field by field."""
    if hasattr(expected, "get_fields_and_field_types"):
        names = expected.get_fields_and_field_types().keys()
        assert set(found) == set(names), where
        for name in names:
            agree(getattr(expected, name), found[name], f"{where}.{name}")
    elif isinstance(expected, (str, bool)):
        assert found == expected, where
    elif isinstance(expected, (int, float)):
        assert float(found) == float(expected), where
    else:
        assert len(found) == len(expected), where
        for place, (one, other) in enumerate(zip(expected, found, strict=True)):
            agree(one, other, f"{where}[{place}]")


@pytest.mark.parametrize("compression", ["none", "lz4", "zstd"])
def test_foxglove_reads_every_message_as_it_was_sent(
    reader: Path, tmp_path: Path, sent: list[Sent], compression: str
) -> None:
    folder = make(
        tmp_path / "run", sent, compression=compression, max_duration=0.05, chunk_size=9000
    )
    files = sorted(folder.glob("*.mcap"), key=lambda file: int(file.stem.split("_")[1]))
    rows = read(reader, files)
    attached = [row for row in rows if "attachment" in row]
    found = [row for row in rows if "topic" in row]
    assert len(files) > 1
    assert len(attached) == len(files)
    assert len(found) == len(sent)
    for row, other in zip(sent, found, strict=True):
        times = str(row.log_time_ns), str(row.publish_time_ns)
        assert (other["topic"], other["log_time"], other["publish_time"]) == (row.topic, *times)
        assert other["sequence"] == row.sequence
        assert other["sha256"] == hashlib.sha256(row.data).hexdigest()
        message = deserialize_message(row.data, message_class(TYPES[row.topic]))
        agree(message, other["content"], row.topic)


CONFIGS = {
    "Plot": "PlotConfig", "3D": "ThreeDeeConfig", "StateTransitions": "StateTransitionsConfig",
    "RawMessages": "RawMessagesConfig", "Publish": "PublishConfig",
    "CallService": "ServiceCallConfig", "RosOut": "LogConfig",
    "DiagnosticSummary": "DiagnosticsSummaryConfig", "Parameters": "", "Tab": "",
}  # fmt: skip
"""Kinds of panels as a layout's file names them, with the classes of their settings in the SDK."""


def settings_of(kind: Any) -> set[str]:
    """The names of a class of settings, as the file spells them."""
    return {
        re.sub(r"_(\w)", lambda match: match[1].upper(), field.name)
        for field in dataclasses.fields(kind)
    }


def test_foxgloves_sdk_knows_each_setting_of_the_layout() -> None:
    """Settings of its own title and of what is older than the SDK aside."""
    layouts = pytest.importorskip("foxglove.layouts", reason="pip install foxglove-sdk")
    panels = json.loads(LAYOUT.read_text("utf-8"))["configById"]
    assert {name.partition("!")[0] for name in panels} == CONFIGS.keys()
    series = settings_of(layouts.PlotSeries), settings_of(layouts.StateTransitionsSeries)
    for name, panel in panels.items():
        kind = name.partition("!")[0]
        if not CONFIGS[kind]:
            continue
        known = settings_of(getattr(layouts, CONFIGS[kind])) | {"foxglovePanelTitle"}
        assert panel.keys() <= known, name
        for path in panel.get("paths", ()):
            assert path.keys() <= series[kind == "StateTransitions"], name
        for layer in panel.get("layers", {}).values():
            assert layer.keys() <= settings_of(layouts.BaseRendererGridLayerSettings), name
    cloud = panels["3D!scene"]["topics"]["/disk/impacts"]
    assert cloud.keys() <= settings_of(layouts.BaseRendererPointCloudTopicSettings)
    camera = panels["3D!scene"]["cameraState"]
    assert camera.keys() <= settings_of(layouts.ThreeDeeCameraState)
