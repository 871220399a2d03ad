"""A ROS domain of one's own: a free one is found and reserved, nodes in it find each other quickly.

Imports neither numba nor rclpy.
"""

from __future__ import annotations

import os
import socket

from bouncing_disk_ros.command_line.environment import DOMAINS_ALLOWED
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.folders import PACKAGE, prefixes, use_package_index

FAST_DISCOVERY_PROFILE = "fast_discovery.xml"
#: tests that share a machine hold TCP port 32768 + domain (the package domain_coordinator)
_FIRST_RESERVATION = 32768


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
