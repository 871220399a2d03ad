"""A user's own controller, from a Python file that says `make_controller(setup)`."""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import NamedTuple, cast

from bouncing_disk_ros.core.model import Disk, Motion
from bouncing_disk_ros.errors import InputError, one_line
from bouncing_disk_ros.juggling.juggler import Controller
from bouncing_disk_ros.juggling.loop_settings import Limits

FUNCTION = "make_controller"


class Setup(NamedTuple):
    """What a controller may know from the start."""

    motion: Motion  # of the platform, steady
    disk: Disk  # as believed: gravity and restitution
    limits: Limits  # in parts of A and Aω²
    phase: float  # forcing phase at simulated time 0, rad


def file_of(file: str | Path) -> Path:
    """The file of a controller; InputError where there is none."""
    path = Path(file)
    if not path.is_file():
        raise InputError("controller", str(file), "a Python file", "There is no such file.")
    return path


def load_controller(file: str | Path, setup: Setup) -> Controller:
    """The controller that `make_controller(setup)` of a file returns; InputError in one line."""
    path = file_of(file)
    try:
        function = runpy.run_path(str(path)).get(FUNCTION)
    except Exception as error:  # noqa: BLE001 (whatever a user's file raises)
        why = one_line(f"{type(error).__name__}: {error}")
        raise InputError("controller", str(file), "a Python file that runs", why) from None
    if not callable(function):
        raise InputError("controller", str(file), f"a file with a function {FUNCTION}(setup)")
    try:
        controller = function(setup)
    except Exception as error:  # noqa: BLE001 (as above)
        why = one_line(f"{type(error).__name__}: {error}")
        allowed = f"a file whose {FUNCTION}(setup) returns a controller"
        raise InputError("controller", str(file), allowed, why) from None
    if not callable(getattr(controller, "on_impact", None)):
        given = f"{FUNCTION} that returns {type(controller).__name__}"
        raise InputError("controller", given, "an object with on_impact(impact, now_ns)")
    return cast("Controller", controller)
