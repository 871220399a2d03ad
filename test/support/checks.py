"""Checks that many tests make: a call is refused in one line, a value is there."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import pytest

from bouncing_disk_ros.errors import InputError

Value = TypeVar("Value")


def refused(said: str, call: Callable[..., object], *given: Any, **named: Any) -> str:
    """The one line of an InputError that a call raises, in which the pattern `said` is found."""
    with pytest.raises(InputError, match=said) as caught:
        call(*given, **named)
    line = caught.value.line
    assert "\n" not in line, line
    return line


def there(value: Value | None) -> Value:
    """The value; AssertionError if it is None."""
    assert value is not None
    return value
