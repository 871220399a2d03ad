"""Folders that a process finds, or does not find, around it: logs, settings, the package index."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from bouncing_disk_ros import folders
from bouncing_disk_ros.errors import InputError
from support.places import installed, private

# logs and matplotlib


def test_a_usable_home_needs_no_settings(clean: pytest.MonkeyPatch) -> None:
    folders.use_log_folder()
    folders.use_matplotlib_folder()
    assert not {"ROS_LOG_DIR", "MPLCONFIGDIR"} & os.environ.keys()


@pytest.mark.parametrize("setting", ["ROS_LOG_DIR", "ROS_HOME"])
def test_a_usable_log_folder_of_the_user_stays(
    no_home: pytest.MonkeyPatch, tmp_path: Path, setting: str
) -> None:
    no_home.setenv(setting, str(tmp_path / "logs"))
    folders.use_log_folder()
    assert os.environ.get("ROS_LOG_DIR") in (None, str(tmp_path / "logs"))


def test_without_home_logs_and_settings_go_to_xdg_folders(
    no_home: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    no_home.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    no_home.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    folders.use_log_folder()
    folders.use_matplotlib_folder()
    assert os.environ["ROS_LOG_DIR"] == str(tmp_path / "state/bouncing_disk_ros/log")
    assert os.environ["MPLCONFIGDIR"] == str(tmp_path / "config/bouncing_disk_ros/matplotlib")


def test_without_home_and_xdg_they_go_to_the_temporary_folder(
    no_home: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    no_home.delenv("HOME")
    folders.use_log_folder()
    folders.use_matplotlib_folder()
    assert os.environ["ROS_LOG_DIR"] == str(private(tmp_path) / "log")
    assert os.environ["MPLCONFIGDIR"] == str(private(tmp_path) / "matplotlib")


def test_with_no_folder_for_logs_the_line_says_what_to_set(
    no_home: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    private(tmp_path).touch()
    folders.use_matplotlib_folder()  # matplotlib then helps itself
    with pytest.raises(InputError, match=r"ROS_LOG_DIR: .* a folder that can be written"):
        folders.use_log_folder()


# package index


def test_the_prefix_of_the_package_joins_the_index(
    clean: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    prefix = installed(tmp_path / "venv", "packages/bouncing_disk_ros")
    clean.setattr(folders, "__file__", str(prefix / "lib/python3/site-packages/p/folders.py"))
    clean.setenv("AMENT_PREFIX_PATH", f"{tmp_path}/ros")
    folders.use_package_index()
    assert os.environ["AMENT_PREFIX_PATH"] == f"{tmp_path}/ros:{prefix}"
    folders.use_package_index()
    assert os.environ["AMENT_PREFIX_PATH"] == f"{tmp_path}/ros:{prefix}"


def test_an_index_that_has_the_package_stays(clean: pytest.MonkeyPatch, tmp_path: Path) -> None:
    prefix = installed(tmp_path / "install", "packages/bouncing_disk_ros")
    clean.setenv("AMENT_PREFIX_PATH", str(prefix))
    folders.use_package_index()
    assert os.environ["AMENT_PREFIX_PATH"] == str(prefix)


def test_without_an_installed_package_the_index_stays_empty(
    clean: pytest.MonkeyPatch, tmp_path: Path
) -> None:
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
    with pytest.raises(InputError, match="Is the package installed with its share files"):
        folders.share_directory()
    config = prefix / "share/bouncing_disk_ros/config"
    config.mkdir(parents=True)
    assert folders.share_directory() == config.parent
