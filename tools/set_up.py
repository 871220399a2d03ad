"""Make `.venv` and install this package into it: the first step of every `make` target.

    python3 tools/set_up.py {run,test,bench,interop}

The virtual environment is built once and kept until the interpreter, the pinned versions or the
list of dependencies change; the package itself is installed anew where the installed files are not
those of the tree, so that edits are seen. Standard library only, and no syntax newer than Python
3.6, so that an old interpreter is refused in words.
"""

import contextlib
import fcntl
import hashlib
import importlib.util
import json
import os
import platform
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
VENV = ROOT / ".venv"
STAMP = VENV / "set-up.json"
SUPPORTED = ((3, 11), (3, 12), (3, 13))
#: what decides which packages are in .venv
INGREDIENTS = ("constraints.txt", "setup.py")
#: part of .venv -> extras of setup.py, megabytes to download, megabytes on disk (measured)
PARTS = {
    "run": (("ros", "prove", "netcdf"), 235, 930),
    "test": (("test", "ci", "docs"), 115, 490),
    "bench": (("bench",), 210, 680),
    "interop": (("interop",), 235, 710),
}
#: what a make target asks for -> the parts that it needs
LEVELS = {
    "run": ("run",),
    "test": ("run", "test"),
    "bench": ("run", "test", "bench"),
    "interop": ("run", "test", "interop"),
}
#: modules whose kernels `make` compiles: what a run needs; then trajectories, studies and fits
KERNELS = (
    "core.engine",
    "core.offset_extremes",
    "maps.lanes.attractor_lanes",
    "maps.basin_labels",
    "maps.single_toss",
    "maps.rotation_map",
    "maps.map_tangent",
    "maps.axial_iteration",
    "maps.orbit_kernels",
    "motor_study.motor_cell",
    "juggling.kernels.loop_kernel",
    "measured.kernels.chains",
    "measured.kernels.linear_equations",
)
APT_LINE = "sudo apt install git make python3 python3-venv"


def refusal() -> str:
    """Return why this machine, user or interpreter will not do, in one line; '' if it will."""
    version = sys.version_info[:2]
    name = "Python {}.{}".format(*version)
    if os.environ.get("SUDO_USER") and os.geteuid() == 0:
        return (
            "run make without sudo: root's files and the shared memory of root's nodes would "
            f"shut out user {os.environ['SUDO_USER']} later"
        )
    if version not in SUPPORTED:
        return (
            f"{name} ({sys.executable}) is not supported: take Python 3.11, 3.12 or 3.13, "
            "for example `make PYTHON=python3.12 test`"
        )
    if (platform.system(), platform.machine()) != ("Linux", "x86_64"):
        return (
            f"no ROS 2 wheels exist for {platform.system()} {platform.machine()}, only for Linux "
            "x86_64: build with colcon on ROS 2 Jazzy (docs/installation.md)"
        )
    if importlib.util.find_spec("ensurepip") is None or importlib.util.find_spec("venv") is None:
        return f"{name} has no venv module. On Debian and Ubuntu: {APT_LINE}"
    return ""


def base_interpreter() -> str:
    """Return the interpreter that .venv is made from, also if a virtual environment runs this."""
    return os.path.realpath(getattr(sys, "_base_executable", sys.executable))


def fingerprint() -> str:
    """Return what .venv depends on: a digest of the interpreter and of the `INGREDIENTS`."""
    digest = hashlib.sha256((base_interpreter() + sys.version).encode())
    for name in INGREDIENTS:
        digest.update((ROOT / name).read_bytes())
    return digest.hexdigest()


def read_stamp() -> "list[str]":
    """Return the parts that .venv holds; none if it is missing, broken or made of other things."""
    try:
        stamp = json.loads(STAMP.read_text())
    except (OSError, ValueError):
        return []
    python = VENV / "bin" / "python"
    return stamp["parts"] if stamp["made_from"] == fingerprint() and python.exists() else []


