"""The package as users get it, by pip, colcon or make: what each puts where, and that it runs."""

from __future__ import annotations

import shutil
import signal
import subprocess
import sys
import zipfile
from configparser import ConfigParser
from functools import partial
from importlib.metadata import distribution
from pathlib import Path

import pytest

from bouncing_disk_ros.executables import EXECUTABLES, entry_point
from support.places import ROOT, copy_tree
from support.processes import Starter, finished
from support.ros import wait_for_message

pytestmark = pytest.mark.timeout(300)  # longer than any wait here

COLCON_PATIENCE = 250.0
#: the environment of a shell that knows ROS (here: the wheels) and not this package
ROS_SHELL: dict[str, str | None] = {"PYTHONPATH": None, "AMENT_PREFIX_PATH": sys.prefix}


run = partial(finished, cwd=ROOT, timeout=COLCON_PATIENCE)


# pip ----------------------------------------------------------------------------------------------


def test_the_wheel_holds_modules_shared_files_entry_points_and_the_version(tmp_path: Path) -> None:
    """Built from a copy of the tree."""
    import bouncing_disk_ros

    tree = copy_tree(tmp_path / "tree")
    build = "import setuptools.build_meta as backend; backend.build_wheel('..')"
    run(sys.executable, "-c", build, cwd=tree)  # as pip does, which takes as long again
    (file,) = tmp_path.glob("*.whl")
    wheel = zipfile.ZipFile(file)
    names = wheel.namelist()
    files = [path for path in (ROOT / "bouncing_disk_ros").rglob("*.*") if path.is_file()]
    ours = {str(path.relative_to(ROOT)) for path in files if path.parent.name != "__pycache__"}
    assert {name for name in names if name.startswith("bouncing_disk_ros/")} == ours
    share = "share/bouncing_disk_ros/"
    wanted = {share + "package.xml", "share/ament_index/resource_index/packages/bouncing_disk_ros"}
    for folder in ("config", "examples", "launch", "urdf", "rviz"):
        files = [path for path in (ROOT / folder).rglob("*") if path.is_file()]
        files = [path for path in files if "__pycache__" not in path.parts]
        assert files, f"{folder} is empty"
        wanted |= {share + str(path.relative_to(ROOT)) for path in files}
    assert {name.partition(".data/data/")[2] for name in names if ".data/" in name} == wanted
    (points,) = (name for name in names if name.endswith("entry_points.txt"))
    table = ConfigParser()
    table.read_string(wheel.read(points).decode())
    assert dict(table["console_scripts"]) == {name: entry_point(name) for name in EXECUTABLES}
    assert dict(table["pytest11"]) == {"bouncing_disk_ros": "bouncing_disk_ros.testing"}
    (about,) = (name for name in names if name.endswith("/METADATA"))
    assert f"\nVersion: {bouncing_disk_ros.__version__}\n" in wheel.read(about).decode()


@pytest.mark.interop  # 20 s
def test_installing_again_does_not_bring_deleted_modules_back(tmp_path: Path) -> None:
    pytest.importorskip("pip")
    tree = copy_tree(tmp_path / "tree")
    python = bare_venv(tree / ".venv")
    package = next((tree / ".venv" / "lib").iterdir()) / "site-packages" / "bouncing_disk_ros"
    extra = tree / "bouncing_disk_ros" / "soon_gone.py"
    extra.write_text("")
    # as pip or an older make may have left it
    stale = tree / "build" / "lib" / "bouncing_disk_ros" / "long_gone.py"
    stale.parent.mkdir(parents=True)
    stale.write_text("")
    set_up = "import set_up; set_up.install_package('--no-deps', '--force-reinstall', '.')"
    for expected in (True, False):
        run(python, "-c", set_up, env={"PYTHONPATH": str(tree / "tools")})
        assert (package / "__init__.py").is_file()
        assert (package / "soon_gone.py").is_file() == expected
        assert not (package / "long_gone.py").exists()
        extra.unlink(missing_ok=True)
    assert not [*tree.glob("*.egg-info"), *tree.glob("build/lib*")]


def bare_venv(folder: Path) -> Path:
    """Make a virtual environment that has only this one's pip and setuptools; return its Python."""
    finished(sys.executable, "-m", "venv", "--without-pip", folder)
    (site,) = (folder / "lib").glob("python*/site-packages")
    ours = Path(distribution("setuptools").locate_file(""))  # type: ignore[arg-type]
    for part in ("pip", "setuptools", "_distutils_hack", "pkg_resources", "wheel"):
        for path in (ours / part, *ours.glob(f"{part}-*")):  # the code and its metadata
            if path.exists():
                (site / path.name).symlink_to(path)
    return folder / "bin" / "python"


