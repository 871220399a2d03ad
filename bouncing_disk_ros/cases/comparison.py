"""Comparison of another simulator's events, or samples, with a reference case."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bouncing_disk_ros.cases.files import QUANTITIES, ReferenceCase, reference_case
from bouncing_disk_ros.errors import InputError, closest, counted
from bouncing_disk_ros.field_checks import numbers
from bouncing_disk_ros.folders import user_path
from bouncing_disk_ros.parsing import number_of, read_table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LARGEST_FILE = 200_000_000
"""Bytes of a CSV file."""
TOLERANCE = 1e-9
"""s, m, m/s, rad and rad/s: the cases are of about one second and one metre."""
_COLUMNS = ("kind", "flight", *QUANTITIES)
_SYNONYMS = {"t": "time", "h": "position", "z": "position", "height": "position"}
Floats = NDArray[np.float64]
Columns = dict[str, Any]  # numbers as arrays of float64, kinds as a list of texts


class Match(NamedTuple):
    """One event of the case and what the other simulator says of it."""

    event: int  # number in the case; 0: an event that the law does not have
    kind: str
    time: float  # s, of the case (of theirs where event is 0)
    condition: float
    errors: Mapping[str, float]  # theirs less the nearest bound, by quantity; {} where missed

    @property
    def is_missed(self) -> bool:
        """Whether the other simulator has no such event."""
        return self.event > 0 and not self.errors

    @property
    def worst(self) -> tuple[str, float]:
        """The quantity with the largest error, and that error."""
        name = max(self.errors, key=lambda q: abs(self.errors[q]), default="")
        return name, self.errors.get(name, math.nan)


class Comparison:
    """Result of a comparison with a reference case.

    `matches` has the events of the case in order, then those that the law does not have.
    """

    def __init__(self, case: ReferenceCase, matches: list[Match], tolerance: float) -> None:
        """From the matched events."""
        self.case, self.matches, self.tolerance = case, matches, tolerance

    @property
    def is_within(self) -> bool:
        """Whether each event is there, within the tolerance, and no other."""
        return not any(self.is_off(match) for match in self.matches)

    def is_off(self, match: Match) -> bool:
        """Whether an event is missed, false, or beyond the tolerance."""
        if match.is_missed:
            return not self._is_too_short(match.event)
        return match.event == 0 or not abs(match.worst[1]) <= self.tolerance

    def _is_too_short(self, event: int) -> bool:
        """Whether an impact follows the event before it by less than the tolerance of time."""
        events, at = self.case.events, event - 1
        if events["kind"][at] != "impact" or at == 0:
            return False
        return bool(events["time_upper"][at] - events["time_lower"][at - 1] <= self.tolerance)

    @property
    def lines(self) -> list[str]:
        """A table of the events, what is wrong, and the verdict."""
        return [*_table(self), *_named(self), self.verdict]

    @property
    def verdict(self) -> str:
        """One sentence."""
        of_case = [match for match in self.matches if match.event > 0]
        good = sum(not self.is_off(match) for match in of_case)
        text = f"{good} of {counted(len(of_case), 'event')} within {self.tolerance:g}"
        missed = sum(m.is_missed for m in of_case)
        false = len(self.matches) - len(of_case)
        text += "".join(f", {n} {word}" for n, word in ((missed, "missed"), (false, "false")) if n)
        return f"{'agrees' if self.is_within else 'differs'}: {text}"

    def figure(self) -> Figure:
        """The errors of time over the number of the event."""
        from bouncing_disk_ros.cases.picture import error_picture

        rows = [
            (m.event, abs(m.errors["time"]), m.condition)
            for m in self.matches
            if m.errors and m.event
        ]
        missed = [m.event for m in self.matches if m.is_missed]
        title = f"case {self.case.number}, {self.case.name}: {self.verdict}"
        return error_picture(np.array(rows, float), missed, self.tolerance, title)


def compare_with_case(
    case: object,
    theirs: object,
    *,
    tolerance: float = TOLERANCE,
    samples: bool | None = None,
) -> Comparison:
    """Comparison of another simulator's run of a reference case with the case's proved bounds.

    `case` is a number, a name, or what `reference_case` returns. `theirs` is the path of a CSV
    file, or a mapping (or structured array) of columns: `time` (s) and any of `kind`, `position`,
    `velocity_before`, `velocity_after`, `angle`, `angular_velocity_before`,
    `angular_velocity_after` (SI units).
    Without `kind` each row is an impact. With `flight`, the number of the event from which a
    simulator was started again, each row is compared with the next impact alone. `time` and
    `position` alone are samples, in which impacts are found (`samples=False`: events all the same).
    `tolerance` holds for each column in its own unit. Raises InputError.

    >>> compare_with_case("drop", {"time": [0.4515, 1.1288]}, tolerance=1e-3).lines
    """
    wanted = case if isinstance(case, ReferenceCase) else reference_case(case)
    if not tolerance >= 0.0:
        raise InputError("tolerance", tolerance, "a number >= 0")
    columns = _columns(theirs)
    if samples is None:
        samples = sorted(columns) == ["position", "time"]
    if samples:
        columns = impacts_in(wanted, columns)
    matches = _restarted(wanted, columns) if "flight" in columns else _in_order(wanted, columns)
    return Comparison(wanted, matches, float(tolerance))


# ------------------------------------------------------------------------------------------------
# What they give.


def _columns(theirs: object) -> Columns:
    """The columns that are known, of one length, in the order of time."""
    if isinstance(theirs, (str, Path)):
        given: Mapping[str, Any] = _read(user_path(theirs))
    elif isinstance(theirs, Mapping):
        given = theirs
    elif isinstance(theirs, np.ndarray) and theirs.dtype.names:
        given = {name: theirs[name] for name in theirs.dtype.names}
    else:
        raise InputError("events", theirs, "a CSV file, or columns by name: time, position ...")
    names = [_SYNONYMS.get(name, name) for name in given]
    if len(set(names)) < len(names):
        raise InputError("columns", ", ".join(map(str, given)), "one column of each quantity")
    given = dict(zip(names, given.values(), strict=True))
    known = {name: given[name] for name in _COLUMNS if name in given}
    if "time" not in known:
        raise InputError("columns", ", ".join(map(str, given)), "time (s) among them")
    found: Columns = {
        name: [str(kind) for kind in values] if name == "kind" else _numbers(name, values)
        for name, values in known.items()
    }
    lengths = {name: len(values) for name, values in found.items()}
    if len(set(lengths.values())) > 1:
        raise InputError("columns", lengths, "columns of one length")
    if "flight" not in found and np.any(np.diff(found["time"]) < 0.0):
        raise InputError("time", "times that fall", "rows in the order of time")
    return found


def _numbers(name: str, values: ArrayLike) -> Floats:
    found = numbers(name, values)
    if found.ndim != 1 or not np.all(np.isfinite(found)):
        raise InputError(name, values, "finite numbers, one for each row")
    return found


def _read(path: Path) -> dict[str, list[Any]]:
    """The columns of a CSV file; without a header one column is times, two are samples."""
    header, rows = read_table("events", path, LARGEST_FILE)
    if not (header or rows):
        raise InputError("events", str(path), "a CSV file with rows")
    if not header:
        header = ["time", "position"][: len(rows[0])]
        if len(rows[0]) > 2:
            raise InputError("events", str(path), "a first row with the names of the columns")
    if len(set(header)) < len(header):
        raise InputError("columns", ", ".join(header), "one column of each name")
    if any(len(row) != len(header) for row in rows):
        allowed = f"{len(header)} values in each row, as in the first"
        raise InputError("events", str(path), allowed)
    found: dict[str, list[Any]] = {}
    for i, name in enumerate(header):
        cells = [row[i] for row in rows]
        found[name] = cells if name == "kind" else [_value_of(cell) for cell in cells]
    return found


def _value_of(cell: str) -> float | str:
    """The number in a cell, else its text."""
    value = number_of(cell)
    return cell if value is None else value


# ------------------------------------------------------------------------------------------------
# Impacts in samples: in a flight the second difference of the positions is −g.
# Two flights that follow each other meet at the impact.


_FITTED = 5
"""Samples near the end of a flight that its parabola is put through.