def pip(*arguments: str) -> None:
    """Run .venv's pip; a failure is told by pip itself, so end with its code."""
    command = [str(VENV / "bin" / "python"), "-m", "pip", "--disable-pip-version-check", *arguments]
    code = subprocess.call(command, cwd=str(ROOT))
    if code:
        sys.stderr.write(f"set-up failed: pip ended with code {code} (see above)\n")
        sys.exit(1)


def remove_build_products() -> None:
    """Delete what an earlier pip left in the tree: it would bring deleted modules back."""
    for path in [
        *(ROOT / "build").glob("lib*"),
        *(ROOT / "build").glob("bdist.*"),
        *ROOT.glob("*.egg-info"),
    ]:
        shutil.rmtree(str(path))
    with contextlib.suppress(OSError):  # missing, or in use by colcon
        (ROOT / "build").rmdir()


def install_package(*options: str) -> None:
    """Install this package, not editable: only so do its share files arrive."""
    remove_build_products()
    pip("install", "--quiet", "--no-build-isolation", "--constraint", "constraints.txt", *options)
    remove_build_products()


def files_of(path: Path) -> "dict[str, bytes]":
    """Return the content of a file, or of each file in a folder that setup.py installs."""
    return {
        str(file.relative_to(path)): file.read_bytes()
        for file in ([path] if path.is_file() else path.rglob("*.*"))
        if file.is_file() and file.parent.name != "__pycache__"
    }


def is_installed() -> bool:
    """Return whether .venv holds this very tree: each file, and the list that pip writes last."""
    share = VENV / "share" / "bouncing_disk_ros"
    pairs = [(path, ROOT / path.name) for path in [*share.glob("*"), share / "package.xml"]]
    lists = list(VENV.glob("lib/*/site-packages/bouncing_disk_ros-*.dist-info/RECORD"))
    pairs += [(path.parents[1] / share.name, ROOT / share.name) for path in lists]
    return len(lists) == 1 and all(files_of(found) == files_of(ours) for found, ours in pairs)


def build(level: str, parts: "list[str]") -> None:
    """Bring .venv to `level`; `parts` are those it holds already (none: start afresh)."""
    missing = [part for part in LEVELS[level] if part not in parts]
    download = sum(PARTS[part][1] for part in missing)
    disk = sum(PARTS[part][2] for part in missing)
    print(
        f"Setting up .venv with Python {platform.python_version()} for `{level}`, once: "
        f"about {download} MB to download, {disk} MB on disk ...",
        flush=True,
    )
    if not parts:
        if VENV.exists():
            shutil.rmtree(str(VENV))
        subprocess.check_call([base_interpreter(), "-m", "venv", str(VENV)])
        pip("install", "--quiet", "--constraint", "constraints.txt", "setuptools", "wheel")
    extras = ",".join(extra for part in missing for extra in PARTS[part][0])
    install_package(f".[{extras}]")
    STAMP.write_text(json.dumps({"made_from": fingerprint(), "parts": [*parts, *missing]}))


def compile_kernels(level: str) -> None:
    """Compile the kernels now, so that the first start is like the others."""
    modules = KERNELS if level != "run" else KERNELS[:1]
    imports = [f"import bouncing_disk_ros.{module}" for module in modules]
    announce = "from bouncing_disk_ros.kernel_cache import announce_compilation as announce"
    code = "\n".join([announce, "announce('make')", *imports])
    subprocess.call([str(VENV / "bin" / "python"), "-P", "-c", code], cwd=str(ROOT))


def main() -> int:
    """Set up for the level named on the command line; return the exit code."""
    level = sys.argv[1] if len(sys.argv) == 2 else ""
    if level not in LEVELS:
        sys.stderr.write("usage: set_up.py {{{}}}\n".format(",".join(LEVELS)))
        return 2
    reason = refusal()
    if reason:
        sys.stderr.write(f"make: {reason}\n")
        return 2
    with Path(__file__).open() as lock:  # two at once would delete each other's build
        fcntl.flock(lock, fcntl.LOCK_EX)
        parts = read_stamp()
        if not set(LEVELS[level]) <= set(parts):
            build(level, parts)
        elif not is_installed():
            install_package("--no-deps", "--force-reinstall", ".")
    compile_kernels(level)
    return 0


if __name__ == "__main__":
    sys.exit(main())
