"""JSON, YAML and tables of text from outside: read within limits, or refused (InputError).

Nothing here recurses deeper than its limit, expands an alias, makes an object of a program or lets
a number overflow.
"""

from __future__ import annotations

import json
import math
import re
import sys
from collections.abc import Callable, Iterator
from itertools import takewhile
from pathlib import Path
from typing import Any

import yaml

from bouncing_disk_ros import limits
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.regular_file import read_text

_PARSER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # ten times as fast, where it is
_OTHER = re.compile(r"[^\[\]{}]+")
_CORE = "tag:yaml.org,2002:"
_TEXT = _CORE + "str"
_NUMBER_LENGTH = 64
"""Characters of the longest number; more are refused before they are converted."""


# --- JSON -----------------------------------------------------------------------------------------
def read_json(field: str, text: str) -> Any:
    """The content of a JSON text; `field` names it in the InputError.

    NaN, infinities, numbers out of range, keys given twice, and what exceeds the limits of size and
    depth are refused.
    """
    if len(text) > limits.JSON:
        raise InputError(field, f"{len(text)} characters", f"at most {limits.JSON}")
    if _json_depth(text) > limits.JSON_DEPTH:
        raise InputError(field, text, f"at most {limits.JSON_DEPTH} levels")
    try:
        return json.loads(
            text, parse_int=_whole, parse_float=_finite, parse_constant=_finite,
            object_pairs_hook=_unique,
        )  # fmt: skip
    except (ValueError, RecursionError) as error:
        raise InputError(field, text, "valid JSON", str(error)) from None


def _json_depth(text: str) -> int:
    """How deep brackets are nested, those in strings left out; at most one beyond the limit."""
    if text.count("[") + text.count("{") <= limits.JSON_DEPTH:
        return 0
    outside = "".join(text.replace("\\\\", "").replace('\\"', "").split('"')[::2])
    depth = deepest = 0
    for letter in _OTHER.sub("", outside):
        depth += 1 if letter in "[{" else -1
        if depth > deepest:
            deepest = depth
            if deepest > limits.JSON_DEPTH:
                break
    return deepest


def _whole(digits: str) -> int:
    if len(digits.lstrip("-")) > limits.DIGITS:
        raise ValueError(f"a number of more than {limits.DIGITS} digits")
    return int(digits)


def _finite(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(f"{text[:40]} is no finite number")
    return value


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) != len(pairs):
        raise ValueError("a key is given twice")
    return found


# --- tables of text -------------------------------------------------------------------------------
_COMMA_NUMBER = r"[+-]?\d+,\d+(?:[eE][+-]?\d+)?"
"""A number with a decimal comma, as some spreadsheets write it."""
_COMMA_NUMBERS = re.compile(rf"{_COMMA_NUMBER}(?:\s+{_COMMA_NUMBER})+")


def read_table(
    field: str, path: Path, most: int, lines: int = sys.maxsize,
    is_header: Callable[[list[str]], bool] | None = None,
) -> tuple[list[str], list[list[str]]]:  # fmt: skip
    """Names of the columns and cells of a text file; lines with # are left out.

    At most `most` bytes and `lines` lines. Lines before names that `is_header` knows are left out.
    Cells are separated by semicolons or tabs (then numbers may have decimal commas), else by
    commas, else by blanks, and may have quotes. The first line has names (in small letters then)
    where it begins with no number; else there are none. InputError, naming `field`.
    """
    text = read_text(field, path, most).removeprefix("\ufeff")
    if (count := text.count("\n")) > lines:
        raise InputError(field, f"{count} lines", f"at most {lines}")
    kept = [line.strip() for line in text.splitlines()]
    kept = [line for line in kept if line and not line.startswith("#")]
    heads = []
    for line in kept:
        if number_of(_cells(line)[0]) is not None:
            break
        heads.append(_names(line))
    start = next((i for i, names in enumerate(heads) if is_header and is_header(names)), 0)
    names = heads[start] if heads else []
    return names, [_cells(line) for line in kept[start + bool(heads) :]]


