"""`bag_report --prove` as a process: a recorded run is proved, and an interrupted proof sums up."""

from __future__ import annotations

import signal
import sys
from pathlib import Path

import pytest

from support.processes import Starter
from support.recorded import period_one_bag

pytestmark = pytest.mark.timeout(300)  # longer than any wait here

WAIT = 250.0  # s


def test_a_recorded_run_is_proved(start: Starter, tmp_path: Path) -> None:
    folder = period_one_bag(tmp_path / "run", 6.0)
    code, report = start.finish("bag_report", str(folder), "--prove", timeout=WAIT)
    assert code == 0, report.output
    assert report.complaints == []
    report.wait_for(r"impact +1\d +0 +0 +0\n")
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
