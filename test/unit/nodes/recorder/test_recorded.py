"""What a recorder records: topics by its options, answers and files that it attaches, snapshots."""

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
from bouncing_disk_ros.nodes.recorder.recorder_options import (
    OPTIONS,
    Selection,
    preset_files,
    writer_options,
)
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.run.input_records import to_json
from bouncing_disk_ros.run.session import Session
from support.checks import refused


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
    refused(line, answered, names, values)


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
    refused("message type", installed_class, kind)
    assert capsys.readouterr().out == ""  # the module `this` prints


# --- options --------------------------------------------------------------------------------------
def values(**given: Value) -> dict[str, Value]:
    return {name: spec.checked(given.get(name, spec.default)) for name, spec in OPTIONS.items()}


def selection(**given: Value) -> Selection:
    return Selection(values(**given), lambda name: name if name[0] == "/" else f"/one/{name}")


def test_the_package_s_own_topics_by_default_and_commands_when_asked_for() -> None:
    """A sender that waits for one listener must not find the recorder instead of the simulator."""
    chosen = selection()
    wanted = {"/one/disk/impacts": True, "/diagnostics": True, "/disk/impacts": False,
              "/one/platform/command": False, "/one/disk/impulse": False}  # fmt: skip
    assert {name: chosen.wants(name) for name in wanted} == wanted
    assert chosen.known["/one/disk/inputs"].name == "disk/inputs"
    for asked in (selection(topics="platform/command"), selection(all=True)):
        assert asked.wants("/one/platform/command")


def test_names_regular_expressions_and_exclusions() -> None:
    chosen = selection(topics="joint_states, /scan  camera", regex="/arm/.*", exclude=".*/raw")
    assert [name for name in ("/one/joint_states", "/scan", "/one/camera", "/arm/x", "/arm/x/raw",
                              "/one/disk/impacts", "/my/arm/x") if chosen.wants(name)] == [
        "/one/joint_states", "/scan", "/one/camera", "/arm/x"]  # fmt: skip


def test_lists_are_arrays_or_one_text(tmp_path: Path) -> None:
    for given in (["/a", "/b"], ("/a", "/b"), "/a /b", "/a,/b"):
        values_ = {name: spec.checked(spec.default) for name, spec in OPTIONS.items()}
        values_["topics"] = OPTIONS["topics"].checked(given)
        chosen = Selection(values_, str)
        assert [name for name in ("/a", "/b", "/c") if chosen.wants(name)] == ["/a", "/b"]
    with_blanks = str(tmp_path / "my preset.yaml")
    values_["presets"] = OPTIONS["presets"].checked([with_blanks])
    assert preset_files(values_) == [Path(with_blanks)]
    assert OPTIONS["topics"].checked([""]) == ""  # as an empty list is declared
    refused("It is a string array, not a list", OPTIONS["topics"].checked, [1, 2])


def test_all_but_hidden_ones_are_recorded_in_megabytes() -> None:
    chosen = selection(all=True, exclude="/rosout")
    assert chosen.wants("/anything/at/all")
    assert not chosen.wants("/rosout")
    assert chosen.wants("/rosout_agg")  # the whole name must match
    assert not chosen.wants("/fibonacci/_action/status")
    assert selection(all=True, topics="/a/_b").wants("/a/_b")
    options = writer_options(values(max_size=1.5, compression="lz4"))
    assert (options.max_size, options.compression) == (1_500_000, "lz4")
