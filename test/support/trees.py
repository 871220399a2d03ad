"""Copies of the source tree, to install and build without touching the one under test."""

from __future__ import annotations

import shutil
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
#: what a user's clone would not hold, or a build does not need
LEFT_OUT = (".*", "build", "install", "log", "output", "__pycache__", "*.egg-info", "docs")


def copy_tree(target: Path) -> Path:
    """Copy the source tree to `target` (with .gitignore's files left out) and return it."""
    shutil.copytree(ROOT, target, ignore=shutil.ignore_patterns(*LEFT_OUT))
    return target
