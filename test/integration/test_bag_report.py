"""bag_report on a recorded run: files, damage, proof, exit codes, signals."""

from __future__ import annotations

import re
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from bouncing_disk_ros.proof import event_proof
from bouncing_disk_ros.report import read_run
from support.processes import ends
from support.recorded import period_one_bag

pytestmark = pytest.mark.timeout(300)  # longer than any wait here


Report = Callable[..., tuple[int, str, list[str]]]
"""Runs bag_report in the process of the test: exit code, stdout, lines of stderr."""


@pytest.fixture
def report(capfd: pytest.CaptureFixture[str]) -> Report:
    return lambda *arguments: ends(capfd, "bag_report", *map(str, arguments))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The bag of a short run; tests leave it as it is."""
    return period_one_bag(tmp_path_factory.mktemp("bags") / "run", 3.0)


def test_files_are_ours_or_left_alone(report: Report, folder: Path, tmp_path: Path) -> None:
    given = folder, tmp_path / "first", "--figures", "png"
    for _ in range(2):  # the second replaces what the first has made
        assert report(*given)[0] == 0
    (tmp_path / "first.png").write_text("a drawing of my own")
    before = (tmp_path / "first.html").read_bytes()
    code, _, (told,) = report(*given)
    assert code == 2
    assert "a new file, or one that bag_report has made" in told
    assert (tmp_path / "first.png").read_text() == "a drawing of my own"
    assert (tmp_path / "first.html").read_bytes() == before


def test_a_cut_off_bag_is_reported_with_what_is_missing(report: Report, tmp_path: Path) -> None:
    folder = period_one_bag(tmp_path / "run", 12.0)
    (folder / "metadata.yaml").unlink()
    (file,) = folder.glob("*.mcap")
    file.write_bytes(file.read_bytes()[:-400])
    code, out, _ = report(folder, "--text-only")
    assert code == 0
    assert re.search("damage +metadata.yaml is missing", out)
    assert re.search("orbit found +period-1", out)


@pytest.mark.parametrize(
    ("place", "name", "options", "said"),
    [
        (read_run.BagRun, "read", (), "bag_report: interrupted"),
        (event_proof, "prove", ("--prove",), "interrupted: proof of"),
    ],
)
def test_it_is_interrupted_in_order(
    report: Report, folder: Path, monkeypatch: pytest.MonkeyPatch, place: Any, name: str,
    options: tuple[str, ...], said: str,
) -> None:  # fmt: skip
    """Also where a shell in the background had the signal ignored; a proof sums up what it has."""

    def interrupted(*_: object) -> None:
        signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(place, name, interrupted)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        code, out, lines = report(folder, *options)
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    assert code == 130
    assert said in "\n".join([out, *lines])
    assert "Traceback" not in "\n".join(lines)
    assert not list(folder.parent.glob("*_report.*"))


def test_a_recorded_run_is_proved(report: Report, folder: Path) -> None:
    code, out, lines = report(folder, "--prove")
    assert (code, lines) == (0, [])
    assert re.search(r"impact +\d+ +0 +0 +0\n", out)
    assert not list(folder.parent.glob("*_report.*"))
