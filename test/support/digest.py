"""Digests of results: numbers by their bits, words apart from them.

Names of fields of tuples and of dataclasses are left out, for they may change. Keys of mappings,
names of columns and texts are published, in messages, bags and stores: they have a digest of
their own, so that a change of words cannot hide a change of numbers.
"""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Mapping, Sequence
from enum import Enum
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

LENGTH = 16
"""Digits of a digest."""


class Near(NamedTuple):
    """Numbers that another processor may compute with other last digits: kept, and compared.

    Those of the C library, of numpy's vectors and of LAPACK. A digest of rounded numbers would fail
    wherever one lies beside the edge of its rounding.
    """

    numbers: object
    digits: int = 12  # that are the same everywhere, counted from the largest of these numbers


class Digest(NamedTuple):
    """What is compared of a result."""

    numbers: str  # of all numbers and bytes, in order
    words: str  # of all texts and published names, in order; empty: there are none
    near: tuple[tuple[int, tuple[float, ...]], ...]  # each `Near`: digits and numbers


class _Walk:
    """Gathers the parts of a result in order."""

    def __init__(self) -> None:
        self.numbers, self.words = hashlib.sha256(), hashlib.sha256()
        self.has_words = False
        self.near: list[tuple[int, tuple[float, ...]]] = []

    def word(self, text: str) -> None:
        self.has_words = True
        self.words.update(text.encode() + b"\0")

    def number(self, tag: str, data: bytes) -> None:
        self.numbers.update(f"{tag}:{len(data)}:".encode() + data)

    def array(self, array: NDArray[Any]) -> None:
        if array.dtype.names is not None:
            self.number("rows", repr(array.shape).encode())
            for name in array.dtype.names:
                self.word(name)
                self.array(array[name])
        elif array.dtype.kind in "UOST":
            self.number("texts", repr(array.shape).encode())
            for text in array.ravel().tolist():
                self.take(text)
        else:
            plain = np.ascontiguousarray(array, array.dtype.newbyteorder("<"))
            if plain.dtype.kind == "f":  # the bits of a NaN besides its kind mean nothing
                plain = np.where(np.isnan(plain), np.array(np.nan, plain.dtype), plain)
            about = f"{plain.dtype.kind}{plain.dtype.itemsize}{array.shape}"
            self.number(about, plain.tobytes())

    def closely(self, content: object, digits: int) -> None:
        """Numbers to compare by their first digits; NaN and infinity have none, and are exact."""
        array = np.asarray(content, np.float64)
        self.array(np.where(np.isfinite(array), 0.0, array))
        if np.isfinite(array).any():
            self.near.append((digits, tuple(array[np.isfinite(array)].tolist())))

    def scalar(self, content: Any) -> None:
        """A number of Python or numpy, by what it is and not by its type."""
        if isinstance(content, (bool, np.bool_)):
            self.number("bool", bytes([bool(content)]))
        elif isinstance(content, (int, np.integer)):
            self.number("int", str(int(content)).encode())
        elif isinstance(content, (float, np.floating)):
            self.array(np.asarray(content, np.float64))
        else:  # np.str_, np.bytes_
            self.take(content.item())

    def take(self, content: Any) -> None:
        match content:
            case Near():
                self.closely(*content)
            case None:
                self.number("none", b"")
            case Enum():
                self.take(content.value)
            case bool() | int() | float() | np.generic() if not isinstance(content, np.void):
                self.scalar(content)
            case str():
                self.word(content)
            case bytes():
                self.number("bytes", content)
            case np.ndarray() | np.void():
                self.array(np.asarray(content))
            case _:
                self.group(content)

    def group(self, content: Any) -> None:
        if isinstance(content, Mapping):
            self.number("mapping", str(len(content)).encode())
            for name, value in content.items():
                self.word(str(name))
                self.take(value)
        elif dataclasses.is_dataclass(content):
            self.take([getattr(content, field.name) for field in dataclasses.fields(content)])
        elif isinstance(content, Sequence):
            self.number("sequence", str(len(content)).encode())
            for item in content:
                self.take(item)
        else:
            raise TypeError(f"no digest of {type(content).__name__}")


def digest_of(content: object) -> Digest:
    """The digest of a result: numbers, texts, arrays, and groups of them within each other."""
    walk = _Walk()
    walk.take(content)
    words = walk.words.hexdigest()[:LENGTH] if walk.has_words else ""
    return Digest(walk.numbers.hexdigest()[:LENGTH], words, tuple(walk.near))


def differences(pinned: Digest, found: Digest) -> list[str]:
    """What differs, in words; empty: nothing."""
    said = [
        f"{name} differ: {before or 'none'} pinned, {now or 'none'} now"
        for name, before, now in (
            ("numbers", pinned.numbers, found.numbers),
            ("words", pinned.words, found.words),
        )
        if before != now
    ]
    shapes = [[(digits, len(numbers)) for digits, numbers in one.near] for one in (pinned, found)]
    if shapes[0] != shapes[1]:
        return [*said, "there are other numbers of which only some digits count"]
    for (digits, before), (_, now) in zip(pinned.near, found.near, strict=True):
        allowed = 10.0**-digits * max(map(abs, before))
        said += [
            f"{first!r} pinned, {second!r} now, of which {digits} digits count"
            for first, second in zip(before, now, strict=True)
            if not abs(second - first) <= allowed
        ]
    return said


def nearly(content: Any, digits: int = 9) -> Any:
    """The same result with all its floats, in arrays too, as `Near`."""
    match content:
        case float() | np.floating():
            return Near(content, digits)
        case np.ndarray() if content.dtype.kind == "f":
            return Near(content, digits)
        case Mapping():
            return {name: nearly(value, digits) for name, value in content.items()}
        case list() | tuple() if not isinstance(content, Near):
            return [nearly(value, digits) for value in content]
        case _:
            return content
