"""Places on a disk: a prefix, the private temporary folder, copies of the source tree."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
#: what a user's clone would not hold, or a build does not need
LEFT_OUT = (".*", "build", "install", "log", "output", "__pycache__", "*.egg-info", "docs")


def copy_tree(target: Path) -> Path:
    """Copy the source tree to `target` (with .gitignore's files left out) and return it."""
    shutil.copytree(ROOT, target, ignore=shutil.ignore_patterns(*LEFT_OUT))
    return target


INDEX = Path("share/ament_index/resource_index")


def private(tmp_path: Path) -> Path:
    return tmp_path / "tmp" / f"bouncing_disk_ros-{os.getuid()}"


def installed(prefix: Path, *resources: str) -> Path:
    for resource in resources:
        file = prefix / INDEX / resource
        file.parent.mkdir(parents=True, exist_ok=True)
        file.touch()
    return prefix
