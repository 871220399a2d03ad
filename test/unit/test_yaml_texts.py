"""Options and YAML files mean what ROS makes of them; what nobody means is refused.

One table for all readers: a command line without ROS, the same before rclpy sees it, presets and
programmes.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
import rclpy
from rclpy.logging import LoggingSeverity, set_logger_level
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from bouncing_disk_ros.command_line.ros_arguments import RosArguments
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.parsing import read_yaml

NAME = "study"
REFUSED = "refused"
Meaning = tuple[str, str, dict[str, str]] | str


def cases(table: str) -> list[str]:
    return table.strip().replace("\n", " | ").split(" | ")


TAKEN = cases("""
1 | +5 | -5 | 0 | 9223372036854775807 | 1e-3 | 1.0e-3 | 1E3 | 1e3 | .5 | 5. | -0.25 | +.5e+2
010.5 | 0.0 | 0e-999 | .inf | -.inf | +.INF | inf | -inf | Inf | nan | .nan | 0.25pi | high
true | False | yes | NO | on | Off | tRue | '1' | "on" | '' | a b | a # b | a:b | ~x | !!str 1
2026-01-31 | 1:30 | 1_0 | 0o10 | 0b11 | 1e400 | 1e-320 | [1, 2] | [0.5, .inf] | [a, '1'] | [on, off]
""")
"""Values with one meaning, to ROS and to us; what is no number there is a text here."""
ROS_ALONE = cases("""
010 | 08 | 0x10 | 0X1p-3 | -0x1F | y | N | infinity | -nan | NaN(1) | iNf | null | ~ | []
9223372036854775808 | ! 5 | !!int 5 | &x 1 | [[1], 2]
""")
"""Values that rcl takes, by other rules than those of YAML: refused, with ROS and without."""
ROS_ALONE += ["--- 1\n--- 2", ">-\n 1"]
NO_VALUE = cases("{b: 1} | b: 1 | *x | ] | 'x | %x | @x | [1, x] | [1, 2.5]")
LINES = cases("""
-p a:=1 -p a:=2 | -p study:a:=1 -p other:a:=2 | -p a.b:=1 -p a/b:=2 -p _a:=5 | --param a:=b:=c
-r __node:=q -p q:a:=1 -p study:a:=2 | -r __ns:=/n/m -p a:=1 | -r __ns:=/ | --remap __name:=z
-r __node:=a -r __node:=b | -r study:__ns:=/q -r other:__node:=b | -r __node:=q -r study:__ns:=/x
-r a:=b -r ~/c:=/d/e -r study:x:=y | --log-level WARN --log-level a.b:=Info | -e /x
--disable-stdout-logs --enable-rosout-logs | --log-file-name x | -p a:=1 -- x --ros-args -p b:=2
-p use_sim_time:=true | -p qos_overrides.x:=1
""")
"""Command lines that rcl takes."""
WRONG_LINES = cases("""
-p a | -p | -p :=1 | -p a=1 | -p a:= | -p a-b:=1 | -p 1a:=1 | -p /**:a:=1
-r __ns:=x | -r __ns:=/a/ | -r __node:=1x | -r __node:=x/y
foo | --foo | -pa:=1 | --params-file /no/such/file.yaml | -p use_sim_time:=1
""")
WRONG_FOR_ROS_ALONE = cases("""
-r a | --log-level loud | --log-level :=info
""")
"""Names and levels that rcl refuses; without ROS they mean nothing."""
FILES = [
    "/**:\n  ros__parameters:\n    a: 1\n    b: {c: [1, 2], d: {e: on}}\n    f: 1e-3\n",
    "study:\n  ros__parameters: {a: 1}\n/**:\n  ros__parameters: {a: 2}\n",
    "/**:\n  ros__parameters: {a: 1}\n/study:\n  ros__parameters: {a: 2}\n",
    "/*:\n  ros__parameters: {a: 1}\n", "'*':\n  ros__parameters: {a: 1}\n",
    "/ns/study:\n  ros__parameters: {a: 1}\n", "/ns/*:\n  ros__parameters: {a: 1}\n",
    "ns:\n  study:\n    ros__parameters: {a: 1}\n", "'**/study':\n  ros__parameters: {a: 1}\n",
    "/ns/**:\n  ros__parameters: {a: 1}\n", "/**:\n  ros__parameters:\n    'x y': 1\n    on: 2\n",
]  # fmt: skip
WRONG_FILES = ["a: [1\n", "- 1\n", "/**: 1\n", "/**:\n  a: 1\n", "ros__parameters:\n  a: 1\n",
               "/**:\n  ros__parameters: 3\n",
               "/**:\n  ros__parameters:\n    a:\n", "/**:\n  ros__parameters:\n    [a, b]: 1\n",
               "/**:\n  ros__parameters:\n    a: &x 1\n    b: *x\n"]  # fmt: skip
