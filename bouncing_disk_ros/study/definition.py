"""What a study is beside its computation: options, refusals, printed lines, pictures.

Imports nothing heavy: computation and pictures are loaded when they are asked for.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.executables import loaded
from bouncing_disk_ros.parameters import Spec, Value
from bouncing_disk_ros.study.shared_options import RUN, TAKEN, specs_by_name

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from bouncing_disk_ros.study.computation import Study


Idle = tuple[str, str, str]
"""An option that does nothing beside the others, what is allowed for it, and why."""


def _none(_: Mapping[str, Value]) -> tuple[Idle, ...]:
    return ()


@dataclass(frozen=True)
class StudyDefinition:
    """A study beside its computation.

    Executable, --help, function, docs/parameters.md, `named` and `figures` are made from it.
    """

    name: str
    about: str
    """What --help says of it."""
    example: str
    """A command, for --help."""
    function: str
    """What the docstring of its function says, with an example."""
    specs: Sequence[Spec]
    """The options that decide its result."""
    study: str
    """The class that computes, as module:name."""
    lines: Callable[[xr.Dataset], list[str]]
    """What the executable prints of a result."""
    image: str = ""
    """The field (rows, columns) that is published as an image; empty: the result is not a map."""
    takes_run: bool = False
    """Whether a recorded run, or a preset, gives the options that it has (`from_run.wanted`)."""
    not_taken: Mapping[str, str] = field(default_factory=dict)
    """Parameters that it could be expected to have -> why it has none."""
    idle: Callable[[Mapping[str, Value]], Iterable[Idle]] = _none
    """The options that do nothing beside these values, besides those of an axis."""

    @cached_property
    def options(self) -> Mapping[str, Spec]:
        """What decides its result, by name."""
        return specs_by_name(*self.specs)

    @cached_property
    def table(self) -> Mapping[str, Spec]:
        """All options of its executable: what decides the result first."""
        return specs_by_name(*self.specs, *(TAKEN if self.takes_run else ()), *RUN)

    def refuse_not_taken(self, names: Iterable[str]) -> None:
        """Refuse, with the reason, parameters that it could be expected to have."""
        for name in names:
            if name in self.not_taken:
                raise InputError("parameter", name, ", ".join(self.options), self.not_taken[name])

    def all_idle(self, values: Mapping[str, Value]) -> tuple[Idle, ...]:
        """The options that do nothing beside these values."""
        return (*_idle_beside_axes(values), *self.idle(values))

    def make(self, values: Mapping[str, Value]) -> Study:
        """The study with these options; InputError for those that it cannot use."""
        if "along" in values and values["begin"] == values["end"] and values["count"] != 1:
            raise InputError("end", values["end"], "another value than begin", "The axis is empty.")
        made: Study = loaded(self.study)(values)
        return made

    def pictures(self, study: Study, result: xr.Dataset) -> Mapping[str, Figure]:
        """Name of the file (without its kind) -> figure; the first one is published.

        The function `pictures` draws them, in `picture.py` beside the module of the study.
        """
        package = self.study.partition(":")[0].rpartition(".")[0]
        drawn: Mapping[str, Figure] = loaded(f"{package}.picture:pictures")(study, result)
        return drawn

    def refuse_idle(self, values: Mapping[str, Value]) -> None:
        """Refuse options, other than their defaults, that do nothing beside the others."""
        for name, allowed, hint in self.all_idle(values):
            if name in values and values[name] != self.options[name].default:
                raise InputError(name, values[name], allowed, hint)


def _idle_beside_axes(values: Mapping[str, Value]) -> Iterator[Idle]:
    """The parameter along an axis; the end of an axis of one value."""
    for axis, key in (("along", ""), ("x_axis", "x_"), ("y_axis", "y_")):
        if axis not in values:
            continue
        begin, end, count = (f"{key}{name}" for name in ("begin", "end", "count"))
        hint = f"{begin}, {end} and {count} give its values."
        yield str(values[axis]), f"none with {axis}:={values[axis]}", hint
        if values[count] == 1 and values[end] != values[begin]:
            yield end, f"{begin} = {values[begin]:g} with {count}:=1", f"The one value is {begin}."
