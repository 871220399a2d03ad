"""Measured times from a text, a sound, a bag or an array; InputError where they cannot be used."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bouncing_disk_ros.errors import InputError, closest
from bouncing_disk_ros.field_checks import numbers
from bouncing_disk_ros.folders import user_path
from bouncing_disk_ros.parsing import number_of, read_table

if TYPE_CHECKING:
    from bouncing_disk_ros.measured.sound import ImpactSound

Array = NDArray[np.float64]
MOST_IMPACTS = 20_000
"""Impacts of one fit."""
LATEST = 1e7
"""s: 115 days. Rounding of later times, above 1 ns, ends searches on a vibrating platform early."""
MOST_BYTES = 64 << 20
"""Of a text file."""
_TEXTS = ("", ".csv", ".txt", ".tsv", ".dat")
"""Ends of names of texts: for them the library of sounds, 0.4 s, is not loaded."""
_SHEETS = (".xlsx", ".xls", ".ods", ".numbers")
_TIME_NAMES = ("time", "t", "times", "seconds", "s", "start", "onset")
_UNITS = {
    1.0: ("s", "sec", "second", "seconds"), 1e-3: ("ms", "msec", "milliseconds"),
    1e-6: ("us", "\u00b5s", "\u03bcs", "microseconds"), 1e-9: ("ns", "nanoseconds"),
    60.0: ("min", "minutes"), 3600.0: ("h", "hours"),
}  # fmt: skip
_WORDS = "|".join(word for words in _UNITS.values() for word in words)
_UNIT = re.compile(rf"(?:([^(\[/]*?)(\s+in\s+|[\s_]+|\s*[(\[/]\s*))?({_WORDS})\s*[)\]]?")
"""Of a column: time_ms, t (ms), t/ms, t in ms, ms."""
_OTHER_WORDS = ("min", "h")
"""Units that are a minimum or a height where no bracket, slash or `in` is before them."""
_OF_RATES = ("m", "mm", "cm", "km", "rad", "deg", "\u00b0", "u", "1")
"""Before a slash: a speed, such as m/s."""
_INCREASING = "increasing times in seconds"


@dataclass(frozen=True)
class Recording:
    """Times of impacts (s), their errors (s, or None), and half of the last digit of the times.

    `sound`: what they were heard in.
    """

    name: str
    times: Array
    errors: Array | None
    resolution: float
    sound: ImpactSound | None = None


def recording_of(
    source: str | Path | ArrayLike, column: str | int = "", namespace: str = ""
) -> Recording:
    """The impacts of an array, a text file, a sound file or a bag.

    `column`: of a text file, its name or its number from 1 on; default: a column called time or t,
    else the first with a unit of time, else the first that does not number the lines. Errors are
    taken from a column called error.
    """
    if not isinstance(source, (str, Path)):
        _refuse_idle("a file", column=column, namespace=namespace)
        return checked("times", _numbers(source), None, 0.0)
    path = user_path(source)
    suffix = path.suffix.lower()
    if path.is_dir() or suffix == ".mcap":
        _refuse_idle("a text", column=column)
        return _from_bag(path, namespace)
    _refuse_idle("a bag", namespace=namespace)
    if suffix not in _TEXTS and (sound := _sound(path)):
        _refuse_idle("a text", column=column)
        return replace(checked(path.name, sound.times, sound.errors, 0.0), sound=sound)
    return _from_text(path, str(column))


def _refuse_idle(wanted: str, **given: object) -> None:
    """InputError where one of these is given, which only `wanted` has."""
    for name, value in given.items():
        if value != "":
            raise InputError(name, value, f"none without {wanted}")


def _sound(path: Path) -> ImpactSound | None:
    """The hits of a sound file; None: it is no such file."""
    from bouncing_disk_ros.measured.sound import SUFFIXES, impact_times

    return impact_times(path) if path.suffix.lower() in SUFFIXES else None


def _numbers(source: ArrayLike, field: str = "times") -> Array:
    values = numbers(field, source, f"numbers, none masked: {field} in seconds")
    if values.ndim != 1:
        given = f"an array of {values.ndim} axes"
        raise InputError(field, given, f"one axis: {field} in seconds")
    return values


def checked(name: str, times: Array, errors: Array | None, resolution: float) -> Recording:
    """A recording whose times can be fitted, or InputError."""
    if len(times) > MOST_IMPACTS:
        hint = "Give a part of the recording."
        raise InputError("times", f"{len(times)} times", f"at most {MOST_IMPACTS}", hint)
    if len(times) < 3:
        what = ("no hits", "one hit", "two hits")[len(times)]
        raise InputError("times", what, "three or more", "A restitution takes two flights.")
    for wrong, what in (
        (~np.isfinite(times), "no finite number"),
        (abs(times) > LATEST, "too large: subtract the first one"),
    ):
        if wrong.any():
            at = int(np.flatnonzero(wrong)[0])
            raise InputError("times", f"{times[at]:g} at place {at + 1}", _INCREASING, what + ".")
    if (np.diff(times) <= 0.0).any():
        at = int(np.flatnonzero(np.diff(times) <= 0.0)[0]) + 1
        given = f"{times[at]:.9g} after {times[at - 1]:.9g} at place {at + 1}"
        hint = "Are these intervals? Add them up." if times[-1] < times[0] else ""
        raise InputError("times", given, _INCREASING, hint)
    if errors is not None:
        errors = checked_errors(errors, times, "error")
    least = max(resolution, 4.0 * float(np.spacing(np.abs(times).max())))
    return Recording(name, times, errors, least)


def checked_errors(given: ArrayLike, times: Array, field: str = "errors") -> Array:
    """The errors of times, s, one for each; InputError where one is below its rounding."""
    errors = _numbers(given, field)
    if len(errors) != len(times):
        raise InputError(field, f"{len(errors)}", f"{len(times)}, one for each time")
    least = 0.5 * float(np.spacing(np.abs(times).max()))
    wrong = ~(np.isfinite(errors) & (errors >= least))
    if wrong.any():
        at = int(np.flatnonzero(wrong)[0])
        allowed = f"seconds from {least:.2g} on: times are rounded to that"
        raise InputError(field, f"{errors[at]:g} at place {at + 1}", allowed)
    return errors


# --- text -----------------------------------------------------------------------------------------
def _from_text(path: Path, column: str) -> Recording:
    if path.suffix.lower() in _SHEETS:
        hint = "Save the sheet as a CSV file."
        raise InputError("recording", path.name, "a text, a sound or a bag", hint)
    named, table = _table(path, column)
    names, units = [_without_unit(name) for name in named], [_unit(name) for name in named]
    if column.isdecimal() and number_of("".join(named[int(column) - 1 : int(column)])) is not None:
        named, table = [], [named, *table]  # a line that begins with a text
    if len(table) == 1 and len(table[0]) > 2:
        raise InputError("recording", f"one line of {len(table[0])} numbers", "a time in each line")
    place = _place(column, named, names, table)
    times, decimals = _column(path, table, place)
    unit = units[place] if place < len(units) else 1.0
    errors = None
    if "error" in names:
        own = names.index("error")
        errors = units[own] * _column(path, table, own)[0]
    return checked(path.name, unit * times, errors, 0.5 * unit * 10.0**-decimals)


def _table(path: Path, column: str) -> tuple[list[str], list[list[str]]]:
    """Names of the columns with their units, and the cells of all lines."""
    known = {column.lower(), *_TIME_NAMES}
    named, table = read_table(
        "recording", path, MOST_BYTES, 2 * MOST_IMPACTS,
        lambda found: not known.isdisjoint([*found, *map(_without_unit, found)]),
    )  # fmt: skip
    if not (named or table):
        raise InputError("recording", str(path), "a column of times in seconds", "It is empty.")
    if len(named) < 2 and table and all(_is_one_number(cells) for cells in table):
        if not named:
            allowed = "a decimal point, or names of the columns in the first line"
            hint = "The comma may be a decimal sign, or may separate two columns."
            raise InputError("recording", f"{','.join(table[0])} in {path.name}", allowed, hint)
        table = [[".".join(cells)] for cells in table]
    if table and len(table[0]) == 1 < len(named):  # blanks in a name
        named = [" ".join(named)]
    if table and len(table[0]) == len(named) and all(number_of(x) is None for x in table[0]):
        units = [unit.strip(" ()[]").lower() for unit in table[0]]
        with_units = [f"{name} ({unit})" for name, unit in zip(named, units, strict=True)]
        if any(map(_name_and_unit, with_units)):  # a line of units below that of names
            named, table = with_units, table[1:]
    return named, table


def _is_one_number(cells: list[str]) -> bool:
    """Whether two cells may be one number with a decimal comma."""
    return len(cells) == 2 and cells[0].lstrip("+-").isdecimal() and cells[1].isdecimal()


def _without_unit(name: str) -> str:
    found = _name_and_unit(name)
    return (found[0] or "time") if found else name


def _unit(name: str) -> float:
    """Of a column, s."""
    found = _name_and_unit(name)
    return found[1] if found else 1.0


def _name_and_unit(name: str) -> tuple[str, float] | None:
    """The name before the unit, and the unit in s; None: there is no unit of time."""
    found = _UNIT.fullmatch(name)
    if not found:
        return None
    before, between, word = found[1] or "", (found[2] or "").strip(" _"), found[3]
    is_rate = between == "/" and not set(before.split()[-1:]).isdisjoint(_OF_RATES)
    if is_rate or (not between and word in _OTHER_WORDS):
        return None
    return before, next(unit for unit, words in _UNITS.items() if word in words)


def _place(column: str, named: list[str], names: list[str], table: list[list[str]]) -> int:
    """The place of the column that is asked for; `names`: without units."""
    count = len(table[0]) if table else len(names)
    if column.isdecimal():
        if 1 <= int(column) <= count:
            return int(column) - 1
        raise InputError("column", column, f"a number from 1 to {count}, or a name")
    if column:
        for each in (named, names):
            if column.lower() in each:
                return each.index(column.lower())
        allowed = ", ".join(named) if named else f"a number from 1 to {count}: no names here"
        raise InputError("column", column, allowed, closest(column.lower(), named))
    known = [names.index(name) for name in _TIME_NAMES if name in names]
    known += [i for i, name in enumerate(named) if _name_and_unit(name) and names[i] != "error"]
    return known[0] if known else int(count > 1 and _is_count([cells[0] for cells in table]))


def _is_count(cells: list[str]) -> bool:
    """Whether these are 0, 1, 2 ... or 1, 2, 3 ..., the numbers of lines."""
    return any(cells == [str(first + i) for i in range(len(cells))] for first in (0, 1))


def _column(path: Path, table: list[list[str]], place: int) -> tuple[Array, int]:
    """Numbers of one column, and the decimals that they are written with."""
    values, decimals = np.empty(len(table)), 0
    for i, cells in enumerate(table):
        value = number_of(cells[place]) if place < len(cells) else None
        if value is None:
            given = f"{' '.join(cells)[:40]!r} in line {i + 1} of the table"
            others = ", or the option column names another one" if len(cells) > 1 else ""
            hint = f"{path.name} is no such text{others}."
            raise InputError("recording", given, "a text with a column of seconds", hint)
        values[i] = value
        mantissa, _, power = cells[place].lower().partition("e")
        decimals = max(decimals, len(mantissa.partition(".")[2]) - int(power or 0))
    return values, decimals


# --- bags -----------------------------------------------------------------------------------------
def _from_bag(path: Path, namespace: str) -> Recording:
    """Times of the impacts of the last run since it changed last; nothing else of it.

    What changes is the motion of the platform, gravity, or the disk: a fit has one set of all.
    """
    from bouncing_disk_ros.bag import BagError
    from bouncing_disk_ros.core.model import ImpactKind
    from bouncing_disk_ros.report.read_run import read_run
    from bouncing_disk_ros.units import NS

    try:
        record = read_run(str(path), namespace=namespace or None)
    except (BagError, OSError) as error:
        raise InputError("recording", str(path), "a bag that can be read", str(error)) from None
    rows = record.rows
    # the time of a chatter's tail is that of its end, even if nothing else shares its row
    single = (rows["count"] == 1) & (rows["kind"] != ImpactKind.CHATTER_TAIL)
    times, name = np.unique(np.asarray(rows["time"], float)[single]), path.name
    changed = [motion.end_ns / NS for motion in record.motions] + [at for at, _ in record.disks[1:]]
    since = max(changed, default=0.0)
    later = times[times > since]
    if len(later) < len(times):
        name = f"{name} since {since:g} s"
        if len(later) < 3:
            given = f"{len(later)} impacts after the last change of the run, at {since:g} s"
            allowed = "three or more with one motion of the platform and one disk"
            raise InputError("recording", given, allowed)
    return checked(name, later, None, 0.5e-9)
