"""The executable `resilience`: how easy attractors are to reach and how hard to lose."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from bouncing_disk_ros.errors import counted
from bouncing_disk_ros.orbit_studies import NO_ROTATION
from bouncing_disk_ros.parameters import TABLE, Spec
from bouncing_disk_ros.study.command import main_of
from bouncing_disk_ros.study.definition import StudyDefinition
from bouncing_disk_ros.study.shared_options import map_options

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr


_ABOUT = """How easy each attractor is to reach and how hard to lose, over axial forcing or
restitution: the smallest impulse and the smallest error in time after which it is not reached
again, how fast it is reached, and its share of the starts."""
_EXAMPLE = "ros2 run bouncing_disk_ros resilience --ros-args -p begin:=0.34 -p end:=0.48"
_NOT_TAKEN = ("phase_lag", "angular_forcing")
_NAMED = 5
"""Attractors that lines tell of, those that are there for longest."""
_FUNCTION = """\
Fatal impulses and timing errors, times and shares of each attractor over a parameter.

>>> resilience(begin=0.4, end=0.45, count=2, samples=10)["line_least_fatal_impulse"]
"""
_SPECS = (
    Spec("along", "axial_forcing", "", "the parameter of the axis: axial_forcing or restitution"),
    Spec("begin", 0.32, "", "first value of it", low=0.0, high=1e3),
    Spec("end", 0.58, "", "last value of it", low=0.0, high=1e3),
    Spec("count", 66, "", "number of values", low=1, high=1_000_000),
    *map_options("where it is not the axis", "axial_forcing", "restitution"),
    Spec("samples", 300, "", "starts along each side of the window", low=2, high=100_000),
    Spec("velocity_begin", -5.0, "πg/ω", "window of starts: τ from 0 to 2π, w_A from this to 0",
         low=-1e3, high=0.0),
    Spec("instants", 32, "", "instants of one repetition at which impulses act, besides the limits "
         "at its impacts", low=1, high=100_000),
    Spec("periods", 1000.0, "", "periods of the platform within which an orbit must be reached "
         "again, or it is lost", low=1.0, high=1e9),
    Spec("largest_impulse", 5.0, "m πg/ω", "impulses up to this are looked at", "J", low=0.02,
         high=1e3),
    Spec("resolution", 0.01, "", "intervals of fatal impulses and timing errors wider than this "
         "part of them are found", low=1e-5, high=1.0),
    Spec("after", "5 10 20 50 100", "", "periods of the platform after which it is counted how "
         "many starts are on each attractor: a list with blanks between", numbers=True),
    Spec("match", 0.3, "", "attractors at values in a row that are nearer than this (rad and πg/ω "
         "together) are one line", low=0.0, high=100.0),
    Spec("most_attractors", 8, "", "attractors kept at each value, by the largest shares",
         low=1, high=1000),
    replace(TABLE["mass"], source="only for results in SI units", while_unconfigured=False),
    replace(TABLE["frequency"], default=3.0, source="as in the preset pizza_multiple_toss; only "
            "for results in SI units", while_unconfigured=False),
    replace(TABLE["gravity"], default=10.0, low=1e-9, source="as in the preset "
            "pizza_multiple_toss; only for results in SI units", while_unconfigured=False),
)  # fmt: skip


def lines(result: xr.Dataset) -> list[str]:
    """Of each kind of attractor, where its share is largest and where it is hardest to lose."""
    import numpy as np

    from bouncing_disk_ros.orbit_studies.resilience.picture import impulse_unit, time_unit
    from bouncing_disk_ros.study.printed_lines import at_value

    largest = f"up to {float(result.attrs['parameter_largest_impulse']):g} m πg/ω"
    units = {
        "least_fatal_impulse": ("impulse", largest, "m πg/ω", impulse_unit(result), "N·s"),
        "fatal_timing_error": ("timing error", "up to π", "rad", 1e3 * time_unit(result), "ms"),
    }
    only = (result["line_kind"].values >= 0).sum(axis=0) == 1
    stretches = _stretches(result)
    share = result["line_share"].values
    rows = []
    for name, line, places in stretches[:_NAMED]:
        x = result["value"][places]
        k = int(np.argmax(share[line, places]))
        error = 100.0 * float(result["line_share_uncertainty"].values[line, places][k])
        first, last = at_value(x, float(x[0])), f"{float(x[-1]):.6g}"
        rows.append(f"  {name}, " + (f"from {first} to {last}" if x.size > 1 else f"at {first}"))
        part = f"{100.0 * share[line, places][k]:.3f} ± {error:.3f} % of the starts"
        rows.append(f"    easiest to reach at {at_value(x, float(x[k]))}: by {part}")
        for field, unit in units.items():
            least = result[f"line_{field}"].values[line, places].min(axis=-1)
            rows.append(f"    {_hardest_to_lose(x, least, only[places], *unit)}")
    return rows + _warnings(result, len(stretches))


def _hardest_to_lose(
    x: xr.DataArray,
    least: np.ndarray,
    only: np.ndarray,
    what: str,
    largest: str,
    unit: str,
    size: float,
    si: str,
) -> str:
    """Where the least fatal one is largest: where none is, before all others.

    `unit` of `least` is `size` in the SI unit `si`; `only`: where there is no other attractor.
    """
    import numpy as np

    from bouncing_disk_ros.study.printed_lines import at_value

    safe = np.isposinf(least)
    if safe.any():
        where = f" at {safe.sum()} of {x.size} values, {_spans(x, safe)}" if not safe.all() else ""
        alone = int((safe & only).sum())
        why = (
            "the only attractor there" if alone == safe.sum() else f"the only attractor at {alone}"
        )
        return f"no {what} looked at, {largest}, is fatal{where}" + (
            f": it is {why}" if alone else ""
        )
    if np.isnan(least).all():
        return f"which {what} is fatal is not known"
    at = int(np.nanargmax(least))
    article = "a" if what.startswith("t") else "an"
    return (
        f"hardest to lose by {article} {what} at {at_value(x, float(x[at]))}: "
        f"{least[at]:.5g} {unit} = {least[at] * size:.5g} {si}"
    )


def _spans(x: xr.DataArray, chosen: np.ndarray) -> str:
    """The chosen values, neighbours as a range: Γ = 0.32 to 0.332, 0.56."""
    import numpy as np

    from bouncing_disk_ros.study.printed_lines import at_value

    places = np.flatnonzero(chosen)
    runs = [x.values[run] for run in np.split(places, np.flatnonzero(np.diff(places) > 1) + 1)]
    texts = [f"{run[0]:.6g}" + (f" to {run[-1]:.6g}" if run.size > 1 else "") for run in runs]
    return ", ".join([at_value(x, runs[0][0]) + texts[0][len(f"{runs[0][0]:.6g}") :], *texts[1:]])


def _stretches(result: xr.Dataset) -> list[tuple[str, int, np.ndarray]]:
    """Name, line and places along the axis of each kind of attractor, the longest first."""
    import numpy as np

    from bouncing_disk_ros.study.attractor_lines import name_of

    found: dict[tuple[str, int], list[int]] = {}
    fields = [result[f"line_{name}"].values for name in ("kind", "impacts", "cycles")]
    for line, k in np.argwhere(fields[0] >= 0):
        name = name_of(*(field[line, k] for field in fields))
        found.setdefault((name, int(line)), []).append(int(k))
    share = result["line_share"].values
    rows = [(name, line, np.array(places)) for (name, line), places in found.items()]
    return sorted(rows, key=lambda row: (-len(row[2]), -float(share[row[1], row[2]].max())))


def _warnings(result: xr.Dataset, count: int) -> list[str]:
    """What was left out."""
    rows = [f"  and {counted(count - _NAMED, 'other')}"] if count > _NAMED else []
    left = int((result["left_out"] > 0).sum())
    if left:
        rows.append(f"  attractors were left out at {left} values: most_attractors:=... keeps them")
    unresolved = float(result["unresolved"].max())
    if unresolved > 0.0:
        rows.append(f"  up to {100 * unresolved:.3f} % of the starts are unresolved")
    return rows


DEFINITION = StudyDefinition(
    name="resilience",
    about=_ABOUT,
    example=_EXAMPLE,
    function=_FUNCTION,
    specs=_SPECS,
    study="bouncing_disk_ros.orbit_studies.resilience.compute:ResilienceStudy",
    lines=lines,
    takes_run=True,
    not_taken=dict.fromkeys(_NOT_TAKEN, NO_ROTATION),
)
main = main_of(DEFINITION)
