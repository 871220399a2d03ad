"""The real `ros2` command drives the installed package: run, launch, topics, parameters, states.

Needs a shell in which a ROS 2 installation and the built workspace are sourced; run it there with
`python3 -m pytest -m interop test/interop/test_ros2_cli.py`. Skipped where `ros2` is missing.
"""

from __future__ import annotations

import re
import shutil
import signal
import subprocess
import time
from pathlib import Path

import pytest

from bouncing_disk_ros.executables import EXECUTABLES
from support.processes import PATIENCE, Process, Starter, environment

pytestmark = pytest.mark.interop

PACKAGE = "bouncing_disk_ros"
DIRECT = ("--no-daemon", "--spin-time", "2")  # a daemon would outlive the test
ECHO = ("topic", "echo", *DIRECT, "--once", "--full-length")
PUBLISH = ("topic", "pub", "--once")


def ros2(*arguments: str, timeout: float = PATIENCE) -> tuple[int, str]:
    """Run `ros2 arguments`; its exit code and all it printed (-1 when it does not end)."""
    try:
        done = subprocess.run(
            ["ros2", *arguments],
            env=environment(),
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=timeout,
        )
    except subprocess.TimeoutExpired as error:
        return -1, str(error)
    return done.returncode, done.stdout


def ask(pattern: str, *arguments: str) -> str:
    """Repeat a command until it prints `pattern`: discovery may take longer than it waits."""
    deadline = time.monotonic() + PATIENCE
    while not re.search(pattern, (printed := ros2(*arguments)[1])):
        assert time.monotonic() < deadline, f"ros2 {' '.join(arguments)} printed:\n{printed}"
    return printed


def reason_to_skip() -> str:
    """Why the command cannot be tried here; empty when it can."""
    if shutil.which("ros2") is None:
        return "no `ros2` on the PATH: source a ROS 2 installation first"
    code, printed = ros2("pkg", "executables", PACKAGE)
    if code or PACKAGE not in printed:
        return f"`ros2` does not find {PACKAGE}: source the workspace that it was built in"
    return ""


@pytest.fixture(scope="module", autouse=True)
def _needs_the_command(ros_domain: int) -> None:
    if reason := reason_to_skip():
        pytest.skip(reason)


@pytest.fixture
def simulator(start: Starter) -> Process:
    given = ("--ros-args", "-p", "preset:=pizza_multiple_toss")
    process = start.command(["ros2", "run", PACKAGE, "simulator", *given])
    process.wait_for("running at")
    return process


def test_every_executable_is_found_and_explains_itself() -> None:
    printed = ros2("pkg", "executables", PACKAGE)[1]
    assert {line.split()[1] for line in printed.splitlines()} == set(EXECUTABLES)
    for name in EXECUTABLES:
        code, printed = ros2("run", PACKAGE, name, "--help")
        assert (code, printed.startswith(f"usage: {name}")) == (0, True), printed


def test_a_wrong_start_is_one_line_and_its_exit_code() -> None:
    code, printed = ros2("run", PACKAGE, "simulator", "--ros-args", "-p", "restitution:=2.0")
    assert code == 2
    assert "simulator: restitution: got 2.0, allowed: a finite number >= 0 and <= 1\n" in printed


