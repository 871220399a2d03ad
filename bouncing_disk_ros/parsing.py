"""JSON and YAML from outside: read within limits, or refused with one line (InputError).

Nothing here recurses over the text, expands an alias, makes an object of a program or lets a
number overflow.
"""

from __future__ import annotations

import json
import math
import re
from typing import Any

import yaml

from bouncing_disk_ros import limits
from bouncing_disk_ros.errors import InputError

_PARSER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # ten times as fast, where it is
_OTHER = re.compile(r"[^\[\]{}]+")
_CORE = "tag:yaml.org,2002:"
_NUMBER_LENGTH = 64
"""A plain scalar longer than this is a text, whatever it looks like."""


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


# --- YAML -----------------------------------------------------------------------------------------
def read_yaml(field: str, text: str, most: int = limits.YAML) -> Any:
    """The content of a YAML text: lists, mappings, texts, numbers, true, false, null.

    `field` names it in the InputError; `most`: characters. Aliases, anchors, merges, tags of
    programs, keys given twice, and what exceeds the limits are refused. Dates are texts.
    """
    if len(text) > most:
        raise InputError(field, f"{len(text)} characters", f"at most {most}")
    builder = _Builder()
    try:
        for event in yaml.parse(text, Loader=_PARSER):
            builder.take(event)
    except (yaml.YAMLError, ValueError, KeyError) as error:  # KeyError: !!bool of another word
        raise InputError(field, text, "valid YAML", str(error)) from None
    return builder.root


class _Builder:
    """Builds the content from the parser's events; ValueError where a limit is exceeded."""

    def __init__(self) -> None:
        self.root: Any = None
        self._open: list[Any] = []  # lists and mappings that have begun
        self._keys: list[Any] = []  # of each: the key that waits for its value
        self._count = self._documents = 0
        self._resolver: Any = yaml.resolver.Resolver()
        self._constructor: Any = yaml.constructor.SafeConstructor()

    def take(self, event: yaml.Event) -> None:
        """Take the next event."""
        match event:
            case yaml.ScalarEvent():
                self._check(event)
                self._put(self._scalar(event))
            case yaml.SequenceStartEvent():
                self._begin(event, [], "seq")
            case yaml.MappingStartEvent():
                self._begin(event, {}, "map")
            case yaml.SequenceEndEvent() | yaml.MappingEndEvent():
                self._open.pop()
                self._keys.pop()
            case yaml.AliasEvent():
                raise ValueError("an alias (*name): write the value itself")
            case yaml.DocumentStartEvent():
                self._documents += 1
                if self._documents > 1:
                    raise ValueError("a second document")

    def _check(self, event: Any) -> None:
        self._count += 1
        if self._count > limits.YAML_NODES:
            raise ValueError(f"more than {limits.YAML_NODES} values")
        if event.anchor is not None:
            raise ValueError("an anchor (&name)")

    def _begin(self, event: Any, content: Any, kind: str) -> None:
        self._check(event)
        if event.tag not in (None, "!", _CORE + kind):
            raise ValueError(f"the tag {event.tag}")
        if len(self._open) >= limits.YAML_DEPTH:
            raise ValueError(f"more than {limits.YAML_DEPTH} levels")
        self._put(content)
        self._open.append(content)
        self._keys.append(_NO_KEY)

    def _put(self, value: Any) -> None:
        if not self._open:
            self.root = value
            return
        into = self._open[-1]
        if isinstance(into, list):
            into.append(value)
        elif self._keys[-1] is _NO_KEY:
            if isinstance(value, (list, dict)):
                raise ValueError("a list or a mapping as a key")
            if value in into:
                raise ValueError(f"the key {value!r} is given twice")
            self._keys[-1] = value
        else:
            into[self._keys[-1]], self._keys[-1] = value, _NO_KEY

    def _scalar(self, event: Any) -> Any:
        text = event.value
        tag = event.tag
        if tag is None or tag == "!":
            tag = self._resolver.resolve(yaml.ScalarNode, text, event.implicit)
        kind = tag.removeprefix(_CORE)
        if kind == "merge":
            raise ValueError("a merge (<<)")
        if kind == "null":
            return None
        if kind in ("int", "float") and len(text) > _NUMBER_LENGTH:
            raise ValueError(f"a number of {len(text)} characters")
        node = yaml.ScalarNode(_CORE + kind, text)
        match kind:
            case "bool":
                return self._constructor.construct_yaml_bool(node)
            case "int":
                value = self._constructor.construct_yaml_int(node)
                if abs(value) >= 10**limits.DIGITS:
                    raise ValueError(f"a whole number of more than {limits.DIGITS} digits")
                return value
            case "float":
                return self._constructor.construct_yaml_float(node)
            case "str" | "timestamp" | "value":
                return text
        raise ValueError(f"the tag {tag}")


_NO_KEY = object()
