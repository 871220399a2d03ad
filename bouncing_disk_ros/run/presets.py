"""YAML files that a name or a path stands for, and the presets of parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from bouncing_disk_ros import limits, parameters
from bouncing_disk_ros.errors import InputError, closest
from bouncing_disk_ros.folders import share_directory, user_path
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.parsing import read_yaml
from bouncing_disk_ros.regular_file import read_text

AT_REST: Mapping[str, Value] = {
    "axial_amplitude": 0.0,
    "angular_amplitude": 0.0,
    "initial_with_platform": True,
    "initial_axial_velocity": 0.0,
    "initial_forcing_phase": parameters.DEFAULTS["initial_forcing_phase"],
}
"""Instead of a preset's start, which may be on an orbit: at rest, at the lowest point."""


def named_file(
    field: str, name: str, folder: Callable[[], Path], names: Callable[[], Sequence[str]]
) -> Path:
    """The file that `name` stands for: a path, or one of the names in the folder. InputError."""
    if not isinstance(name, str):
        raise InputError(field, name, "a name, or the path of a file")
    if "/" in name or name.endswith((".yaml", ".yml")):
        return user_path(name)
    path = folder() / f"{name}.yaml"
    if not path.is_file():
        known = names()
        allowed = ", ".join(known) + " or the path of a file"
        raise InputError(field, name, allowed, closest(name, known))
    return path


def read_yaml_file(field: str, name: str, path: Path) -> Any:
    """The content of the file that `name` stands for. InputError where it cannot be read."""
    try:
        text = read_text(field, path, limits.YAML)
    except InputError as error:
        raise InputError(field, name, "a readable YAML file", error.hint or error.line) from None
    try:
        return read_yaml(field, text)
    except InputError as error:
        raise InputError(field, str(path), error.allowed, error.hint) from None


# ------------------------------------------------------------------------------------------------
# Presets: named sets of parameters in share/config, keyed `/**:` as ROS parameter files.


PRESET_KEY = "/**"
"""A wildcard, so that a namespace or another node name keeps the values."""


def preset_names() -> list[str]:
    """Names of the presets that come with the package.

    >>> preset_names()
    """
    files = _folder().glob("*.yaml")
    return sorted(file.stem for file in files if _is_preset(file))


def load_preset(name: str) -> dict[str, Value]:
    """Values of a preset, all checked: a name in share/config, or the path of a YAML file.

    >>> load_preset("pizza_multiple_toss")["axial_amplitude"]
    """
    path = named_file("preset", name, _folder, preset_names)
    content = read_yaml_file("preset", name, path)
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
        raise error.inside(f"preset {path.name}, ") from None


def _folder() -> Path:
    return share_directory() / "config"


def _is_preset(file: Path) -> bool:
    return f"{PRESET_KEY}:" in file.read_text(encoding="utf-8")