def test_topics_are_echoed_and_commanded_and_ctrl_c_ends_it(simulator: Process) -> None:
    ask("data: (flight|sticking|sliding)", *ECHO, "/disk/phase")
    ask("platform_rotation", *ECHO, "/joint_states")
    ask('data: .*"kind":"snapshot"', *ECHO, "/disk/inputs")
    ask("angular:", *ECHO, "/disk/rotor_speed")
    ask("bouncing_disk: energy", *ECHO, "/diagnostics")
    ros2(*PUBLISH, "/platform/axial_amplitude", "std_msgs/msg/Float64", "{data: 0.0425}")
    ask("- 0.0425", *ECHO, "/platform/motion")
    points = "[{positions: [0.035, 1.25], time_from_start: {sec: 1}}]"
    programme = f"{{joint_names: [axial_amplitude, angular_amplitude], points: {points}}}"
    kind = "trajectory_msgs/msg/JointTrajectory"
    ros2(*PUBLISH, "/platform/command", kind, programme)
    ask(r"- 0.035\n +- 1.25", *ECHO, "/platform/motion")
    impulse = "{wrench: {force: {z: 0.05}}}"
    ros2(*PUBLISH, "/disk/impulse", "geometry_msgs/msg/WrenchStamped", impulse)
    ask("work_impulses .J.\n +value: '-?[0-9.e-]*[1-9]", *ECHO, "/diagnostics")
    ros2(*PUBLISH, "/disk/impulse", "geometry_msgs/msg/WrenchStamped", "{wrench: {force: {x: 1}}}")
    simulator.wait_for("refused: disk/impulse wrench.force.x: got 1.0, allowed: 0")
    simulator.send(signal.SIGINT)
    assert simulator.wait() == 0
    assert "Traceback" not in simulator.output


def test_parameters_are_described_set_refused_and_loaded(
    simulator: Process, tmp_path: Path
) -> None:
    def param(verb: str, *arguments: str) -> tuple[str, ...]:
        return ("param", verb, *DIRECT, "/bouncing_disk", *arguments)

    ask("Max value: 1.0", *param("describe", "restitution"))
    ask("Set parameter successful", *param("set", "restitution", "1"))
    ask("Double value is: 1.0", *param("get", "restitution"))
    ask("failed: restitution: got 1.5, allowed: a finite", *param("set", "restitution", "1.5"))
    ask("failed: mass: got 1.0, allowed: no change while", *param("set", "mass", "1.0"))
    file = tmp_path / "dump.yaml"
    file.write_text(ask("restitution: 1.0", *param("dump")))
    assert "failed" not in ask("use_sim_time successful", *param("load", str(file)))


def test_services_pause_step_and_reset(simulator: Process) -> None:
    def call(name: str, *arguments: str) -> str:
        return ask("success=", "service", "call", f"/bouncing_disk/{name}", *arguments)

    assert "success=False" in call("step", "std_srvs/srv/Trigger")
    assert "success=True" in call("pause", "std_srvs/srv/SetBool", "{data: true}")
    assert "1 period(s)" in call("step", "std_srvs/srv/Trigger")
    assert "success=True" in call("reset", "std_srvs/srv/Trigger")
    ask("data: paused", *ECHO, "/disk/phase")
    assert "success=True, message='running" in call(
        "pause", "std_srvs/srv/SetBool", "{data: false}"
    )


def test_lifecycle_states_are_gone_through(simulator: Process) -> None:
    leads_to = {
        "deactivate": "inactive",
        "activate": "active",
        "cleanup": "unconfigured",
        "configure": "inactive",
    }
    for verb in ("deactivate", "activate", "deactivate", "cleanup", "configure"):
        ask("Transitioning successful", "lifecycle", "set", *DIRECT, "/bouncing_disk", verb)
        ask(rf"^{leads_to[verb]} \[", "lifecycle", "get", *DIRECT, "/bouncing_disk")
    ask("Transitioning successful", "lifecycle", "set", *DIRECT, "/bouncing_disk", "shutdown")
    assert simulator.wait() == 0


def test_launch_gives_preset_namespace_and_name_and_ends_in_order(start: Starter) -> None:
    given = ("preset:=swum", "namespace:=one", "name:=motor")
    launch = start.command(["ros2", "launch", PACKAGE, "simulate.launch.py", *given])
    launch.wait_for(r"\[one.motor\]: running at .* frequency 40000")
    ask("(?m)^/one/motor$", "node", "list", *DIRECT)
    assert launch.end(signal.SIGINT) == 0
    assert "process has finished cleanly" in launch.output
    assert "Traceback" not in launch.output
