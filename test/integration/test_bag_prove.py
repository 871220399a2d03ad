"""`bag_report --prove`: a recorded run is proved, and an interrupted proof sums up."""

from __future__ import annotations

import re
import signal
import sys
from pathlib import Path

import pytest

from support.in_process import ends
from support.processes import Starter
from support.recorded import period_one_bag

pytestmark = pytest.mark.timeout(300)  # longer than any wait here


def test_a_recorded_run_is_proved(capfd: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    folder = period_one_bag(tmp_path / "run", 6.0)
    code, out, lines = ends(capfd, "bag_report", str(folder), "--prove")
    assert (code, lines) == (0, [])
    assert re.search(r"impact +1\d +0 +0 +0\n", out)
    assert not list(tmp_path.glob("*_report.*"))


def test_an_interrupted_proof_sums_up(start: Starter, tmp_path: Path) -> None:
    folder = period_one_bag(tmp_path / "run", 6.0)
    report = start.command([sys.executable, "-c", _SLOW, str(folder), "--prove"])
    report.wait_for("proving")
    assert report.end(signal.SIGINT) == 130
    assert "interrupted: proof of" in report.stdout
    assert "Traceback" not in report.stderr


_SLOW = """
import sys, time
from bouncing_disk_ros.nodes import bag_report
from bouncing_disk_ros.proof import event_proof
def slow(event):
    print("proving", flush=True)
    time.sleep(60)
event_proof.prove = slow
sys.exit(bag_report.main())
"""
