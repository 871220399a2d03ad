"""Errors are one clear line: what was given, what is allowed, what to do."""

from __future__ import annotations

import pickle
import time
from array import array
from functools import partial

import pytest

from bouncing_disk_ros.errors import ExitCode, InputError, closest, one_line, shown
from bouncing_disk_ros.help_text import EXIT_MEANINGS


@pytest.mark.parametrize(
    ("given", "line"),
    [
        (("restitution", 1.5, ">= 0 and <= 1", "Lower it."),
         "restitution: got 1.5, allowed: >= 0 and <= 1. Lower it."),
        (("mass", -1, "> 0"), "mass: got -1, allowed: > 0"),
        (("preset", "a\nb", "one of\nthese", "do\n\tthis"),
         r"preset: got 'a\nb', allowed: one of these. do this"),
        (("bag", "", "b", "it holds \x1b[31m and \x00"),
         "bag: got '', allowed: b. it holds ?[31m and ?"),
    ],
)  # fmt: skip
def test_an_error_is_one_line_without_letters_that_a_terminal_obeys(
    given: tuple[str, object, str], line: str
) -> None:
    error = InputError(*given)
    assert str(error) == error.line == line
    assert one_line("a\n b\t\x07") == "a b ?"


def test_a_value_is_cut_before_it_is_made_a_text() -> None:
    nested: list[object] = [1.0]
    for _ in range(100):
        nested = [nested, nested]  # as a text it would have 2^100 numbers
    huge = 10**5000  # str() refuses it
    for value in (
        nested,
        {"a": nested},
        huge,
        "x" * 10**7,
        b"x" * 10**7,
        array("d", [0.0] * 10**6),
    ):
        began = time.perf_counter()
        assert len(shown(value)) <= 120
        assert len(InputError("field", value, "less").line) < 200
        assert time.perf_counter() - began < 0.1
    assert shown(huge) == "an integer of 16610 bits"
    assert len(shown("x" * 1000)) == 120


def test_the_line_is_made_when_it_is_read_in_another_process_too() -> None:
    asked = []

    def hint() -> str:
        asked.append(1)
        return "Do this."

    error = InputError("name", "x", "y", hint)
    assert not asked
    assert error.line == str(error) == "name: got 'x', allowed: y. Do this."
    assert asked
    sent = pickle.loads(pickle.dumps(InputError("name", "x", "y", partial(closest, "ab", ["abc"]))))
    assert sent.line == "name: got 'x', allowed: y. Did you mean abc?"
    assert sent.given == "x"


@pytest.mark.parametrize(
    ("given", "names", "meant"),
    [
        ("restituton", ["restitution", "mass"], "restitution"),
        ("zzz", ["restitution"], ""),
        ("s", ["start", "starts"], ""),
        ("first_tos", ["spin_up", "first_toss_to_period_1"], "first_toss_to_period_1"),
        ("pizza", ["pizza_toss", "swum", "pizza_spin"], "pizza_toss or pizza_spin"),
        ("epsilon", ["angular_forcing", "restitution"], "restitution"),
        ("Γ", ["axial_forcing", "angular_forcing"], "axial_forcing"),
        ("Gamma_T", ["axial_forcing", "angular_forcing"], "angular_forcing"),
        ("theta", ["axial_forcing", "restitution"], ""),
    ],
)
def test_closest_knows_the_names_that_are_meant_or_says_nothing(
    given: str, names: list[str], meant: str
) -> None:
    assert closest(given, names) == (f"Did you mean {meant}?" if meant else "")


def test_exit_codes_are_those_of_the_contract_and_all_explained() -> None:
    assert {code.name: code.value for code in ExitCode} == {
        "DONE": 0,
        "FAILED": 1,
        "BAD_INPUT": 2,
        "REPLAY_DIFFERS": 3,
        "INTERRUPTED": 130,
    }
    assert EXIT_MEANINGS.keys() == set(ExitCode)
