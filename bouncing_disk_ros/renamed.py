"""Keywords of an earlier version: they still work, with a DeprecationWarning."""

from __future__ import annotations

import functools
import warnings
from collections.abc import Callable
from typing import Any, TypeVar

F = TypeVar("F", bound=Callable[..., Any])
C = TypeVar("C", bound=type)


def renamed_keywords(**names: str) -> Callable[[F], F]:
    """Let a function take keywords by their former names too: `former="new"`."""

    def decorate(function: F) -> F:
        @functools.wraps(function)
        def wrapped(*args: Any, **given: Any) -> Any:
            for former, new in names.items():
                if former in given:
                    if new in given:
                        raise TypeError(f"{function.__name__}: {former} is {new}, which is given")
                    warn(function.__qualname__.removesuffix(".__init__"), former, new)
                    given[new] = given.pop(former)
            return function(*args, **given)

        return wrapped  # type: ignore[return-value]

    return decorate


def renamed_fields(**names: str) -> Callable[[C], C]:
    """Let a class take and give fields by their former names too: `former="new"`."""

    def decorate(kind: C) -> C:
        kind.__init__ = renamed_keywords(**names)(kind.__init__)  # type: ignore[misc]
        for former, new in names.items():
            setattr(kind, former, property(_reader(former, new)))
        return kind

    return decorate


def _reader(former: str, new: str) -> Callable[[Any], Any]:
    def read(self: Any) -> Any:
        warn(type(self).__name__, former, new)
        return getattr(self, new)

    return read


def warn(where: str, former: str, new: str) -> None:
    """Say that a name is another one now."""
    text = f"{where}: {former} is now {new}"
    warnings.warn(text, DeprecationWarning, stacklevel=3)
