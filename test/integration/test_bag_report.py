"""bag_report on a real recording and on what it must refuse: files, exit codes, signals."""

from __future__ import annotations

import re
import signal
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from support.in_process import ends
from support.processes import Starter
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


def test_it_is_interrupted_in_order(start: Starter, folder: Path) -> None:
    """Also where a shell in the background had the signal ignored."""
    shell = ["sh", "-c", 'trap "" INT; exec "$@"', "sh"]
    report = start.command([*shell, sys.executable, "-c", _INTERRUPTED, str(folder)])
    report.wait_for("reading")
    assert report.end(signal.SIGINT) == 130
    assert "bag_report: interrupted" in report.stderr
    assert "Traceback" not in report.stderr
    assert not list(folder.parent.glob("*_report.*"))


_INTERRUPTED = """
import sys, time
from bouncing_disk_ros.nodes import bag_report
from bouncing_disk_ros.report import read_run
def slow(self):
    print("reading", flush=True)
    time.sleep(60)
    yield
read_run.BagRun.read = slow
sys.exit(bag_report.main())
"""
