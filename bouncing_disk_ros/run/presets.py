"""Presets: named sets of parameters in share/config, keyed `/**:` as ROS parameter files."""

from __future__ import annotations

from pathlib import Path

from bouncing_disk_ros import parameters
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.folders import share_directory
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.run.yaml_file import named_file, read_yaml

PRESET_KEY = "/**"
"""A wildcard, so that a namespace or another node name keeps the values."""


def preset_names() -> list[str]:
    """Names of the presets that come with the package.

    >>> preset_names()
    """
    files = _folder().glob("*.yaml")
    return sorted(file.stem for file in files if _is_preset(file))


def load_preset(name: str) -> dict[str, Value]:
    """The values of a preset, all checked: a name in share/config, or the path of a YAML file.

    >>> load_preset("pizza_multiple_toss")["axial_amplitude"]
    """
    path = named_file("preset", name, _folder, preset_names)
    content = read_yaml("preset", name, path)
    try:
        values = content[PRESET_KEY]["ros__parameters"]
        if not isinstance(values, dict):
            raise TypeError
    except (TypeError, KeyError):
        allowed = f"'{PRESET_KEY}: ros__parameters:' and below it names and values"
        raise InputError("preset", str(path), allowed) from None
    try:
        if "preset" in values:
            raise InputError("preset", values["preset"], "no preset within a preset")
        return parameters.checked({str(key): value for key, value in values.items()})
    except InputError as error:
        field = f"preset {path.name}, {error.field}"
        raise InputError(field, error.given, error.allowed, error.hint) from None


def _folder() -> Path:
    return share_directory() / "config"


def _is_preset(file: Path) -> bool:
    return f"{PRESET_KEY}:" in file.read_text(encoding="utf-8")
