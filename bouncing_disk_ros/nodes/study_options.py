"""The options that every study has besides its own; light, so that --help is quick."""

from __future__ import annotations

from collections.abc import Mapping

from bouncing_disk_ros.errors import InputError, closest
from bouncing_disk_ros.parameters import TABLE, Spec

FIGURE_KINDS = ("png", "pdf", "svg")

_SPECS = (
    Spec("output", "", "", "folder for the result and the figures; a run goes on with what it "
         "finds there; empty: output/ and the name of the study with a digest of its parameters"),
    Spec("workers", 0, "", "threads that compute; 0: one for each core", low=0, high=4096),
    Spec("scheduler", "", "", "address of a Dask scheduler whose workers compute instead, such as "
         "tcp://host:8786"),
    Spec("figures", "png pdf", "", "kinds of figure files: any of png, pdf, svg"),
    Spec("netcdf", True, "", "also export the whole result as result.nc"),
    Spec("hold", False, "", "stay when done, so that the latched topics can be read, until Ctrl-C"),
)  # fmt: skip
COMMON: Mapping[str, Spec] = {spec.name: spec for spec in _SPECS}

_PAPER = "paper, Fig. 2"
TOSS_SPECS = (
    Spec("arc_amplitude", 0.25, "m", "amplitude of the path of the hand, c = √(A² + (a_e Φ)²)", "c",
         low=1e-9, high=1e6, source=_PAPER),
    Spec("gravity", 10.0, "m/s²", "acceleration of gravity", "g", low=1e-9, high=1e9,
         source=_PAPER),
    *(TABLE[name] for name in ("frequency", "mass", "friction", "friction_radius",
                               "gyration_radius", "preload", "load_torque")),
)  # fmt: skip
"""What the studies of single tosses share; the defaults are those of the paper."""


def table_of(*specs: Spec) -> Mapping[str, Spec]:
    """The whole table of a study: its own options first."""
    return {**{spec.name: spec for spec in specs}, **COMMON}


def figure_kinds(text: str) -> list[str]:
    """The kinds of figure files named in a text."""
    kinds = text.replace(",", " ").lower().split()
    for kind in kinds:
        if kind not in FIGURE_KINDS:
            allowed = "any of " + ", ".join(FIGURE_KINDS)
            raise InputError("figures", text, allowed, closest(kind, FIGURE_KINDS))
    return kinds
