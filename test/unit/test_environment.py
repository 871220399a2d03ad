"""Folders, package index and ROS settings that a process finds, or does not find, around it."""

from __future__ import annotations

import os
import socket
import stat
import tempfile
from pathlib import Path

import pytest

from bouncing_disk_ros import environment, folders
from bouncing_disk_ros.errors import InputError

INDEX = Path("share/ament_index/resource_index")


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


def private(tmp_path: Path) -> Path:
    return tmp_path / "tmp" / f"bouncing_disk_ros-{os.getuid()}"


# numba's cache


def test_kernels_are_cached_under_home(clean: pytest.MonkeyPatch, tmp_path: Path) -> None:
    folder = environment.numba_cache_directory()
    assert folder is not None
    assert folder.is_dir()
    assert folder.parent == tmp_path / "home" / ".cache" / "bouncing_disk_ros"
    environment.use_numba_cache()
    assert os.environ["NUMBA_CACHE_DIR"] == str(folder)


def test_xdg_cache_home_goes_before_home(clean: pytest.MonkeyPatch, tmp_path: Path) -> None:
    clean.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
    folder = environment.numba_cache_directory()
    assert folder is not None
    assert folder.parent == tmp_path / "xdg" / "bouncing_disk_ros"


@pytest.mark.parametrize("home", ["unset", "unusable"])
def test_without_home_kernels_are_cached_in_a_private_temporary_folder(
    no_home: pytest.MonkeyPatch, tmp_path: Path, home: str
) -> None:
    if home == "unset":
        no_home.delenv("HOME")
    folder = environment.numba_cache_directory()
    assert folder is not None
    assert folder.parent == private(tmp_path)
    assert stat.S_IMODE(private(tmp_path).stat().st_mode) == 0o700


@pytest.mark.parametrize("kind", ["link", "open to others", "file"])
def test_a_temporary_folder_that_others_prepared_is_not_trusted(
    no_home: pytest.MonkeyPatch, tmp_path: Path, kind: str
) -> None:
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir(mode=0o700)
    place = private(tmp_path)
    if kind == "link":
        place.symlink_to(elsewhere)
    elif kind == "file":
        place.touch(mode=0o700)
    else:
        place.mkdir()
        place.chmod(0o777)
    assert environment.numba_cache_directory() is None


