"""The options of an executable from what its command line gives, with ROS or without."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from bouncing_disk_ros.errors import InputError, closest
from bouncing_disk_ros.parameters import Spec, Value, is_rclpy_parameter, listed_text


def option_values(
    given: Mapping[str, object], table: Mapping[str, Spec], lists: Collection[str] = ()
) -> dict[str, Value]:
    """The values of a table's options; unknown names and wrong values are InputErrors.

    `given`: parameter overrides. `lists`: texts that hold numbers; a number, or an array of them,
    is taken there as well.
    """
    taken = dict(given)
    for name in taken:
        if name not in table and not is_rclpy_parameter(name):
            hint = closest(name, table) or "--help lists the parameters."
            raise InputError("parameter", name, ", ".join(table), hint)
        if name in lists:
            taken[name] = listed_text(taken[name])
    return {name: spec.checked(taken.get(name, spec.default)) for name, spec in table.items()}
