"""Where modules are looked for under `python -m`."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

import bouncing_disk_ros
from bouncing_disk_ros.command_line.safe_path import leave_current_folder_out

ROOT = Path(bouncing_disk_ros.__file__).resolve().parents[1]


@pytest.fixture
def search(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> pytest.MonkeyPatch:
    """As `python -m` has it while it looks for its module, in a folder of somebody's."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["-m"])
    monkeypatch.setattr(sys, "path", [str(tmp_path), "/usr/lib/python3", str(tmp_path)])
    monkeypatch.setenv("PYTHONSAFEPATH", "")
    return monkeypatch


def test_the_current_folder_is_left_out_here_and_in_processes(
    search: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    leave_current_folder_out()
    assert sys.path == ["/usr/lib/python3", str(tmp_path)]  # PYTHONPATH may name it too
    assert os.environ["PYTHONSAFEPATH"] == "1"


def test_where_the_package_lies_in_it_it_is_searched_last(search: pytest.MonkeyPatch) -> None:
    search.chdir(ROOT)
    search.setattr(sys, "path", [str(ROOT), "/usr/lib/python3"])
    leave_current_folder_out()
    assert sys.path == ["/usr/lib/python3", str(ROOT)]
    assert os.environ["PYTHONSAFEPATH"] == ""


def test_outside_of_python_m_and_where_it_is_safe_already_nothing_changes(
    search: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    safe = ["/usr/lib/python3", str(tmp_path)]
    cases = [(argv, list(sys.path)) for argv in (["script.py"], ["-c"], [])]
    for argv, path in (*cases, (["-m"], safe)):
        search.setattr(sys, "argv", argv)
        search.setattr(sys, "path", list(path))
        leave_current_folder_out()
        assert sys.path == path
