"""The tables reach ROS: types exist, profiles and descriptors say what the tables say."""

from __future__ import annotations

import importlib

from rcl_interfaces.msg import ParameterType
from rclpy.parameter import Parameter

from bouncing_disk_ros.parameters import TABLE
from bouncing_disk_ros.ros.validated_parameters import cast, descriptor_of, with_slider
from bouncing_disk_ros.sliders import slider_of
from bouncing_disk_ros.topics import SERVICES, TOPICS


def test_types_exist() -> None:
    types = [row.type for row in TOPICS.values()] + [row.type for row in SERVICES.values()]
    for name in types:
        package, kind, short = name.split("/")
        assert hasattr(importlib.import_module(f"{package}.{kind}"), short)


KINDS = {
    bool: ParameterType.PARAMETER_BOOL,
    int: ParameterType.PARAMETER_INTEGER,
    float: ParameterType.PARAMETER_DOUBLE,
    str: ParameterType.PARAMETER_STRING,
}


def test_descriptors_carry_the_row() -> None:
    for spec in TABLE.values():
        descriptor = descriptor_of(spec)
        assert descriptor.type == KINDS[spec.type]
        assert descriptor.read_only == spec.read_only
        assert spec.description in descriptor.description
        ranges = [*descriptor.floating_point_range, *descriptor.integer_range]
        bounds = [(bounds.from_value, bounds.to_value) for bounds in ranges]
        assert bounds == ([(spec.low, spec.high)] if None not in (spec.low, spec.high) else [])


def test_sliders_lie_within_what_is_allowed_hold_the_value_and_have_a_scale_of_use() -> None:
    for name, spec in TABLE.items():
        for value in (spec.default, spec.low, spec.high):
            slider = slider_of(name, spec.default if value is None else value)
            if slider is not None and value is not None:
                low, high = slider
                assert (spec.low or low) <= low <= float(value) <= high <= (spec.high or high)
                assert low < high
            descriptor = with_slider(descriptor_of(spec), spec.default if value is None else value)
            assert descriptor.additional_constraints == spec.allowed
    assert slider_of("frequency", 3.0) == (0.1, 20.0)
    assert slider_of("frequency", 40_000.0) == (0.1, 80_000.0)
    (bounds,) = with_slider(descriptor_of(TABLE["preload"]), -3.0).floating_point_range
    assert (bounds.from_value, bounds.to_value) == (-6.0, 10.0)
    wide = [n for n, s in TABLE.items() if s.type is float and (s.high or 0) > 100]
    assert all(slider_of(name, TABLE[name].default) for name in wide)


def test_integers_for_doubles_are_cast_and_nothing_else() -> None:
    given = [
        Parameter("restitution", value=1),
        Parameter("step_periods", value=2),
        Parameter("preset", value="x"),
        Parameter("foreign", value=3),
    ]
    assert [parameter.value for parameter in cast(given)] == [1.0, 2, "x", 3]
    assert cast(given)[0].type_ is Parameter.Type.DOUBLE
