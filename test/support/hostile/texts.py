"""Hostile texts: metadata.yaml, quality of service, notes, names, definitions of messages."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from bouncing_disk_ros.bag.notes import signed
from support.hostile.base import NOTES, content, enter_forged, entry, messages, put
from support.hostile.files import FILES
from support.mcap_bytes import Sent, forged

_LAUGHS = "a: &a [x,x,x,x,x,x,x,x,x]\n" + "".join(
    f"{new}: &{new} [{','.join(f'*{old}' for _ in range(9))}]\n"
    for old, new in zip("abcdefgh", "bcdefghi", strict=True)
)


def _metadata(**changes: Any) -> str:
    fields = {
        "version": "9", "storage_identifier": "mcap", "compression_mode": "''",
        "relative_file_paths": "[run_0.mcap]", "custom_data": "{}", "message_count": "1",
        "duration": "{nanoseconds: 1}", "starting_time": "{nanoseconds_since_epoch: 1}",
        "topics_with_message_count": "[]", "compression_format": "''", "files": "[]",
        "ros_distro": "jazzy",
    }  # fmt: skip
    lines = "".join(f"  {key}: {value}\n" for key, value in {**fields, **changes}.items())
    return f"rosbag2_bagfile_information:\n{lines}"


METADATA: dict[str, str | bytes] = {
    "laughs": _LAUGHS,
    "deep lists": "[" * 100_000,
    "deep mappings": "{a: " * 100_000,
    "deep blocks": "- " * 100_000,
    "deep keys": "? " * 100_000,
    "an alias": _metadata(relative_file_paths="&a [run_0.mcap]", custom_data="{a: *a}"),
    "a merge": _metadata(custom_data="{<<: {a: 1}}"),
    "a program": "!!python/object/apply:os.system ['touch HACKED']",
    "a program inside": _metadata(custom_data="{a: !!python/name:os.system ''}"),
    "a number too long": _metadata(version="9" * 100_000),
    "sixties": _metadata(version=":".join(["1"] * 100_000)),
    "a date": _metadata(version="2001-99-99"),
    "too large": "# " + "x" * (9 << 20),
    "many values": _metadata(custom_data="[" + "a," * 400_000 + "]"),
    "not UTF-8": b"\xff\xfe\xfa",
    "a zero byte": b"rosbag2_bagfile_information: {}\0",
    "a key twice": _metadata() + _metadata(),
    "a list as a key": "? [a]\n: b\n",
    "two documents": _metadata() + "---\n" + _metadata(),
    "a parent": _metadata(relative_file_paths="[../../etc/passwd]"),
    "a parent within": _metadata(relative_file_paths="[a/../../run/run_0.mcap]"),
    "a path from the root": _metadata(relative_file_paths="[/etc/passwd]"),
    "no name": _metadata(relative_file_paths="['']"),
    "a dot": _metadata(relative_file_paths="['.']"),
    "a zero byte in a name": _metadata(relative_file_paths='["a\\0b"]'),
    "a name too long": _metadata(relative_file_paths=f"[{'a' * 5000}]"),
    "a file twice": _metadata(relative_file_paths="[run_0.mcap, ./run_0.mcap]"),
    "many files": _metadata(relative_file_paths=str([f"{n}.mcap" for n in range(120_000)])),
    "other storage": _metadata(storage_identifier="sqlite3"),
    "compressed files": _metadata(compression_mode="FILE"),
    **{
        f"{name} {what}": _metadata(**{name: value})
        for name in (
            "version", "storage_identifier", "compression_mode", "relative_file_paths",
            "custom_data", "message_count", "duration", "starting_time",
            "topics_with_message_count", "compression_format", "files", "ros_distro",
        )
        for what, value in (("null", "null"), ("a list", "[[1], {a: b}]"), ("a number", "1e400"))
    },
}  # fmt: skip
"""Texts of metadata.yaml beside a whole file."""


def _with_metadata(folder: Path, text: str | bytes) -> Path:
    put(folder, forged({}, content()))
    raw = text.encode() if isinstance(text, str) else text
    (folder / "metadata.yaml").write_bytes(raw)
    return folder


def _enter_metadata(name: str, text: str | bytes) -> None:
    entry(f"metadata.yaml: {name}")(lambda folder: _with_metadata(folder, text))


for _name, _given in METADATA.items():
    _enter_metadata(_name, _given)


def _enter_place(name: str, make: Callable[[Path], object]) -> None:
    def made(folder: Path) -> Path:
        make(put(folder, forged({}, content())) / "metadata.yaml")
        return folder

    entry(f"metadata.yaml: {name}")(made)


for _name in ("a FIFO", "a folder", "a link to a device"):
    _enter_place(_name, FILES[_name])


@entry("metadata.yaml: names a FIFO")
def _names_fifo(folder: Path) -> Path:
    put(folder, forged({}, content()))
    os.mkfifo(folder / "run_1")
    (folder / "metadata.yaml").write_text(_metadata(relative_file_paths="[run_0.mcap, run_1]"))
    return folder


# --- quality of service, notes, names -------------------------------------------------------------
for _name, _text in (
    ("laughs", _LAUGHS), ("deep lists", "[" * 100_000), ("deep mappings", "{a: " * 50_000),
    ("a program", "- !!python/object/apply:os.system ['touch HACKED']"), ("no list", "5"),
    ("too large", "[" + "a," * 300_000 + "]"), ("a control letter", "- {a: \x07}"),
    ("of no mappings", "[1, [2], null, 1e400]"),
):  # fmt: skip
    enter_forged(f"QoS: {_name}", {}, qos=_text)

HOSTILE_NOTES = {
    "a format of letters": {"format": "abc"}, "a format of digits": {"format": "9" * 5000},
    "a format below 0": {"format": "-1"}, "a version in red": {"version": "\x1b[31mred"},
    "a long version": {"version": "x" * 100_000}, "losses too deep": {"lost": "[" * 100_000},
    "losses cut off": {"lost": "{1e400"}, "losses of NaN": {"lost": "NaN"},
    "lines in a number": {"lost_impact_rows": "\n\n"},
    "markup": {"<script>alert(1)</script>": "<script>alert(1)</script>"},
}  # fmt: skip
for _name, _notes in HOSTILE_NOTES.items():
    enter_forged(f"note: {_name}", {}, notes=signed({**NOTES, **_notes}))
enter_forged("notes with a wrong checksum", {}, notes={**signed(NOTES), "version": "9"})
enter_forged("a topic that writes to the terminal", {"channel.topic": "\x1b]0;title\x07/disk"})
enter_forged("a topic in markup", {"channel.topic": "/<script>alert(1)</script>/disk/inputs"})
enter_forged("all topics alike", {"channel.topic": "/disk/inputs"})
enter_forged("all types alike", {"schema.name": "std_msgs/msg/String"})


# --- definitions of messages ----------------------------------------------------------------------
_SEPARATOR = "=" * 80
_NESTED = "".join(
    f"{_SEPARATOR}\nMSG: a/T{n}\nT{n + 1}[1000] x\n" for n in range(6)
) + f"{_SEPARATOR}\nMSG: a/T6\nuint8 x\n"  # fmt: skip
DEFINITIONS = {
    "recursive": "String next\n",
    "recursive in two": f"a/A x\n{_SEPARATOR}\nMSG: a/A\na/B x\n{_SEPARATOR}\nMSG: a/B\na/A x\n",
    "exponential": f"string data\na/T0 x\n{_NESTED}",
    "an array of texts": "string[2000000000] data\n",
    "an array of nothing": "string data\nuint8[0] x\n",
    "a negative array": "string data\nuint8[-5] x\n",
    "sequences of nothing": f"string data\na/E[] x\n{_SEPARATOR}\nMSG: a/E\n\n",
    "deep": "string data\na/D0 x\n" + "".join(
        f"{_SEPARATOR}\nMSG: a/D{n}\nD{n + 1} x\n" for n in range(500)
    ) + f"{_SEPARATOR}\nMSG: a/D500\nuint8 x\n",
    "many fields": "".join(f"uint8 a{n}\n" for n in range(20_000)),
    "many lines": "string data\n" + "#\n" * 100_000,
    "too large": "string data # " + "x" * 300_000,
    "no fields": "",
    "another field": "string text\n",
    "another type": "int64 data\n",
    "a type that is missing": "string data\nother/Thing x\n",
    "code": "string data\nuint8 X=1\nimport os; os.system('touch HACKED')\n",
    "code in a default": "string data \"'); import os; os.system('touch HACKED') #\"\n",
    "code in a constant": "string data\nstring X='\"+__import__(\"os\").system(\"touch H\")'\n",
    "an infinite constant": "string data\nfloat64 X=1e999\n",
    "a long number": "string data\nint64 X=" + "9" * 10_000 + "\n",
    "a keyword": "string data\nuint8 class\nuint8 class_\n",
    "no text": "\x00\x01\x02",
}  # fmt: skip


def _defined(text: str) -> Callable[[], list[Sent]]:
    """The messages, those of type String with another definition."""

    def rows() -> list[Sent]:
        return [
            row._replace(definition=text) if row.kind == "std_msgs/msg/String" else row
            for row in messages()
        ]

    return rows


for _name, _text in DEFINITIONS.items():
    enter_forged(f"definition: {_name}", {}, messages=_defined(_text))
enter_forged("definition: not UTF-8", {"schema.data": b"string data\xff\n"})
enter_forged("definition: a name of two lines", {"schema.name": "std_msgs/msg/String\nint8 x"})
enter_forged("definition: a name of code", {"schema.name": "a/msg/X: pass\nimport os"})
