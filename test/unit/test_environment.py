"""ROS settings that a process finds, or does not find, around it."""

from __future__ import annotations

import os
import socket
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from bouncing_disk_ros import environment
from bouncing_disk_ros.errors import InputError
from support.places import installed


@pytest.mark.parametrize("text", ["", "0", "7", "101", "102", "232"])
def test_domains_that_dds_can_use(clean: pytest.MonkeyPatch, text: str) -> None:
    clean.setenv("ROS_DOMAIN_ID", text)
    environment.check_domain()


@pytest.mark.parametrize("text", ["233", "300", "-1", "1.5", "abc", " 7", "0x7", "٣", "9" * 5000])
def test_domains_that_are_refused(clean: pytest.MonkeyPatch, text: str) -> None:
    clean.setenv("ROS_DOMAIN_ID", text)
    with pytest.raises(InputError, match="a whole number from 0 to 232") as caught:
        environment.check_domain()
    assert caught.value.given == text


def test_middleware_must_be_installed(clean: pytest.MonkeyPatch, tmp_path: Path) -> None:
    names = ("rmw_fastrtps_cpp", "rmw_zenoh_cpp", "rmw_implementation")
    prefix = installed(tmp_path / "ros", *(f"rmw_typesupport/{name}" for name in names))
    clean.setenv("AMENT_PREFIX_PATH", str(prefix))
    environment.check_middleware()
    clean.setenv("RMW_IMPLEMENTATION", "rmw_zenoh_cpp")
    environment.check_middleware()
    for wrong, hint in [
        ("rmw_fastrtps", "Did you mean rmw_fastrtps_cpp"),
        ("xyz", "Install it, or unset RMW_IMPLEMENTATION"),
    ]:
        clean.setenv("RMW_IMPLEMENTATION", wrong)
        with pytest.raises(InputError, match="rmw_fastrtps_cpp or rmw_zenoh_cpp") as caught:
            environment.check_middleware()
        assert hint in caught.value.line


@pytest.mark.parametrize(
    ("name", "text"),
    [("ROS_SECURITY_ENABLE", "1"), ("ROS_SECURITY_ENABLE", "True"), ("ROS_SECURITY_STRATEGY", "x")],
)
def test_security_is_not_left_off_by_a_spelling(
    clean: pytest.MonkeyPatch, name: str, text: str
) -> None:
    environment.check_security()
    clean.setenv(name, text)
    with pytest.raises(InputError, match=f"{name}: got '{text}', allowed: .* no other spelling"):
        environment.check_security()


def test_security_needs_a_keystore(clean: pytest.MonkeyPatch, tmp_path: Path) -> None:
    clean.setenv("ROS_SECURITY_ENABLE", "false")
    environment.check_security()
    clean.setenv("ROS_SECURITY_ENABLE", "true")
    for store in ("", str(tmp_path)):
        clean.setenv("ROS_SECURITY_KEYSTORE", store)
        with pytest.raises(InputError, match="a keystore: a folder with enclaves/ in it"):
            environment.check_security()
    (tmp_path / "enclaves").mkdir()
    environment.check_security()


def test_prepare_ends_with_one_line_and_code_2(
    clean: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    clean.setenv("ROS_DOMAIN_ID", "abc")
    with pytest.raises(SystemExit) as caught:
        environment.prepare()
    assert caught.value.code == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("bouncing_disk_ros: ROS_DOMAIN_ID: got 'abc', allowed:")
    assert captured.err.count("\n") == 1


# a domain of one's own


@pytest.fixture
def free() -> Iterator[Callable[[], int]]:
    """Find a free domain, which stays reserved until the end of the test."""
    with ExitStack() as stack:

        def find() -> int:
            domain, reservation = environment.free_domain()
            stack.enter_context(reservation)
            return domain

        yield find


def test_a_domain_with_a_participant_is_not_free() -> None:
    domain, reservation = environment.free_domain()
    reservation.close()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as participant:
        participant.bind(("", 7400 + 250 * domain + 10))
        assert not environment.domain_is_free(domain)
        other, reservation = environment.free_domain()
        reservation.close()
        assert other != domain
    assert environment.domain_is_free(domain)


def test_a_domain_is_given_to_one_at_a_time(free: Callable[[], int]) -> None:
    """Also before the first participant is there, which alone can be seen."""
    domains = [free() for _ in range(20)]
    assert len(set(domains)) == 20


def test_the_domain_of_a_session_of_tests_is_not_free(ros_domain: int) -> None:
    """Whether or not a node of the tests is there at this moment."""
    assert environment.reserved(ros_domain) is None


@pytest.fixture
def private(clean: pytest.MonkeyPatch) -> Iterator[pytest.MonkeyPatch]:
    """Private domains are held no longer than the test."""
    kept: list[socket.socket] = []
    clean.setattr(environment, "_reservations", kept)
    yield clean
    for reservation in kept:
        reservation.close()


def test_a_private_domain_stays_reserved(private: pytest.MonkeyPatch) -> None:
    environment.use_private_domain()
    assert environment.reserved(int(os.environ["ROS_DOMAIN_ID"])) is None


def test_no_free_domain_is_told(clean: pytest.MonkeyPatch) -> None:
    clean.setattr(environment, "domain_is_free", lambda domain: False)
    with pytest.raises(InputError, match="all in use"):
        environment.free_domain()


def test_private_domain_is_on_this_machine_and_says_how_to_join(
    private: pytest.MonkeyPatch,
) -> None:
    line = environment.use_private_domain()
    domain = os.environ["ROS_DOMAIN_ID"]
    assert 1 <= int(domain) <= 101
    assert line == f"export ROS_DOMAIN_ID={domain} ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST"


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
