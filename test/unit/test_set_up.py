"""tools/set_up.py: which machines and interpreters are refused, and when .venv is made anew."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import json
import re
import runpy
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet
from packaging.utils import canonicalize_name

from bouncing_disk_ros.kernel_cache import KERNEL_FOLDERS

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def set_up(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """A fresh copy of the module, on a machine where nothing is to be refused."""
    monkeypatch.delenv("SUDO_USER", raising=False)
    spec = importlib.util.spec_from_file_location("set_up", ROOT / "tools" / "set_up.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    monkeypatch.setattr(module.platform, "system", lambda: "Linux")
    monkeypatch.setattr(module.platform, "machine", lambda: "x86_64")
    return module


APT = "sudo apt install git make python3 python3-venv"
OTHER = "Python {}.*is not supported: take Python 3\\.11, 3\\.12 or 3\\.13"


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        *(({"version": version}, "") for version in ((3, 11), (3, 12), (3, 13))),
        *(({"version": (3, k)}, OTHER.format(rf"3\.{k} \(")) for k in (6, 10, 14)),
        *(
            ({"system": system, "machine": machine}, f"{system} {machine}.*with colcon on ROS 2")
            for system, machine in (("Linux", "aarch64"), ("Darwin", "arm64"), ("Windows", "AMD64"))
        ),
        *(({"missing": name}, APT) for name in ("venv", "ensurepip")),
        ({"sudo": "mario", "user": 0}, "without sudo"),
        ({"sudo": "mario", "user": 1000}, ""),
        ({"user": 0}, ""),  # root of a container
    ],
)
def test_machines_and_interpreters_that_are_refused(
    set_up: ModuleType, monkeypatch: pytest.MonkeyPatch, changes: dict[str, Any], words: str
) -> None:
    if "version" in changes:
        monkeypatch.setattr(sys, "version_info", (*changes["version"], 0, "final", 0))
    for name in ("system", "machine"):
        if name in changes:
            monkeypatch.setattr(set_up.platform, name, lambda name=name: changes[name])
    if "missing" in changes:
        find = lambda name: None if name == changes["missing"] else object()  # noqa: E731
        monkeypatch.setattr(set_up.importlib.util, "find_spec", find)
    if "sudo" in changes:
        monkeypatch.setenv("SUDO_USER", changes["sudo"])
    monkeypatch.setattr(set_up.os, "geteuid", lambda: changes.get("user", 1000))
    refusal = set_up.refusal()
    assert re.search(words, refusal) if words else refusal == "", refusal


def test_a_refusal_is_one_line_and_code_2(
    set_up: ModuleType, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for arguments in ([], ["everything"], ["run", "test"]):
        monkeypatch.setattr(sys, "argv", ["set_up.py", *arguments])
        assert set_up.main() == 2
    capsys.readouterr()
    monkeypatch.setattr(sys, "argv", ["set_up.py", "test"])
    monkeypatch.setattr(set_up, "refusal", lambda: "no")
    assert set_up.main() == 2
    assert capsys.readouterr() == ("", "make: no\n")


@pytest.fixture
def made(set_up: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> ModuleType:
    """The module in a tree of its own, with a .venv that looks as `run` leaves it."""
    for name in set_up.INGREDIENTS:
        (tmp_path / name).write_text("original")
    (tmp_path / ".venv" / "bin").mkdir(parents=True)
    (tmp_path / ".venv" / "bin" / "python").touch()
    for name, path in [("ROOT", ""), ("VENV", ".venv"), ("STAMP", ".venv/set-up.json")]:
        monkeypatch.setattr(set_up, name, tmp_path / path)
    stamp = {"made_from": set_up.fingerprint(), "parts": ["run"]}
    (tmp_path / ".venv" / "set-up.json").write_text(json.dumps(stamp))
    return set_up


@pytest.mark.parametrize(
    "change", ["", "constraints.txt", "setup.py", "interpreter", ".venv/bin/python", "set-up.json"]
)
def test_a_venv_is_made_anew_where_anything_changed(
    made: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, change: str
) -> None:
    if change == "interpreter":
        monkeypatch.setattr(made, "base_interpreter", lambda: "/another/python3")
    elif change in ("constraints.txt", "setup.py"):
        (tmp_path / change).write_text("changed")
    elif change:
        (tmp_path / ".venv" / change.removeprefix(".venv/")).unlink()
    assert made.read_stamp() == ([] if change else ["run"])


SITE = ".venv/lib/python3.12/site-packages"
SHARE = ".venv/share/bouncing_disk_ros"
INSTALLED = {
    "bouncing_disk_ros/py.typed": SITE, "bouncing_disk_ros/core/a.py": SITE,
    "config/swum.yaml": SHARE, "package.xml": SHARE,
}  # fmt: skip


@pytest.mark.parametrize("is_deleted", [True, False])
@pytest.mark.parametrize(
    "place", [*INSTALLED, f"{SITE}/bouncing_disk_ros/core/a.py", "bouncing_disk_ros/core/b.py",
              f"{SITE}/bouncing_disk_ros-1.dist-info/RECORD", f"{SHARE}/package.xml"],
)  # fmt: skip
def test_the_package_is_installed_again_where_a_file_differs(
    made: ModuleType, tmp_path: Path, place: str, is_deleted: bool
) -> None:
    record = f"{SITE}/bouncing_disk_ros-1.dist-info/RECORD"
    for name in (*INSTALLED, *(f"{folder}/{name}" for name, folder in INSTALLED.items()), record):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("original")
    compiled = tmp_path / "bouncing_disk_ros" / "core" / "__pycache__" / "a.pyc"
    compiled.parent.mkdir()
    compiled.touch()
    assert made.is_installed()
    if is_deleted:
        (tmp_path / place).unlink(missing_ok=True)
    else:
        (tmp_path / place).write_text("another")
    same = is_deleted if place.endswith("b.py") else place == record and not is_deleted
    assert made.is_installed() == same


@pytest.fixture
def told(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """What setup.py tells setuptools."""
    told: dict[str, Any] = {}
    fake = SimpleNamespace(setup=told.update, find_packages=lambda include: include)
    monkeypatch.setitem(sys.modules, "setuptools", fake)
    runpy.run_path(str(ROOT / "setup.py"))
    return told


def test_every_dependency_is_pinned(told: dict[str, Any]) -> None:
    groups = [told["install_requires"], *told["extras_require"].values()]
    wanted = {re.split(r"[\[<>=]", name)[0].lower() for group in groups for name in group}
    lines = (ROOT / "constraints.txt").read_text("utf-8").splitlines()
    pinned = [line.split("==")[0].lower() for line in lines if line and not line.startswith("#")]
    assert wanted <= set(pinned)
    assert len(pinned) == len(set(pinned))
    assert all(re.fullmatch(r"[\w.-]+==[\w.]+", line) for line in lines if line[0] != "#")


@pytest.mark.parametrize("name", ["constraints.txt", "constraints-ubuntu-24.04.txt"])
def test_what_is_tested_is_within_the_bounds(told: dict[str, Any], name: str) -> None:
    lines = (ROOT / name).read_text("utf-8").splitlines()
    given = [Requirement(line) for line in lines if line and not line.startswith("#")]
    tested = {one.name.lower(): one.specifier for one in given}
    for needed in map(Requirement, told["install_requires"]):
        allowed = tested[needed.name.lower()]
        oldest = [one.version for one in allowed if one.operator in ("==", ">=")]
        assert oldest, f"{needed.name}: no version is named"
        assert all(version in needed.specifier for version in oldest), needed.name


def test_ubuntu_keeps_its_numpy_and_sources_use_nothing_newer_than_the_oldest_interpreter() -> None:
    """What apt compiled against numpy 1.26 breaks when pip puts numpy 2 over it."""
    lines = (ROOT / "constraints-ubuntu-24.04.txt").read_text("utf-8").splitlines()
    (numpy,) = [Requirement(line) for line in lines if line.startswith("numpy")]
    assert ("1.26.4" in numpy.specifier, "2.0.0" in numpy.specifier) == (True, False)
    folders = ("bouncing_disk_ros", "examples", "launch", "test", "tools")
    files = [path for folder in folders for path in (ROOT / folder).rglob("*.py")]
    assert len(files) > 100
    newer = [str(path) for path in files if ADDED_LATER.search(path.read_text())]
    assert [name for name in newer if name != __file__] == []


# the oldest interpreters --------------------------------------------------------------------------

OLDEST = ("3.11.2", "3.12.3", "3.13.0")
"""What Debian 12 and Ubuntu 24.04 have, and the first 3.13."""
ADDED_LATER = re.compile(r"extractall\([^)]*filter|unpack_archive\([^)]*filter|\.data_filter|"
                         r"\.tar_filter|parseaddr\([^)]*strict|[rR]eparseDeferral")  # fmt: skip
"""What 3.11.3 to 3.11.14 added to the library; ruff and mypy refuse what is newer than 3.11."""


def test_installed_pins_are_for_the_oldest_interpreters() -> None:
    """`make fresh` asks the package index too: are there wheels, and those of make bench?"""
    pins = dict(
        re.findall(r"^([^#=\s]+)==(\S+)", (ROOT / "constraints.txt").read_text(), re.MULTILINE)
    )
    pins = {canonicalize_name(name): version for name, version in pins.items()}
    refused = []
    seen = 0
    for found in importlib.metadata.distributions():
        if pins.get(canonicalize_name(found.name)) == found.version:
            seen += 1
            allowed = SpecifierSet((found.metadata.get_all("Requires-Python") or [""])[0])
            refused += [(found.name, found.version, v) for v in OLDEST if v not in allowed]
    if seen < len(pins) // 2:
        pytest.skip("this environment is not made from constraints.txt")
    assert refused == []


def test_make_compiles_kernels_of_each_folder_that_has_some(set_up: ModuleType) -> None:
    """Each of the suite's workers compiled those of fits."""
    folders = {name.rpartition(".")[0].replace(".", "/") for name in set_up.KERNELS}
    assert folders >= {*KERNEL_FOLDERS}
