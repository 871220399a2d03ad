"""YAML files that a name or a path stands for: presets and programmes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from bouncing_disk_ros import limits
from bouncing_disk_ros.errors import InputError, closest
from bouncing_disk_ros.parsing import read_yaml as parsed
from bouncing_disk_ros.regular_file import read_text


def named_file(
    field: str, name: str, folder: Callable[[], Path], names: Callable[[], Sequence[str]]
) -> Path:
    """The file that `name` stands for: a path, or one of the names in the folder. InputError."""
    if not isinstance(name, str):
        raise InputError(field, name, "a name, or the path of a file")
    if "/" in name or name.endswith((".yaml", ".yml")):
        return Path(name).expanduser()
    path = folder() / f"{name}.yaml"
    if not path.is_file():
        known = names()
        allowed = ", ".join(known) + " or the path of a file"
        raise InputError(field, name, allowed, closest(name, known))
    return path


def read_yaml(field: str, name: str, path: Path) -> Any:
    """The content of the file that `name` stands for. InputError where it cannot be read."""
    try:
        text = read_text(field, path, limits.YAML)
    except InputError as error:
        raise InputError(field, name, "a readable YAML file", error.hint or error.line) from None
    try:
        return parsed(field, text)
    except InputError as error:
        raise InputError(field, str(path), error.allowed, error.hint) from None
