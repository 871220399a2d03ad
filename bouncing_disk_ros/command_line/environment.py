"""What a process must find around it: writable folders, the package index, sane ROS settings.

Every executable calls `prepare` first in its `main`. Imports neither numba nor rclpy.
"""

from __future__ import annotations

import importlib.util
import io
import os
import socket
import stat
import sys
from pathlib import Path
from typing import Any

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
FAST_DISCOVERY_PROFILE = "fast_discovery.xml"
ROS_PACKAGES = ("rclpy", "std_msgs", "sensor_msgs")
"""What there is of ROS 2 wherever it is installed."""


def ros_is_here() -> bool:
    """Return whether ROS 2 can be imported; the library, studies and bag tools do without it."""
    try:
        return all(importlib.util.find_spec(name) is not None for name in ROS_PACKAGES)
    except (ModuleNotFoundError, ValueError):
        return False


# ROS settings -------------------------------------------------------------------------------------


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


# stdout -------------------------------------------------------------------------------------------


class _Pipe(io.FileIO):
    """A pipe to a reader that may go (`| head`): what is written later is dropped quietly."""

    reader_is_gone = False

    def write(self, data: Any) -> int:
        """Write, or drop what nobody reads."""
        try:
            return super().write(data)
        except BrokenPipeError:
            self.reader_is_gone = True
            os.dup2(os.open(os.devnull, os.O_WRONLY), self.fileno())
            return memoryview(data).nbytes


def _open_closed_streams() -> None:
    """Let standard streams that were closed (`2>&-`) lead nowhere.

    Else the next files get their numbers, and what libraries print goes into them.
    """
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # gets the lowest number that is free
        if getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(number, "w" if number else "r", closefd=False))


def prepare_stdout() -> None:
    """Let stdout take any text and outlive its reader; all standard streams are open then.

    Letters that the terminal's encoding lacks are shown as escapes, as on stderr. What is written
    to a pipe whose reader has gone is dropped: the work goes on and its files are written.
    """
    _open_closed_streams()
    out = sys.stdout
    if not isinstance(out, io.TextIOWrapper):
        return  # captured
    out.reconfigure(errors="backslashreplace")
    try:
        is_pipe = out is sys.__stdout__ and stat.S_ISFIFO(os.fstat(out.fileno()).st_mode)
    except OSError:
        return
    if is_pipe:
        out.flush()
        pipe = io.BufferedWriter(_Pipe(out.fileno(), "wb", closefd=False))
        sys.stdout = io.TextIOWrapper(
            pipe, encoding=out.encoding, errors=out.errors, line_buffering=out.line_buffering,
            write_through=out.write_through,
        )  # fmt: skip


def reader_is_gone() -> bool:
    """Whether stdout is a pipe whose reader was found to have gone."""
    raw = getattr(getattr(sys.stdout, "buffer", None), "raw", None)
    return isinstance(raw, _Pipe) and raw.reader_is_gone


# a domain of one's own ----------------------------------------------------------------------------


#: tests that share a machine hold TCP port 32768 + domain (the package domain_coordinator)
_FIRST_RESERVATION = 32768


NICENESS = 10
"""Of threads that compute: with another program at work, 1 kHz ticks in the same process were late
by 2.6 ms at p99 so, and by 3.9 ms without."""


def give_way() -> None:
    """Let the calling thread come after others, so that a simulator beside it keeps its ticks."""
    if sys.platform == "linux":  # elsewhere it would be the whole process
        os.nice(NICENESS)


def _bound(kind: socket.SocketKind, port: int) -> socket.socket | None:
    """A socket on a port of this machine; None: the port is taken."""
    found = socket.socket(socket.AF_INET, kind)
    try:
        found.bind(("", port))
    except OSError:
        found.close()
        return None
    return found


def domain_is_free(domain: int) -> bool:
    """Return whether no DDS participant of this machine is in the ROS domain `domain`.

    The first participant of a domain holds UDP port 7400 + 250 * domain + 10 (RTPS, 9.6.1.1).
    """
    probe = _bound(socket.SOCK_DGRAM, 7400 + 250 * domain + 10)
    if probe is not None:
        probe.close()
    return probe is not None


def reserved(domain: int) -> socket.socket | None:
    """Return what keeps others from taking the ROS domain until it is closed; None: it is taken.

    A session of tests has its domain also while none of its nodes is there.
    """
    return _bound(socket.SOCK_STREAM, _FIRST_RESERVATION + domain)


def free_domain() -> tuple[int, socket.socket]:
    """Return a free ROS domain in 1..101, and what reserves it until it is closed."""
    for step in range(101):
        domain = 1 + (os.getpid() + step) % 101
        if domain_is_free(domain) and (reservation := reserved(domain)):
            return domain, reservation
    raise InputError("ROS_DOMAIN_ID", "nothing, and 1 to 101 are all in use", DOMAINS_ALLOWED)


_reservations: list[socket.socket] = []
"""Of this process, for as long as it lives."""


def use_private_domain() -> str:
    """Keep strangers out: a domain of its own, this machine only, found quickly.

    What the user has set stays. Returns the line that joins a second terminal to it.
    """
    if "ROS_DOMAIN_ID" not in os.environ:
        domain, reservation = free_domain()
        _reservations.append(reservation)
        os.environ["ROS_DOMAIN_ID"] = str(domain)
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    use_fast_discovery()
    names = ("ROS_DOMAIN_ID", "ROS_AUTOMATIC_DISCOVERY_RANGE")
    return "export " + " ".join(f"{name}={os.environ[name]}" for name in names)


def use_fast_discovery() -> None:
    """Let Fast DDS announce often at first, unless a profile is set: 0.7 s to discover, not 3 s."""
    if {"FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_DEFAULT_PROFILES_FILE"} & os.environ.keys():
        return
    use_package_index()
    for prefix in prefixes():
        profile = prefix / "share" / PACKAGE / "config" / FAST_DISCOVERY_PROFILE
        if profile.is_file():
            os.environ["FASTRTPS_DEFAULT_PROFILES_FILE"] = str(profile)
            return