def _names(line: str) -> list[str]:
    """The names of columns, in small letters; a unit belongs to the name before it."""
    return [name.lower() for name in _cells(re.sub(r"\s+(?=[(\[])", "", line))]


def _cells(line: str) -> list[str]:
    """The cells of one line."""
    line = line.rstrip(",;")
    if re.search(r"[;\t]", line) or _COMMA_NUMBERS.fullmatch(line):
        found = re.split(r"[;\t]" if re.search(r"[;\t]", line) else r"\s+", line)
        bare = [cell.strip("\"' ") for cell in found]
        return [x.replace(",", ".") if re.fullmatch(_COMMA_NUMBER, x) else x for x in bare]
    found = line.split(",") if "," in line else line.split()
    return [cell.strip("\"' ") for cell in found]


def number_of(text: str) -> float | None:
    """The number that a cell of a table is; None: another text."""
    try:
        return float(text)
    except ValueError:
        return None


# --- YAML -----------------------------------------------------------------------------------------
def value_of(text: str) -> Any:
    """What a YAML scalar without quotes means: None, true or false, a number, or its text.

    A number is one that YAML and ROS read alike: `1`, `+5`, `1e-3`, `.5`, `5.`, `.inf`, `nan`.
    Octals, hexadecimals, `1_0`, `1:30` and dates are texts.
    """
    if text in _WORDS:
        return _WORDS[text]
    if _NO_NUMBER.fullmatch(text):
        return float(text.replace(".", ""))
    if not _NUMBER.fullmatch(text):
        return text
    if len(text) > _NUMBER_LENGTH:
        raise ValueError(f"a number of {len(text)} characters")
    if _WHOLE.fullmatch(text):
        if abs(int(text)) >= 10**limits.DIGITS:
            raise ValueError(f"a whole number of more than {limits.DIGITS} digits")
        return int(text)
    value = float(text)
    is_zero = not re.search("[1-9]", re.split("[eE]", text)[0])
    return value if is_zero or sys.float_info.min <= abs(value) < math.inf else text


def ros_value_of(text: str) -> Any:
    """What a YAML scalar without quotes means to ROS; ValueError where `value_of` reads another."""
    value = value_of(text)
    if value is None:
        raise ValueError("there is no value")
    if isinstance(value, str) and _ROS_ONLY.fullmatch(text):
        how = "a decimal number, true or false, or quotes around a text"
        raise ValueError(f"{text} has several meanings: write {how}")
    if isinstance(value, int) and not -(2**63) <= value < 2**63:
        raise ValueError(f"{text} has more than 64 bits")
    return value


def text_of(text: str) -> str | None:
    """A YAML scalar as it is written; None where it says that there is none."""
    return None if text in _WORDS and _WORDS[text] is None else text


_WORDS: dict[str, bool | None] = {
    "": None,
    "~": None,
    **dict.fromkeys(("null", "Null", "NULL"), None),
    **{form: True for word in ("true", "yes", "on") for form in (word, word.title(), word.upper())},
    **{form: False for word in ("false", "no", "off")
       for form in (word, word.title(), word.upper())},
}  # fmt: skip
_WHOLE = re.compile(r"[+-]?(?:0|[1-9]\d*)", re.ASCII)
_NUMBER = re.compile(
    rf"{_WHOLE.pattern}|[+-]?(?:\d+\.\d*|\.\d+|(?:0|[1-9]\d*)(?=[eE]))(?:[eE][+-]?\d+)?", re.ASCII
)
_NO_NUMBER = re.compile(r"[+-]?\.?(?:inf|Inf|INF)|\.?(?:nan|NaN|NAN)")
_ROS_ONLY = re.compile(
    r"[yn]|[+-]?(?:0\d+(?:e[+-]?\d+)?|0x[\da-f.p+-]+|inf(?:inity)?|nan(?:\(\w*\))?)",
    re.ASCII | re.IGNORECASE,
)
"""Booleans and numbers of rcl (C's strtol and strtod) that are texts here."""


