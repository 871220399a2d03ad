"""A ROS domain of one's own."""

from __future__ import annotations

import os
import socket
from contextlib import ExitStack
from pathlib import Path

import pytest

from bouncing_disk_ros.command_line import private_domain
from bouncing_disk_ros.errors import InputError
from support.places import installed


def test_a_domain_with_a_participant_is_not_free() -> None:
    domain, reservation = private_domain.free_domain()
    reservation.close()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as participant:
        participant.bind(("", 7400 + 250 * domain + 10))
        assert not private_domain.domain_is_free(domain)
        other, reservation = private_domain.free_domain()
        reservation.close()
        assert other != domain
    assert private_domain.domain_is_free(domain)


def test_a_domain_is_given_to_one_at_a_time(ros_domain: int) -> None:
    """Also before the first participant is there, which alone can be seen."""
    with ExitStack() as stack:
        domains = []
        for _ in range(20):
            domain, reservation = private_domain.free_domain()
            stack.enter_context(reservation)
            domains.append(domain)
        assert len(set(domains)) == 20
    assert private_domain.reserved(ros_domain) is None, "that of the session of tests"


def test_no_free_domain_is_told(clean: pytest.MonkeyPatch) -> None:
    clean.setattr(private_domain, "domain_is_free", lambda domain: False)
    with pytest.raises(InputError, match="all in use"):
        private_domain.free_domain()


def test_private_domain_is_on_this_machine_stays_reserved_and_says_how_to_join(
    clean: pytest.MonkeyPatch,
) -> None:
    kept: list[socket.socket] = []
    clean.setattr(private_domain, "_reservations", kept)
    line = private_domain.use_private_domain()
    domain = os.environ["ROS_DOMAIN_ID"]
    assert 1 <= int(domain) <= 101
    assert line == f"export ROS_DOMAIN_ID={domain} ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST"
    assert private_domain.reserved(int(domain)) is None
    for reservation in kept:
        reservation.close()


def test_private_domain_keeps_what_the_user_has_set(clean: pytest.MonkeyPatch) -> None:
    clean.setenv("ROS_DOMAIN_ID", "5")
    clean.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET")
    clean.setenv("FASTDDS_DEFAULT_PROFILES_FILE", "mine.xml")
    assert private_domain.use_private_domain() == (
        "export ROS_DOMAIN_ID=5 ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET"
    )
    assert "FASTRTPS_DEFAULT_PROFILES_FILE" not in os.environ


def test_fast_discovery_takes_the_installed_profile(
    clean: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    prefix = installed(tmp_path / "ros", "packages/bouncing_disk_ros")
    clean.setenv("AMENT_PREFIX_PATH", str(prefix))
    private_domain.use_fast_discovery()
    assert "FASTRTPS_DEFAULT_PROFILES_FILE" not in os.environ
    profile = prefix / "share/bouncing_disk_ros/config/fast_discovery.xml"
    profile.parent.mkdir(parents=True)
    profile.touch()
    private_domain.use_fast_discovery()
    assert os.environ["FASTRTPS_DEFAULT_PROFILES_FILE"] == str(profile)
