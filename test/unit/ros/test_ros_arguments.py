"""ROS arguments read without ROS mean what they mean to rclpy, and what it refuses is refused."""

from __future__ import annotations

import random
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
import rclpy
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.ros.ros_arguments import RosArguments

NAME = "study"
REFUSED = "refused"
Meaning = tuple[str, str, dict[str, str]] | str

RULES = """
-p a:=1 | -p a:=1 -p a:=2 | -p a:=1 -p a:=x | -p a:=true -p a:=[1] | -p a:=[] -p a:=1 | -p a:=[]
-p a:=0x1F -p b:=010 -p c:=08 -p d:=0o17 -p e:=0b1 -p f:=1_000 -p g:=+5 -p h:=-0x10 -p i:=0x
-p a:=1e3 -p b:=.5 -p c:=5. -p d:=0x1p-3 -p e:=1e400 -p f:=1e-400 -p g:=1e-320 -p h:=0e-999
-p a:=.inf -p b:=-.inf -p c:=inf -p d:=-infinity -p e:=.nan -p f:=nan -p g:=-.nan -p h:=NaN(1)
-p a:=9223372036854775807 -p b:=9223372036854775808 -p c:=-9223372036854775808
-p a:=on -p b:=Off -p c:=Y -p d:=n -p e:=oN -p f:=null -p g:=~ -p h:='1' -p i:="x" -p j:=0.25pi
-p a:=[1,2] -p b:=[a,'b'] -p c:=[on,off] -p d:=[1.5,.inf] | -p a:=[1,2.5] | -p a:=[x,1]
-p a:=[[1],2] | -p a:=[1,[2]] | -p a:={b:1} | -p a:=*x | -p a:=&x | -p a:=!!str | -p a:= | -p a:=#
-p a:=] | -p a:='x | -p a:=%x | -p a:=--- | -p a:=b:=c | -p a | -p | -p :=1 | -p a=1 | -p a::=1
-p study:a:=1 -p other:a:=2 | -p other:a:=1 | -p /study:a:=1 | -p /**:a:=1 | -p *:a:=1
-p a.b:=1 -p a/b:=2 -p /a:=3 -p a__b:=4 -p _a:=5 -p a_._b:=6 -p a//b:=7 -p a__1:=8 -p /:=9
-p __a:=1 | -p 1a:=1 | -p a.1:=1 | -p a..b:=1 | -p a.:=1 | -p .a:=1 | -p a___b:=1 | -p a-b:=1
-p ~/a:=1 | -p a/1:=1 | -p a/__a:=1 | -p rostopic://a:=1 | -p é:=1 | -p a:b:c:=1 | -p a__b:c:=1
-r __node:=q -p q:a:=1 -p study:a:=2 | -r __ns:=/n -p a:=1 | -r __ns:=/ | -r __ns:=/n/m
-r __node:=a -r __node:=b | -r __ns:=/a -r __ns:=/b | -r other:__node:=b | -r study:__name:=b
-r __node:=q -r study:__ns:=/x | -r __node:=q -r q:__ns:=/x | -r study:__ns:=/q
-r __ns:=x | -r __ns:=/a/ | -r __ns:=// | -r __ns:=/1x | -r __ns:=/a__b | -r __ns:= | -r __node:=
-r __node:=1x | -r __node:=x/y | -r __node:=a__b | -r __node:=_ | -r __node:=a:=b | -r __a:=x
-r a:=b -r ~/c:=/d/e -r study:x:=y -r rosservice://a:=b -r a:/b:=~/c | -r a | -r | -r a:=
-r a:=b:=c | -r *:=x | -r ~a:=x | -r x:=~ | -r x:=/ | -r a/:=x | -r a.b:=x | -r rostopic://:=b
--log-level debug --log-level WARN --log-level a.b:=Info | --log-level loud | --log-level warning
--log-level | --log-level a:= | --log-level :=info | --log-level a:=b:=info | --log-level a/b:=info
-e /x | -e x | -e /1 | -e / | -e | --enclave /a/b | --log-file-name x | --log-config-file x
--enable-rosout-logs --disable-stdout-logs --disable-external-lib-logs | --enable-rosout
foo | --foo | - | a:=1 | -pa:=1 | --param=a:=1 | -- foo -p a:=1 | -- foo --ros-args -p a:=1
--ros-args -p a:=1 | -p a:=1 -- x --ros-args -r __node:=q | -p -- | --params-file
--params-file /no/such/file.yaml | --param a:=1 --remap __node:=z | -p use_sim_time:=true
-p use_sim_time:=1 | -p start_type_description_service:=x | -p qos_overrides.x:=1
"""
CASES = [case.split() for line in RULES.strip().splitlines() for case in line.split(" | ")]

