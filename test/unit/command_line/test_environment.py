"""ROS settings that a process finds, or does not find, around it."""

from __future__ import annotations

import os
import socket
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

import pytest

from bouncing_disk_ros.command_line import environment
from support.checks import refused
from support.places import installed

DOMAIN, MIDDLEWARE, SECURITY = (
    environment.check_domain, environment.check_middleware, environment.check_security,
)  # fmt: skip
ON = {"ROS_SECURITY_ENABLE": "true"}


@pytest.fixture
def ros(clean: pytest.MonkeyPatch, tmp_path: Path) -> pytest.MonkeyPatch:
    """Two middlewares are installed, and a keystore lies at tmp_path."""
    names = ("rmw_fastrtps_cpp", "rmw_zenoh_cpp", "rmw_implementation")
    prefix = installed(tmp_path / "ros", *(f"rmw_typesupport/{name}" for name in names))
    clean.setenv("AMENT_PREFIX_PATH", str(prefix))
    (tmp_path / "enclaves").mkdir()
    return clean


@pytest.mark.parametrize(
    ("check", "settings"),
    [
        *((DOMAIN, {"ROS_DOMAIN_ID": text}) for text in ("", "0", "7", "101", "102", "232")),
        (MIDDLEWARE, {}),
        (MIDDLEWARE, {"RMW_IMPLEMENTATION": "rmw_zenoh_cpp"}),
        (SECURITY, {}),
        (SECURITY, {"ROS_SECURITY_ENABLE": "false"}),
        (SECURITY, {**ON, "ROS_SECURITY_KEYSTORE": "HERE"}),
    ],
)
def test_settings_that_ros_understands(
    ros: pytest.MonkeyPatch, tmp_path: Path, check: Callable[[], None], settings: dict[str, str]
) -> None:
    for name, text in settings.items():
        ros.setenv(name, text.replace("HERE", str(tmp_path)))
    check()


@pytest.mark.parametrize(
    ("check", "settings", "words"),
    [
        *(
            (DOMAIN, {"ROS_DOMAIN_ID": text}, "a whole number from 0 to 232")
            for text in ("233", "300", "-1", "1.5", "abc", " 7", "0x7", "٣", "9" * 5000)
        ),
        (MIDDLEWARE, {"RMW_IMPLEMENTATION": "rmw_fastrtps"},
         "rmw_fastrtps_cpp or rmw_zenoh_cpp.*Did you mean rmw_fastrtps_cpp"),
        (MIDDLEWARE, {"RMW_IMPLEMENTATION": "xyz"}, "Install it, or unset RMW_IMPLEMENTATION"),
        *(
            (SECURITY, {name: text}, f"{name}: got '{text}', allowed: .* no other spelling")
            for name, text in (("ROS_SECURITY_ENABLE", "1"), ("ROS_SECURITY_ENABLE", "True"),
                               ("ROS_SECURITY_STRATEGY", "x"))
        ),
        (SECURITY, ON, "a keystore: a folder with enclaves/ in it"),
        (SECURITY, {**ON, "ROS_SECURITY_KEYSTORE": "/"}, "a keystore: a folder with enclaves/"),
    ],
)  # fmt: skip
def test_settings_that_are_refused(
    ros: pytest.MonkeyPatch, check: Callable[[], None], settings: dict[str, str], words: str
) -> None:
    for name, text in settings.items():
        ros.setenv(name, text)
    refused(words, check)


# a domain of one's own


def test_a_domain_with_a_participant_is_not_free_and_none_that_is_is_told(
    clean: pytest.MonkeyPatch,
) -> None:
    domain, reservation = environment.free_domain()
    reservation.close()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as participant:
        participant.bind(("", 7400 + 250 * domain + 10))
        assert not environment.domain_is_free(domain)
        other, reservation = environment.free_domain()
        reservation.close()
        assert other != domain
    assert environment.domain_is_free(domain)
    clean.setattr(environment, "domain_is_free", lambda domain: False)
    refused("all in use", environment.free_domain)


def test_a_domain_is_given_to_one_at_a_time(ros_domain: int) -> None:
    """Also before the first participant is there, which alone can be seen."""
    with ExitStack() as stack:
        domains = []
        for _ in range(20):
            domain, reservation = environment.free_domain()
            stack.enter_context(reservation)
            domains.append(domain)
        assert len(set(domains)) == 20
    assert environment.reserved(ros_domain) is None, "that of the session of tests"


def test_private_domain_is_on_this_machine_stays_reserved_and_says_how_to_join(
    clean: pytest.MonkeyPatch,
) -> None:
    kept: list[socket.socket] = []
    clean.setattr(environment, "_reservations", kept)
    line = environment.use_private_domain()
    domain = os.environ["ROS_DOMAIN_ID"]
    assert 1 <= int(domain) <= 101
    assert line == f"export ROS_DOMAIN_ID={domain} ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST"
    assert environment.reserved(int(domain)) is None
    for reservation in kept:
        reservation.close()


def test_private_domain_keeps_what_the_user_has_set(clean: pytest.MonkeyPatch) -> None:
    clean.setenv("ROS_DOMAIN_ID", "5")
    clean.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET")
    clean.setenv("FASTDDS_DEFAULT_PROFILES_FILE", "mine.xml")
    assert environment.use_private_domain() == (
        "export ROS_DOMAIN_ID=5 ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET"
    )
    assert "FASTRTPS_DEFAULT_PROFILES_FILE" not in os.environ


def test_fast_discovery_takes_the_installed_profile(
    clean: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    prefix = installed(tmp_path / "ros", "packages/bouncing_disk_ros")
    clean.setenv("AMENT_PREFIX_PATH", str(prefix))
    environment.use_fast_discovery()
    assert "FASTRTPS_DEFAULT_PROFILES_FILE" not in os.environ
    profile = prefix / "share/bouncing_disk_ros/config/fast_discovery.xml"
    profile.parent.mkdir(parents=True)
    profile.touch()
    environment.use_fast_discovery()
    assert os.environ["FASTRTPS_DEFAULT_PROFILES_FILE"] == str(profile)
