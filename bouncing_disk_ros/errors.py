"""Errors with a line for the user, and the exit codes of every executable.

An `InputError` is one clear line: what was given, what is allowed, what to do.
"""

from __future__ import annotations

import reprlib
from array import array
from collections.abc import Callable, Iterable
from enum import IntEnum


class ExitCode(IntEnum):
    """Exit codes of every executable of this package: the one table."""

    DONE = 0  # finished, or ended by Ctrl-C or SIGTERM (nodes)
    FAILED = 1  # something went wrong that is not the user's input
    BAD_INPUT = 2  # a parameter, command line, preset, file or environment that cannot be used
    REPLAY_DIFFERS = 3  # a replay gave other impacts than the record
    INTERRUPTED = 130  # a study ended by Ctrl-C before it was done


class InputError(ValueError):
    """Error of input that cannot be used; nothing was changed by the input.

    `field` names what was given, `given` is the value, `allowed` says what would be accepted and
    `hint` what to do about it (may be empty, or a function that gives it). The line is made only
    when it is read: an error that is only counted costs little.
    """

    def __init__(
        self, field: str, given: object, allowed: str, hint: str | Callable[[], str] = ""
    ) -> None:
        self.field = field
        self.given = given
        self.allowed = allowed
        self._hint = hint

    def __reduce__(self) -> tuple[type[InputError], tuple[object, ...]]:
        return type(self), (self.field, self.given, self.allowed, self._hint)

    def inside(self, whole: str) -> InputError:
        """The same error of a field that is a part of `whole`."""
        return InputError(whole + self.field, self.given, self.allowed, self._hint)

    @property
    def hint(self) -> str:
        """What to do about it."""
        return self._hint if isinstance(self._hint, str) else self._hint()

    @property
    def line(self) -> str:
        """The whole message, one line."""
        text = f"{cut(self.field)}: got {shown(self.given)}, allowed: {cut(self.allowed, LONGEST)}"
        if hint := self.hint:
            text += f". {cut(hint, LONGEST)}"
        return one_line(text)

    def __str__(self) -> str:
        return self.line


class MissingLibraryError(InputError):
    """Error of an option whose library is not installed."""

    def __init__(self, option: str, library: str) -> None:
        super().__init__(option, f"no {library}", library, f"pip install {library}")
        self.library = library

    def __reduce__(self) -> tuple[type[InputError], tuple[object, ...]]:
        return type(self), (self.field, self.library)

    @property
    def line(self) -> str:
        """The whole message, one line."""
        return f"{self.field} needs {self.library}, which is not installed: {self.hint}"


class FailedError(Exception):
    """Error that is not one of the input, as one line for the user; exit code FAILED."""


class BagError(Exception):
    """Error of a bag that is damaged where it was read, or cannot be decoded. One line."""

    def __str__(self) -> str:
        return one_line(super().__str__())


LONGEST = 2000
"""Characters of what is allowed, and of a hint, in the line of an error."""
_SHORT = reprlib.Repr()
_SHORT.maxlevel, _SHORT.maxstring, _SHORT.maxother = 3, 40, 60


def cut(text: str, limit: int = 120) -> str:
    """A text of at most `limit` characters; one that is longer ends with an ellipsis."""
    return text if len(text) <= limit else text[: limit - 1] + "…"


def counted(number: int, what: str) -> str:
    """A number of things in words: 1 row, 2 rows."""
    return f"{number} {what}{'' if number == 1 else 's'}"


def one_line(text: str) -> str:
    """A text on one line, fit for a terminal: letters that cannot be shown become ?."""
    line = " ".join(text.split())
    return line if line.isprintable() else "".join(c if c.isprintable() else "?" for c in line)


def shown(value: object, limit: int = 120) -> str:
    """A value as it appears in a message: short, on one line.

    The work does not grow with the value: it is cut before it is made a text.
    """
    if isinstance(value, (str, bytes, bytearray)):
        text = repr(value[: limit + 1])
    elif isinstance(value, int) and value.bit_length() > 200:
        text = f"an integer of {value.bit_length()} bits"  # str() refuses more than 4300 digits
    elif isinstance(value, (list, tuple, dict, set, frozenset, array)):
        text = _SHORT.repr(value)
    else:
        text = str(value)
    return cut(" ".join(text.split()), limit)


SYMBOLS = {
    "epsilon": "restitution", "ε": "restitution", "gamma": "axial_forcing", "Γ": "axial_forcing",
    "theta": "phase_lag", "θ": "phase_lag", "gamma_t": "angular_forcing",
    "Γ_T": "angular_forcing", "mu": "friction", "μ": "friction",
}  # fmt: skip
"""The paper's letters for parameters, which some users write instead of their names."""


def closest(name: str, names: Iterable[str]) -> str:
    """A hint with the known names that are meant, or an empty string.

    The parameter of a letter of the paper, else names that begin with the text, else the nearest.
    """
    import difflib  # here: nothing takes time before signals are taken over

    given, known = name[:100], list(names)
    match = [one for one in known if one == SYMBOLS.get(given, SYMBOLS.get(given.lower()))]
    match = match or [one for one in known if len(given) > 2 and one.startswith(given)]
    match = match or difflib.get_close_matches(given, known, n=1)
    return f"Did you mean {' or '.join(match[:3])}?" if match else ""


def one_of(field: str, given: object, names: Iterable[str], why: str = "") -> str:
    """The name given if it is a known one; else InputError with `why`, or the nearest name."""
    known = list(names)
    if isinstance(given, str) and given in known:
        return given
    raise InputError(field, given, "one of " + ", ".join(known), why or closest(str(given), known))