FILES = [
    "/**:\n  ros__parameters:\n    a: 1\n    b: {c: [1, 2], d: {e: on}}\n    f: 0x1F\n",
    "study:\n  ros__parameters: {a: 1}\n/**:\n  ros__parameters: {a: 2}\n",
    "/**:\n  ros__parameters: {a: 1}\n/study:\n  ros__parameters: {a: 2}\n",
    "/*:\n  ros__parameters: {a: 1}\n", "'*':\n  ros__parameters: {a: 1}\n",
    "/ns/study:\n  ros__parameters: {a: 1}\n", "/ns/*:\n  ros__parameters: {a: 1}\n",
    "ns:\n  study:\n    ros__parameters: {a: 1}\n", "/**/study:\n  ros__parameters: {a: 1}\n",
    "'**/study':\n  ros__parameters: {a: 1}\n", "/*/study:\n  ros__parameters: {a: 1}\n",
    "/ns/**:\n  ros__parameters: {a: 1}\n", "/:\n  study:\n    ros__parameters: {a: 1}\n",
    "**:\n  ros__parameters: {a: 1}\n", "/**:\n  a: 1\n", "/**:\n  ros__parameters:\n",
    "/**:\n  ros__parameters: {}\n", "", "x\n", "a: [1\n", "- 1\n", "/**: 1\n",
    "/**:\n  ros__parameters:\n    a:\n", "/**:\n  ros__parameters: 3\n",
    "/**:\n  ros__parameters:\n    a: &x 1\n    b: *x\n", "ros__parameters:\n  a: 1\n",
    "/**:\n  ros__parametersX:\n    a: 1\n", "/**:\n  ros__parameters:\n    a: 1\n    a: 2.5\n",
    "/**:\n  ros__parameters:\n    a: {}\n    b: 1\n", "1bad:\n  ros__parameters: {a: 1}\n",
    "//a:\n  ros__parameters: {a: 1}\n", "/a/../b:\n  ros__parameters: {a: 1}\n",
    "/**:\n  ros__parameters:\n    'x y': 1\n", "/**:\n  ros__parameters:\n    '': 2\n",
    "/**:\n  ros__parameters:\n    a: |\n      text\n    b: >\n      1\n    c: ! 5\n",
    "---\n/**:\n  ros__parameters: {a: 1}\n---\n/**:\n  ros__parameters: {b: 1}\n",
    "/**:\n  ros__parameters:\n    [a, b]: 1\n", "/**:\n  ros__parameters:\n    a: [[1], [3]]\n",
    "/**:\n  ros__parameters:\n    a: [{b: 1}]\n", "/**:\n  ros__parameters:\n    a: []\n",
    "/**:\n  ros__parameters:\n    a.b: 1\n    a: {b: 2, c: {d: 5}}\n    e: 1\n",
    "/**:\n  ros__parameters:\n    <<: {a: 1}\n    b: 2021-01-01\n    c: 1:30\n    d: oN\n",
    "/**:\n\tros__parameters:\n\t\ta: 1\n", "\ufeff/**:\n  ros__parameters: {a: 1}\n",
]  # fmt: skip
NAMESPACES: tuple[list[str], ...] = ([], ["-r", "__ns:=/ns"], ["-r", "__ns:=/ns/deep"])


def plain(value: Any) -> str:
    """A value as text: NaN equals NaN, and 1 is not 1.0."""
    listed = hasattr(value, "__iter__") and not isinstance(value, str)
    return repr(list(value)) if listed else repr(value)


def to_rclpy(arguments: Sequence[str]) -> Meaning:
    """What rclpy makes of a command line."""
    context = rclpy.Context()
    try:
        rclpy.init(
            context=context,
            args=["program", *arguments],
            signal_handler_options=SignalHandlerOptions.NO,
        )
        node = Node(NAME, context=context, start_parameter_services=False, enable_rosout=False)
    except Exception:  # noqa: BLE001 (of several private types; the executables end with code 2)
        return REFUSED
    else:
        given = {name: plain(one.value) for name, one in node._parameter_overrides.items()}
        found = node.get_name(), node.get_namespace(), given
        node.destroy_node()
        return found
    finally:
        context.try_shutdown()


