"""`demo`: the whole story in its short form, and how it ends."""

from __future__ import annotations

import os
import re
import signal
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, cast

import psutil
import pytest

from bouncing_disk_ros import bag
from bouncing_disk_ros.nodes.demo.demo_bag import remove_old_bag
from bouncing_disk_ros.nodes.demo.demo_story import verdict
from support.processes import PATIENCE, Starter, ends, executed

if TYPE_CHECKING:
    from bouncing_disk_ros.report.run_summary import Summary

OWN_DOMAIN: dict[str, str | None] = dict.fromkeys(
    ("ROS_DOMAIN_ID", "ROS_AUTOMATIC_DISCOVERY_RANGE", "FASTRTPS_DEFAULT_PROFILES_FILE")
)
"""As from a plain terminal: the demo finds a domain of its own."""


def test_the_story_lands_in_period_one(warm_kernels: None, tmp_path: Path) -> None:
    """12 s after the programme's beginning the orbit has settled to the detector's tolerance."""
    picture, folder = tmp_path / "pictures" / "demo.png", tmp_path / "bags" / "demo"
    demo = executed(
        "demo", "--bag", str(folder), "--ros-args", "-p", "duration:=12.0", "-p",
        f"picture:={picture}", env=OWN_DOMAIN, timeout=90.0,
    )  # fmt: skip
    assert demo.stderr == ""
    joining = r"^To look .*: export ROS_DOMAIN_ID=\d+ ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST$"
    assert re.search(joining, demo.stdout, re.MULTILINE)
    assert "the platform changes to a helical motion" in demo.stdout
    assert "the platform changes to a semi-elliptical motion" in demo.stdout
    assert "Verified: the orbit found is period-1." in demo.stdout
    difference = re.search(r"eq\. 4.*difference (\S+) rad/s", demo.stdout)
    assert difference is not None
    # the detector asks for 1e-3 rad over 8 impacts; with |multiplier| = 1/2 the last ones are 2⁻⁷
    # closer, and the speed depends on the phase in second order: 27 rad/s · (8e-6)² and rounding
    assert abs(float(difference[1])) < 1e-6
    impacts = re.search(r"impacts +(\d+), 0 rows lost", demo.stdout)
    assert impacts is not None
    report = folder.with_name("demo_report.html")
    last = [f"Bag: {folder}", f"Report: {os.path.relpath(report)}"]
    assert demo.stdout.splitlines()[-3:-1] == last
    assert report.stat().st_size > 30_000
    replay = re.fullmatch(r"replay identical: (\d+) impacts", demo.stdout.splitlines()[-1])
    assert replay is not None
    assert abs(int(replay[1]) - int(impacts[1])) <= 1  # an impact in the simulator's last tick
    assert picture.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    assert picture.stat().st_size > 30_000


def test_too_short_to_tell(capfd: pytest.CaptureFixture[str]) -> None:
    orbit = SimpleNamespace(is_period_one=False, name="unresolved", impacts=0)
    assert verdict(cast("Summary", SimpleNamespace(orbit=orbit, inputs=1)), 3.0) == 0
    assert capfd.readouterr().out == (
        "Not verified: the orbit found is unresolved, not period-1; "
        "3 s are too short to reach it.\n"
    )


def test_a_signal_leaves_nothing_behind_but_a_whole_bag(start: Starter, tmp_path: Path) -> None:
    demo = start("demo", "--bag", f"{tmp_path}/bag", env=OWN_DOMAIN)
    demo.wait_for(r" impacts +rotor ")
    children = psutil.Process(demo.pid).children(recursive=True)
    assert len(children) == 3
    assert demo.end(signal.SIGTERM) == 130
    assert demo.stderr == "demo: interrupted\n"
    assert "Traceback" not in demo.output
    _, alive = psutil.wait_procs(children, timeout=PATIENCE)
    assert alive == []
    with bag.open(tmp_path / "bag") as recorded:
        assert recorded.complete


def test_an_earlier_bag_is_replaced_and_nothing_else(
    capfd: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    earlier, other = tmp_path / "earlier", tmp_path / "other"
    bag.Writer(earlier).close()
    for wrong in ("duration:=1.0", "picture:=demo.txt", "duratoin:=20.0"):
        assert ends(capfd, "demo", "--bag", str(earlier), "--ros-args", "-p", wrong)[0] == 2
        assert earlier.exists()
    remove_old_bag(earlier)
    assert not earlier.exists()
    remove_old_bag(earlier)
    bag.Writer(other).close()
    (other / "thesis.txt").write_text("two years of work")
    code, _, (told,) = ends(capfd, "demo", "--bag", str(other))
    assert code == 2
    assert told.startswith(f"demo: --bag: got '{other}', allowed: a new folder, or")
    assert (other / "thesis.txt").exists()


def test_children_die_with_a_killed_parent(start: Starter) -> None:
    code = "import signal; from bouncing_disk_ros.command_line.child import Child; "
    code += "child = Child('echo_impacts'); print('begun', flush=True); signal.pause()"
    parent = start.command([sys.executable, "-c", code])
    parent.wait_for("begun")
    children = psutil.Process(parent.pid).children(recursive=True)
    assert len(children) == 1
    parent.end(signal.SIGKILL)
    _, alive = psutil.wait_procs(children, timeout=PATIENCE)
    assert alive == []
