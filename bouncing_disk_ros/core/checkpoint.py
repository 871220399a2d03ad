"""Records as plain numbers and back, to the bit: what a checkpoint is made of.

Floats go through Python's shortest round-trip form, so JSON keeps them exactly.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

FORMAT = 1
"""Version of the checkpoint's layout; another one is refused."""


def check_format(snapshot: Mapping[str, Any]) -> None:
    """Raise ValueError for a checkpoint of another format."""
    if snapshot.get("format") != FORMAT:
        raise ValueError(f"checkpoint format {snapshot.get('format')!r}: allowed {FORMAT}")


def plain(record: NDArray[np.void]) -> dict[str, Any]:
    """The one element of a structured array as {field: number}."""
    return {name: record[name][0].item() for name in record.dtype.names or ()}


def record(values: dict[str, Any], dtype: np.dtype[np.void]) -> NDArray[np.void]:
    """Inverse of `plain`; a missing or an unknown field raises ValueError."""
    names = set(dtype.names or ())
    if set(values) != names:
        raise ValueError(f"checkpoint fields {sorted(set(values) ^ names)} do not fit this version")
    r = np.zeros(1, dtype)
    for name, value in values.items():
        r[name] = value
    return r
