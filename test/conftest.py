"""What all tests share: a ROS domain of their own, compiled kernels, processes, hypothesis.

Fixtures: `start` (support/processes.py), `talker` (support/ros_peer.py), `ros_domain`,
`warm_kernels`, `warm_juggling`. Every test runs in the session's own ROS domain, on
this machine only.
"""

from __future__ import annotations

import gc
import itertools
import os
from collections.abc import Generator, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

import hypothesis
import pytest

import bouncing_disk_ros
from bouncing_disk_ros import folders
from bouncing_disk_ros.command_line import private_domain
from support.processes import Starter

if TYPE_CHECKING:
    from support.ros_peer import Talker

ROOT = Path(__file__).resolve().parent.parent

# Not `derandomize`: its examples change with the version of Python. pyproject.toml has the seed.
hypothesis.settings.register_profile(
    "suite", deadline=None, database=None, print_blob=True, max_examples=60
)
# hypothesis's own number, EXAMPLES times, with another seed for each run: `make soak`
hypothesis.settings.register_profile(
    "soak",
    parent=hypothesis.settings.get_profile("suite"),
    max_examples=100 * int(os.environ.get("EXAMPLES", "1")),
)
hypothesis.settings.load_profile("soak" if "EXAMPLES" in os.environ else "suite")


def differing_modules() -> list[str]:
    """Return the modules whose tested copy is not that of the tree beside these tests."""
    tested = Path(bouncing_disk_ros.__file__).resolve().parent
    tree = ROOT / "bouncing_disk_ros"
    names = {path.relative_to(top) for top in (tested, tree) for path in top.rglob("*.py")}
    return sorted(
        str(name)
        for name in names
        if not ((tested / name).is_file() and (tree / name).is_file())
        or (tested / name).read_bytes() != (tree / name).read_bytes()
    )


def pytest_sessionstart(session: pytest.Session) -> None:
    """Refuse to test something else than the tree says."""
    if hasattr(session.config, "workerinput"):  # of a run that has looked
        return
    if differing := differing_modules():
        pytest.exit(
            f"the installed package differs from the tree ({', '.join(differing[:3])} ...): run "
            "`make setup`, or test the tree itself with PYTHONPATH=.",
            returncode=2,
        )


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Import all tests without a search for unused cycles, and leave them out of later ones.

    They are half a million objects that stay; each worker would search them again and again.
    Searches of all objects took 3.4 of 29 s of 200 tests: they come a tenth as often. With fewer
    searches of young objects tests of nodes took a fifth more.
    """
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.set_threshold(700, 10, 100)
        gc.enable()


def pytest_sessionfinish(session: pytest.Session, exitstatus: int) -> None:
    """Fail if nothing was collected: `colcon test` takes pytest's code for it (5) for success."""
    if exitstatus == pytest.ExitCode.NO_TESTS_COLLECTED:
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


@pytest.fixture(scope="session", autouse=True)
def ros_domain() -> Iterator[int]:
    """Hold a ROS domain for the session, for this process and its children; return its number."""
    from domain_coordinator import domain_id

    candidates = (1 + (os.getpid() + step) % 101 for step in itertools.count())
    free = filter(private_domain.domain_is_free, candidates)
    with ExitStack() as stack:
        domain: int = stack.enter_context(domain_id(lambda: next(free)))
        patch = stack.enter_context(pytest.MonkeyPatch.context())
        patch.setenv("ROS_DOMAIN_ID", str(domain))
        patch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        for name in ("ROS_STATIC_PEERS", "ROS_DISCOVERY_SERVER", "ROS_LOCALHOST_ONLY"):
            patch.delenv(name, raising=False)
        patch.setenv(
            "FASTRTPS_DEFAULT_PROFILES_FILE",
            str(ROOT / "config" / private_domain.FAST_DISCOVERY_PROFILE),
        )
        patch.setenv("AMENT_PREFIX_PATH", os.environ.get("AMENT_PREFIX_PATH", ""))
        folders.use_package_index()
        yield domain


@pytest.fixture(scope="session")
def warm_kernels() -> None:
    """Compile the core's kernels once, so that no test waits for it."""
    from bouncing_disk_ros.core.model import Disk, InitialState, Motion
    from bouncing_disk_ros.core.simulation import Simulation

    motion = Motion(axial_amplitude=0.01, angular_amplitude=0.5, frequency=10.0, phase_lag=0.1)
    disk = Disk(
        mass=1.0,
        restitution=0.5,
        friction=0.5,
        friction_radius=0.1,
        gyration_radius=0.1,
        gravity=9.81,
        preload=0.0,
        load_torque=0.0,
    )
    initial = InitialState(
        height=0.01, axial_velocity=0.0, angular_velocity=0.0, angle=0.0, forcing_phase=0.0
    )
    simulation = Simulation(motion, disk, initial)
    simulation.advance(1_000_000_000)
    simulation.sample()
    simulation.energy()


@pytest.fixture(scope="session")
def warm_juggling(warm_kernels: None) -> None:
    """The same for those of a loop that juggles: only `make` compiles them beforehand."""
    from bouncing_disk_ros.workbench import local_juggling

    local_juggling._load()


@pytest.fixture
def start(ros_domain: int, warm_kernels: None) -> Iterator[Starter]:
    """Start executables and commands as processes; see support/processes.py."""
    starter = Starter()
    yield starter
    starter.close()


@pytest.fixture
def talker(ros_domain: int) -> Iterator[Talker]:
    """A node of the test that publishes and calls services; see support/ros_peer.py."""
    from support.ros_peer import Talker

    talker = Talker()
    yield talker
    talker.close()
