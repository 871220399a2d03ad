"""What a process must find around it: writable folders, the package index, sane ROS settings.

Every executable calls `prepare` first in its `main`. Imports neither numba nor rclpy.
"""

from __future__ import annotations

import importlib.util
import os
import sys
from pathlib import Path

from bouncing_disk_ros.errors import ExitCode, InputError, closest
from bouncing_disk_ros.folders import (
    INDEX,
    PACKAGE,
    prefixes,
    use_log_folder,
    use_matplotlib_folder,
    use_package_index,
)

#: Fast DDS computes UDP ports 7400 + 250 * domain + ...; from 233 on they pass 65535.
LARGEST_DOMAIN = 232
DOMAINS_ALLOWED = (
    f"a whole number from 0 to {LARGEST_DOMAIN} "
    "(0 to 101 and 215 to 232 keep clear of the ports that Linux hands out)"
)
ROS_PACKAGES = ("rclpy", "std_msgs", "sensor_msgs")
"""What there is of ROS 2 wherever it is installed."""


def ros_is_here() -> bool:
    """Return whether ROS 2 can be imported; the library, studies and bag tools do without it."""
    try:
        return all(importlib.util.find_spec(name) is not None for name in ROS_PACKAGES)
    except (ModuleNotFoundError, ValueError):
        return False


def check_domain() -> None:
    """Raise InputError unless ROS_DOMAIN_ID is empty or a number that DDS can use."""
    text = os.environ.get("ROS_DOMAIN_ID", "")
    # rclpy would read '1.5' as 1 and '-1' as 0, without a word
    allowed = text.isascii() and text.isdigit() and len(text) <= 9 and int(text) <= LARGEST_DOMAIN
    if text and not allowed:
        raise InputError("ROS_DOMAIN_ID", text, DOMAINS_ALLOWED, "Set it, or unset it to take 0")


def check_middleware() -> None:
    """Raise InputError if RMW_IMPLEMENTATION names one that is not installed.

    rclpy would end the process with code 102 from within C.
    """
    wanted = os.environ.get("RMW_IMPLEMENTATION", "")
    markers = [path / INDEX / "rmw_typesupport" for path in prefixes()]
    found = {file.name for folder in markers for file in folder.glob("*")}
    found.discard("rmw_implementation")  # the switch itself
    if wanted and found and wanted not in found:
        hint = closest(wanted, found) or "Install it, or unset RMW_IMPLEMENTATION"
        raise InputError("RMW_IMPLEMENTATION", wanted, " or ".join(sorted(found)), hint)


def check_security() -> None:
    """Raise InputError unless the variables of ROS 2 security say something that it understands.

    It takes ROS_SECURITY_ENABLE=1 for off and ROS_SECURITY_STRATEGY=enforce for permissive, without
    a word: nodes would run open where someone believes them closed.
    """
    for name, words in (
        ("ROS_SECURITY_ENABLE", ("true", "false")),
        ("ROS_SECURITY_STRATEGY", ("Enforce", "Permissive")),
    ):
        given = os.environ.get(name, "")
        if given and given not in words:
            raise InputError(name, given, " or ".join(words), "ROS 2 takes no other spelling")
    if security_is_on():
        store = os.environ.get("ROS_SECURITY_KEYSTORE", "")
        if not Path(store, "enclaves").is_dir() or not store:
            allowed = "a keystore: a folder with enclaves/ in it"
            hint = "Make one with `ros2 security`, or unset ROS_SECURITY_ENABLE (docs/security.md)"
            raise InputError("ROS_SECURITY_KEYSTORE", store, allowed, hint)


def security_is_on() -> bool:
    """Return whether nodes are to be authenticated and encrypted (SROS2)."""
    return os.environ.get("ROS_SECURITY_ENABLE") == "true"


def prepare(*, uses_ros: bool) -> None:
    """Make the process ready for rclpy, or end it with one line on stderr and exit code 2.

    To be called first in an executable's `main`, before `rclpy.init` and the import of matplotlib.
    Where ROS is not installed or not used, its settings do not matter.
    """
    try:
        use_package_index()
        use_matplotlib_folder()
        if uses_ros and ros_is_here():
            use_log_folder()
            check_domain()
            check_middleware()
            check_security()
    except InputError as error:
        sys.stderr.write(f"{PACKAGE}: {error.line}\n")
        raise SystemExit(int(ExitCode.BAD_INPUT)) from None
