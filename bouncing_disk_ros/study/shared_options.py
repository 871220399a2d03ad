"""Options that several studies have."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

from bouncing_disk_ros.parameters import TABLE, Spec

TAKEN = (
    Spec("preset", "", "", "name of a preset in share/bouncing_disk_ros/config, or a file: "
         "parameters that are not given here are taken from it"),
    Spec("bag", "", "", "folder of a recorded run: parameters that are not given here are taken "
         "from its last steady motion up and down, and from the disk then"),
    Spec("namespace", "", "", "of the simulator, where that bag has several"),
)  # fmt: skip
"""Whence a study takes parameters that are not given."""
RUN = (
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
"""How a study runs, and what becomes of its result."""


def specs_by_name(*specs: Spec) -> Mapping[str, Spec]:
    """Options by their names."""
    return MappingProxyType({spec.name: spec for spec in specs})


def of_simulator(name: str) -> Spec:
    """A parameter of the simulator as a study has it: nothing is changed or reset there."""
    spec = TABLE[name]
    description, _, _ = spec.description.partition(" at the start and after a reset")
    return replace(spec, description=description, while_unconfigured=False)


COMMON: Mapping[str, Spec] = specs_by_name(*TAKEN, *RUN)
"""Options of the executables that say where and how, not what: no part of a study's parameters."""
_PAPER = "paper, Fig. 2"
TOSS_OPTIONS = (
    Spec("arc_amplitude", 0.25, "m", "amplitude of the path of the hand, c = √(A² + (a_e Φ)²)", "c",
         low=1e-9, high=1e6, source=_PAPER),
    Spec("gravity", 10.0, "m/s²", "acceleration of gravity", "g", low=1e-9, high=1e9,
         source=_PAPER),
    *map(of_simulator, ("frequency", "mass", "friction", "friction_radius", "gyration_radius",
                        "preload", "load_torque")),
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
