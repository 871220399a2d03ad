"""Executables on machines and in shells where something is missing or wrong (whole processes)."""

from __future__ import annotations

import signal
import sys
from pathlib import Path

import pytest
from sensor_msgs.msg import JointState

import bouncing_disk_ros
from bouncing_disk_ros.__main__ import main
from bouncing_disk_ros.executables import EXECUTABLES
from support.processes import Starter, executed, finished
from support.ros import wait_for_message

#: every variable that names a place for files, as a bare container has them: none
NO_FOLDERS: dict[str, str | None] = dict.fromkeys(
    ("HOME", "ROS_HOME", "ROS_LOG_DIR", "MPLCONFIGDIR", "XDG_CACHE_HOME", "XDG_STATE_HOME")
)


# python -m bouncing_disk_ros ----------------------------------------------------------------------


def test_it_lists_the_executables_tells_its_version_and_refuses_an_unknown_one(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    def ended(*arguments: str) -> tuple[int | None, str, str]:
        monkeypatch.setattr(sys, "argv", ["bouncing_disk_ros", *arguments])
        return main(), *capfd.readouterr()

    for arguments in ((), ("--help",)):
        code, out, err = ended(*arguments)
        assert (code, err) == (0, "")
        for name, summary in EXECUTABLES.items():
            assert any(line.split(maxsplit=1) == [name, summary] for line in out.splitlines())
    version = f"bouncing_disk_ros {bouncing_disk_ros.__version__}\n"
    assert ended("--version") == (0, version, "")
    refused = (
        "bouncing_disk_ros: executable: got 'simulatr', allowed: "
        f"{', '.join(EXECUTABLES)}. Did you mean simulator?\n"
    )
    assert ended("simulatr", "--ros-args", "-p", "a:=1") == (2, "", refused)


def test_no_module_of_the_current_folder_is_run(tmp_path: Path) -> None:
    for name in ("yaml", "tempfile", "hashlib", "argparse", "numpy", "mcap", "rclpy", "optional"):
        (tmp_path / f"{name}.py").write_text(f"print('hostile {name}')")
    home = Path(bouncing_disk_ros.__file__).resolve().parents[1]
    command = (sys.executable, "-m", "bouncing_disk_ros", "bag_report", "no_bag")
    env = {"PYTHONPATH": str(home), "PYTHONSAFEPATH": None}
    done = finished(*command, code=2, env=env, cwd=tmp_path)
    assert "hostile" not in done.stdout + done.stderr


# an old rclpy, no place for files -----------------------------------------------------------------


def test_a_simulator_runs_with_an_old_rclpy_and_without_a_home(
    start: Starter, tmp_path: Path
) -> None:
    """Without rclpy.experimental another executor is used, and told once."""
    (tmp_path / "file").touch()
    (tmp_path / "tmp").mkdir()
    places = {"HOME": str(tmp_path / "file" / "home"), "TMPDIR": str(tmp_path / "tmp")}
    code = "import runpy, sys; sys.modules['rclpy.experimental'] = None; "  # as if not installed
    code += "runpy.run_module('bouncing_disk_ros', run_name='__main__', alter_sys=True)"
    node = start.command([sys.executable, "-c", code, "simulator"], env={**NO_FOLDERS, **places})
    node.wait_for("SingleThreadedExecutor is used")
    assert wait_for_message(JointState, "joint_states").position
    assert node.end(signal.SIGTERM) == 0
    assert node.complaints_but_late == []
    assert node.stderr.count("SingleThreadedExecutor") == 1
    (logs,) = (tmp_path / "tmp").glob("bouncing_disk_ros-*/log")
    assert any(logs.iterdir())


# a wrong ROS setting ------------------------------------------------------------------------------

NEED_NO_ROS = {"bag_recover", "bag_report", "compare_with_case", "reference_cases", "replay"}


EACH = """
import os, sys
from bouncing_disk_ros.__main__ import main
for name in sys.argv[1:]:
    if os.fork() == 0:
        sys.argv[1:] = [name]
        sys.exit(main())
    print(name, os.waitstatus_to_exitcode(os.wait()[1]), flush=True)
"""


@pytest.mark.parametrize(
    ("variable", "value", "names"),
    [
        ("ROS_DOMAIN_ID", "abc", sorted(EXECUTABLES.keys() - NEED_NO_ROS)),
        ("RMW_IMPLEMENTATION", "rmw_nonsense_cpp", ["simulator"]),
    ],
)
def test_a_wrong_setting_is_one_line_and_code_2(
    start: Starter, variable: str, value: str, names: list[str]
) -> None:
    process = start.command([sys.executable, "-c", EACH, *names], env={variable: value})
    assert process.wait() == 0
    assert process.stdout.splitlines() == [f"{name} 2" for name in names]
    lines = process.stderr.splitlines()
    assert len(lines) == len(names)
    said = f"bouncing_disk_ros: {variable}: got {value!r}, allowed: "
    assert all(line.startswith(said) for line in lines)


def test_security_that_cannot_be_had_is_one_line_and_code_2(tmp_path: Path) -> None:
    """On any machine: the wheels have no security, and a ROS installation finds no such enclave."""
    (tmp_path / "keystore" / "enclaves").mkdir(parents=True)
    settings: dict[str, str | None] = {
        "ROS_SECURITY_ENABLE": "true",
        "ROS_SECURITY_STRATEGY": "Enforce",
        "ROS_SECURITY_KEYSTORE": str(tmp_path / "keystore"),
    }
    process = executed("recorder", tmp_path / "run", code=2, env=settings)
    assert process.stdout == ""
    (line,) = process.stderr.splitlines()
    assert line.startswith("recorder: ROS_SECURITY_ENABLE: got 'true', allowed: an enclave")
