"""The table of parameters: values, bounds, rules between them, angles, and the generated page."""

from __future__ import annotations

import math
from itertools import product
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bouncing_disk_ros import help_text, limits, parameters
from bouncing_disk_ros.angles import angle_of, angles_of, numbers_of
from bouncing_disk_ros.core.model import Disk, InitialState, Motion
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.executables import STUDIES
from bouncing_disk_ros.parameters import DEFAULTS, GROUPS, TABLE, Spec, Value
from bouncing_disk_ros.study.by_name import definition_of
from support.checks import refused

DEFINITIONS = [definition_of(name) for name in STUDIES]

DOCS = Path(__file__).resolve().parents[2] / "docs"
NUMBERS = [spec for spec in TABLE.values() if spec.type in (int, float)]
FLOATS = [spec for spec in NUMBERS if spec.type is float]


def test_pages_hold_the_current_tables() -> None:
    read = {name: (DOCS / f"{name}.md").read_text(encoding="utf-8")
            for name in ("parameters", "interfaces", "recording")}  # fmt: skip
    made_by = "run: python -m bouncing_disk_ros.help_text docs"
    assert read["parameters"] == help_text.parameters_page(), made_by
    assert help_text.topics_table() in read["interfaces"], made_by
    for page, home in (("recording", limits.FILES_READ), ("interfaces", limits.MESSAGES)):
        assert read[page] == help_text.with_limits(read[page], home), made_by
        assert limits.table(home) in read[page]


def test_every_limit_is_on_a_page() -> None:
    shown = limits.table(limits.FILES_READ) + limits.table(limits.MESSAGES)
    assert [row.what for row in limits.TABLE if f"| {row.what} |" not in shown] == []
    assert len({row.what for row in limits.TABLE}) == len(limits.TABLE)


def test_rows_are_complete_with_each_field_of_the_model_and_defaults_allowed() -> None:
    for spec in TABLE.values():
        assert spec.description
        assert spec.group in GROUPS
        assert spec.allowed
    assert parameters.complete({}) == dict(DEFAULTS)
    assert {*Motion._fields, *Disk._fields} <= TABLE.keys()
    assert {f"initial_{name}" for name in InitialState._fields} <= TABLE.keys()


@pytest.mark.parametrize("spec", NUMBERS, ids=lambda spec: spec.name)
def test_bounds_are_inclusive_and_hold(spec: Spec) -> None:
    for bound, beyond in ((spec.low, -math.inf), (spec.high, math.inf)):
        if bound is None:
            continue
        assert spec.checked(spec.type(bound)) == bound
        step = math.copysign(1, beyond)
        outside = bound + step if spec.type is int else math.nextafter(bound, beyond)
        refused(f"^{spec.name}: got", spec.checked, spec.type(outside))


def test_numbers_that_are_none_are_refused() -> None:
    for spec, value in product(FLOATS, (math.nan, math.inf, -math.inf)):
        if spec.unlimited and value == math.inf:
            assert spec.checked(value) == spec.high
        else:
            refused(f"{spec.name}.*finite number", spec.checked, value)


def test_other_types_are_refused() -> None:
    for spec, value in product(TABLE.values(), (None, [1.0], b"x", "1.0", True, 1, 1.0)):
        castable = type(value) is int and spec.type is float
        castable |= spec.numbers and type(value) in (int, float, list)
        if type(value) is not spec.type and not castable:
            refused(f"It is an? {spec.type_name}, not an? ", spec.checked, value)


ANGLES = [
    spec
    for table in (TABLE, *(one.options for one in DEFINITIONS))
    for spec in table.values()
    if spec.unit == "rad" and spec.type is float
]


def test_every_angle_takes_a_part_of_pi_and_nothing_else_does() -> None:
    for spec in ANGLES:
        assert spec.checked("0.25pi") == math.pi / 4
        assert "also 0.25pi" in spec.allowed
        refused("It is a double, not a string", spec.checked, "0.25 rad")
        refused(f"^{spec.name}: got '1e300pi', allowed: a finite", spec.checked, "1e300pi")
    for spec in (spec for spec in FLOATS if spec not in ANGLES):
        refused("It is a double, not a string", spec.checked, "0.25pi")


