"""How the result of a study is shown: pictures, lines, the published image."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Generic, TypeVar

from bouncing_disk_ros.parameters import Value

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from bouncing_disk_ros.study import Study

S = TypeVar("S", bound="Study")


@dataclass(frozen=True)
class StudyView(Generic[S]):
    """A study with the ways to show its result; made after the slow imports."""

    make: Callable[[Mapping[str, Value]], S]
    pictures: Callable[[S, xr.Dataset], Mapping[str, Figure]]
    """Of the study and its result: name of the file (without its kind) -> figure; the first one is
    published."""
    lines: Callable[[xr.Dataset], list[str]]
    from_bag: Callable[[Mapping[str, Value]], Sequence[str]] | None = None
    """The options that a recorded run can give, by the others; None: it takes no bag."""
    image: str = ""
    """The field (rows, columns) that is published as an image; empty: the result is not a map."""
