"""The ROS 2 arguments of a command line, read without ROS: as rcl reads them.

`--ros-args -p name:=value --params-file FILE -r __node:=name -r __ns:=/namespace --log-level LEVEL
[--]`. Remapped topics and levels of logs are checked, and mean nothing where there is no ROS.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path

from bouncing_disk_ros import limits
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.parameters import is_rclpy_parameter
from bouncing_disk_ros.regular_file import read_text
from bouncing_disk_ros.ros.parameter_yaml import Overrides, ParameterRules

_SWITCHES = {
    f"--{verb}-{logs}-logs"
    for verb in ("enable", "disable")
    for logs in ("rosout", "stdout", "external-lib")
}
_LEVELS = {"debug", "info", "warn", "error", "fatal", "unset"}
# a word of rcl: two underscores in a row end it
_WORD = r"(?:_|[A-Za-z])(?:[A-Za-z0-9]|(?<!_)_)*"
_TOPIC = rf"(?:~?/)?{_WORD}(?:/{_WORD})*"
_PARAMETER = re.compile(
    rf"(?!rostopic://|rosservice://)(?:({_WORD}):)?([A-Za-z0-9_./]+):=(.*)", re.ASCII | re.DOTALL
)
_PART = re.compile(r"(?!__|[0-9])(?:(?!/__|___|/[0-9])[A-Za-z0-9_/])+", re.ASCII)
_NAME_RULE = re.compile(rf"(?:({_WORD}):)?__(?:node|name):=({_WORD})", re.ASCII)
_NAMESPACE_RULE = re.compile(rf"(?:({_WORD}):)?__ns:=(/|(?:/{_WORD})+)", re.ASCII)
_TOPIC_RULE = re.compile(
    rf"(?:{_WORD}:)?(?:(?:rostopic|rosservice)://)?{_TOPIC}:={_TOPIC}", re.ASCII
)
_ENCLAVE = re.compile(r"/|(?:/[A-Za-z_][A-Za-z0-9_]*)+", re.ASCII)
_NAME_LENGTH = 255


class RosArguments:
    """The ROS arguments of a node that is called `default_name`.

    Raises InputError for what rcl refuses. `node_name`, `namespace`: after remapping;
    `overrides`: of its parameters; `unused_files`: parameter files that say nothing of it.
    """

    def __init__(self, arguments: Sequence[str], default_name: str) -> None:
        self._rules = ParameterRules()
        self._files: list[tuple[str, ParameterRules]] = []
        self._names: list[tuple[str, str]] = []  # name of a node or empty, new name
        self._namespaces: list[tuple[str, str]] = []
        takers: dict[str, Callable[[str, str], None]] = {
            **dict.fromkeys(("-p", "--param"), self._parameter),
            **dict.fromkeys(("-r", "--remap"), self._remap),
            "--params-file": self._file,
            "--log-level": self._log_level,
            "--log-config-file": self._log_config,
            "--log-file-name": lambda _flag, _text: None,
            **dict.fromkeys(("-e", "--enclave"), self._enclave),
        }
        self._read(arguments, takers)
        self.node_name = _first(self._names, default_name) or default_name
        self.namespace = _first(self._namespaces, self.node_name) or "/"
        if max(len(self.node_name), len(self.namespace)) > _NAME_LENGTH:
            given = max(self.node_name, self.namespace, key=len)
            raise InputError("-r", given, f"at most {_NAME_LENGTH} characters")
        whole_name = f"{self.namespace.rstrip('/')}/{self.node_name}"
        self.overrides: Overrides = self._rules.overrides(whole_name)
        self.unused_files = [file for file, rules in self._files if not rules.overrides(whole_name)]
        self._check_rclpy_parameters()

    def _read(
        self, arguments: Sequence[str], takers: dict[str, Callable[[str, str], None]]
    ) -> None:
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
        if match is None or not all(map(_PART.fullmatch, match[2].split("."))):
            raise InputError(flag, text, "name:=value")
        try:
            self._rules.add_value(match[1] or "/**", match[2], match[3])
        except ValueError as error:
            raise InputError(flag, text, "name:=value", str(error)) from None

    def _remap(self, flag: str, text: str) -> None:
        if match := _NAME_RULE.fullmatch(text):
            self._names.append((match[1] or "", match[2]))
        elif match := _NAMESPACE_RULE.fullmatch(text):
            self._namespaces.append((match[1] or "", match[2]))
        elif not _TOPIC_RULE.fullmatch(text):
            raise InputError(flag, text, "from:=to, __node:=name or __ns:=/namespace")

    def _file(self, flag: str, text: str) -> None:
        content, alone = read_text(flag, Path(text), limits.YAML), ParameterRules()
        try:
            self._rules.add_file(content)
            alone.add_file(content)
        except ValueError as error:
            raise InputError(flag, text, "a ROS 2 parameter file", str(error)) from None
        self._files.append((text, alone))

    def _log_level(self, flag: str, text: str) -> None:
        logger, separator, level = text.partition(":=")
        level = level if separator else logger
        if level.lower() not in _LEVELS or (separator and not logger):
            allowed = "debug, info, warn, error, fatal or unset, also NAME:=LEVEL"
            raise InputError(flag, text, allowed)

    def _log_config(self, flag: str, text: str) -> None:
        if text:
            raise InputError(flag, text, "nothing", "The logger of ROS 2 takes none (spdlog).")

    def _enclave(self, flag: str, text: str) -> None:
        if not _ENCLAVE.fullmatch(text):
            raise InputError(flag, text, "an absolute name, such as /enclave")

    def _check_rclpy_parameters(self) -> None:
        for name, value in self.overrides.items():
            if is_rclpy_parameter(name) and "." not in name and not isinstance(value, bool):
                raise InputError(name, value, "true or false")


def _first(rules: Sequence[tuple[str, str]], node: str) -> str:
    """The replacement of the first rule for a node; empty: none is for it."""
    return next((new for wanted, new in rules if wanted in ("", node)), "")
