"""Errors a person can act on, and the exit codes of every executable.

An `InputError` is one clear line: what was given, what is allowed, what to do.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from enum import IntEnum


class ExitCode(IntEnum):
    """Exit codes of every executable of this package: the one table."""

    DONE = 0  # finished, or ended by Ctrl-C or SIGTERM (nodes)
    FAILED = 1  # something went wrong that is not the user's input
    BAD_INPUT = 2  # a parameter, command line, preset, file or environment that cannot be used
    REPLAY_DIFFERS = 3  # a replay gave other impacts than the record
    INTERRUPTED = 130  # a study ended by Ctrl-C before it was done


class InputError(ValueError):
    """Something given from outside that cannot be used; nothing was changed by it.

    `field` names what was given, `given` is the value, `allowed` says what would be accepted and
    `hint` what to do about it (may be empty).
    """

    def __init__(self, field: str, given: object, allowed: str, hint: str = "") -> None:
        self.field = field
        self.given = given
        self.allowed = allowed
        self.hint = hint
        super().__init__(self.line)

    @property
    def line(self) -> str:
        """The whole message, one line."""
        text = f"{self.field}: got {shown(self.given)}, allowed: {self.allowed}"
        if self.hint:
            text += f". {self.hint}"
        return " ".join(text.split())


class FailedError(Exception):
    """One line for the user about what went wrong that is not the input; exit code FAILED."""


def shown(value: object, limit: int = 120) -> str:
    """A value as it appears in a message: short, on one line."""
    text = repr(value) if isinstance(value, (str, bytes)) else str(value)
    text = " ".join(text.split())
    return text if len(text) <= limit else text[: limit - 1] + "…"


def closest(name: str, names: Iterable[str]) -> str:
    """A hint with the nearest known name, or an empty string."""
    match = difflib.get_close_matches(name, list(names), n=1)
    return f"Did you mean {match[0]}?" if match else ""
