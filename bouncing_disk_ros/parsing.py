"""JSON, YAML and tables of text from outside: read within limits, or refused (InputError).

Nothing here recurses deeper than its limit, expands an alias, makes an object of a program or lets
a number overflow.
"""

from __future__ import annotations

import contextlib
import csv
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
from bouncing_disk_ros.regular_file import read_bytes

_PARSER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # ten times as fast, where it is
_OTHER = re.compile(r"[^\[\]{}]+")
_TEXT = "tag:yaml.org,2002:str"
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
_CLOCK = re.compile(r"(?:(\d{1,9}):)?(\d{1,9}):(\d\d)[.,](\d+)", re.ASCII)
"""hh:mm:ss.sss or mm:ss.sss."""
_NO_ROW = re.compile(r"#|\\|sep=", re.IGNORECASE)
"""Comments, frequencies of Audacity's labels, and the separator that spreadsheets name."""
_CONTROLS = re.compile(rb"[\x00-\x08\x0e-\x1f]")
_UTF_16 = (b"\xff\xfe", b"\xfe\xff")
_COMMA_NUMBERS = re.compile(rf"{_COMMA_NUMBER}(?:\s+{_COMMA_NUMBER})+")


def read_table(
    field: str, path: Path, most: int, lines: int = sys.maxsize,
    is_header: Callable[[list[str]], bool] | None = None,
) -> tuple[list[str], list[list[str]]]:  # fmt: skip
    """Names of the columns and cells of a text file; lines with # are left out.

    At most `most` bytes and `lines` lines. Lines before names that `is_header` knows are left out.
    Cells are separated by semicolons or tabs (then numbers may have decimal commas), else by
    commas, else by blanks, and may have quotes. The first line has names (in small letters then)
    where it begins with no number; else there are none. Times of a clock, 0:01.25, become seconds.
    UTF-8, UTF-16, or a Windows text. Lines of separators alone are empty. InputError, naming
    `field`.
    """
    text = _decoded(field, path, read_bytes(field, path, most))
    if (count := text.count("\n")) > lines:
        raise InputError(field, f"{count} lines", f"at most {lines}")
    kept = [line.strip() for line in text.splitlines()]
    kept = [line for line in kept if line.strip(",;\t ") and not _NO_ROW.match(line)]
    heads = []
    for line in kept:
        if number_of(_cells(line)[0]) is not None:
            break
        heads.append(_names(line))
    start = next((i for i, names in enumerate(heads) if is_header and is_header(names)), 0)
    names = heads[start] if heads else []
    return names, [_cells(line) for line in kept[start + bool(heads) :]]


def _decoded(field: str, path: Path, content: bytes) -> str:
    """The text of a file: UTF-16 with its mark, else UTF-8, else of Windows."""
    encodings = ["utf-8-sig"] if _CONTROLS.search(content) else ["utf-8-sig", "cp1252"]
    for encoding in ["utf-16"] if content.startswith(_UTF_16) else encodings:
        with contextlib.suppress(UnicodeDecodeError):
            return content.decode(encoding)
    raise InputError(field, str(path), "a readable text in UTF-8")


def _names(line: str) -> list[str]:
    """The names of columns, in small letters; a unit belongs to the name before it."""
    return [name.lower() for name in _cells(re.sub(r"\s+(?=[(\[])", "", line))]


def _cells(line: str) -> list[str]:
    """The cells of one line."""
    line, has_commas = line.rstrip(",;"), True
    if re.search(r"[;\t]", line) or _COMMA_NUMBERS.fullmatch(line):
        found = re.split(r"[;\t]" if re.search(r"[;\t]", line) else r"\s+", line)
    elif '"' in line and "," in line:
        found = next(csv.reader([line], skipinitialspace=True))
    else:
        found, has_commas = line.split(",") if "," in line else line.split(), False
    return [_cell(text.strip("\"' "), has_commas) for text in found]


def _cell(text: str, has_commas: bool) -> str:
    """A cell with a decimal point in its number; a clock's time in seconds."""
    if clock := _CLOCK.fullmatch(text):
        hours, minutes, seconds, part = clock.groups(default="0")
        return f"{3600 * int(hours) + 60 * int(minutes) + int(seconds)}.{part}"
    return text.replace(",", ".") if has_commas and re.fullmatch(_COMMA_NUMBER, text) else text


def number_of(text: str) -> float | None:
    """The number that a cell of a table is; None: another text."""
    try:
        return None if "_" in text else float(text)  # Python's 1_0 is 10
    except ValueError:
        return None


