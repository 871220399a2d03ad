"""Message types as a bag needs them: full definitions with all dependencies, and type hashes.

Both come from share/<package>/msg of the prefixes of the package index (AMENT_PREFIX_PATH). Where a
package is not installed there, the standard types are those of ROS 2 Jazzy that `rosbags` has.
"""

from __future__ import annotations

import functools
import json
import re
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bouncing_disk_ros import folders
from bouncing_disk_ros.errors import InputError

ENCODING = "ros2msg"
SEPARATOR = "=" * 80
_PRIMITIVES = frozenset(("bool", "byte", "char", "string", "wstring", "float32", "float64"))
_INTEGER = re.compile(r"u?int(8|16|32|64)")
_FIELD = re.compile(r"^\s*([A-Za-z][\w/]*)(?:<=\d+)?(?:\[[^\]]*\])?\s+[A-Za-z]\w*")


@dataclass(frozen=True)
class Schema:
    """A message type: `pkg/msg/Name`, its definition with all dependencies, its RIHS01 hash."""

    name: str
    text: str
    type_hash: str


@functools.cache
def schema_of(name: str) -> Schema:
    """The schema of a message type `pkg/msg/Name`; InputError when its definition is not found."""
    own = _definition(name)
    parts, seen = [own], [name]
    todo = _dependencies(name, own)
    while todo:
        dependency = todo.pop(0)
        if dependency in seen:
            continue
        seen.append(dependency)
        text = _definition(dependency)
        package, _, short = dependency.split("/")
        parts.append(f"{SEPARATOR}\nMSG: {package}/{short}\n{text}")
        todo += _dependencies(dependency, text)
    return Schema(name, "\n".join(part.rstrip("\n") for part in parts) + "\n", _hash(name))


def _dependencies(name: str, text: str) -> list[str]:
    """The message types that a definition mentions, in order, full names."""
    package = name.split("/")[0]
    found = []
    for line in text.splitlines():
        match = _FIELD.match(line.partition("#")[0])
        if match is None or match[1] in _PRIMITIVES or _INTEGER.fullmatch(match[1]):
            continue
        parts = match[1].split("/")
        if parts == ["Header"]:
            parts = ["std_msgs", "Header"]
        found.append(f"{parts[0] if len(parts) > 1 else package}/msg/{parts[-1]}")
    return found


def _definition(name: str) -> str:
    try:
        return _file(name, ".msg").read_text(encoding="utf-8")
    except InputError:
        if name not in (store := _jazzy()).fielddefs:
            raise
    text: str = store.generate_msgdef(name, ros_version=2)[0]
    return text.partition(SEPARATOR)[0]


def _hash(name: str) -> str:
    """The hash that the middleware announces for the type; empty when the package names none."""
    try:
        content = json.loads(_file(name, ".json").read_text(encoding="utf-8"))
        rows = {row["type_name"]: row["hash_string"] for row in content["type_hashes"]}
    except InputError:  # no such package here
        store = _jazzy()
        return store.hash_rihs01(name) if name in store.fielddefs else ""
    except (ValueError, KeyError):
        return ""
    return str(rows.get(name, ""))


@functools.cache
def _jazzy() -> Any:
    """The standard types of ROS 2 Jazzy, as `rosbags` knows them."""
    from rosbags.typesys import Stores, get_typestore

    return get_typestore(Stores.ROS2_JAZZY)


def _file(name: str, suffix: str) -> Path:
    package, kind, short = _parts(name)
    for prefix in [*folders.prefixes(), Path(sys.prefix)]:
        path = prefix / "share" / package / kind / f"{short}{suffix}"
        if path.is_file():
            return path
    hint = f"Install the package {package} (or source its workspace); its share/ is searched."
    raise InputError("message type", name, "a type whose .msg file is installed", hint)


def _parts(name: str) -> tuple[str, str, str]:
    parts = name.split("/")
    if len(parts) != 3 or parts[1] != "msg":
        raise InputError("message type", name, "package/msg/Name")
    return parts[0], parts[1], parts[2]
