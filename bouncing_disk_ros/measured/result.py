"""`ImpactFit`: what a fit of measured impacts found."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import yaml
from numpy.typing import NDArray

from bouncing_disk_ros.distributions import normal, normal_quantile
from bouncing_disk_ros.errors import InputError, one_line
from bouncing_disk_ros.measured.bootstrap import bootstrapped
from bouncing_disk_ros.measured.goodness import FEWEST
from bouncing_disk_ros.measured.kernels.rest_laws import AMPLITUDE, FREQUENCY, PHASE, RESTITUTION
from bouncing_disk_ros.measured.laws import Law, other_law
from bouncing_disk_ros.measured.predict import Prediction
from bouncing_disk_ros.measured.profiles import LEVEL, Array, Interval, Profiles, interval_text
from bouncing_disk_ros.measured.settled_flights import told_by
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.regular_file import replaced
from bouncing_disk_ros.report.report_files import PRESET_MARK
from bouncing_disk_ros.run.presets import PRESET_KEY
from bouncing_disk_ros.scalar_search import halved

if TYPE_CHECKING:
    from bouncing_disk_ros.measured.sound import ImpactSound

REFUTED = 0.01
"""Probability of the residuals below which no preset is written, of true models one in a hundred.

Long recordings of real plates refute every model a little. So below 5 % this is said, no more.
"""
_NAMES = {RESTITUTION: "restitution", AMPLITUDE: "axial_amplitude", PHASE: "forcing_phase",
          FREQUENCY: "frequency"}  # fmt: skip


@dataclass(frozen=True)
class Alternative:
    """Other impacts that explain the hits: times of missed ones and of rejected hits, s.

    `odds`: of these impacts against the impacts of the fit. `parameters`: their restitution and
    platform.
    """

    missed: Array
    rejected: Array
    parameters: dict[str, Interval]
    odds: float

    @property
    def restitution(self) -> Interval:
        """The restitution with these impacts."""
        return self.parameters["restitution"]

    @property
    def text(self) -> str:
        """What it is, in words."""
        shown = ", ".join(f"{t:.6g} s" for t in self.missed[:5])
        missed = f"impacts missed near {shown}" if shown else "no impact missed"
        eps = interval_text(self.restitution)
        return f"{missed}, {len(self.rejected)} hits rejected, ε = {eps}, odds {self.odds:.2g}"


@dataclass(frozen=True)
class ImpactFit:
    """Result of `fit_impacts`. Times in s, lengths in m, angles in rad.

    `gravity`: given, or found from the `height` of the release (0: not given).
    `parameters`: name -> value with the ends of its 95 % interval: restitution, scatter and
    time_error; at rest also first_flight, end (of all bounces), first_height; on a vibrating
    platform axial_forcing, axial_amplitude, forcing_phase (at time 0), frequency if it was fitted.
    `times`: the true times as estimated, with those of missed impacts (`missed`: which).
    `residuals`: measured minus estimated times, nan where missed. `rejected`: times of hits that no
    flight reaches, or within the dead time. `flights`: columns take-off and landing velocity, m/s,
    height above the take-off, m. `restitutions`: coefficient of each inner impact, `speeds`: of
    these impacts relative to the platform, m/s. `contacts`: indices of times after which chatter
    ends in contact, or no flight leads to the next hit; flights and impacts there are nan.
    `probability`: of residuals as odd as these if the model is true; nan with too few
    impacts, or if the residuals are rounding of the times. `possible`: probability that no flight
    goes below the platform. `other_frequency`: a frequency that the times fit better than the
    one of the fit, Hz, or nan. `other_value`: the name of a given amplitude or phase and the value
    that they fit better, or None. `rival`: a multiple of the frequency that these data do not
    exclude, Hz, 0 for a platform at rest, or nan. `chance`: estimate of the probability that hits
    of no law have flights as likely as these; nan with too few impacts. `alternatives`: other
    impacts, with other parameters, that these hits do not exclude at a level of 1 %: the intervals
    of restitution and platform hold them by their odds. `second`: the fit of rejected hits, where
    they are flights of a second disk.
    `untold`: parameters that these data do not tell. `laws`: at rest, laws of the restitution with
    their evidence, the constant one first. `prediction`: impacts to come, with a constant one.
    `sound`: where the hits were heard, or None.
    """

    name: str
    frequency: float
    gravity: float
    height: float
    parameters: dict[str, Interval]
    times: Array
    residuals: Array
    missed: NDArray[np.bool_]
    rejected: Array
    flights: Array
    restitutions: Array
    speeds: Array
    contacts: NDArray[np.int64]
    probability: float
    possible: float
    other_frequency: float
    other_value: tuple[str, float] | None
    rival: float
    chance: float
    alternatives: tuple[Alternative, ...]
    second: ImpactFit | None
    untold: tuple[str, ...]
    laws: tuple[Law, ...]
    prediction: Prediction
    profiles: Profiles
    sound: ImpactSound | None

    def __getitem__(self, name: str) -> Interval:
        """A parameter by its name."""
        return self.parameters[name]

    def bootstrap(self, count: int = 200) -> dict[str, Interval]:
        """The intervals of the fitted parameters by a second method, a parametric bootstrap.

        `count` experiments with the fitted model are simulated and fitted again, each as long as
        the fit itself. Raises FailedError where most of them end in contact.
        """
        found = bootstrapped(self.profiles, count)
        if RESTITUTION in found:
            one = found[RESTITUTION]
            found[RESTITUTION] = Interval(one.value, max(one.low, 0.0), min(one.high, 1.0))
        if PHASE in found:
            found[PHASE] = turned(found[PHASE])
        if FREQUENCY in found:
            one = found[FREQUENCY]
            found[FREQUENCY] = Interval(*(x / math.tau for x in (one.value, one.low, one.high)))
        return {_NAMES[index]: one for index, one in found.items()}

    @property
    def told(self) -> str:
        """What steady flights tell where parameters are untold, on a vibrating platform; or ''."""
        if not self.untold or self.frequency == 0.0:
            return ""
        frequency = float(self.profiles.estimate[FREQUENCY]) / math.tau
        has_phase = self.profiles.model.phase is not None and "forcing_phase" not in self.untold
        return told_by(self.times, frequency, self["forcing_phase"] if has_phase else None)

    @property
    def doubt(self) -> str:
        """Why the model is rejected, doubtful or not tested, in words; '' if it is not refuted."""
        if self.second is not None:
            other = interval_text(self.second["restitution"])
            return f"two sequences: of {len(self.rejected)} rejected hits, some have ε = {other}"
        if self._better:
            return f"the model does not hold: the times fit {self._better} better"
        if self.alternatives:
            other = self.alternatives[0].text
            return f"these hits do not tell which impacts were missed or false: {other}"
        if self.rival >= 0.0:
            return f"the model cannot be tested by these impacts: {self._other} explains them"
        if self.possible < LEVEL:
            what = "the model does not hold" if self.possible < REFUTED else "the model is doubtful"
            return f"{what}: flights go below the platform"
        if self.chance > REFUTED:
            return "the model does not hold: hits of no law have such flights too"
        if self.probability < REFUTED:
            return "the model does not hold: of true ones, one in a hundred has such residuals"
        if self.probability < 1.0 - LEVEL:
            return "the model is doubtful: of true ones, one in twenty has such residuals"
        if self.profiles.data.count <= max(len(self.profiles.model.free), FEWEST - 1):
            return "the model cannot be tested by so few impacts"
        return ""

    @property
    def preset(self) -> dict[str, Value]:
        """Parameters of the simulator.

        InputError where the data do not tell them, or tell a law that it does not have or another
        frequency, or two sequences, or where `probability` is below 1 %, or `chance` above, or
        `possible` is below 95 %: no interval of 95 % can hold there.
        """
        if self.other_value:
            name, value = self.other_value
            allowed = f"{value:.4g}, which the times fit better"
            hint = "Are this value, gravity, and the delay right? If it is left out, it is fitted."
            raise InputError("preset", f"the given {name}", allowed, hint)
        if self.untold:
            given, hint = ", ".join(self.untold), "Record a transient, or more impacts"
            has_none = self.frequency > 0.0 and self.profiles.model.phase is None
            hint += ", or give forcing_phase_error." if has_none else "."
            raise InputError("preset", f"no {given}", "a fit whose data tell all parameters", hint)
        if law := other_law(self.laws):
            given = f"{law.text}, {law.evidence(self.laws[0])}"
            hint = "The simulator has no such law. `laws` has its parameters."
            raise InputError("preset", given, "a constant restitution", hint)
        if self.second is not None:
            hint = "Give the hits of one disk: `rejected` are those of the other."
            raise InputError("preset", "two sequences", "the hits of one disk", hint)
        if self.other_frequency > 0.0:
            allowed = f"{self.other_frequency:.5g} Hz, which the times fit better"
            hint = "Is the frequency right? Was the disk in contact? frequency_error fits it."
            raise InputError("preset", f"{self.frequency:g} Hz", allowed, hint)
        if self.alternatives:
            given = f"impacts that may be others: {self.alternatives[0].text}"
            allowed = "hits that tell which impacts were missed or false"
            raise InputError("preset", given, allowed, "Record more impacts, or another transient.")
        if self.rival >= 0.0:
            given = f"{self.frequency:g} Hz, while {self._other} explains these impacts too"
            allowed = "impacts that exclude multiples of the frequency, and a platform at rest"
            raise InputError("preset", given, allowed, "Record a transient, or more impacts.")
        self._check_goodness()
        values = {"restitution": min(max(self["restitution"].value, 0.0), 1.0),
                  "gravity": self.gravity, "preload": 0.0}  # fmt: skip
        if self.frequency > 0.0:
            values["frequency"] = float(self.profiles.estimate[FREQUENCY]) / math.tau
            values["axial_amplitude"] = float(self.profiles.estimate[AMPLITUDE])
            values["initial_forcing_phase"] = self["forcing_phase"].value
        else:
            height = self.height or self["first_height"].value
            values |= {"axial_amplitude": 0.0, "angular_amplitude": 0.0}
            values["initial_height"] = height
        return dict(values)

    def _check_goodness(self) -> None:
        """InputError where the model does not hold."""
        if self.possible < LEVEL:
            given = f"flights above the platform with the probability {self.possible:.2g}"
            hint = "The model does not hold: a contact was not found, or the frequency is wrong."
            raise InputError("preset", given, f"a probability of at least {LEVEL}", hint)
        if self.chance > REFUTED:
            given = f"flights that hits of no law have with a probability up to {self.chance:.2g}"
            hint = "The model does not hold: too many hits are left out, or the scatter is large."
            raise InputError("preset", given, f"a probability up to {REFUTED}", hint)
        if self.probability < REFUTED:
            given = f"residuals that have the probability {self.probability:.2g}"
            hint = "The model does not hold: no contact, spin or other motion is in it."
            raise InputError("preset", given, f"a probability of at least {REFUTED}", hint)

    @property
    def _better(self) -> str:
        """What the times fit better than what was given, in words; or ''."""
        if self.other_value:
            name, value = self.other_value
            return f"{name} {value:.4g}"
        return f"{self.other_frequency:.5g} Hz" if self.other_frequency > 0.0 else ""

    @property
    def _other(self) -> str:
        """The motion that these data do not exclude, in words."""
        return f"{self.rival:.5g} Hz" if self.rival else "a platform at rest"

    def write_preset(self, file: str | Path) -> None:
        """Write the preset as a YAML file, for `preset:=FILE`. Raises InputError as `preset`."""
        content = yaml.safe_dump({PRESET_KEY: {"ros__parameters": self.preset}}, sort_keys=False)
        doubt = f"\n# {self.doubt}" if self.doubt else ""
        text = f"{PRESET_MARK}{one_line(self.name)}{doubt}\n{content}"
        replaced(Path(file), lambda path: path.write_text(text, "utf-8"))


def mixed(own: Mapping[str, Interval], others: Sequence[Alternative]) -> dict[str, Interval]:
    """Intervals of a fit, widened for other impacts that its hits do not exclude, by their odds.

    2.5 % of the probability is beyond either end, but no interval becomes shorter. The probability
    is half of a normal distribution on each side of each value.
    """
    found = dict(own)
    for name in others[0].parameters if others else ():
        one, intervals = own[name], [own[name]]
        for other in others:
            given = other.parameters[name]
            turns = round((one.value - given.value) / math.tau) if name == "forcing_phase" else 0
            intervals.append(_moved(given, turns * math.tau, 1.0))
        odds = [1.0, *(other.odds for other in others)]
        low = _lower_end(intervals, odds)
        high = -_lower_end([_moved(each, 0.0, -1.0) for each in intervals], odds)
        found[name] = replace(one, low=low, high=high)
    return found


def _moved(given: Interval, by: float, sign: float) -> Interval:
    """An interval elsewhere; `sign` -1: of the opposite of the value."""
    ends = sorted((sign * given.low, sign * given.high))
    return Interval(sign * given.value + by, ends[0] + by, ends[1] + by)


def _lower_end(intervals: Sequence[Interval], odds: Sequence[float]) -> float:
    """Where 2.5 % of the probability are below, at most the end of the first interval."""
    shares, first = np.array(odds) / sum(odds), intervals[0].low
    least = min(one.low for one in intervals)

    def is_beyond(x: float) -> bool:
        return float(shares @ [_below(one, x) for one in intervals]) <= 0.5 * (1.0 - LEVEL)

    if is_beyond(first):
        return first
    return least if math.isinf(least) else halved(is_beyond, least, first)[0]


def _below(one: Interval, x: float) -> float:
    """Probability that a value with this interval is below x."""
    half = one.value - one.low if x < one.value else one.high - one.value
    if not half > 0.0:
        return float(x >= one.value)
    return normal(normal_quantile(0.5 * (1.0 + LEVEL)) * (x - one.value) / half)


def turned(phase: Interval) -> Interval:
    """With a value from 0 to 2π."""
    turns = math.floor(phase.value / math.tau) * math.tau
    return Interval(*(x - turns for x in (phase.value, phase.low, phase.high)))
