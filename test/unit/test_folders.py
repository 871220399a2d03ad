"""Folders that a process finds, or does not find, around it: logs, settings, the package index."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from bouncing_disk_ros import folders
from support.checks import refused
from support.places import installed, private

# logs and matplotlib


@pytest.mark.parametrize(
    ("home", "settings", "logs", "matplotlib"),
    [
        ("usable", {}, None, None),
        ("no folder", {"ROS_LOG_DIR": "TMP/logs"}, "TMP/logs", "PRIVATE/matplotlib"),
        ("no folder", {"ROS_HOME": "TMP/ros"}, None, "PRIVATE/matplotlib"),
        ("no folder", {"XDG_STATE_HOME": "TMP/state", "XDG_CONFIG_HOME": "TMP/config"},
         "TMP/state/bouncing_disk_ros/log", "TMP/config/bouncing_disk_ros/matplotlib"),
        ("unset", {}, "PRIVATE/log", "PRIVATE/matplotlib"),
    ],
)  # fmt: skip
def test_logs_and_settings_go_where_they_can_be_written(
    clean: pytest.MonkeyPatch, tmp_path: Path, home: str, settings: dict[str, str],
    logs: str | None, matplotlib: str | None,
) -> None:  # fmt: skip
    def place(text: str) -> str:
        return text.replace("TMP", str(tmp_path)).replace("PRIVATE", str(private(tmp_path)))

    if home == "no folder":
        (tmp_path / "file").touch()
        clean.setenv("HOME", str(tmp_path / "file" / "home"))
    elif home == "unset":
        clean.delenv("HOME")
    for name, text in settings.items():
        clean.setenv(name, place(text))
    folders.use_log_folder()
    folders.use_matplotlib_folder()
    assert os.environ.get("ROS_LOG_DIR") == (None if logs is None else place(logs))
    assert os.environ.get("MPLCONFIGDIR") == (None if matplotlib is None else place(matplotlib))


def test_with_no_folder_for_logs_the_line_says_what_to_set(
    no_home: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    private(tmp_path).touch()
    folders.use_matplotlib_folder()  # matplotlib then helps itself
    refused(r"ROS_LOG_DIR: .* a folder that can be written", folders.use_log_folder)


# package index


def test_the_prefix_of_the_package_joins_the_index_which_stays_empty_without_one(
    clean: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    prefix = installed(tmp_path / "venv", "packages/bouncing_disk_ros")
    clean.setattr(folders, "__file__", str(prefix / "lib/python3/site-packages/p/folders.py"))
    clean.setenv("AMENT_PREFIX_PATH", f"{tmp_path}/ros")
    folders.use_package_index()
    assert os.environ["AMENT_PREFIX_PATH"] == f"{tmp_path}/ros:{prefix}"
    folders.use_package_index()
    assert os.environ["AMENT_PREFIX_PATH"] == f"{tmp_path}/ros:{prefix}"
    clean.delenv("AMENT_PREFIX_PATH")
    clean.setattr(folders, "__file__", str(tmp_path / "folders.py"))
    clean.setattr("sys.prefix", str(tmp_path))
    folders.use_package_index()
    assert "AMENT_PREFIX_PATH" not in os.environ


# the shared files


def test_the_shared_files_are_those_of_the_source_tree_or_of_the_installed_prefix(
    clean: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    assert (folders.share_directory() / "config" / "fast_discovery.xml").is_file()
    prefix = installed(tmp_path / "venv", "packages/bouncing_disk_ros")
    place = prefix / "lib/python3/site-packages/bouncing_disk_ros/folders.py"
    clean.setattr(folders, "__file__", str(place))
    clean.setattr("sys.prefix", str(tmp_path))  # the package under test may be installed there,
    clean.delenv("AMENT_PREFIX_PATH", raising=False)  # and the lookup above has named it then
    refused("Is the package installed with its share files", folders.share_directory)
    config = prefix / "share/bouncing_disk_ros/config"
    config.mkdir(parents=True)
    assert folders.share_directory() == config.parent


def test_a_name_that_begins_with_a_tilde_is_that_of_a_file(monkeypatch: pytest.MonkeyPatch) -> None:
    """It was a traceback: there is no user of that name."""
    monkeypatch.setenv("HOME", "/home/me")
    assert folders.user_path("~draft.csv") == Path("~draft.csv")
    assert folders.user_path("~/run_1") == Path("/home/me/run_1")