def test_without_any_lasting_folder_one_warning_and_a_passing_one(
    no_home: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    private(tmp_path).touch()
    with pytest.warns(RuntimeWarning, match="Set NUMBA_CACHE_DIR") as caught:
        environment.use_numba_cache()
    assert len(caught) == 1
    environment.use_numba_cache()  # a second warning would be an error
    assert Path(os.environ["NUMBA_CACHE_DIR"]).is_dir()


def test_with_no_folder_at_all_numba_is_left_to_itself(
    no_home: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    no_home.setattr(folders, "passing_folder", lambda: None)
    private(tmp_path).touch()
    with pytest.warns(RuntimeWarning):
        environment.use_numba_cache()
    assert "NUMBA_CACHE_DIR" not in os.environ


def test_passing_folder_is_none_where_nothing_can_be_made(clean: pytest.MonkeyPatch) -> None:
    def refuse(**_: object) -> str:
        raise OSError

    clean.setattr(tempfile, "mkdtemp", refuse)
    assert folders.passing_folder() is None


def test_the_users_cache_folder_stays(clean: pytest.MonkeyPatch) -> None:
    clean.setenv("NUMBA_CACHE_DIR", "/some/where")
    environment.use_numba_cache()
    assert os.environ["NUMBA_CACHE_DIR"] == "/some/where"


def test_digest_changes_with_any_file_of_the_core(
    clean: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    core = tmp_path / "core"
    core.mkdir()
    clean.setattr(folders, "__file__", str(tmp_path / "folders.py"))
    seen = {folders.core_digest()}
    (core / "a.py").write_text("x = 1")
    seen.add(folders.core_digest())
    (core / "a.py").write_text("x = 2")
    seen.add(folders.core_digest())
    (core / "a.py").rename(core / "b.py")
    seen.add(folders.core_digest())
    assert len(seen) == 4
    (core / "notes.txt").touch()
    assert folders.core_digest() in seen


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


def installed(prefix: Path, *resources: str) -> Path:
    for resource in resources:
        file = prefix / INDEX / resource
        file.parent.mkdir(parents=True, exist_ok=True)
        file.touch()
    return prefix


def test_the_prefix_of_the_package_joins_the_index(
    clean: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    prefix = installed(tmp_path / "venv", "packages/bouncing_disk_ros")
    clean.setattr(
        environment, "__file__", str(prefix / "lib/python3/site-packages/p/environment.py")
    )
    clean.setenv("AMENT_PREFIX_PATH", f"{tmp_path}/ros")
    environment.use_package_index()
    assert os.environ["AMENT_PREFIX_PATH"] == f"{tmp_path}/ros:{prefix}"
    environment.use_package_index()
    assert os.environ["AMENT_PREFIX_PATH"] == f"{tmp_path}/ros:{prefix}"


def test_an_index_that_has_the_package_stays(clean: pytest.MonkeyPatch, tmp_path: Path) -> None:
    prefix = installed(tmp_path / "install", "packages/bouncing_disk_ros")
    clean.setenv("AMENT_PREFIX_PATH", str(prefix))
    environment.use_package_index()
    assert os.environ["AMENT_PREFIX_PATH"] == str(prefix)


def test_without_an_installed_package_the_index_stays_empty(
    clean: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    clean.setattr(environment, "__file__", str(tmp_path / "environment.py"))
    clean.setattr("sys.prefix", str(tmp_path))
    environment.use_package_index()
    assert "AMENT_PREFIX_PATH" not in os.environ


# ROS settings


@pytest.mark.parametrize("text", ["", "0", "7", "101", "102", "232"])
def test_domains_that_dds_can_use(clean: pytest.MonkeyPatch, text: str) -> None:
    clean.setenv("ROS_DOMAIN_ID", text)
    environment.check_domain()


@pytest.mark.parametrize("text", ["233", "300", "-1", "1.5", "abc", " 7", "0x7", "٣", "9" * 5000])
def test_domains_that_are_refused(clean: pytest.MonkeyPatch, text: str) -> None:
    clean.setenv("ROS_DOMAIN_ID", text)
    with pytest.raises(InputError, match="a whole number from 0 to 232") as caught:
        environment.check_domain()
    assert caught.value.given == text


def test_middleware_must_be_installed(clean: pytest.MonkeyPatch, tmp_path: Path) -> None:
    names = ("rmw_fastrtps_cpp", "rmw_zenoh_cpp", "rmw_implementation")
    prefix = installed(tmp_path / "ros", *(f"rmw_typesupport/{name}" for name in names))
    clean.setenv("AMENT_PREFIX_PATH", str(prefix))
    environment.check_middleware()
    clean.setenv("RMW_IMPLEMENTATION", "rmw_zenoh_cpp")
    environment.check_middleware()
    for wrong, hint in [
        ("rmw_fastrtps", "Did you mean rmw_fastrtps_cpp"),
        ("xyz", "Install it, or unset RMW_IMPLEMENTATION"),
    ]:
        clean.setenv("RMW_IMPLEMENTATION", wrong)
        with pytest.raises(InputError, match="rmw_fastrtps_cpp or rmw_zenoh_cpp") as caught:
            environment.check_middleware()
        assert hint in caught.value.line


def test_prepare_ends_with_one_line_and_code_2(
    clean: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    clean.setenv("ROS_DOMAIN_ID", "abc")
    with pytest.raises(SystemExit) as caught:
        environment.prepare()
    assert caught.value.code == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("bouncing_disk_ros: ROS_DOMAIN_ID: got 'abc', allowed:")
    assert captured.err.count("\n") == 1


# a domain of one's own


def test_a_domain_with_a_participant_is_not_free() -> None:
    domain = environment.free_domain()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as participant:
        participant.bind(("", 7400 + 250 * domain + 10))
        assert not environment.domain_is_free(domain)
        assert environment.free_domain() != domain
    assert environment.domain_is_free(domain)


def test_no_free_domain_is_told(clean: pytest.MonkeyPatch) -> None:
    clean.setattr(environment, "domain_is_free", lambda domain: False)
    with pytest.raises(InputError, match="all in use"):
        environment.free_domain()


def test_private_domain_is_on_this_machine_and_says_how_to_join(clean: pytest.MonkeyPatch) -> None:
    line = environment.use_private_domain()
    domain = os.environ["ROS_DOMAIN_ID"]
    assert 1 <= int(domain) <= 101
    assert line == f"export ROS_DOMAIN_ID={domain} ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST"


def test_private_domain_keeps_what_the_user_has_set(clean: pytest.MonkeyPatch) -> None:
    clean.setenv("ROS_DOMAIN_ID", "5")
    clean.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET")
    clean.setenv("FASTDDS_DEFAULT_PROFILES_FILE", "mine.xml")
    assert environment.use_private_domain() == (
        "export ROS_DOMAIN_ID=5 ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET"
    )
    assert "FASTRTPS_DEFAULT_PROFILES_FILE" not in os.environ


def test_fast_discovery_takes_the_installed_profile(
    clean: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    prefix = installed(tmp_path / "ros", "packages/bouncing_disk_ros")
    clean.setenv("AMENT_PREFIX_PATH", str(prefix))
    environment.use_fast_discovery()
    assert "FASTRTPS_DEFAULT_PROFILES_FILE" not in os.environ
    profile = prefix / "share/bouncing_disk_ros/config/fast_discovery.xml"
    profile.parent.mkdir(parents=True)
    profile.touch()
    environment.use_fast_discovery()
    assert os.environ["FASTRTPS_DEFAULT_PROFILES_FILE"] == str(profile)