Not the last one, where there are others: an impact just before it bends the curve too little to be
seen in the second difference, and moves it all the same.
"""


def impacts_in(case: ReferenceCase, columns: Columns) -> Columns:
    """Times, positions and speeds of the impacts in samples of (time, position)."""
    if "position" not in columns:
        raise InputError("columns", ", ".join(columns), "time and position, for samples")
    first = np.diff(columns["time"], prepend=-math.inf) > 0.0  # an event may stand there twice
    t, x = columns["time"][first], columns["position"][first]
    if len(t) < 4:
        raise InputError("samples", counted(len(t), "row"), "at least 4 instants")
    values = case.case.parameters
    g = float(values["gravity"]) + float(values["preload"]) / float(values["mass"])
    slopes = np.diff(x) / np.diff(t)
    bends = 2.0 * np.diff(slopes) / (t[2:] - t[:-2])
    falls = np.abs(bends + g) < 0.5 * g  # nearer to a fall than to rest
    edges = np.flatnonzero(np.diff(np.concatenate(([0], falls.astype(np.int8), [0]))))
    flights = [(int(a), int(b) + 1) for a, b in edges.reshape(-1, 2)]  # first and last sample
    found = [_meeting(t, x, one, other) for one, other in itertools.pairwise(flights)]
    rows = np.array([row for row in found if row is not None]).reshape(-1, 4)
    names = ("time", "position", "velocity_before", "velocity_after")
    return {name: rows[:, i] for i, name in enumerate(names)}


def _meeting(
    t: Floats, x: Floats, one: tuple[int, int], other: tuple[int, int]
) -> tuple[float, float, float, float] | None:
    """Where two flights meet: time, position, speeds before and after; None: they do not."""
    middle = 0.5 * (t[one[1]] + t[other[0]])
    last = one[1] - (one[1] - one[0] > 2)
    first = other[0] + (other[1] - other[0] > 2)
    ends = slice(max(one[0], last - _FITTED + 1), last + 1)
    begins = slice(first, min(other[1], first + _FITTED - 1) + 1)
    before = np.polynomial.Polynomial.fit(t[ends] - middle, x[ends], 2).convert()
    after = np.polynomial.Polynomial.fit(t[begins] - middle, x[begins], 2).convert()
    c, b, a = (*(after - before).coef, 0.0, 0.0)[:3]
    square = b * b - 4.0 * a * c
    if b == 0.0 or square < 0.0:
        return None
    at = -2.0 * c / (b + math.copysign(math.sqrt(square), b))  # the root near 0: a is rounding
    speeds = float(before.deriv()(at)), float(after.deriv()(at))
    return middle + at, float(before(at)), *speeds


# ------------------------------------------------------------------------------------------------
# Which event is which.


def _errors(case: ReferenceCase, event: int, columns: Columns, row: int) -> dict[str, float]:
    """Theirs less the bounds of an event: 0 within them."""
    reference, found = case.events[event], {}
    for name in QUANTITIES:
        if name in columns:
            value = float(columns[name][row])
            low, high = float(reference[f"{name}_lower"]), float(reference[f"{name}_upper"])
            found[name] = value - min(max(value, low), high)
    return found


def _match(case: ReferenceCase, event: int, errors: Mapping[str, float]) -> Match:
    row = case.events[event]
    return Match(
        event + 1, str(row["kind"]), float(row["time_lower"]), float(row["condition"]), errors
    )


def _restarted(case: ReferenceCase, columns: Columns) -> list[Match]:
    """Each row against the first impact after the event from which it was started."""
    if len(columns["flight"]) == 0:
        raise InputError("flight", "no rows", "a row for each flight")
    found = []
    for row, start in enumerate(columns["flight"]):
        later = np.flatnonzero(case.events["kind"][int(start) :] == "impact")
        if not (0 <= start < len(case.events) and start == int(start)) or len(later) == 0:
            allowed = "0 (the start) or the number of an event with an impact after it"
            raise InputError("flight", start, allowed)
        event = int(start) + int(later[0])
        found.append(_match(case, event, _errors(case, event, columns, row)))
    return found


def _in_order(case: ReferenceCase, columns: Columns) -> list[Match]:
    """Each kind of event in order; impacts where no kind is given, be it for want of rows."""
    ended = columns["time"] > case.events["time_upper"][-1]
    kinds = columns.get("kind", ["impact"] * len(ended))
    there = [str(kind) for kind in case.events["kind"]]
    if unknown := sorted(set(kinds) - set(there)):
        allowed = ", ".join(dict.fromkeys(there))
        hint = closest(unknown[0], there) or f"Case {case.number} has no other events."
        raise InputError("kind", unknown[0], allowed, hint)
    compared = set(kinds) or {"impact"}
    if not compared & set(there):
        raise InputError("events", "no rows", f"{', '.join(dict.fromkeys(there))} of this case")
    pairs: dict[int, int] = {}
    for kind in dict.fromkeys(kinds):
        events = [i for i, name in enumerate(there) if name == kind]
        rows = [i for i, name in enumerate(kinds) if name == kind]
        times = case.events["time_lower"][events]
        for i, j in aligned(times, columns["time"][rows]):
            pairs[events[i]] = rows[j]
    found = [
        _match(case, i, _errors(case, i, columns, pairs[i]) if i in pairs else {})
        for i, kind in enumerate(there)
        if kind in compared
    ]
    used = set(pairs.values())
    for row, kind in enumerate(kinds):
        if (
            row not in used
            and not ended[row]
            and not (kind == "impact" and _is_in_tail(case, columns["time"][row]))
        ):
            found.append(Match(0, kind, float(columns["time"][row]), math.nan, {}))
    return found


def _is_in_tail(case: ReferenceCase, time: float) -> bool:
    """Whether a time is among the impacts of a chatter that are too slow to be listed."""
    events = case.events
    ends = np.flatnonzero((events["kind"][1:] == "contact") & (events["kind"][:-1] == "impact"))
    starts, stops = events["time_lower"][ends], events["time_upper"][ends + 1]
    return bool(np.any((starts < time) & (time <= stops)))


def aligned(reference: Floats, theirs: Floats) -> list[tuple[int, int]]:
    """Pairs (reference, theirs) in order, with the least sum of distances.

    An event without a partner costs half of the shorter interval beside it: two events are no pair
    where each is nearer to a neighbour.
    """
    skips = [_half_interval(reference), _half_interval(theirs)]
    n, m = len(reference), len(theirs)
    cost = np.zeros((n + 1, m + 1))
    cost[1:, 0], cost[0, 1:] = np.cumsum(skips[0]), np.cumsum(skips[1])
    for i in range(1, n + 1):
        paired = cost[i - 1, :-1] + np.abs(theirs - reference[i - 1])
        best = np.minimum(paired, cost[i - 1, 1:] + skips[0][i - 1])
        for j in range(1, m + 1):
            cost[i, j] = min(best[j - 1], cost[i, j - 1] + skips[1][j - 1])
    pairs, i, j = [], n, m
    while i > 0 and j > 0:
        if cost[i, j] == cost[i - 1, j - 1] + abs(theirs[j - 1] - reference[i - 1]):
            i, j = i - 1, j - 1
            pairs.append((i, j))
        elif cost[i, j] == cost[i - 1, j] + skips[0][i - 1]:
            i -= 1
        else:
            j -= 1
    return pairs[::-1]


def _half_interval(times: Floats) -> Floats:
    if len(times) < 2:
        return np.full(len(times), math.inf)
    gaps = np.diff(times)
    return np.asarray(0.5 * np.minimum(np.append(gaps, gaps[-1]), np.insert(gaps, 0, gaps[0])))


# ------------------------------------------------------------------------------------------------
# In words.


_SHOWN, _NAMED = 40, 5


def _table(found: Comparison) -> list[str]:
    head = f"{'event':>5}  {'kind':<10}  {'time (s)':>12}  {'time error':>11}  "
    lines = [head + f"{'largest error':<37}  {'condition':>9}"]
    for match in found.matches[:_SHOWN]:
        quantity, error = match.worst
        number = str(match.event) if match.event else "-"
        if match.errors:
            off = f"{match.errors['time']:>11.2e}  {f'{error:.2e} {quantity}':<37}"
        else:
            off = f"{'':>11}  {'missed' if match.event else 'not in the law':<37}"
        grows = "" if math.isnan(match.condition) else f"{match.condition:.3g}"
        mark = " *" if found.is_off(match) else ""
        lines.append(f"{number:>5}  {match.kind:<10}  {match.time:>12.9f}  {off}  {grows:>9}{mark}")
    if len(found.matches) > _SHOWN:
        lines.append(f"... {len(found.matches) - _SHOWN} more")
    return lines


def _named(found: Comparison) -> list[str]:
    """What is wrong, by name: events missed and false, the first late one, energy, spin."""
    lines = []
    off = [match for match in found.matches if found.is_off(match)]
    for word, some in (
        ("missed", [match for match in off if match.is_missed]),
        ("false", [match for match in off if match.event == 0]),
    ):
        lines += [f"{word}: {_name(match)} at {match.time:.9g} s" for match in some[:_NAMED]]
        lines += [f"{word}: {len(some) - _NAMED} more"] if len(some) > _NAMED else []
    groups = {
        "time": ("time",),
        "position or speed": ("position", "velocity_before", "velocity_after"),
        "spin": ("angle", "angular_velocity_before", "angular_velocity_after"),
    }
    for name, quantities in groups.items():
        for match in off:
            errors = {q: match.errors[q] for q in quantities if q in match.errors}
            worst = max(errors, key=lambda q: abs(errors[q]), default="")
            if worst and abs(errors[worst]) > found.tolerance:
                is_late = "late" if errors[worst] > 0 else "early"
                what = f"{abs(errors[worst]):.3g} s {is_late}" if name == "time" else (
                    f"{worst} {errors[worst]:+.3g} {QUANTITIES[worst]}"
                )  # fmt: skip
                lines.append(f"{name}: first at {match.kind} {match.event}: {what}")
                break
    lines += filter(None, [_restitution(found), _drift(found)])
    return lines


def _name(match: Match) -> str:
    return f"{match.kind} {match.event}" if match.event else match.kind


def _impacts(found: Comparison) -> list[tuple[Any, Mapping[str, float]]]:
    """Impacts with both speeds: the event of the case, and the errors."""
    needed = {"velocity_before", "velocity_after"}
    return [
        (found.case.events[m.event - 1], m.errors)
        for m in found.matches
        if m.kind == "impact" and m.event and needed <= m.errors.keys()
    ]


def _restitution(found: Comparison) -> str:
    """The restitution of the impacts, if it differs from the restitution of the case."""
    epsilon = float(found.case.case.parameters["restitution"])
    ratios = []
    for event, errors in _impacts(found):
        before, after = float(event["velocity_before_upper"]), float(event["velocity_after_upper"])
        platform = (after + epsilon * before) / (1.0 + epsilon)
        w = before + errors["velocity_before"] - platform
        if w != 0.0:
            ratios.append((-(after + errors["velocity_after"] - platform) / w, abs(w)))
    off = [r for r, w in ratios if abs(r - epsilon) * w > 2.0 * found.tolerance]
    if not off:
        return ""
    middle = float(np.median([r for r, _ in ratios]))
    return f"restitution: {middle:.9g} for {epsilon:g} (median of {counted(len(ratios), 'impact')})"


def _drift(found: Comparison) -> str:
    """Whether speeds are all too large, or all too small, ever more from impact to impact."""
    errors = [
        (2.0 * e["velocity_after"] / float(event["velocity_after_upper"]))
        for event, e in _impacts(found)
        if float(event["velocity_after_upper"]) != 0.0
    ]
    steps = np.diff(np.abs(errors))
    if len(steps) < 2 or not (np.all(np.sign(errors) == np.sign(errors[0])) and np.all(steps > 0)):
        return ""
    if not any(abs(e["velocity_after"]) > found.tolerance for _, e in _impacts(found)):
        return ""
    drift = math.copysign(float(np.median(steps)), errors[0])
    return f"energy: drifts by {drift:+.3g} of itself from impact to impact"
