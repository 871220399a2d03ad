"""The ROS 2 arguments of a command line, read without ROS; what they say means the same to rcl.

`--ros-args -p name:=value --params-file FILE -r __node:=name -r __ns:=/namespace [--]`. What YAML
and rcl read differently (octals, `y`, a key given twice) is refused, also where there is ROS: so
rcl, which reads the line again for its nodes, makes the same of it. Remapped topics and options of
logs and security mean nothing here: where there is ROS, rcl checks them.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from bouncing_disk_ros import limits
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.parameters import is_rclpy_parameter
from bouncing_disk_ros.parsing import read_yaml
from bouncing_disk_ros.regular_file import read_text

Overrides = dict[str, Any]
"""Name of a parameter -> its value: a scalar, or a list of scalars of one type."""

_SWITCH = re.compile(r"--(?:en|dis)able-(?:rosout|stdout|external-lib)-logs")
_PARAMETER_FLAGS, _FILE_FLAG = ("-p", "--param"), "--params-file"
_VALUED = (*_PARAMETER_FLAGS, _FILE_FLAG, "-r", "--remap", "--log-level", "-e", "--enclave",
           "--log-file-name", "--log-config-file")  # fmt: skip
_PARAMETER = re.compile(r"(?:(\w+):)?([A-Za-z_][\w./]*):=(.*)", re.ASCII | re.DOTALL)
_RULE = re.compile(r"(?:(\w+):)?__(node|name|ns):=(.*)", re.ASCII)
_WORD = r"[A-Za-z_]\w*"
_NEW = {"node": _WORD, "name": _WORD, "ns": rf"/|(?:/{_WORD})+"}
_PARAMETERS = "ros__parameters"


class RosArguments:
    """The ROS arguments of a node that is called `default_name`.

    Raises InputError for parameters that rcl refuses, and for what it reads as nobody means it.
    `node_name`, `namespace`: after remapping; `overrides`: of its parameters; `unused_files`:
    parameter files that say nothing of it.
    """

    def __init__(self, arguments: Sequence[str], default_name: str) -> None:
        given = list(_options(arguments))
        self.node_name = _renamed(given, ("node", "name"), default_name) or default_name
        self.namespace = _renamed(given, ("ns",), self.node_name) or "/"
        whole = f"{self.namespace.rstrip('/')}/{self.node_name}"
        rules: dict[str, Overrides] = {}  # names of nodes -> parameters, in the order of rcl
        self.unused_files: list[str] = []
        for flag, text in given:
            if flag not in (*_PARAMETER_FLAGS, _FILE_FLAG):
                continue
            is_file = flag == _FILE_FLAG
            try:
                rows = list(_rows(_content(text)) if is_file else _parameter(text))
                for row in rows:
                    _put(rules, *row)
            except ValueError as error:
                allowed = "a ROS 2 parameter file" if is_file else "name:=value"
                hint = error.hint if isinstance(error, InputError) else str(error)
                raise InputError(flag, text, allowed, hint) from None
            if is_file and not any(_matches(nodes, whole) for nodes, _, _ in rows):
                self.unused_files.append(text)
        self.overrides: Overrides = {}
        for nodes, values in rules.items():
            if _matches(nodes, whole):
                self.overrides.update(values)
        for name, value in self.overrides.items():
            if is_rclpy_parameter(name) and "." not in name and not isinstance(value, bool):
                raise InputError(name, value, "true or false")


def _options(arguments: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Each option of ROS that has a value, with its value."""
    inside = False
    rest = iter(arguments)
    for word in rest:
        if word == "--ros-args":
            inside = True
        elif word == "--":
            inside = False
        elif inside and word in _VALUED:
            value = next(rest, None)
            if value is None:
                raise InputError(word, "nothing", "a value after it")
            yield word, value
        elif inside and not _SWITCH.fullmatch(word):
            allowed = ", ".join(["--ros-args", *_VALUED])
            raise InputError(
                "ROS arguments", word, allowed, "Options of the tool come before them."
            )


def _renamed(given: Sequence[tuple[str, str]], kinds: Sequence[str], node: str) -> str:
    """The new name by the first rule for a node; empty: none is for it."""
    for flag, text in given:
        match = _RULE.fullmatch(text) if flag in ("-r", "--remap") else None
        if match is None:
            continue
        if not re.fullmatch(_NEW[match[2]], match[3], re.ASCII):
            raise InputError(flag, text, "__node:=name or __ns:=/namespace")
        if match[2] in kinds and match[1] in (None, node):
            return match[3]
    return ""


def _content(file: str) -> Any:
    return read_yaml(_FILE_FLAG, read_text(_FILE_FLAG, Path(file), limits.YAML))


def _parameter(text: str) -> Iterator[tuple[str, str, Any]]:
    match = _PARAMETER.fullmatch(text)
    if match is None:
        raise ValueError
    yield match[1] or "/**", match[2], read_yaml("-p", match[3])


def _put(rules: dict[str, Overrides], nodes: str, name: str, value: Any) -> None:
    """Take the value of a parameter of nodes; ValueError where rcl takes none like this."""
    is_list, kinds = _kind(value)
    if not kinds <= {bool, int, float, str}:
        raise ValueError(f"{name}: a value is true, false, a number, a text or a list of them")
    if len(kinds) != 1:
        raise ValueError(f"{name}: the values of a list are of one type, and at least one")
    values = rules.setdefault(nodes, {})
    before = values.get(name, value)
    if _kind(before) != (is_list, kinds):  # rcl would keep both, and use an integer before a double
        raise ValueError(f"{name} is {before!r} and {value!r}: give both the same type")
    values[name] = value


def _kind(value: Any) -> tuple[bool, set[type]]:
    """Whether a value is a list, and the types in it."""
    is_list = isinstance(value, list)
    return is_list, {*map(type, value if is_list else [value])}


def _rows(content: Any, nodes: str = "") -> Iterator[tuple[str, str, Any]]:
    """Names of nodes, name of a parameter and its value, of each value of a parameter file."""
    if not isinstance(content, dict) or not content:
        raise ValueError(f"names of nodes belong above {_PARAMETERS}, names of parameters below")
    for key, below in content.items():
        if key != _PARAMETERS:
            yield from _rows(below, f"{nodes.removesuffix('/')}/{key}" if nodes else key)
            continue
        if not nodes or not isinstance(below, dict):
            raise ValueError(f"a name of a node belongs above {_PARAMETERS}, names below")
        flat = list(_flat(below))
        if len(dict(flat)) < len(flat):
            raise ValueError(f"a name below {_PARAMETERS} is given twice")
        yield from ((nodes, *pair) for pair in flat)


def _flat(values: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in values.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{above}{key}.")
        else:
            yield above + key, value


def _matches(nodes: str, node: str) -> bool:
    """Whether a name of a parameter file stands for a node: * is one word, ** any number."""
    whole = nodes if nodes.startswith("/") else f"/{nodes}"
    parts = re.split(r"(/\*\*|/\*)", whole)
    regex = "".join({"/**": r"(/\w+)*", "/*": r"/\w+"}.get(part, re.escape(part)) for part in parts)
    return re.fullmatch(regex, node, re.ASCII) is not None