def test_help_shows_no_unit_where_there_is_none() -> None:
    for table in (TABLE, *(one.table for one in DEFINITIONS)):
        dimensionless = [spec for spec in table.values() if spec.unit == "1"]
        assert dimensionless or table is not TABLE
        for spec in dimensionless:
            head, *_ = help_text.spec_lines(spec)
            assert head == f"  {spec.name} ({spec.type_name}, default {spec.default:.10g})"
            assert spec.shown_unit == ""


def test_the_ends_of_an_axis_of_phase_lags_can_be_angles() -> None:
    for study, names in (("bifurcation", ("begin", "end")),
                         ("parameter_map", ("x_begin", "x_end", "y_begin", "y_end"))):  # fmt: skip
        for name in names:
            assert definition_of(study).options[name].checked("-pi") == -math.pi


def test_integers_and_doubles_stand_for_each_other_only_without_loss() -> None:
    value = TABLE["restitution"].checked(1)
    assert (value, type(value)) == (1.0, float)
    refused("mass", TABLE["mass"].checked, 10**400)
    refused("It is an integer, not a double", TABLE["step_periods"].checked, 2.0)


@given(mass=st.floats(1e-3, 1e3), gravity=st.floats(0.0, 100.0), share=st.floats(0.0, 2.0))
def test_preload_must_leave_the_disk_pressed_down(
    mass: float, gravity: float, share: float
) -> None:
    values: dict[str, Value] = {
        "mass": mass,
        "gravity": gravity,
        "preload": -share * mass * gravity,
    }
    if -share * mass * gravity > -mass * gravity:
        parameters.complete(values)
    else:
        refused(r"preload: got .* allowed: a finite number > ", parameters.complete, values)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"restituton": 0.5}, "Did you mean restitution"),
        ({"gravity": 0.0}, r"preload: got 0.0, allowed: .*mass × gravity = 0 N"),
        ({"real_time_factor": 0.0}, ""),
        ({"real_time_factor": 1e-6}, ""),
        ({"real_time_factor": 1e-7}, r"real_time_factor: got 1e-07, allowed: 0 .free"),
        ({"initial_axial_velocity": 1.0}, "Set initial_with_platform to false"),
        ({"initial_axial_velocity": 1.0, "initial_with_platform": False}, ""),
    ],
)
def test_what_does_not_fit_together_is_refused(given: dict[str, Value], words: str) -> None:
    if words:
        refused(words, parameters.complete, given)
    else:
        assert parameters.complete(given).items() >= given.items()


def test_each_value_of_a_change_is_checked_also_of_a_name_given_twice() -> None:
    values = parameters.complete({})
    change: list[tuple[str, object]] = [("restitution", 0.4), ("restitution", 0.3)]
    assert parameters.checked_change(change, values, is_configured=True) == {"restitution": 0.3}
    for first in (-1.0, "0.4"):
        change[0] = ("restitution", first)
        refused(r"^restitution: got", parameters.checked_change, change, values, is_configured=True)
    change = [("mass", 0.5), ("mass", values["mass"])]
    with pytest.raises(InputError, match="no change while it runs"):
        parameters.checked_change(change, values, is_configured=True)


# --- angles ---------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("text", "parts"),
    [("0.25pi", 0.25), ("-0.5pi", -0.5), ("pi", 1.0), ("-pi", -1.0), ("+pi", 1.0), ("1e-1pi", 0.1),
     ("0.1234π", 0.1234), (" 2pi ", 2.0)],
)  # fmt: skip
def test_parts_of_pi(text: str, parts: float) -> None:
    assert angle_of(text) == parts * math.pi


@pytest.mark.parametrize("text", ["", "1", "0.25", "pi/4", "pi2", "pipi", "xpi", "nanpi", "infpi"])
def test_texts_that_are_none(text: str) -> None:
    assert angle_of(text) is None


@given(st.lists(st.floats(-1e6, 1e6), min_size=1), st.sampled_from([" ", ",", ", ", "  "]))
def test_a_list_gives_its_numbers(numbers: list[float], between: str) -> None:
    assert numbers_of("list", between.join(map(repr, numbers)), "numbers") == numbers
    parts = between.join(f"{number!r}pi" for number in numbers)
    assert angles_of("list", parts) == [number * math.pi for number in numbers]


@pytest.mark.parametrize("text", ["", " , ", "1 x", "0.25pi nan", "1 2 3pi4"])
def test_a_list_that_cannot_be_read_names_the_word(text: str) -> None:
    with pytest.raises(InputError, match="allowed: angles in rad") as caught:
        angles_of("phase_lags", text)
    assert str(caught.value.given) in text
