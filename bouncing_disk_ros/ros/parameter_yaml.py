"""Parameter values and parameter files of ROS 2, read without ROS: as rcl_yaml_param_parser does.

Its rules are neither those of YAML 1.1 nor of 1.2 (`010` is 8, `0o17` and `1_000` are texts, `on`
is true), and a file is read event by event. What rcl makes of odd files is done here too, so that a
command line means the same with ROS and without; the tests compare the two.
"""

from __future__ import annotations

import math
import re
from typing import Any

import yaml

Scalar = bool | int | float | str
Overrides = dict[str, Any]
"""Name of a parameter -> its value: a scalar, a list of scalars of one type, or None."""

_PARSER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_TRUE = {"Y", "y", "yes", "Yes", "YES", "true", "True", "TRUE", "on", "On", "ON"}
_FALSE = {"N", "n", "no", "No", "NO", "false", "False", "FALSE", "off", "Off", "OFF"}
_DOTTED = re.compile(r"\.(?:nan|NaN|NAN)|[+-]?\.(?:inf|Inf|INF)")
_INTEGER = re.compile(r"\s*([+-]?)(?:0[xX]([0-9a-fA-F]+)|(0[0-7]*)|([1-9][0-9]*))", re.ASCII)
_DECIMAL = re.compile(r"\s*[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)
_HEXADECIMAL = re.compile(
    r"\s*[+-]?0[xX](?:[0-9a-fA-F]+\.?[0-9a-fA-F]*|\.[0-9a-fA-F]+)(?:[pP][+-]?\d+)?", re.ASCII
)
_NO_NUMBER = re.compile(r"\s*([+-]?)(?:(inf|infinity)|nan(?:\(\w*\))?)", re.ASCII | re.IGNORECASE)
_TINY = 2.2250738585072014e-308
"""The least normal double: strtod reports a range error below it."""
_KINDS = (bool, int, float, str)
_TEXT_TAG = "tag:yaml.org,2002:str"


# --- scalars --------------------------------------------------------------------------------------
def scalar_of(text: str, *, quoted: bool = False) -> Scalar:
    """The value of a YAML scalar as rcl reads it: bool, integer, double or text."""
    if quoted:
        return text
    if text in _TRUE or text in _FALSE:
        return text in _TRUE
    integer = _integer(text)
    if integer is not None:
        return integer
    double = _double(text)
    return text if double is None else double


def _integer(text: str) -> int | None:
    """What C's strtol makes of a text with base 0; None: not the whole text, or out of range."""
    match = _INTEGER.fullmatch(text)
    if match is None:
        return None
    sign, hexadecimal, octal, decimal = match.groups()
    digits = hexadecimal or octal or decimal
    if len(digits) > 30:
        return None
    value = int(digits, 16 if hexadecimal else 8 if octal else 10) * (-1 if sign == "-" else 1)
    return value if -(2**63) <= value < 2**63 else None


def _double(text: str) -> float | None:
    """What C's strtod makes of a text; None: not the whole text, or out of range."""
    if _DOTTED.fullmatch(text):
        return float(text.replace(".", "").lower())
    if match := _NO_NUMBER.fullmatch(text):
        size = math.inf if match[2] else math.nan
        return -size if match[1] == "-" else size
    try:
        if _DECIMAL.fullmatch(text):
            value = float(text)
            zero = not re.search("[1-9]", re.split("[eE]", text)[0])
        elif _HEXADECIMAL.fullmatch(text):
            value = float.fromhex(text.strip())
            zero = not re.search("[1-9a-fA-F]", re.split("[pP]", text)[0].lower().split("x")[1])
        else:
            return None
    except OverflowError:
        return None
    in_range = zero or _TINY <= abs(value) < math.inf
    return value if in_range else None


# --- values of parameters -------------------------------------------------------------------------
class _Slots:
    """The values of one parameter: one for each type, of which the first in rcl's order counts."""

    def __init__(self) -> None:
        self._scalars: dict[type, Scalar] = {}
        self._arrays: dict[type, list[Scalar]] = {}

    def put(self, value: Scalar) -> None:
        self._scalars[type(value)] = value

    def begin_array(self, value: Scalar) -> None:
        self._arrays[type(value)] = [value]

    def append(self, value: Scalar) -> None:
        self._arrays[type(value)].append(value)

    @property
    def value(self) -> Scalar | list[Scalar] | None:
        for slots in (self._scalars, self._arrays):
            for kind in _KINDS:
                if kind in slots:
                    return slots[kind]
        return None


class _ValueReader:
    """Puts scalars into the slots of a parameter, alone or as elements of a list."""

    def __init__(self) -> None:
        self.in_list = False
        self._kind: type | None = None

    def begin_list(self) -> None:
        self.in_list, self._kind = True, None

    def take(self, event: Any, slots: _Slots) -> None:
        quoted = event.style in ("'", '"')
        if not event.value and not quoted:
            raise ValueError("there is no value")
        value = scalar_of(event.value, quoted=quoted or event.tag == _TEXT_TAG)
        if not self.in_list:
            slots.put(value)
        elif self._kind is None:
            self._kind = type(value)
            slots.begin_array(value)
        elif self._kind is type(value):
            slots.append(value)
        else:
            raise ValueError("the values of a list are of one type")


class ParameterRules:
    """All that parameter files and `-p` rules say, by name of a node, in the order of rcl."""

    def __init__(self) -> None:
        self._nodes: dict[str, list[tuple[str, _Slots]]] = {}

    def add_value(self, node: str, name: str, text: str) -> None:
        """Take a rule `node:name:=text`; ValueError where the text is no value."""
        if not text:
            raise ValueError("there is no value")
        rows = self._nodes.setdefault(node, [])
        slots = rows[_place(rows, name)][1]
        reader = _ValueReader()
        for event in _events(text):
            match event:
                case yaml.ScalarEvent():
                    reader.take(event, slots)
                case yaml.SequenceStartEvent():
                    reader.begin_list()
                case yaml.SequenceEndEvent():
                    reader.in_list = False
                case yaml.MappingStartEvent() | yaml.MappingEndEvent() | yaml.AliasEvent():
                    raise ValueError("a mapping or an alias is no value")

    def add_file(self, text: str) -> None:
        """Take a parameter file; ValueError where it is none."""
        reader = _FileReader(self._nodes)
        for event in _events(text):
            reader.take(event)

    def overrides(self, node: str) -> Overrides:
        """What the rules say for a node of this full name, such as /namespace/name."""
        found: Overrides = {}
        for pattern, rows in self._nodes.items():
            if _matches(pattern, node):
                found.update({name: slots.value for name, slots in rows})
        return found


def _events(text: str) -> Any:
    try:
        yield from yaml.parse(text, Loader=_PARSER)
    except yaml.YAMLError as error:
        raise ValueError(" ".join(str(error).split())) from None


def _place(rows: list[tuple[str, _Slots]], name: str) -> int:
    """Where a parameter stands among those of a node; entered if it is new."""
    for place, (known, _) in enumerate(rows):
        if known == name:
            return place
    rows.append((name, _Slots()))
    return len(rows) - 1


def _matches(pattern: str, node: str) -> bool:
    """Whether a name of a parameter file stands for a node: * is one word, ** any number."""
    whole = pattern if pattern.startswith("/") else f"/{pattern}"
    parts = re.split(r"(/\*\*|/\*)", whole)
    regex = "".join({"/**": r"(/\w+)*", "/*": r"/\w+"}.get(part, re.escape(part)) for part in parts)
    return re.fullmatch(regex, node, re.ASCII) is not None


# --- files ----------------------------------------------------------------------------------------
_PARAMETERS = "ros__parameters"
_WORD = re.compile(r"[A-Za-z_][A-Za-z0-9_]*", re.ASCII)


class _FileReader:
    """Reads the events of one parameter file into the rows of each node.

    Above `ros__parameters` keys are parts of the name of a node, below it parts of the name of a
    parameter.
    """

    def __init__(self, nodes: dict[str, list[tuple[str, _Slots]]]) -> None:
        self._nodes = nodes
        self._node: str | None = None  # whose parameters are read
        self._place = 0  # of the current parameter
        self._node_name, self._node_parts = "", 0
        self._prefix, self._prefix_parts = "", 0  # of parameters
        self._depth = 0
        self._in_parameters = self._new_map = False
        self._at_key = True
        self._values = _ValueReader()

    def take(self, event: Any) -> None:
        """Take the next event; ValueError where it does not belong there."""
        match event:
            case yaml.ScalarEvent() if self._at_key:
                if not event.value:
                    raise ValueError("there is no key")
                (self._parameter_key if self._in_parameters else self._node_key)(event.value)
                self._at_key = False
            case yaml.ScalarEvent():
                self._value(event)
            case yaml.SequenceStartEvent():
                if self._at_key or not self._in_parameters:
                    raise ValueError("a list stands where a name belongs")
                self._values.begin_list()
            case yaml.SequenceEndEvent():
                self._values.in_list = False
                self._at_key = True
            case yaml.MappingStartEvent():
                self._depth += 1
                self._at_key = True
                self._new_map = not (self._in_parameters and self._depth == self._node_parts + 3)
            case yaml.MappingEndEvent():
                self._end_map()
            case yaml.AliasEvent():
                raise ValueError("aliases are not supported")

    def _value(self, event: Any) -> None:
        rows = self._nodes.get(self._node, []) if self._node is not None else []
        if not self._in_parameters or not rows:
            raise ValueError(f"a value stands before {_PARAMETERS}")
        self._values.take(event, rows[self._place][1])
        if not self._values.in_list:
            self._at_key = True

    def _node_key(self, key: str) -> None:
        if not key.startswith(_PARAMETERS):
            above = f"{self._node_name.removesuffix('/')}/" if self._node_parts else ""
            self._node_name = above + key
            self._node_parts += 1
            return
        if not self._node_parts:
            raise ValueError(f"no name of a node stands before {_PARAMETERS}")
        check_node_pattern(self._node_name)
        self._node = self._node_name
        self._nodes.setdefault(self._node, [])
        self._leave_node()
        self._in_parameters = True

    def _parameter_key(self, key: str) -> None:
        assert self._node is not None
        rows = self._nodes[self._node]
        if self._new_map:
            if self._place >= len(rows):
                raise ValueError("a mapping stands where a value belongs")
            self._prefix = rows[self._place][0]
            self._prefix_parts += 1
            self._new_map = False
        if not self._prefix_parts:
            self._place = _place(rows, key)
        else:
            self._place = _place(rows, self._prefix)
            rows[self._place] = (f"{self._prefix}.{key}", rows[self._place][1])

    def _end_map(self) -> None:
        if self._in_parameters and self._prefix_parts:
            self._prefix = self._prefix.rpartition(".")[0]
            self._prefix_parts -= 1
        elif self._in_parameters:
            self._in_parameters = False
        elif self._depth == self._node_parts + 1:
            self._leave_node()
        self._depth -= 1

    def _leave_node(self) -> None:
        if self._node_parts:
            self._node_parts -= 1
            self._node_name = self._node_name.rpartition("/")[0] if self._node_parts else ""


def check_node_pattern(name: str) -> None:
    """ValueError unless this can stand for nodes in a parameter file: words, * and **."""
    words = name.removeprefix("/").split("/")
    for word in words:
        if word not in ("*", "**") and not _WORD.fullmatch(word):
            raise ValueError(f"{name!r} is no name of a node")
