"""The package with Ubuntu 24.04's versions (numpy 1.26, numba 0.59), in an environment of its own.

The environment is made once, in .venv-ubuntu-24.04, and again when its list of versions changes.
"""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Mapping
from pathlib import Path

import pytest

from support.processes import finished

ROOT = Path(__file__).resolve().parents[2]
CONSTRAINTS = ROOT / "constraints-ubuntu-24.04.txt"
VENV = ROOT / ".venv-ubuntu-24.04"
STAMP = VENV / "constraints.txt"
#: what decides how the children find Python's and ROS's packages; all of it is this environment's
OURS = (
    "PYTEST_ADDOPTS",
    "PYTHONPATH",
    "PYTHONHOME",
    "LD_LIBRARY_PATH",
    "_ROS_WHEELS_BOOTSTRAP_COMPLETE",
)
TESTED = (
    "test/unit/core",
    "test/unit/ros",
    "test/unit/study/test_studies.py",
    "test/integration/test_simulator_stepped.py",
    "test/integration/test_simulator_live.py",
    "test/integration/test_simulator_process.py",
)

pytestmark = [pytest.mark.interop, pytest.mark.timeout(3600)]


def run(*command: str, code: int | None = 0, env: Mapping[str, str] | None = None) -> int:
    """The exit code of a command in the tree without what this environment would give it."""
    whole = {**dict.fromkeys(OURS), **(env or {})}
    return finished(*command, code=code, env=whole, cwd=ROOT, timeout=1700.0).returncode


def interpreter() -> str:
    """Return a Python that numba 0.59 is made for, Ubuntu's 3.12 if it is here."""
    base = os.path.realpath(getattr(sys, "_base_executable", sys.executable))
    for candidate in ("python3.12", base):
        program = "import sys, ensurepip; sys.exit(sys.version_info[:2] not in ((3, 11), (3, 12)))"
        found = shutil.which(candidate)
        if found and run(found, "-c", program, code=None) == 0:
            return found
    pytest.skip("no Python 3.11 or 3.12 here: numba 0.59 knows no newer one")


@pytest.fixture(scope="module")
def ubuntu() -> str:
    """The Python of the environment."""
    python = str(VENV / "bin" / "python")
    if STAMP.exists() and STAMP.read_text("utf-8") == CONSTRAINTS.read_text("utf-8"):
        return python
    shutil.rmtree(VENV, ignore_errors=True)
    lines = CONSTRAINTS.read_text("utf-8").splitlines()
    names = [line.split("=")[0].rstrip("<>") for line in lines if not line.startswith("#")]
    names[names.index("ros-jazzy-rclpy")] += "[fastrtps]"
    install = (python, "-m", "pip", "install", "--quiet", "--constraint", str(CONSTRAINTS))
    for command in [(interpreter(), "-m", "venv", str(VENV)), (*install, *names)]:
        run(*command)
    shutil.copy(CONSTRAINTS, STAMP)
    return python


def passes(python: str, *tests: str, **changes: str) -> None:
    """Run tests on the tree; the package is not installed there, so its plugin is named."""
    options = ("-q", "-p", "no:cacheprovider", "-p", "bouncing_disk_ros.testing")
    patient = "--timeout=900"  # kernels are compiled for this numba first
    settings = {"PYTHONPATH": str(ROOT), "AMENT_PREFIX_PATH": str(VENV), **changes}
    run(python, "-m", "pytest", *options, patient, *tests, env=settings)


def test_core_node_and_studies_pass(ubuntu: str) -> None:
    passes(ubuntu, *TESTED)


def test_every_file_of_tests_is_collected(ubuntu: str) -> None:
    passes(ubuntu, "-m", "interop", "test/interop/test_collection.py")


def test_results_are_those_of_the_newest_versions(ubuntu: str) -> None:
    """Runs are pinned to the bit: which versions compiled and ran them must not show."""
    passes(ubuntu, "test/reference/test_pinned.py", EXAMPLES="1")  # all of them
