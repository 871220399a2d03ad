"""Which answers and which files a recorder attaches, and what it takes for a snapshot."""

from __future__ import annotations

import os
from array import array
from pathlib import Path
from typing import Any

import pytest
from rcl_interfaces.msg import ParameterValue
from rclpy.serialization import serialize_message
from std_msgs.msg import String

from bouncing_disk_ros import parameters
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.limits import ANSWER_BYTES, PRESET_BYTES
from bouncing_disk_ros.nodes.recorder.attachments import answered, dumped, preset_bytes
from bouncing_disk_ros.nodes.recorder.recorded_topic import installed_class, is_snapshot
from bouncing_disk_ros.run.input_records import to_json
from bouncing_disk_ros.run.session import Session


# --- answers --------------------------------------------------------------------------------------
def test_every_type_of_an_answer_is_taken() -> None:
    values = [
        ParameterValue(type=0),
        ParameterValue(type=1, bool_value=True),
        ParameterValue(type=2, integer_value=-3),
        ParameterValue(type=3, double_value=0.5),
        ParameterValue(type=4, string_value="text"),
        ParameterValue(type=5, byte_array_value=[b"a"]),
        ParameterValue(type=6, bool_array_value=[True]),
        ParameterValue(type=7, integer_array_value=array("q", [1])),
        ParameterValue(type=8, double_array_value=array("d", [0.5])),
        ParameterValue(type=9, string_array_value=["a"]),
    ]
    names = [f"n{place}" for place in range(len(values))]
    found = answered(names, values)
    expected = [None, True, -3, 0.5, "text", [b"a"], [True], [1], [0.5], ["a"]]
    assert list(found.values()) == expected
    assert dumped(found)


@pytest.mark.parametrize(
    ("names", "values", "line"),
    [
        (["a"], [], "get_parameters: got '0 values', allowed: 1, as asked"),
        (["a"], [ParameterValue(type=99)], "unexpected parameter type 99"),
        (["a"], [ParameterValue(type=4, string_value="x" * ANSWER_BYTES)], "at most 100000 bytes"),
        (["a"], [ParameterValue(type=8, double_array_value=[0.0] * 20_000)], "at most 100000"),
        (["a"], [ParameterValue(type=9, string_array_value=["x"] * 20_000)], "at most 100000"),
        (["x" * ANSWER_BYTES], [ParameterValue()], "at most 100000 bytes"),
    ],
)
def test_other_answers_are_refused(names: list[str], values: list[Any], line: str) -> None:
    with pytest.raises(InputError, match=line):
        answered(names, values)


# --- presets --------------------------------------------------------------------------------------
def test_a_preset_is_read_byte_for_byte(tmp_path: Path) -> None:
    content = b"# mine\n/**: {ros__parameters: {restitution: 0.25}}\n"
    (tmp_path / "mine.yaml").write_bytes(content)
    assert preset_bytes(tmp_path / "mine.yaml") == content
    (tmp_path / "link.yaml").symlink_to(tmp_path / "mine.yaml")
    assert preset_bytes(tmp_path / "link.yaml") == content


@pytest.mark.parametrize(
    "kind", ["missing", "folder", "pipe", "device", "large", "secret", "wrong"]
)
def test_what_is_no_preset_is_not_read(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "file.yaml"
    match kind:
        case "folder":
            path.mkdir()
        case "pipe":
            os.mkfifo(path)
        case "device":
            path = Path("/dev/zero")
        case "large":
            path.write_text("/**: {ros__parameters: {}} #" + "x" * PRESET_BYTES)
        case "secret":
            path.write_text("password: 1234")
        case "wrong":
            path.write_text("/**: {ros__parameters: {restitution: 2.0}}")
    with pytest.raises(InputError, match=r"^preset") as caught:
        preset_bytes(path)
    assert "1234" not in caught.value.line


# --- what a message says --------------------------------------------------------------------------
def message(text: str) -> bytes:
    return bytes(serialize_message(String(data=text)))


def test_a_snapshot_of_a_session_is_one() -> None:
    records: list[dict[str, Any]] = []
    session = Session(parameters.complete({}), records.append)
    session.set_paused(True)
    session.snapshot()
    assert [is_snapshot(message(to_json(record))) for record in records] == [True, False, True]
    padded = message(to_json(records[0])) + bytes(3)
    assert is_snapshot(padded)


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"\x00\x01\x00\x00",
        message(""),
        message('{"kind":"snapshot","index":1e400,"time_ns":0}'),
        message('{"index":0,"time_ns":0,"kind":"snapshot","state":1,"parameters":{}}'),
        message('{"index":0,"time_ns":0,"kind":"snapshot","state":' + "[" * 100_000),
        message('{"index":0,"time_ns":0,"kind":"snapshot","state":1e400,"parameters":NaN'),
        message('{"index":0,"time_ns":0,"kind":"snapshot",' + '"a":1,' * 10),
        message('{"index":0,"time_ns":0,"kind":"snapshot","state":{}}')[:-8] + b"\xff\xfe\xfd",
    ],
)
def test_nothing_else_is_one(data: bytes) -> None:
    assert not is_snapshot(data)


@pytest.mark.parametrize(
    "kind",
    ["", "String", "std_msgs/String", "a/b/c/d", "../etc/msg/passwd", "this/msg/Zen", "os/msg/path",
     "std_msgs/msg/../msg/String", "std_msgs/srv/String", "std_msgs/msg/Nothing"],
)  # fmt: skip
def test_a_type_loads_no_module_unless_it_is_installed(
    kind: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(InputError, match="message type"):
        installed_class(kind)
    assert capsys.readouterr().out == ""  # the module `this` prints