def read_yaml(
    field: str, text: str, most: int = limits.YAML, plain: Callable[[str], Any] = value_of
) -> Any:
    """The content of a YAML text: lists, mappings whose keys are texts, and scalars.

    `field` names it in the InputError; `most`: characters; `plain`: what a scalar without quotes
    means. Aliases, anchors, merges, tags, keys given twice, and what exceeds the limits are
    refused.
    """
    if len(text) > most:
        raise InputError(field, f"{len(text)} characters", f"at most {most}")
    try:
        return _Builder(text, plain).content()
    except (yaml.YAMLError, ValueError) as error:
        raise InputError(field, text, "valid YAML", str(error)) from None


class _Builder:
    """Builds the content of a text from the parser's events; ValueError beyond a limit."""

    def __init__(self, text: str, plain: Callable[[str], Any]) -> None:
        self._events: Iterator[Any] = iter(yaml.parse(text, Loader=_PARSER))
        self._plain, self._count = plain, 0

    def content(self) -> Any:
        """The content of the only document; None where there is none."""
        next(self._events)  # the stream begins
        if isinstance(next(self._events), yaml.StreamEndEvent):
            return None
        found = self._node(next(self._events), 0)
        next(self._events)  # the document ends
        if not isinstance(next(self._events), yaml.StreamEndEvent):
            raise ValueError("a second document")
        return found

    def _node(self, event: Any, depth: int) -> Any:
        """What begins with an event, within so many lists and mappings."""
        self._check(event)
        if isinstance(event, yaml.ScalarEvent):
            return self._scalar(event)
        is_list = isinstance(event, yaml.SequenceStartEvent)
        if event.tag not in (None, "!", _CORE + ("seq" if is_list else "map")):
            raise ValueError(f"the tag {event.tag}")
        if depth >= limits.YAML_DEPTH:
            raise ValueError(f"more than {limits.YAML_DEPTH} levels")
        below = takewhile(_is_no_end, self._events)
        if is_list:
            return [self._node(one, depth + 1) for one in below]
        found: dict[str, Any] = {}
        for one in below:
            key = self._key(one)
            if key in found:
                raise ValueError(f"the key {key!r} is given twice")
            found[key] = self._node(next(self._events), depth + 1)
        return found

    def _check(self, event: Any) -> None:
        self._count += 1
        if self._count > limits.YAML_NODES:
            raise ValueError(f"more than {limits.YAML_NODES} values")
        if event.anchor is not None:
            raise ValueError("an anchor (&name) or an alias (*name): write the value itself")

    def _scalar(self, event: Any) -> Any:
        as_text = _is_quoted(event) or event.tag == _TEXT
        value = event.value if as_text else self._plain(event.value)
        if event.style in ("|", ">") and value != event.value:
            raise ValueError("a number, true or false as a block of text")
        return value

    def _key(self, event: Any) -> str:
        self._check(event)
        if not isinstance(event, yaml.ScalarEvent):
            raise ValueError("a list or a mapping as a key")
        key = str(event.value)
        if not _is_quoted(event) and key in ("", "<<"):
            raise ValueError("a merge (<<)" if key else "there is no key")
        return key


def _is_no_end(event: yaml.Event) -> bool:
    return not isinstance(event, yaml.CollectionEndEvent)


def _is_quoted(event: Any) -> bool:
    """Whether a scalar has quotes; ValueError for a tag that is not of texts."""
    quoted = event.style in ("'", '"')
    if event.tag not in ((None, "!", _TEXT) if quoted else (None, _TEXT)):
        raise ValueError(f"the tag {event.tag}")
    return quoted
