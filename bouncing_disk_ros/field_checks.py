"""Checks of values from outside: what a value must be, or the InputError that says so.

Each check returns the value. `field` names it in the line of the error.
"""

from __future__ import annotations

import sys
from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from bouncing_disk_ros import limits
from bouncing_disk_ros.errors import InputError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray

_LARGEST = sys.float_info.max
_INT64 = 2**63 - 1


def whole(field: str, value: object, low: int = -_INT64 - 1, high: int = _INT64) -> int:
    """A whole number within bounds, which are those of int64 at most; no bool."""
    if type(value) is not int or not low <= value <= high:
        raise InputError(field, value, f"a whole number{_bounds(low, high, _INT64)}")
    return value


def number(field: str, value: object, low: float = -_LARGEST, high: float = _LARGEST) -> float:
    """A finite number within bounds as a float; no bool, no text."""
    if type(value) is float and low <= value <= high:  # nearly always: this saves the rest
        return value
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not low <= value <= high:
        raise out_of_range(field, value, low, high)
    return float(value)


def plain(given: object) -> object:
    """A number of NumPy, or an array of none or one axis, as Python's; everything else as it is."""
    if hasattr(given, "dtype") and hasattr(given, "tolist"):
        return given.tolist()
    return given


def numbers(
    field: str, value: ArrayLike, allowed: str = "numbers, none masked"
) -> NDArray[np.float64]:
    """Real numbers as an array that a kernel takes; none masked, no texts, bools or times."""
    import numpy as np

    try:
        found = np.asanyarray(value)
        objects = found.dtype.kind == "O" and not any(map(_is_no_number, found.flat))
        if (objects or found.dtype.kind in "iuf") and not np.ma.is_masked(found):
            return np.require(found, np.float64, ["C", "W", "E"])
    except (TypeError, ValueError, OverflowError):
        pass
    raise InputError(field, value, allowed)


def _is_no_number(value: object) -> bool:
    return isinstance(value, (bool, str, bytes))


def out_of_range(field: str, given: object, low: float, high: float) -> InputError:
    """The error of what is no finite number within bounds."""
    return InputError(field, given, f"a finite number{_bounds(low, high, _LARGEST)}")


def _bounds(low: float, high: float, largest: float) -> str:
    """Bounds in words; empty where the largest number is the only one."""
    if high == largest:
        return f" >= {_short(low)}" if abs(low) < largest else ""
    return f" from {_short(low)} to {_short(high)}"


def _short(bound: float) -> str:
    return str(bound) if isinstance(bound, int) else f"{bound:g}"


def items(field: str, value: object, most: int = sys.maxsize) -> Sequence[Any]:
    """A list or tuple of at most `most` items."""
    if not isinstance(value, (list, tuple)):
        raise InputError(field, value, "a list")
    if len(value) > most:
        raise too_many(field, len(value), most)
    return value


def row(field: str, value: object, names: Collection[str]) -> Sequence[Any]:
    """A list or tuple with one item for each name."""
    if not isinstance(value, (list, tuple)) or len(value) != len(names):
        raise InputError(field, value, f"[{', '.join(names)}]")
    return value


def too_many(field: str, count: int, most: int) -> InputError:
    """The error of more items than are accepted."""
    return InputError(field, f"{count} of them", f"at most {most}")


def mapping(field: str, value: object) -> Mapping[str, Any]:
    """A mapping whose keys are texts."""
    if not isinstance(value, (dict, Mapping)) or not all(isinstance(key, str) for key in value):
        raise InputError(field, value, "a JSON object")
    return value


def with_names(field: str, value: object, names: Collection[str]) -> Mapping[str, Any]:
    """A mapping that has all these names; it may have others."""
    found = mapping(field, value)
    for name in names:
        if name not in found:
            raise InputError(f"{field} {name}".lstrip(), "nothing", "a value")
    return found


def only_names(field: str, value: object, names: Collection[str]) -> Mapping[str, Any]:
    """A mapping that has these names and no others."""
    found = with_names(field, value, names)
    if len(found) > len(names):
        raise InputError(field, next(iter(found.keys() - {*names})), ", ".join(names))
    return found


def truth(field: str, value: object) -> bool:
    """True or false."""
    if not isinstance(value, bool):
        raise InputError(field, value, "true or false")
    return value


def text(field: str, value: object) -> str:
    """A text that is not longer than a name."""
    if not isinstance(value, str) or len(value) > limits.NAME:
        raise InputError(field, value, f"a text of at most {limits.NAME} letters")
    return value
