"""What a study is beside its computation: options, refusals, printed lines, pictures.

The studies by name too. Imports nothing heavy: computation and pictures are loaded when they are
asked for.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from bouncing_disk_ros.errors import InputError, closest
from bouncing_disk_ros.executables import STUDIES, loaded, module_of
from bouncing_disk_ros.parameters import TABLE, Spec, Value

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from bouncing_disk_ros.study.computation import Study


Idle = tuple[str, str, str]
"""An option that does nothing beside the others, what is allowed for it, and why."""

_TAKEN = (
    Spec("preset", "", "", "name of a preset in share/bouncing_disk_ros/config, or a file: "
         "parameters that are not given here are taken from it"),
    Spec("bag", "", "", "folder of a recorded run: parameters that are not given here are taken "
         "from its last steady motion up and down, and from the disk then"),
    Spec("namespace", "", "", "of the simulator, where that bag has several"),
)  # fmt: skip
_RUN = (
    Spec("output", "", "", "folder for the result and the figures; a run continues the result "
         "there; empty: output/ and the name of the study with a digest of its parameters"),
    Spec("workers", 0, "", "threads that compute; 0: one for each core", low=0, high=4096),
    Spec("scheduler", "", "", "address of a Dask scheduler whose workers compute instead, such as "
         "tcp://host:8786"),
    Spec("figures", "png pdf", "", "kinds of figure files: any of png, pdf, svg, or none",
         listed=True),
    Spec("netcdf", True, "", "also export the whole result as result.nc, if netCDF4 is installed"),
    Spec("csv", False, "", "also export the result as text tables, result_*.csv: one for each "
         "group of arrays with the same axes"),
    Spec("hold", False, "", "keep running when done, until Ctrl-C, so that the latched topics can "
         "be read"),
)  # fmt: skip


def _by_name(*specs: Spec) -> Mapping[str, Spec]:
    return MappingProxyType({spec.name: spec for spec in specs})


COMMON: Mapping[str, Spec] = _by_name(*_TAKEN, *_RUN)
"""Options of the executables that say where and how, not what: no part of a study's parameters."""


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
    pictures: Callable[[Any, xr.Dataset], Mapping[str, Figure]]
    """Of the study and its result: name of the file (without its kind) -> figure; the first one is
    published."""
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
        return _by_name(*self.specs)

    @cached_property
    def table(self) -> Mapping[str, Spec]:
        """All options of its executable: what decides the result first."""
        return _by_name(*self.specs, *(_TAKEN if self.takes_run else ()), *_RUN)

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
        made: Study = loaded(self.study)(values)
        return made

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


# --- by name --------------------------------------------------------------------------------------


def definition_of(name: str) -> StudyDefinition:
    """What the study called `name` is; InputError for another name."""
    if name not in STUDIES:
        raise InputError("study", name, ", ".join(STUDIES), closest(name, STUDIES))
    found: StudyDefinition = loaded(f"{module_of(name)}:DEFINITION")
    return found


def named(name: str, **given: object) -> Study:
    """Study called `name`, with the parameters given and the defaults of docs/parameters.md.

    Numbers of NumPy are numbers; where a list of numbers is a text, a sequence is taken too.
    Raises InputError for an unknown name, or a value that cannot be used.

    >>> named("basins", axial_forcing=0.34, width=60, height=60)
    """
    definition = definition_of(name)
    table = definition.options
    definition.refuse_not_taken(given)
    for key in given:
        if key not in table:
            raise InputError("parameter", key, ", ".join(table), closest(key, table))
    values = {key: spec.checked(given.get(key, spec.default)) for key, spec in table.items()}
    made = definition.make(values)
    definition.refuse_idle(values)
    return made


def figures(result: xr.Dataset) -> dict[str, Figure]:
    """Figures of a study's result by name, as the study's command stores them.

    As the last line of a notebook's cell they are shown. `result` comes from a study (`basins`,
    `bifurcation` ...) or from its result.nc; its attributes say which study it is. Raises
    InputError where they do not.

    >>> figures(bifurcation(restitution=0.3, begin=0.0, count=201))["bifurcation"].savefig("f.pdf")
    """
    identity = getattr(result, "attrs", {}).get("identity", {})
    if isinstance(identity, str):
        identity = json.loads(identity)  # from NetCDF
    name = str(identity.get("study", ""))
    if name not in STUDIES:
        given = f"{type(result).__name__} without the name of a study"
        raise InputError("result", given, "the dataset that a study gave")
    from bouncing_disk_ros.matplotlib_figures import Figures  # not for --help

    study = named(name, **identity["parameters"])
    return Figures(definition_of(name).pictures(study, result))


# --- options of several studies -------------------------------------------------------------------
_PAPER = "paper, Fig. 2"
TOSS_OPTIONS = (
    Spec("arc_amplitude", 0.25, "m", "amplitude of the path of the hand, c = √(A² + (a_e Φ)²)", "c",
         low=1e-9, high=1e6, source=_PAPER),
    Spec("gravity", 10.0, "m/s²", "acceleration of gravity", "g", low=1e-9, high=1e9,
         source=_PAPER),
    *(TABLE[name] for name in ("frequency", "mass", "friction", "friction_radius",
                               "gyration_radius", "preload", "load_torque")),
)  # fmt: skip
"""What the studies of single tosses share; the defaults are those of the paper."""

RESTITUTION = Spec("restitution", 0.5, "1", "coefficient of restitution", "ε", low=0.0, high=1.0)


def map_options(where: str, *names: str) -> tuple[Spec, ...]:
    """Parameters of the next-collision map that a study fixes: these, or all; and where it does."""
    specs = (
        Spec("axial_forcing", 0.45, "1", f"axial forcing {where}", "Γ", low=0.0, high=1e3),
        Spec("restitution", 0.5, "1", f"restitution {where}", "ε", low=0.0, high=1.0),
        Spec("phase_lag", 0.0, "rad", f"phase lag {where}", "θ", low=-1e3, high=1e3),
        Spec("angular_forcing", 100.0, "1", f"angular forcing {where}", "Γ_T", low=1e-9,
             high=1e12),
    )  # fmt: skip
    return tuple(spec for spec in specs if not names or spec.name in names)
