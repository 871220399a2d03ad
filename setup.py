"""Install the package for pip and for colcon (ament_python). The version comes from package.xml."""

import runpy
import xml.etree.ElementTree as ET
from pathlib import Path

from setuptools import find_packages, setup

ROOT = Path(__file__).resolve().parent
MANIFEST = ET.parse(ROOT / "package.xml").getroot()
NAME = MANIFEST.findtext("name")
EXECUTABLES = runpy.run_path(str(ROOT / NAME / "executables.py"))
SHARED_FOLDERS = ("config", "examples", "launch", "urdf", "rviz")


def data_files():
    """Return what goes into share/: index marker, package.xml, the shared folders' files."""
    rows = {
        "share/ament_index/resource_index/packages": [f"resource/{NAME}"],
        f"share/{NAME}": ["package.xml"],
    }
    for folder in SHARED_FOLDERS:
        for file in sorted((ROOT / folder).rglob("*.*")):
            relative = file.relative_to(ROOT)
            if file.is_file() and "__pycache__" not in relative.parts:
                rows.setdefault(f"share/{NAME}/{relative.parent}", []).append(str(relative))
    return list(rows.items())


setup(
    name=NAME,
    version=MANIFEST.findtext("version"),
    description=" ".join(MANIFEST.findtext("description").split()),
    long_description=(ROOT / "README.md").read_text("utf-8")
    if (ROOT / "README.md").exists()
    else "",
    long_description_content_type="text/markdown",
    license="Apache-2.0",
    maintainer=MANIFEST.findtext("maintainer"),
    maintainer_email=MANIFEST.find("maintainer").get("email"),
    packages=find_packages(include=[NAME, f"{NAME}.*"]),
    package_data={NAME: ["py.typed"], "": ["*.pyi"]},
    data_files=data_files(),
    zip_safe=False,
    python_requires=">=3.11",
    # Bounds: what Ubuntu 24.04 has, or the oldest that has what is used. None from above: see the
    # two lists of constraints, which are tested.
    install_requires=[
        "PyYAML>=6.0",
        "bokeh>=3.7",  # interactive plots: HTML reports, the page of the workbench
        "google-crc32c",  # checksums of stored results
        "lz4",  # chunks of bags, with mcap
        "matplotlib>=3.6",
        "mcap",
        "numba>=0.59",
        "numcodecs",  # compression of stored results
        "numpy>=1.26",
        "rosbags>=0.10",  # decodes messages by the definitions in a bag
        "tqdm",  # progress of long studies
        "xarray>=2024.10",  # results with axes, units and attributes
        "zarr>=3",  # opens stored results in xarray and other tools; this package does without it
        "zstandard",  # chunks of bags, with mcap
    ],
    extras_require={
        # ROS 2 Jazzy as wheels, for a machine without ROS; a ROS machine has these from apt and
        # must not ask for them. Always ros-jazzy-*: ros-* carries other distributions' versions.
        "ros": ["ros-jazzy-rclpy[fastrtps]", "ros-jazzy-common-interfaces"],
        "test": [
            "distributed",  # studies on many machines, tried on this one
            "hypothesis",
            "ipykernel",  # runs the notebooks of docs/notebooks
            "mcap-ros2-support",  # reads our bags, as a tool that is not ours
            "mpmath",
            "nbclient",
            "nbformat",
            "netCDF4>=1.6",
            "psutil",
            "pytest",
            "pytest-timeout",
            "pytest-xdist",  # the suite on all cores
            "python-flint",  # ball arithmetic, for proofs of flights and contacts
            "scipy",
            "soundfile",
        ],
        "docs": ["furo", "myst-parser", "sphinx"],  # guides and API as web pages
        # what `make test` needs besides on a machine without ROS
        "ci": [
            "colcon-common-extensions",
            "colcon-ros",
            "mypy",
            "ros-jazzy-domain-coordinator",
            "ruff",
            "types-PyYAML",
        ],
        "prove": [
            "python-flint"
        ],  # ball arithmetic: `bag_report --prove`, and the referee of the tests
        "netcdf": ["netCDF4>=1.6"],  # results of studies exported
        "measured": ["soundfile"],  # `fit_impacts`: sounds from files
        "cluster": ["distributed"],  # studies on many machines
        # what `make bench` measures beside this package; without them it skips their rows by name
        "bench": [
            "selenium",  # a browser that draws the page of the workbench
            "heyoka",  # Taylor integration with events
            "jax",  # the algorithm of the lanes on arrays, compiled for them
            "pynamicalsys",  # Lyapunov exponents of the same map
            "rebound",  # an archive that gives the state at any instant
        ],
        # selenium drives a browser, foxglove-sdk knows what a layout may say, mujoco runs a case
        "interop": ["cyclonedds", "foxglove-sdk", "mujoco", "rerun-sdk", "selenium"],
    },
    entry_points={
        "console_scripts": [
            f"{name} = {EXECUTABLES['entry_point'](name)}" for name in EXECUTABLES["EXECUTABLES"]
        ],
        "pytest11": [f"{NAME} = {NAME}.testing"],  # the fixture `stepped_simulator`
    },
)