# colcon -------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A colcon workspace with the package's sources."""
    pytest.importorskip("colcon_core")
    folder = tmp_path_factory.mktemp("workspace")
    copy_tree(folder / "src" / "bouncing_disk_ros")
    return folder


def executable(folder: Path, name: str) -> Path:
    return folder / "install" / "bouncing_disk_ros" / "lib" / "bouncing_disk_ros" / name


def sourced(folder: Path, *command: str) -> list[str]:
    """Return `command` after the workspace's set-up file, as a ROS user's shell has it."""
    return ["bash", "-c", f'source "{folder}/install/local_setup.bash" && exec "$@"', "-", *command]


def test_colcon_sees_a_ros_package(workspace: Path) -> None:
    done = run(sys.executable, "-m", "colcon", "list", cwd=workspace)
    assert done.stdout.split() == [
        *("bouncing_disk_ros", "src/bouncing_disk_ros", "(ros.ament_python)")
    ]


@pytest.mark.interop  # a minute
@pytest.mark.parametrize("options", [[], ["--symlink-install"]], ids=["copied", "symlinked"])
def test_what_colcon_builds_runs(
    start: Starter, tmp_path: Path, workspace: Path, options: list[str]
) -> None:
    from sensor_msgs.msg import JointState

    shutil.copytree(workspace / "src", tmp_path / "src")
    done = run(sys.executable, "-m", "colcon", "build", *options, cwd=tmp_path)
    assert "1 package finished" in done.stdout
    share = tmp_path / "install" / "bouncing_disk_ros" / "share" / "bouncing_disk_ros"
    for name in ("package.xml", "launch/simulate.launch.py", "urdf/bouncing_disk.urdf", "config"):
        assert (share / name).exists()
    folder = executable(tmp_path, "simulator").parent  # where `ros2 run` looks
    assert sorted(path.name for path in folder.iterdir()) == sorted(EXECUTABLES)
    probe = "import bouncing_disk_ros as package; print(package.__file__)"
    found = run(*sourced(tmp_path, sys.executable, "-c", probe), cwd=tmp_path, env=ROS_SHELL)
    assert found.stdout.startswith(str(tmp_path)), "another copy of the package would run"
    for name in EXECUTABLES:
        done = run(*sourced(tmp_path, str(executable(tmp_path, name)), "--help"), env=ROS_SHELL)
        assert done.stderr == ""
        assert name in done.stdout
    node = start.command(sourced(tmp_path, str(executable(tmp_path, "simulator"))), env=ROS_SHELL)
    assert wait_for_message(JointState, "joint_states", timeout=COLCON_PATIENCE).position
    assert node.end(signal.SIGINT) == 0
    assert node.complaints_but_late == []


# make ---------------------------------------------------------------------------------------------


def make(
    *arguments: str, code: int = 0, env: dict[str, str | None] | None = None
) -> subprocess.CompletedProcess[str]:
    if not shutil.which("make"):
        pytest.skip("no make here: a ROS machine may do without")
    clean: dict[str, str | None] = {"MAKEFLAGS": None, "MAKELEVEL": None, "MFLAGS": None}
    return run("make", *arguments, code=code, env={**clean, **(env or {})})


def test_make_alone_lists_the_targets() -> None:
    done = make()
    for target in ("demo", "test", "bench", "soak", "interop", "lint", "setup", "clean"):
        assert f"make {target} " in done.stdout


def test_make_without_python_prints_the_apt_line() -> None:
    done = make("setup", "PYTHON=no-such-python", code=2)
    told = done.stderr.splitlines()[0]
    assert told.startswith("make: no no-such-python here.")
    assert told.endswith("sudo apt install git make python3 python3-venv")


def test_make_keeps_a_sourced_ros_shell_out() -> None:
    foreign = {
        "PYTHONPATH": "/opt/ros/humble/lib/python3.10/site-packages",
        "LD_LIBRARY_PATH": "/opt/ros/humble/lib",
        "AMENT_PREFIX_PATH": "/opt/ros/humble",
        "ROS_DOMAIN_ID": "42",
        "ROS_DISTRO": "humble",
        "RMW_IMPLEMENTATION": "rmw_cyclonedds_cpp",
        "FASTRTPS_DEFAULT_PROFILES_FILE": "/etc/profile.xml",
        "VIRTUAL_ENV": "/another/venv",
        "_ROS_WHEELS_BOOTSTRAP_COMPLETE": "1",
    }
    seen = make("--eval=seen: ; @env", "seen", env=dict(foreign)).stdout.splitlines()
    variables = dict(line.split("=", 1) for line in seen if "=" in line)
    assert variables["AMENT_PREFIX_PATH"] == str(ROOT / ".venv")
    assert not (foreign.keys() - {"AMENT_PREFIX_PATH"}) & variables.keys()