# --- YAML -----------------------------------------------------------------------------------------
_NULLS = ("", "~", "null", "Null", "NULL")
_WORDS = {
    form: word in ("true", "yes", "on")
    for word in ("true", "yes", "on", "false", "no", "off")
    for form in (word, word.title(), word.upper())
}
_NUMBER = re.compile(
    r"[+-]?(?:(0|[1-9]\d*)|(?:\d+\.\d*|\.\d+|(?:0|[1-9]\d*)(?=[eE]))(?:[eE][+-]?\d+)?"
    r"|\.?(?:inf|Inf|INF))|\.?(?:nan|NaN|NAN)", re.ASCII,
)  # fmt: skip
"""Decimal numbers, infinities and nan; group 1: whole numbers."""
_SEVERAL = re.compile(
    r"[yn]|[+-]?(?:0\d+(?:e[+-]?\d+)?|0x[\da-f.p+-]+|inf(?:inity)?|nan(?:\(\w*\))?)",
    re.ASCII | re.IGNORECASE,
)
"""Booleans and numbers of ROS (C's strtol and strtod) that are texts to YAML, or other numbers."""


def value_of(text: str) -> bool | int | float | str:
    """What a YAML scalar without quotes means: true or false, a number, or its text.

    A number is one that YAML and ROS read alike: `1`, `+5`, `1e-3`, `.5`, `5.`, `.inf`, `nan`.
    `1_0`, `1:30` and dates are texts. ValueError for what they read differently, such as octals,
    hexadecimals and `y`, and where there is no value.
    """
    if text in _WORDS:
        return _WORDS[text]
    if text in _NULLS:
        raise ValueError("there is no value")
    match = _NUMBER.fullmatch(text)
    if match is None:
        if _SEVERAL.fullmatch(text):
            how = "a decimal number, true or false, or quotes around a text"
            raise ValueError(f"{text} has several meanings: write {how}")
        return text
    if len(text) > _NUMBER_LENGTH:
        raise ValueError(f"a number of {len(text)} characters")
    if match[1]:
        if not -(2**63) <= int(text) < 2**63:
            raise ValueError(f"{text} has more than 64 bits")
        return int(text)
    value = float(re.sub(r"\.(?=[a-zA-Z])", "", text))  # .inf is inf
    is_exact = not re.search(r"[1-9]", text.lower().partition("e")[0])  # 0, inf, nan
    return value if is_exact or sys.float_info.min <= abs(value) < math.inf else text


def text_of(text: str) -> str | None:
    """A YAML scalar as it is written; None where it says that there is none."""
    return None if text in _NULLS else text


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
    events = _events(text)
    try:
        next(events)  # the stream begins
        if isinstance(next(events), yaml.StreamEndEvent):
            return None
        found = _node(next(events), events, plain, 0)
        next(events)  # the document ends
        if not isinstance(next(events), yaml.StreamEndEvent):
            raise ValueError("a second document")
    except (yaml.YAMLError, ValueError) as error:
        raise InputError(field, text, "valid YAML", str(error)) from None
    return found


def _events(text: str) -> Iterator[Any]:
    """The parser's events; ValueError for what no text here may have."""
    count = 0
    for event in yaml.parse(text, Loader=_PARSER):
        count += isinstance(event, yaml.NodeEvent)
        if count > limits.YAML_NODES:
            raise ValueError(f"more than {limits.YAML_NODES} values")
        if getattr(event, "anchor", None) is not None:
            raise ValueError("an anchor (&name) or an alias (*name): write the value itself")
        if (tag := getattr(event, "tag", None)) not in (None, _TEXT):
            raise ValueError(f"the tag {tag}")
        yield event


def _node(event: Any, events: Iterator[Any], plain: Callable[[str], Any], depth: int) -> Any:
    """What begins with an event, within so many lists and mappings."""
    if isinstance(event, yaml.ScalarEvent):
        return _scalar(event, plain)
    if depth >= limits.YAML_DEPTH:
        raise ValueError(f"more than {limits.YAML_DEPTH} levels")
    below = takewhile(lambda one: not isinstance(one, yaml.CollectionEndEvent), events)
    if isinstance(event, yaml.SequenceStartEvent):
        return [_node(one, events, plain, depth + 1) for one in below]
    found: dict[str, Any] = {}
    for one in below:
        if not isinstance(one, yaml.ScalarEvent):
            raise ValueError("a list or a mapping as a key")
        if one.value in found or one.value in ("", "<<"):
            raise ValueError(f"the key {one.value!r} is empty, a merge, or given twice")
        found[one.value] = _node(next(events), events, plain, depth + 1)
    return found


def _scalar(event: Any, plain: Callable[[str], Any]) -> Any:
    is_text = event.style in ("'", '"') or event.tag is not None
    value = event.value if is_text else plain(event.value)
    if event.style in ("|", ">") and value != event.value:
        raise ValueError("a number, true or false as a block of text")
    return value
