"""Where ROS is not installed: the library, every study, the bag tools; what needs it says so."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from support.processes import Process, Starter
from support.recorded import period_one_bag

ROOT = Path(__file__).resolve().parents[2]
RUNNER = ROOT / "test" / "support" / "without_ros.py"
WAIT = 110.0  # s; imports are slow on a loaded machine
SMALL: dict[str, dict[str, object]] = {
    "toss_paths": {"points": 16},
    "toss_map": {"phase_lag_count": 5, "amplitude_angle_count": 3},
    "bifurcation": {"count": 3, "settling": 10, "measured": 20, "kept": 5, "doublings": 0},
    "parameter_map": {"x_count": 2, "y_count": 2, "settling": 10, "measured": 256},
    "basins": {"width": 12, "height": 8},
    "basin_shares": {"count": 2, "samples": 8},
    "juggling": {"width": 3, "height": 3, "deadline": 5.0},
}  # fmt: skip
LIVE = ("simulator", "recorder", "perform", "echo_impacts", "juggle")


def begin(start: Starter, *arguments: str) -> Process:
    env = {"PYTHONPATH": str(ROOT), "ROS_DOMAIN_ID": "no number", "RMW_IMPLEMENTATION": "none"}
    return start.command([sys.executable, str(RUNNER), *arguments], env=env)


def test_each_study_computes(start: Starter, tmp_path: Path) -> None:
    file = tmp_path / "parameters.yaml"
    file.write_text("/lab/*:\n  ros__parameters: {netcdf: false, figures: [png]}\n")
    shared = ["--ros-args", "--params-file", str(file), "-r", "__ns:=/lab", "--log-level", "debug"]
    nodes = {}
    for name, values in SMALL.items():
        given = {**values, "output": tmp_path / name}
        options = [word for key, value in given.items() for word in ("-p", f"{key}:={value}")]
        nodes[name] = begin(start, name, *shared, *options, "--")
    for name, node in nodes.items():
        assert node.wait(WAIT) == 0, node.output
        assert node.complaints == []
        files = {path.suffix for path in (tmp_path / name).iterdir()}
        assert files == {".png", ".zarr"}, "the file of parameters counts"


def test_a_bag_is_reported_on_replayed_and_recovered(start: Starter, tmp_path: Path) -> None:
    folder = str(period_one_bag(tmp_path / "run", 3.0))
    report = begin(start, "bag_report", folder)
    replay = begin(start, "replay", folder, "--what-if", "restitution:=0.4")
    recover = begin(start, "bag_recover", folder)
    basins = begin(
        start, "basins", "--ros-args", "-p", f"bag:={folder}", "-p", "width:=8", "-p", "height:=8",
        "-p", f"output:={tmp_path / 'basins'}",
    )  # fmt: skip
    for node in (report, replay, recover, basins):
        assert node.wait(WAIT) == 0, node.output
        assert node.complaints == []
    assert (tmp_path / "run_report.html").is_file()
    assert (tmp_path / "run_recovered" / "metadata.yaml").is_file()
    replay.wait_for("^replay identical: ")
    basins.wait_for(r"^basins: from .*: Γ = 0\.45, ε = 0\.5$")


def test_the_demonstration_tells_its_story(start: Starter, tmp_path: Path) -> None:
    picture = tmp_path / "demo.png"
    node = begin(start, "demo", "--ros-args", "-p", f"picture:={picture}")
    assert node.wait(WAIT) == 0, node.output
    node.wait_for("^ .* changes to a helical motion")
    node.wait_for(r"^  orbit found +period-1: τ_imp 0\.736624 rad")
    node.wait_for(r"^  rotor speed +27\.390382 rad/s")
    node.wait_for("^Verified: the orbit found is period-1")
    assert "nan" not in node.output
    assert picture.stat().st_size > 10_000
    wrong = begin(start, "demo", "--ros-args", "-p", "picture:=demo.gif")
    assert wrong.wait(WAIT) == 2
    wrong.wait_for("^demo: picture: got 'demo.gif', allowed: a file ending in .png")


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


def test_the_library_works(start: Starter, tmp_path: Path) -> None:
    node = begin(start, "-c", CODE, str(period_one_bag(tmp_path / "run", 1.0)))
    assert node.wait(WAIT) == 0, node.output
    node.wait_for("^all done$")


@pytest.mark.parametrize("name", LIVE)
def test_what_needs_ros_says_so_in_one_line(start: Starter, name: str) -> None:
    node = begin(start, name)
    assert node.wait(WAIT) == 2, node.output
    (line,) = node.output.splitlines()
    assert line.startswith(f"{name}: needs ROS 2, ")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("basins", "--ros-args", "-p", "widt:=3"), "basins: parameter: got 'widt', .* mean width"),
        (("basins", "--ros-args", "-p", "width:=3.5"), "basins: width: got 3.5, allowed: an int"),
        (("basins", "--ros-args", "-p", "width=3"), "basins: -p: got 'width=3', allowed: name:="),
        (("basins", "--ros-args", "-p", "hold:=true"), "false where ROS 2 is not installed"),
        (("basins", "--ros-args", "foo"), "basins: ROS arguments: got 'foo'"),
        (("basins", "--ros-args", "--params-file", "/no/file"), "--params-file: got '/no/file'"),
    ],
)
def test_a_wrong_command_line_is_one_line_and_code_2(
    start: Starter, arguments: tuple[str, ...], words: str
) -> None:
    node = begin(start, *arguments)
    assert node.wait(WAIT) == 2, node.output
    assert len(node.complaints) == 1
    node.wait_for(words)
