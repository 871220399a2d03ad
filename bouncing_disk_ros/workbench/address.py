"""The address of a page: parameters of the run, tab and window, as text after the question mark.

It holds no token, so that it can be sent to others.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple
from urllib.parse import urlencode

from bouncing_disk_ros import parameters
from bouncing_disk_ros.errors import InputError, closest
from bouncing_disk_ros.parameters import DEFAULTS, Value
from bouncing_disk_ros.topics import MOTION_NAMES
from bouncing_disk_ros.workbench.actions import RUN_NAMES, typed_value, value_text

WRITES = """
const left = new URLSearchParams(location.search);
left.delete("token");
history.replaceState(null, "", "?" + (status.tags[0] ?? left));
"""
"""How a browser shows a new address, the text in the tags of `status`; none: without the token."""
_OTHERS = ("tab", "window")
_LEFT_OUT = "token"


class Address(NamedTuple):
    """What an address asks for. Empty: nothing."""

    parameters: Mapping[str, Value] = {}  # all of RUN_NAMES, or none
    tab: str = ""
    window: tuple[float, ...] = ()  # ends of the axis across, and of the one up


def written(values: Mapping[str, Value], tab: str, window: Sequence[float]) -> str:
    """The text for parameters in force (none: they are left out), a tab and the window in it."""
    parts = {
        name: value_text(values[name])
        for name in RUN_NAMES
        if name in values and (name in MOTION_NAMES or values[name] != DEFAULTS[name])
    }
    parts["tab"] = tab
    if window:
        parts["window"] = ",".join(value_text(float(end)) for end in window)
    return urlencode(parts, safe=",")


def read(given: Mapping[str, str], tabs: Sequence[str]) -> Address:
    """What the names and texts of an address ask for; parameters left out have their defaults.

    Raises InputError.
    """
    values, tab, window = {}, given.get("tab", ""), given.get("window", "")
    for name, text in given.items():
        if name in RUN_NAMES:
            values[name] = typed_value(name, text)
        elif name not in (*_OTHERS, _LEFT_OUT):
            names = (*RUN_NAMES, *_OTHERS)
            raise InputError("address", name, "parameters of the run, tab, window",
                             closest(name, names))  # fmt: skip
    whole = parameters.complete(values)
    if tab and tab not in tabs:
        raise InputError("address tab", tab, ", ".join(tabs), closest(tab, tabs))
    asked = {name: whole[name] for name in RUN_NAMES} if values else {}
    return Address(asked, tab, _ends(window))


def _ends(text: str) -> tuple[float, ...]:
    try:
        ends = tuple(float(part) for part in text.split(",")) if text else ()
    except ValueError:
        ends = (0.0,)
    if ends and not (len(ends) == 4 and ends[0] < ends[1] and ends[2] < ends[3]):
        allowed = "four numbers with commas: begin, end of the axis across, then of the one up"
        raise InputError("address window", text, allowed)
    return ends
