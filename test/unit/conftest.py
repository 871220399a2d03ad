"""A process without settings: what the tests of folders and of the environment start from."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

import pytest


@pytest.fixture
def clean(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> pytest.MonkeyPatch:
    """No setting at all, a usable HOME at tmp_path/home and temporary files at tmp_path/tmp."""
    for name in list(os.environ):
        if name.startswith(("ROS_", "RMW_", "XDG_", "NUMBA_", "MPL", "FAST", "AMENT_", "HOME")):
            monkeypatch.delenv(name)
    for name in ("home", "tmp"):
        (tmp_path / name).mkdir()
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "tmp"))
    return monkeypatch


@pytest.fixture
def no_home(clean: pytest.MonkeyPatch, tmp_path: Path) -> pytest.MonkeyPatch:
    """HOME names a place where no folder can be made, whoever asks (root too)."""
    (tmp_path / "file").touch()
    clean.setenv("HOME", str(tmp_path / "file" / "home"))
    return clean