FILES_OF_ROS_ALONE = [
    "/**:\n  ros__parameters:\n    a: 1\n    a: 2\n",
    "/**:\n  ros__parameters: {a.b: 1, a: {b: 2}}\n",
    "/**:\n  ros__parameters:\n    <<: {a: 1}\n", "/**:\n  ros__parameters:\n    a: 010\n",
    "/**:\n  ros__parameters: {a: 1}\n---\n/**:\n  ros__parameters: {b: 1}\n",
    "/**:\n  ros__parameters: {a: 1}\n/**:\n  ros__parameters: {b: 1}\n",
]  # fmt: skip
NAMESPACES: tuple[list[str], ...] = ([], ["-r", "__ns:=/ns"], ["-r", "__ns:=/ns/deep"])


def to_ros(arguments: Sequence[str]) -> Meaning:
    """What rclpy makes of a command line; values as texts, so that NaN equals NaN, 1 is not 1.0."""
    context = rclpy.Context()
    try:
        rclpy.init(context=context, args=["program", "--ros-args", *arguments],
                   signal_handler_options=SignalHandlerOptions.NO)  # fmt: skip
        node = Node(NAME, context=context, start_parameter_services=False, enable_rosout=False)
    except Exception:  # noqa: BLE001 (of several private types; the executables end with code 2)
        return REFUSED
    else:
        given = {name: one.value for name, one in node._parameter_overrides.items()}
        found = node.get_name(), node.get_namespace(), {k: plain(v) for k, v in given.items()}
        node.destroy_node()
        return found
    finally:
        context.try_shutdown()
        set_logger_level("", LoggingSeverity.INFO)  # --log-level outlives its context


def plain(value: Any) -> str:
    listed = hasattr(value, "__iter__") and not isinstance(value, str)
    return repr(list(value)) if listed else repr(value)


def to_us(arguments: Sequence[str]) -> Meaning:
    """What is made of it without ROS."""
    try:
        found = RosArguments(["--ros-args", *arguments], NAME)
    except InputError:
        return REFUSED
    values = {name: plain(value) for name, value in found.overrides.items()}
    return found.node_name, found.namespace, values


@pytest.mark.parametrize("text", TAKEN)
def test_a_value_means_what_it_means_to_ros(ros_domain: int, text: str) -> None:
    value = plain(read_yaml("preset", f"a: {text}")["a"])
    assert to_us(["-p", f"a:={text}"]) == (NAME, "/", {"a": value})
    assert to_ros(["-p", f"a:={text}"]) == (NAME, "/", {"a": value})


@pytest.mark.parametrize("text", [*ROS_ALONE, *NO_VALUE])
@pytest.mark.filterwarnings("ignore:Failed to fini:RuntimeWarning")
def test_what_nobody_means_is_refused(ros_domain: int, text: str) -> None:
    assert to_us(["-p", f"a:={text}"]) == REFUSED
    assert (to_ros(["-p", f"a:={text}"]) == REFUSED) == (text in NO_VALUE)
    try:
        found = read_yaml("preset", f"a: {text}")["a"]
    except InputError:
        return
    assert not isinstance(found, float | bool)
    assert not isinstance(found, int) or found == 2**63


def test_a_parameter_of_two_types_is_refused() -> None:
    """Of them rcl would take the integer, the first and not the last."""
    assert to_us(["-p", "a:=1", "-p", "a:=0.5"]) == REFUSED
    assert to_us(["-p", "a:=[1]", "-p", "a:=1"]) == REFUSED


@pytest.mark.parametrize("line", [*LINES, *WRONG_LINES])
@pytest.mark.filterwarnings("ignore:Failed to fini:RuntimeWarning")
def test_a_command_line_means_what_it_means_to_ros(ros_domain: int, line: str) -> None:
    assert to_us(line.split()) == to_ros(line.split())
    assert (to_us(line.split()) == REFUSED) == (line in WRONG_LINES)


@pytest.mark.parametrize("line", WRONG_FOR_ROS_ALONE)
@pytest.mark.filterwarnings("ignore:Failed to fini:RuntimeWarning")
def test_ros_checks_what_means_nothing_without_it(ros_domain: int, line: str) -> None:
    assert to_ros(line.split()) == REFUSED != to_us(line.split())


@pytest.mark.parametrize("text", [*FILES, *WRONG_FILES, *FILES_OF_ROS_ALONE])
@pytest.mark.filterwarnings("ignore:Failed to fini:RuntimeWarning")
def test_a_file_means_what_it_means_to_ros(ros_domain: int, tmp_path: Path, text: str) -> None:
    file = tmp_path / "parameters.yaml"
    file.write_text(text, encoding="utf-8")
    given = ["--params-file", str(file)]
    for more in (*NAMESPACES, ["-p", "a:=7"], given):
        meaning = to_us([*given, *more])
        if text in FILES:
            assert meaning == to_ros([*given, *more]) != REFUSED, more
        else:
            assert meaning == REFUSED
            assert (to_ros([*given, *more]) == REFUSED) == (text in WRONG_FILES)


def test_keys_are_texts_and_may_be_given_once() -> None:
    assert read_yaml("preset", "on: 1\n1: 2\n") == {"on": 1, "1": 2}
    for text in ("a: 1\na: 2", "1: a\n'1': b", "<<: {a: 1}", "? [a]\n: 1", ": 1",
                 "a: !!python/name:os.system x", "a: !!float 1", f"a: {'1' * 65}"):  # fmt: skip
        with pytest.raises(InputError):
            read_yaml("preset", text)
