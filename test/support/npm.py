"""Packages of the npm registry, installed into a temporary folder."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest


def install(manifest: Path, folder: Path) -> None:
    """Install what a package.json names into a folder, or skip the test."""
    for program in ("node", "npm"):
        if shutil.which(program) is None:
            pytest.skip(f"no `{program}` on the PATH: install Node.js 18 or later")
    shutil.copy(manifest, folder)
    command = ["npm", "install", "--no-audit", "--no-fund", "--ignore-scripts"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=240)
    if done.returncode:
        pytest.skip(f"npm cannot install the packages of {manifest}: {done.stderr.strip()[-200:]}")
