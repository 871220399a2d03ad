"""The ROS 2 arguments of a command line, read without ROS; what they say means the same to rcl.

`--ros-args -p name:=value --params-file FILE -r __node:=name -r __ns:=/namespace --log-level LEVEL
[--]`. What YAML and rcl read differently (octals, `y`, a key given twice) is refused. Remapped
topics and options of logs and security mean nothing here.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from bouncing_disk_ros import limits
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.parameters import is_rclpy_parameter
from bouncing_disk_ros.parsing import read_yaml, ros_value_of
from bouncing_disk_ros.regular_file import read_text

Overrides = dict[str, Any]
"""Name of a parameter -> its value: a scalar, or a list of scalars of one type."""

_SWITCHES = {
    f"--{verb}-{logs}-logs"
    for verb in ("enable", "disable")
    for logs in ("rosout", "stdout", "external-lib")
}
_LEVELS = ("debug", "info", "warn", "error", "fatal", "unset")
_WORD = r"(?:_|[A-Za-z])(?:[A-Za-z0-9]|(?<!_)_)*"  # two underscores in a row end a word of rcl
_PARAMETER = re.compile(rf"(?:({_WORD}):)?([A-Za-z_][\w./]*):=(.*)", re.ASCII | re.DOTALL)
_NAME_RULE = re.compile(rf"(?:({_WORD}):)?__(?:node|name):=({_WORD})", re.ASCII)
_NAMESPACE_RULE = re.compile(rf"(?:({_WORD}):)?__ns:=(/|(?:/{_WORD})+)", re.ASCII)
_TOPIC_RULE = re.compile(r"(?!.*__(?:node|name|ns):=)[^\s=]+:=[^\s=]+")
_NODE = re.compile(rf"/?(?:\*\*?|{_WORD})(?:/(?:\*\*?|{_WORD}))*", re.ASCII)
_PARAMETERS = "ros__parameters"
_NAME_LENGTH = 255


class RosArguments:
    """The ROS arguments of a node that is called `default_name`.

    Raises InputError for what rcl refuses, and for what it reads as nobody means it. `node_name`,
    `namespace`: after remapping; `overrides`: of its parameters; `unused_files`: parameter files
    that say nothing of it.
    """

    def __init__(self, arguments: Sequence[str], default_name: str) -> None:
        self._rules: dict[str, Overrides] = {}  # name of nodes -> parameters, in the order of rcl
        self._files: list[tuple[str, list[str]]] = []  # file, names of nodes
        self._names: list[tuple[str, str]] = []  # name of a node or empty, new name
        self._namespaces: list[tuple[str, str]] = []
        self._read(arguments)
        self.node_name = _first(self._names, default_name) or default_name
        self.namespace = _first(self._namespaces, self.node_name) or "/"
        for name in (self.node_name, self.namespace):
            if len(name) > _NAME_LENGTH:
                raise InputError("-r", name, f"at most {_NAME_LENGTH} characters")
        whole = f"{self.namespace.rstrip('/')}/{self.node_name}"
        self.overrides: Overrides = {}
        for nodes, values in self._rules.items():
            if _matches(nodes, whole):
                self.overrides.update(values)
        self.unused_files = [
            file for file, names in self._files if not any(_matches(name, whole) for name in names)
        ]
        for name, value in self.overrides.items():
            if is_rclpy_parameter(name) and "." not in name and not isinstance(value, bool):
                raise InputError(name, value, "true or false")

    def _read(self, arguments: Sequence[str]) -> None:
        takers: dict[str, Callable[[str, str], None]] = {
            **dict.fromkeys(("-p", "--param"), self._parameter),
            **dict.fromkeys(("-r", "--remap"), self._remap),
            "--params-file": self._file,
            "--log-level": _check_level,
            **dict.fromkeys(("-e", "--enclave", "--log-file-name", "--log-config-file"), _ignore),
        }
        inside = False
        rest = iter(arguments)
        for word in rest:
            if word == "--ros-args":
                inside = True
            elif not inside or word in _SWITCHES:
                continue
            elif word == "--":
                inside = False
            elif word in takers:
                value = next(rest, None)
                if value is None:
                    raise InputError(word, "nothing", "a value after it")
                takers[word](word, value)
            else:
                allowed = ", ".join(["--ros-args", *takers])
                hint = "Options of the tool come before them."
                raise InputError("ROS arguments", word, allowed, hint)

    def _parameter(self, flag: str, text: str) -> None:
        match = _PARAMETER.fullmatch(text)
        if match is None:
            raise InputError(flag, text, "name:=value")
        try:
            self._put(match[1] or "/**", match[2], read_yaml(flag, match[3], plain=ros_value_of))
        except ValueError as error:
            raise InputError(flag, text, "name:=value", _reason(error)) from None

    def _remap(self, flag: str, text: str) -> None:
        if match := _NAME_RULE.fullmatch(text):
            self._names.append((match[1] or "", match[2]))
        elif match := _NAMESPACE_RULE.fullmatch(text):
            self._namespaces.append((match[1] or "", match[2]))
        elif not _TOPIC_RULE.fullmatch(text):
            raise InputError(flag, text, "from:=to, __node:=name or __ns:=/namespace")

    def _file(self, flag: str, text: str) -> None:
        content = read_text(flag, Path(text), limits.YAML)
        try:
            rows = list(_rows(read_yaml(flag, content, plain=ros_value_of)))
            for row in rows:
                self._put(*row)
        except ValueError as error:
            raise InputError(flag, text, "a ROS 2 parameter file", _reason(error)) from None
        self._files.append((text, [nodes for nodes, _, _ in rows]))

    def _put(self, nodes: str, name: str, value: Any) -> None:
        """Take the value of a parameter of nodes; ValueError where rcl takes none like this."""
        scalars = value if isinstance(value, list) else [value]
        if not all(isinstance(one, bool | int | float | str) for one in scalars):
            raise ValueError(f"{name}: a value is true, false, a number, a text or a list of them")
        kinds = _kinds(value)
        if len(kinds - {list}) != 1:
            raise ValueError(f"{name}: the values of a list are of one type, and at least one")
        values = self._rules.setdefault(nodes, {})
        before = values.get(name, value)
        if _kinds(before) != kinds:  # rcl would keep both, and use an integer before a double
            raise ValueError(f"{name} is {before!r} and {value!r}: give both the same type")
        values[name] = value


def _kinds(value: Any) -> set[type]:
    return {list, *map(type, value)} if isinstance(value, list) else {type(value)}


def _reason(error: ValueError) -> str:
    return error.hint if isinstance(error, InputError) else str(error)


def _rows(content: Any, nodes: str = "") -> Iterator[tuple[str, str, Any]]:
    """Names of nodes, name of a parameter and its value, of each value of a parameter file."""
    if not isinstance(content, dict) or not content:
        raise ValueError(f"names of nodes belong above {_PARAMETERS}, names of parameters below")
    for key, below in content.items():
        if key != _PARAMETERS:
            yield from _rows(below, f"{nodes.removesuffix('/')}/{key}" if nodes else key)
            continue
        if not _NODE.fullmatch(nodes):
            raise ValueError(f"{nodes!r} above {_PARAMETERS} is no name of a node")
        if not isinstance(below, dict):
            raise ValueError(f"names of parameters belong below {_PARAMETERS}")
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


def _check_level(flag: str, text: str) -> None:
    logger, separator, level = text.rpartition(":=")
    if level.lower() not in _LEVELS or (separator and not logger):
        raise InputError(flag, text, ", ".join(_LEVELS) + ", also NAME:=LEVEL")


def _ignore(_flag: str, _text: str) -> None:
    """Take what means nothing without ROS."""


def _first(rules: Sequence[tuple[str, str]], node: str) -> str:
    """The replacement of the first rule for a node; empty: none is for it."""
    return next((new for wanted, new in rules if wanted in ("", node)), "")


def _matches(nodes: str, node: str) -> bool:
    """Whether a name of a parameter file stands for a node: * is one word, ** any number."""
    whole = nodes if nodes.startswith("/") else f"/{nodes}"
    parts = re.split(r"(/\*\*|/\*)", whole)
    regex = "".join({"/**": r"(/\w+)*", "/*": r"/\w+"}.get(part, re.escape(part)) for part in parts)
    return re.fullmatch(regex, node, re.ASCII) is not None
