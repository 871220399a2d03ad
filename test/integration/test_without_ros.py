"""Where ROS is not installed: the library, the studies, the bag tools; what needs it says so."""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path

import pytest

from support.page_client import PageClient
from support.processes import Process, Starter
from support.recorded import period_one_bag

pytestmark = pytest.mark.timeout(300)  # longer than any wait here

ROOT = Path(__file__).resolve().parents[2]
RUNNER = ROOT / "test" / "support" / "without_ros.py"
WAIT = 250.0  # s; imports are slow on a loaded machine
LIVE = ("simulator", "recorder", "perform", "echo_impacts", "juggle")


def begin(start: Starter, *arguments: str) -> Process:
    paths = f"{ROOT}{os.pathsep}{ROOT / 'test'}"
    env = {"PYTHONPATH": paths, "ROS_DOMAIN_ID": "no number", "RMW_IMPLEMENTATION": "none"}
    return start.command([sys.executable, str(RUNNER), *arguments], env=env)


def test_library_bags_studies_the_demonstration_and_the_workbench_are_there(
    start: Starter, tmp_path: Path
) -> None:
    """The other studies are made from their definitions alike; test_public_names computes each.

    What needs ROS, and wrong command lines, are one line and code 2. All in one process.
    """
    folder, picture = str(period_one_bag(tmp_path / "run", 3.0)), tmp_path / "demo.png"
    file = tmp_path / "parameters.yaml"
    file.write_text("/lab/*:\n  ros__parameters: {netcdf: false, figures: [png]}\n")

    def study(name: str, *words: str, **options: object) -> list[str]:
        given = [word for key, value in options.items() for word in ("-p", f"{key}:={value}")]
        return [name, "--ros-args", *words, *given]

    lines = [
        ["bag_report", folder, "--figures", "none"],
        ["replay", folder, "--what-if", "restitution:=0.4"],
        ["bag_recover", folder],
        study("basins", bag=folder, width=8, height=8, output=tmp_path / "basins", figures="none"),
        [
            *study("toss_paths", "--params-file", str(file), "-r", "__ns:=/lab", "--log-level",
                   "debug", points=16, output=tmp_path / "paths"),
            "--",
        ],
        study("demo", picture=picture),
    ]  # fmt: skip
    wrong = [given.replace(" ", " --ros-args ", 1).split() for given, _ in WRONG]
    lines.append(["workbench", "--ros-args", "-p", "port:=0", "-p", "open_browser:=false"])
    words = [word for line in [*wrong, *lines] for word in ("+", *line)]
    node = begin(start, "-c", CODE, folder, *words)
    node.wait_for("^all done$", WAIT)
    told = node.wait_for(r"^workbench: simulated in this process, without ROS: (http://\S+)$", WAIT)
    simulates_by_itself(told[1])
    assert node.end() == 0, node.output
    assert node.output.count(" ended with 0\n") == len(lines)
    assert node.output.count(" ended with 2\n") == len(WRONG)
    assert len(node.complaints) == len(WRONG), node.output
    for complaint, (_, pattern) in zip(node.complaints, WRONG, strict=True):
        assert re.search(pattern, complaint)
    assert (tmp_path / "run_report.html").is_file()
    assert (tmp_path / "run_recovered" / "metadata.yaml").is_file()
    node.wait_for("^replay identical: ")
    node.wait_for(r"^basins: from .*: Γ = 0\.45, ε = 0\.5$")
    files = {path.suffix for path in (tmp_path / "paths").iterdir()}
    assert files == {".png", ".zarr"}, "the file of parameters counts"
    node.wait_for("^ .* changes to a helical motion")
    node.wait_for(r"^  orbit found +period-1: τ_imp 0\.736624 rad")
    node.wait_for(r"^  rotor speed +27\.390382 rad/s")
    node.wait_for("^Verified: the orbit found is period-1")
    assert "nan" not in node.output
    assert picture.stat().st_size > 10_000


def simulates_by_itself(url: str) -> None:
    """The page of a workbench: its run goes on, and takes a command."""
    page = PageClient(url)
    try:
        page.wait(lambda: len(page.model("path").data["time"]) > 20, WAIT)
        page.change("restitution", "value_throttled", 0.4)
        page.wait(lambda: page.model("restitution").value == 0.4)
    finally:
        page.close()


CODE = """
import sys
import bouncing_disk_ros
from bouncing_disk_ros import bag, simulate
from bouncing_disk_ros.study import named, run
for name in bouncing_disk_ros.__all__:
    if name not in bouncing_disk_ros.NEED_ROS:
        getattr(bouncing_disk_ros, name)
assert len(simulate(1.0, preset="pizza_multiple_toss").impacts) > 1
with bag.open(sys.argv[3]) as opened:
    assert len(opened.columns("/disk/inputs")["data"]) >= 1
try:
    bouncing_disk_ros.SimulatorNode
except ImportError as error:
    assert "needs ROS 2" in str(error), error
print("all done")
"""


WRONG = (
    ("basins -p widt:=3", "basins: parameter: got 'widt', .* mean width"),
    ("basins -p width:=3.5", "basins: width: got 3.5, allowed: an int"),
    ("basins -p width=3", "basins: -p: got 'width=3', allowed: name:="),
    ("basins -p hold:=true", "false where ROS 2 is not installed"),
    ("basins foo", "basins: ROS arguments: got 'foo'"),
    ("basins --params-file /no/file", "--params-file: got '/no/file'"),
    ("demo -p picture:=demo.gif", "demo: picture: got 'demo.gif', allowed: a file ending in .png"),
    *((name, f"{name}: needs ROS 2, ") for name in LIVE),
)
"""Executables with their arguments, and what is said of them."""