def to_us(arguments: Sequence[str]) -> Meaning:
    """What is made of it without ROS."""
    try:
        found = RosArguments(arguments, NAME)
    except InputError:
        return REFUSED
    given = {name: plain(value) for name, value in found.overrides.items()}
    return found.node_name, found.namespace, given


@pytest.mark.parametrize("case", CASES, ids=" ".join)
@pytest.mark.filterwarnings("ignore:Failed to fini:RuntimeWarning")
def test_rules_mean_what_they_mean_to_rclpy(ros_domain: int, case: list[str]) -> None:
    arguments = ["--ros-args", *case]
    assert to_us(arguments) == to_rclpy(arguments)


def test_values_with_blanks_and_arguments_of_the_tool(ros_domain: int) -> None:
    cases = [
        ["-p", "a:=1"], ["bag", "--ros-args", "-p", "a: =1"], [], ["--"],
        ["--ros-args", "-p", "a:= 1", "-p", "b:=  x ", "-p", "c:=1 2", "-p", "d:=a # b"],
        ["--ros-args", "-p", "a:=- 1"], ["--ros-args", "-p", "a:=b: 1"], ["--ros-args", ""],
        ["--ros-args", "-p", "a:=[true, 1]"], ["--ros-args", "-p", "a:=!!int '5'"],
        ["--ros-args", "-p", "a:=|-\n 1"], ["--ros-args", "-e", ""], ["--ros-args", "-p", "a b:=1"],
    ]  # fmt: skip
    for arguments in cases:
        assert to_us(arguments) == to_rclpy(arguments), arguments


@pytest.mark.parametrize("number", range(len(FILES)))
def test_files_mean_what_they_mean_to_rclpy(ros_domain: int, tmp_path: Path, number: int) -> None:
    file = tmp_path / "parameters.yaml"
    file.write_text(FILES[number], encoding="utf-8")
    given = ["--ros-args", "--params-file", str(file)]
    for more in (*NAMESPACES, ["-p", "a:=7"], ["-p", "study:a:=7"], ["--params-file", str(file)]):
        assert to_us([*given, *more]) == to_rclpy([*given, *more]), more


KEYS = ["a", "b", "a.b", "c", "'x y'", "''", "ros__parameters", "[a]"]
VALUES = ["1", "0x1F", "1e3", ".inf", "nan", "on", "'1'", "[1, 2]", "[a, 'b']", "[]", "[[1], 2]",
          "{a: 1}", "", "null", "!!str 1", "&x 1", "*x", "0.25pi", "x # c", "[1, 2.5]"]  # fmt: skip
TOPS = ["/**", "study", "/study", "'*'", "/*", "/n/*", "n", "//a", "/a/", "/", "/**/", "''"]


def random_file(draw: random.Random) -> str:
    """A file as a hasty hand would write it."""

    def one_of(items: Sequence[str]) -> str:
        return draw.choice(items if draw.random() < 0.1 else items[:5])  # the first ones are sound

    def mapping(depth: int, indent: str) -> str:
        rows = []
        for _ in range(draw.randint(1, 3)):
            deeper = depth and draw.random() < 0.3
            value = (
                f"\n{mapping(depth - 1, indent + '  ')}" if deeper else f" {draw.choice(VALUES)}"
            )
            rows.append(f"{indent}{one_of(KEYS)}:{value}")
        return "\n".join(rows)

    parts = []
    for _ in range(draw.randint(1, 3)):
        nested = draw.random() < 0.2
        middle = f"  {one_of(TOPS)}:\n" if nested else ""
        indent = "    " if nested else "  "
        parts.append(
            f"{one_of(TOPS)}:\n{middle}{indent}ros__parameters:\n{mapping(2, indent + '  ')}\n"
        )
    return "".join(parts)


def test_random_files_mean_what_they_mean_to_rclpy(ros_domain: int, tmp_path: Path) -> None:
    draw = random.Random(20090501)
    file = tmp_path / "parameters.yaml"
    used = 0
    for _ in range(400):
        file.write_text(random_file(draw), encoding="utf-8")
        given = ["--ros-args", "--params-file", str(file), *draw.choice(NAMESPACES)]
        meant = to_us(given)
        assert meant == to_rclpy(given), file.read_text("utf-8")
        used += meant != REFUSED and bool(meant[2])
    assert used > 20
