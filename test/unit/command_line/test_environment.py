"""ROS settings that a process finds, or does not find, around it."""

from __future__ import annotations

from collections.abc import Callable
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
