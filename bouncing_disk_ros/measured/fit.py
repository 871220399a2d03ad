"""`fit_impacts`: the model behind measured impacts, with intervals, and the impacts to come."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bouncing_disk_ros.errors import FailedError, InputError
from bouncing_disk_ros.measured.fit_options import checked_options
from bouncing_disk_ros.measured.goodness import evidence_of, probability_of
from bouncing_disk_ros.measured.kernels.chains import MOST_ODD
from bouncing_disk_ros.measured.kernels.rest_laws import (
    AMPLITUDE,
    FREQUENCY,
    PARAMETERS,
    PHASE,
    RESTITUTION,
    VOID,
)
from bouncing_disk_ros.measured.laws import laws_of
from bouncing_disk_ros.measured.predict import (
    LONG,
    MANY,
    NOTHING,
    Draws,
    draws_of,
    interval_of,
    is_reached,
    part_possible,
    predicted,
    rest_parameters,
)
from bouncing_disk_ros.measured.profiles import LEVEL, Array, Data, Interval, Model, Profiles
from bouncing_disk_ros.measured.reading import Recording, checked_errors, recording_of
from bouncing_disk_ros.measured.result import REFUTED, Alternative, ImpactFit, mixed, turned
from bouncing_disk_ros.measured.sequence import Chain, Change, at_rest, chain_of
from bouncing_disk_ros.measured.starts import first_values, other_frequency
from bouncing_disk_ros.parameters import DEFAULTS

NOMINAL = 1e-6
"""Errors that are not given are multiples of this, s."""
_VOID = 1e3
"""Error of a missed impact, in errors of a measured one: it pulls by a millionth."""
_FEWEST = 7
"""Times with more equations than ε, A, φ and ω: others have a frequency for which all is exact."""
_USUAL, _TRIED = 4, 12
"""First values that are fitted, and those that chains are looked for with.

Clean hits have one. False hits and contacts can make a wrong one the first.
"""
_PART, _PARTS = 5, 20
"""Neighbouring impacts that may be without a false or missed one, two more than parameters."""
_FEWEST_ALONE = 4
"""Hits that may be flights of a second disk: with three there is one equation for ε."""
_MOST_SCANNED = 120
"""Times in which another frequency is looked for: more frequencies are tried in longer ones."""
_MOST_FREQUENCIES = 1000
"""Of those on either side of the given one, with frequency_error: each takes some milliseconds."""
_MULTIPLES = (1 / 4, 1 / 3, 1 / 2, 2 / 3, 3 / 4, 4 / 3, 3 / 2, 2.0, 3.0, 4.0)
"""Of the frequency: the platform is at the same phase again after one to four periods."""
_HOPELESS = 20.0
"""Logarithm by which the chain of another frequency is less likely: that one is not fitted."""
_EXCLUDED = 200.0
"""Logarithm by which a change makes a fit so unlikely that it is not tried again after others.

Other changes near it raised the logarithm of one change by 39.
"""
_SURE = 500.0
"""Logarithm of odds: beyond it they are no finite number."""
_EQUAL = 2e-4
"""Part of a flight by which equal ones add up to other times: seven have 1 - ε below 5e-5."""
_EXACT = 1e-9
"""Part of a flight by which measured times differ more: only computed flights are so equal."""
_WHOLE = 0.05
"""Part of a period by which equal flights are off whole ones, beside the frequency's error."""
_HIGHEST = 1e3
"""Median height of flights, m: higher ones are taken for times in ms, where g is not fitted."""


def fit_impacts(
    source: str | Path | ArrayLike,
    *,
    frequency: float = 0.0,
    frequency_error: float = 0.0,
    axial_amplitude: float = 0.0,
    forcing_phase: float = 0.0,
    forcing_phase_error: float = 0.0,
    delay: float = 0.0,
    delay_error: float = 0.0,
    dead_time: float = 0.0,
    gravity: float = 0.0,
    height: float = 0.0,
    fall_time: float = 0.0,
    time_error: float = 0.0,
    scatter: float = -1.0,
    errors: ArrayLike | None = None,
    column: str | int = "",
    namespace: str = "",
) -> ImpactFit:
    """The model behind measured impacts: parameters with 95 % intervals, and what comes next.

    - `source`: times of impacts in s (an array), or a file of them: a text, a sound, or a bag.
    - `frequency`: of the platform, Hz; 0: it is at rest. `frequency_error`: how well that is
      known, Hz; above 0 it is fitted. `axial_amplitude`: of the platform, m; 0: fitted.
    - `forcing_phase`: of the platform at time 0, rad, by a reference, with its standard deviation
      `forcing_phase_error`; 0: there is no reference. `delay`: of the measured times behind the
      impacts, s, such as that of sound, with its own error. Both give the phase that times have.
    - `dead_time`: of the detector, s: after a hit it hears nothing for so long; 0: not known.
    - `gravity`: m/s²; 0: standard gravity. `height`: of the release at rest, m, if no impact
      is missed: then gravity is found. `fall_time`: of that drop, s, from the release to the first
      impact, as exact as the times; 0: not known.
    - `time_error`: standard deviation of the times, s; 0: fitted. `errors`: one for each time, s:
      only their ratios count, and time_error is the error of the median hit.
    - `scatter`: standard deviation of the restitution from impact to impact; below 0: fitted.
    - `column`, `namespace`: of a text and of a bag that have several.

    Raises InputError for data or values that cannot be used, FailedError where no model fits.

    >>> fit_impacts([0.3, 0.75, 1.0875, 1.340625, 1.5305], time_error=1e-4)["restitution"]
    """
    values = checked_options({
        "frequency": frequency, "frequency_error": frequency_error,
        "axial_amplitude": axial_amplitude, "forcing_phase": forcing_phase,
        "forcing_phase_error": forcing_phase_error, "delay": delay, "delay_error": delay_error,
        "dead_time": dead_time, "gravity": gravity, "height": height, "fall_time": fall_time,
        "time_error": time_error, "scatter": scatter,
    })  # fmt: skip
    recording = recording_of(source, column, namespace)
    own = recording.errors if errors is None else checked_errors(errors, recording.times)
    if own is not None and values["time_error"] > 0.0:
        own = own * (values["time_error"] / float(np.median(own)))
    return _Known.of(values).fit(recording, own)


@dataclass(frozen=True)
class _Sequence:
    """A chain of impacts, their fit, and draws of it.

    `others`: other chains with their parameters; `evidence` is the logarithm of their odds.
    """

    chain: Chain
    profiles: Profiles
    others: tuple[Chain, ...] = ()

    @cached_property
    def draws(self) -> Draws:
        """Which take as long as the fit: few chains need them."""
        return draws_of(self.profiles)

    @cached_property
    def many_draws(self) -> Draws:
        """Draws for the results: more than the others in a short recording."""
        is_long = len(self.profiles.data.times) >= LONG
        return self.draws if is_long else draws_of(self.profiles, MANY)


@dataclass(frozen=True)
class _Known:
    """What is known beside the times; 0: not known."""

    frequency: float  # rad/s; 0: at rest
    frequency_error: float
    amplitude: float
    gravity: float
    height: float
    fall_time: float
    time_error: float
    scatter: float | None
    phase: tuple[float, float] | None  # that times have, with its error
    dead_time: float

    @classmethod
    def of(cls, values: Mapping[str, float]) -> _Known:
        """What options tell."""
        w, w_error = (math.tau * values[name] for name in ("frequency", "frequency_error"))
        phase = values["forcing_phase"] - w * values["delay"]
        error = math.hypot(values["forcing_phase_error"], w * values["delay_error"])
        return cls(
            w, w_error, values["axial_amplitude"],
            values["gravity"] or float(DEFAULTS["gravity"]), values["height"],
            values["fall_time"], values["time_error"],
            None if values["scatter"] < 0.0 else values["scatter"],
            (phase, error) if error else None, values["dead_time"],
        )  # fmt: skip

    @property
    def free(self) -> tuple[int, ...]:
        """Indices of the parameters that are fitted."""
        if self.frequency == 0.0:
            return (RESTITUTION,)
        fitted = {RESTITUTION: True, AMPLITUDE: self.amplitude == 0.0, PHASE: True,
                  FREQUENCY: self.frequency_error > 0.0}  # fmt: skip
        return tuple(index for index, is_fitted in fitted.items() if is_fitted)

    def fit(self, recording: Recording, errors: Array | None) -> ImpactFit:
        """The fit of a recording; with a height that of the gravity which the first fit finds."""
        found = self._fitted(recording, errors)
        for name, value in (("height", self.height), ("fall_time", self.fall_time)):
            if value > 0.0 and (found.rejected < found.times[0]).any():
                at = f"{recording.times[0]:.6g} s"
                given = f"{value:g}, but no flight begins with the first hit, at {at}"
                hint = "Leave that hit out if it is false. Else leave out the option."
                raise InputError(name, given, "the drop to the first impact of a flight", hint)
        if self.height == 0.0:
            return found
        return replace(self, gravity=found["gravity"].value)._fitted(recording, errors)

    def _fitted(self, recording: Recording, errors: Array | None) -> ImpactFit:
        """The fit with this gravity."""
        return self._results(recording, errors, self._flights(recording, errors))

    def _check_times(self, recording: Recording) -> None:
        """InputError where these are no times of impacts in seconds."""
        typical = float(np.median(np.diff(recording.times)))
        if self.height == 0.0 and self.gravity * typical**2 / 8.0 > _HIGHEST:
            hint = "Milliseconds? Divide by 1000, or call the column of a text time_ms."
            raise InputError("times", f"flights of {typical:.4g} s", "times in seconds", hint)
        if len(recording.times) >= _FEWEST:
            self._check_equal(recording, typical)

    def _check_equal(self, recording: Recording, flight: float) -> None:
        """InputError where all flights are equal, up to the last digit of the times.

        On a vibrating platform they take whole periods: in others its velocities at the impacts
        cancel, as at rest, and only ε = 1 loses nothing. Without any errors these tell nothing.
        """
        times = recording.times
        away = float(np.abs(times - np.linspace(times[0], times[-1], len(times))).max())
        if away > max(2.0 * recording.resolution, _EQUAL * flight):
            return
        given = f"{len(times)} times, each {flight:.4g} s after the one before"
        hint = "Are these all frames of a video? Does the platform vibrate?"
        allowed = "times of impacts: on a platform at rest flights become shorter"
        if self.frequency > 0.0:
            turns, error = (flight * w / math.tau for w in (self.frequency, self.frequency_error))
            if abs(turns - max(round(turns), 1)) < _WHOLE + error and away > _EXACT * flight:
                return
            hint = "Are these all frames of a video? Is the frequency right?"
            allowed = "times of impacts with their errors: equal flights tell neither ε nor Γ"
        raise InputError("times", given, allowed, hint)

    def _flights(self, recording: Recording, errors: Array | None) -> _Sequence:
        """The flights of one disk among the hits, and their fit."""
        self._check_times(recording)
        found = self._in_sequence(recording, errors)
        if self.frequency > 0.0:
            found = self._corrected(found, recording, errors)
            begun = self._begun(found, recording, errors)
            if begun.chain is not found.chain:
                begun = self._corrected(begun, recording, errors)
            found = self._with_contacts(begun, recording, errors)
        return found

    def _results(self, recording: Recording, errors: Array | None, found: _Sequence) -> ImpactFit:
        """All results of a fit: intervals, other frequencies, a second disk, impacts to come."""
        chain, profiles = found.chain, found.profiles
        data = profiles.data
        rejected = np.delete(recording.times, chain.kept)
        with ThreadPoolExecutor() as beside:  # the kernels let go of the GIL
            told = beside.submit(self._told, found)
            second = beside.submit(self._second, recording, errors, found)
            value = self._other_value(recording, errors, found)
            rival, other = math.nan, math.nan
            if value is None:
                rival, other = self._others(recording, errors, found)
        parameters, possible = told.result()
        laws = laws_of(profiles) if self.frequency == 0.0 else ()
        better = f"the times fit {other:.5g} Hz better" if other > 0.0 else ""
        better = f"the times fit {value[0]} {value[1]:.4g} better" if value else better
        _check(recording.name, parameters["restitution"], better)
        is_told = profiles.degrees > 0 or profiles.data.is_absolute
        if is_told:
            _check_scatter(recording.name, profiles, parameters, better)
        else:
            parameters = {name: Interval(one.value, 0.0, 1.0 if name == "restitution" else math.inf)
                          for name, one in parameters.items()}  # fmt: skip
        alternatives = self._alternatives(recording, errors, found, parameters)
        parameters = mixed(parameters, alternatives)
        hits = slice(int(data.is_released), None)
        times, missed = profiles.best.times[hits], data.missed[hits]
        flights, speeds = flights_of(times, profiles.estimate, self.gravity)
        contacts = np.array(data.contacts, np.int64)
        flights[contacts] = np.nan
        speeds[data.kinds[hits] == VOID] = np.nan
        lead = len(profiles.best.times) - len(times)  # of the release: its impact is the first row
        probability = probability_of(profiles, np.r_[[-speeds[0, 0]] * lead, -speeds[:, 0]])
        return ImpactFit(
            recording.name, self.frequency / math.tau, self.gravity, self.height, parameters, times,
            np.where(missed, np.nan, data.times[hits] - times), missed, rejected,
            flights, -speeds[:, 1] / speeds[:, 0], -speeds[:, 0], contacts, probability,
            possible, other, value, rival,
            self._chance(found, recording),
            alternatives,
            second.result(),
            _untold(parameters) if is_told else tuple(parameters), laws,
            predicted(profiles, found.many_draws) if is_told else NOTHING,
            profiles, recording.sound,
        )  # fmt: skip

    def _in_sequence(self, recording: Recording, errors: Array | None) -> _Sequence:
        """Data without false hits and with missed impacts, and their fit.

        The search for chains knows the errors only roughly. So several likely chains are fitted,
        and the likeliest fit is taken. Where no chain of flights is likelier than hits of no law,
        all hits stay.
        """
        found, failure = list[_Sequence](), FailedError("")
        for chain in self._first_chains(recording, errors):
            if not any(chain.is_like(one.chain) for one in found):
                try:
                    found.append(self._refined(recording, errors, chain))
                except FailedError as error:
                    failure = error
        if not found:
            raise failure
        evidences = np.nan_to_num([self._evidence(one, recording) for one in found], nan=-math.inf)
        best = found[int(np.argmax(evidences))]
        if not evidences.max() > -math.inf:
            return best
        odds = evidences - evidences.max()
        return replace(best, others=tuple(
            replace(one.chain, parameters=one.profiles.estimate, evidence=float(log))
            for one, log in zip(found, odds, strict=True) if one is not best
        ))  # fmt: skip

    def _refined(self, recording: Recording, errors: Array | None, found: Chain) -> _Sequence:
        """The fit of a chain, whose false hits are looked for again on a vibrating platform.

        The fit says which hits are false, and these change the fit, until a chain comes again. Hits
        have finitely many chains, so the search ends.
        """
        times, seen = recording.times, list[Chain]()
        while not any(found.is_like(one) for one in seen):
            chain = found
            seen.append(chain)
            data = self._data(recording, errors, chain)
            profiles = self._profiles(recording.name, data)
            if self.frequency == 0.0 or chain.holds_all(len(times)):
                break
            found = self._chain(times, [profiles.estimate])
        return _Sequence(chain, profiles)

    def _corrected(self, found: _Sequence, recording: Recording, errors: Array | None) -> _Sequence:
        """The fit without those parts of the chain that make it unlikelier.

        Near a graze the search for chains takes a hit for a false one, or misses an impact. It
        takes a false hit for a missed impact nearby. Missed impacts, contacts, rejected hits and
        hits with large residuals are undone one after another, until none is left that makes the
        fit likelier.
        """
        times, tried = recording.times, _Tried(self, recording, errors, found)
        changes, last = found.chain.changes(self._heard(times)), None
        while tried.chain is not last:
            last, near = tried.chain, list[Change]()
            for change in changes:
                other = tried.chain.changed(change, times)
                if tried.add(other, is_near=True) and tried.chain is not other:
                    near.append(change)
            changes = near
            for other in [tried.chain.changed(change, times) for change in tried.suspected]:
                tried.add(other)
        return tried.likeliest()

    def _begun(self, found: _Sequence, recording: Recording, errors: Array | None) -> _Sequence:
        """The fit with missed impacts after the first hit, if that is likelier.

        The first flights of a transient depend most on the parameters. With one flight in place of
        two their fit has other parameters. So the times of missed impacts are computed with the
        parameters of the later flights. A chain with missed impacts is taken only if it is a
        hundred times as likely as a false first hit.
        """
        times, tried = recording.times, _Tried(self, recording, errors, found)
        heard, chain = self._heard(times), found.chain
        parameters = [found.profiles.estimate]
        later = chain.without_hit(int(chain.kept[0]), times)
        if len(later.kept) >= _FEWEST_ALONE:
            data = self._data(recording, errors, later)
            parameters += self._starts(data.times, data.kinds != VOID, _TRIED)
            for start in parameters:
                tried.add(later, start)
        least = tried.evidence_without(int(chain.kept[0])) - math.log(REFUTED)
        for begun in chain.begins(heard, times, parameters, self.gravity):
            tried.add(begun, begun.parameters, least=least)
        return tried.likeliest()

    def _with_contacts(
        self, found: _Sequence, recording: Recording, errors: Array | None
    ) -> _Sequence:
        """The fit with a contact wherever chatter may have ended unheard.

        Few impacts can fit a flight there as well: with other parameters, and too short intervals.
        So nothing is fitted across it, unless that fit itself refutes the contact: the flight after
        it does not reach the next hit. What hits of no law explain as well is refuted as it is.
        """
        if not self._chance(found, recording) <= REFUTED:
            return found
        hits, profiles = recording.times[found.chain.kept], found.profiles
        _, speeds = flights_of(profiles.best.times, profiles.estimate, self.gravity)
        after = -profiles.estimate[RESTITUTION] * speeds[~profiles.data.missed[1:-1], 0]
        places = found.chain.unheard_ends(hits, after, self.gravity)
        while len(places):
            chain = found.chain.with_contacts(places, hits)
            data = self._data(recording, errors, chain)
            profiles = self._profiles(recording.name, data)
            other = _Sequence(chain, profiles, found.others)
            is_likely = [is_reached(other.draws, self.gravity, *hits[k : k + 2]) for k in places]
            if all(is_likely):
                return other
            places = places[is_likely]
        return found

    def _chance(self, found: _Sequence, recording: Recording) -> float:
        """Probability, at most, of flights as likely as these if the hits follow no law."""
        return math.exp(-max(self._evidence(found, recording), 0.0))

    def _evidence(self, found: _Sequence, recording: Recording) -> float:
        """Logarithm of how much likelier these flights are than hits of no law; nan: not told."""
        chain, heard = found.chain, len(self._heard(recording.times))
        flights = np.searchsorted(recording.times[chain.kept], chain.missed)
        missed = int(np.minimum(np.bincount(flights), MOST_ODD).sum())
        return evidence_of(found.profiles, heard - len(chain.kept) + missed + len(chain.contacts))

    def _alternatives(
        self, recording: Recording, errors: Array | None, found: _Sequence,
        parameters: Mapping[str, Interval],
    ) -> tuple[Alternative, ...]:  # fmt: skip
        """Other chains with parameters out of the intervals, if their odds are above 1 %."""
        model, alternatives = found.profiles.model, list[Alternative]()
        own, chains = self._physical(found, recording), list[Chain]()
        if own == -math.inf:  # `possible` is 0
            return ()
        outside = [one for one in found.others if _is_outside(one.parameters, parameters)]
        for chain in sorted(outside, key=lambda one: -one.evidence):
            if len(chains) == _USUAL or any(chain.is_like(one) for one in chains):
                continue
            data = self._data(recording, errors, chain)
            with contextlib.suppress(np.linalg.LinAlgError, FailedError):
                fit = Profiles(data, model, chain.parameters)
                odds = _odds(self._physical(_Sequence(chain, fit), recording), own)
                if odds > 0.0 and _is_outside(fit.estimate, parameters):
                    chains.append(chain)
                    alternatives.append(Alternative(
                        data.times[data.missed], np.delete(recording.times, chain.kept),
                        self._intervals(fit), odds,
                    ))  # fmt: skip
        is_open = sum(one.odds for one in alternatives) > REFUTED
        return tuple(sorted(alternatives, key=lambda one: -one.odds)) if is_open else ()

    def _second(
        self, recording: Recording, errors: Array | None, found: _Sequence
    ) -> ImpactFit | None:
        """The fit of the hits that a chain leaves out; None where they are no flights.

        On a vibrating platform some of them are heard during the flights of the chain: one disk
        cannot have both. Other hits can be impacts of chatter, or impacts after a contact. Few
        false hits have chains too, but with flights below the platform, or on a platform that
        moves otherwise than the one below the first disk.
        """
        times, chain = recording.times, found.chain
        left = np.setdiff1d(self._heard(times), chain.kept)
        flight = np.searchsorted(chain.kept, left) - 1
        is_during = (flight >= 0) & (flight < len(chain.kept) - 1)
        is_during &= ~np.isin(flight, chain.contacts)
        is_during |= self.frequency == 0.0
        if len(left) < _FEWEST_ALONE or not is_during.any():
            return None
        part = replace(recording, times=times[left], sound=None)
        errors = None if errors is None else errors[left]
        models = [replace(self, height=0.0, fall_time=0.0)]
        if self.frequency > 0.0:
            _, amplitude, phase, frequency, *_ = found.profiles.estimate
            models.append(replace(
                models[0], amplitude=float(amplitude), frequency=float(frequency),
                frequency_error=0.0, phase=(float(phase), found.profiles.deviation(PHASE)),
            ))  # fmt: skip
        try:
            for model in models:
                other = model._flights(part, errors)
                if not is_during[other.chain.kept].any():
                    return None
                if not model._evidence(other, part) >= -math.log(REFUTED):
                    return None  # before its draws
                is_other = part_possible(other.profiles, other.draws) >= LEVEL
                if not (is_other and model._physical(other, part) >= -math.log(REFUTED)):
                    return None
            return model._results(part, errors, other)
        except (InputError, FailedError):
            return None

    def _first_chains(self, recording: Recording, errors: Array | None) -> list[Chain]:
        """Likely chains by first values from all hits and from parts, the likeliest first.

        All hits, where those from all hits lead to no chain.
        """
        times = recording.times
        if self.frequency == 0.0:
            return [self._chain(times, [])]
        found, least, parts = list[Chain](), 0.0, self._starts_of_parts(times)
        whole, from_all = self._starts(times, most=_TRIED), False
        for place, start in enumerate([*whole, *parts]):
            one = self._chain(times, [start], least)
            if one.evidence > least and not any(one.is_like(other) for other in found):
                found.append(one)
                least = max(least, one.evidence - _HOPELESS)
                from_all |= place < len(whole)
        found = [self._likelier(recording, errors, one) for one in found if one.evidence > least]
        found.sort(key=lambda one: -one.evidence)
        return found[:_USUAL] + [self._chain(times, whole, math.inf)] * (not from_all)

    def _likelier(self, recording: Recording, errors: Array | None, found: Chain) -> Chain:
        """The chain by first values from the hits of a chain, and so on: without contacts."""
        times, seen = recording.times, list[Chain]()
        while not any(found.is_like(one) for one in seen):
            if found.holds_all(len(times)) and not len(found.contacts):
                break
            seen.append(found)
            data = self._data(recording, errors, found)
            starts = self._starts(data.times, data.kinds != VOID, _TRIED)
            found = self._chain(times, [found.parameters, *starts])
        return found

    def _starts_of_parts(self, times: Array) -> list[Array]:
        """First values from few neighbouring hits: one false or missed one spoils all equations.

        Also from shorter parts, if there are few: these may have none without such a hit.
        """
        places, parts = np.arange(len(times) - 2), list[NDArray[np.bool_]]()
        for size in (_PART, _PART - 1):
            last = len(places) - size
            if last >= 0 and len(parts) < _PARTS:
                firsts = np.linspace(0, last, min(last + 1, _PARTS)).astype(int)[:, None]
                parts += list((firsts <= places) & (places < firsts + size))
        given = replace(self, frequency_error=0.0)
        return [start for part in parts for start in given._starts(times, part)]

    def _chain(self, times: Array, tried: list[Array], least: float = -math.inf) -> Chain:
        heard = self._heard(times)
        if self.frequency == 0.0:
            found = at_rest(times[heard], self.gravity, self.dead_time, least)
        else:
            found = chain_of(times[heard], np.array(tried), self.gravity, self.dead_time, least)
        if len(found.kept) < 3 or not found.evidence > 0.0:
            nothing = np.empty(0)
            return Chain(heard, nothing, nothing.astype(np.int64), found.parameters)
        return replace(found, kept=heard[found.kept])

    def _heard(self, times: Array) -> NDArray[np.int64]:
        """Indices of hits that a detector can hear after the one before."""
        found = [0]
        for i in range(1, len(times)):
            if times[i] - times[found[-1]] > self.dead_time:
                found.append(i)
        if len(found) < 3:
            allowed = "a time after which three hits or more are heard"
            raise InputError("dead_time", self.dead_time, allowed)
        return np.array(found)

    def _other_frequency(
        self, recording: Recording, errors: Array | None, profiles: Profiles
    ) -> float:
        """What the times fit better than the given or fitted frequency, Hz, or nan.

        Up to 2 % off, found by the equations, and confirmed by the likelihood of the same times.
        Else nearby, where the given one is refuted at the level of a preset.
        """
        times = recording.times[:_MOST_SCANNED]
        if self.frequency == 0.0 or len(times) < _FEWEST:
            return math.nan
        if FREQUENCY not in self.free:
            model = replace(profiles.model, free=(*self.free, FREQUENCY))
            with contextlib.suppress(np.linalg.LinAlgError):
                freed = Profiles(profiles.data, model, profiles.estimate)
                if profiles.refuted(freed, REFUTED):
                    return float(freed.best.p[FREQUENCY]) / math.tau
        phase, used = self.phase and self.phase[0], float(profiles.estimate[FREQUENCY])
        found = other_frequency(times, used, self.gravity, phase)
        if found is None:
            return math.nan
        none = np.empty(0)
        every = Chain(np.arange(len(times)), none, none.astype(np.int64), none)
        data, costs = self._data(recording, errors, every), []
        for frequency in (used, found):
            start = first_values(times, frequency, self.gravity, phase)[0]
            start[AMPLITUDE] = self.amplitude or start[AMPLITUDE]
            fitted = Profiles(data, profiles.model, start)
            costs.append(fitted.cost(fitted.best))
        is_better = costs[0] - costs[1] > -2.0 * math.log(REFUTED)
        return found / math.tau if is_better else math.nan

    def _other_value(
        self, recording: Recording, errors: Array | None, found: _Sequence
    ) -> tuple[str, float] | None:
        """The name of a given value that the times refute, and the value that they fit better.

        That is the amplitude, or the phase of a reference: at the level of a preset, or where the
        platform moves the other way. None, if even without it another frequency fits better.
        """
        profiles, tried = found.profiles, []
        is_turned = profiles.estimate[AMPLITUDE] < 0.0
        is_turned = is_turned and profiles.interval(AMPLITUDE, -math.inf, 0.0).high < 0.0
        for name, index, free in (
            ("forcing_phase", PHASE, replace(self, phase=None)),
            ("axial_amplitude", AMPLITUDE, replace(self, amplitude=0.0)),
        ):
            if free == self:
                continue
            with contextlib.suppress(FailedError):
                freed = free._profiles(recording.name, profiles.data, profiles.estimate)
                if is_turned or profiles.refuted(freed, REFUTED):
                    other, value = replace(found, profiles=freed), float(freed.estimate[index])
                    tried.append((free._physical(other, recording), name, value, free, other))
        evidence, name, value, free, other = max(
            tried, key=lambda one: one[0], default=(-math.inf, "", 0.0, self, found)
        )
        if evidence == -math.inf or free._others(recording, errors, other)[1] > 0.0:
            return None
        return name, value % math.tau if name == "forcing_phase" else value

    def _others(
        self, recording: Recording, errors: Array | None, found: _Sequence
    ) -> tuple[float, float]:
        """What these data do not exclude (`rival`), what they fit better (`other_frequency`)."""
        rival, odds, at_rest = self._rivals(recording, errors, found)
        is_worse = odds >= 1.0 / REFUTED
        other = rival
        if not is_worse:
            other = self._other_frequency(recording, errors, found.profiles)
        if at_rest > REFUTED:
            return 0.0, other
        is_open = not is_worse and odds > REFUTED and self.phase is None  # a reference tells it
        return rival if is_open else math.nan, other

    def _rivals(
        self, recording: Recording, errors: Array | None, found: _Sequence
    ) -> tuple[float, float, float]:
        """The multiple of the frequency that explains the hits best, Hz, and the odds for others.

        They are those of all multiples together, and of a platform at rest: each one before the
        hits are heard. Each model has its own chain and fit. nan where there is nothing to compare.
        """
        if self.frequency == 0.0 or found.profiles.degrees < 1:
            return math.nan, math.nan, math.nan
        part = replace(recording, times=recording.times[:_MOST_SCANNED])
        errors = None if errors is None else errors[:_MOST_SCANNED]
        least = self._chain(part.times, [found.profiles.estimate]).evidence - _HOPELESS
        multiples = [replace(self, frequency=multiple * self.frequency, frequency_error=0.0)
                     for multiple in _MULTIPLES]  # fmt: skip
        still = replace(self, frequency=0.0, frequency_error=0.0, phase=None)
        with ThreadPoolExecutor() as beside:  # `still` takes as long as all multiples
            moves = self.amplitude > 0.0  # a platform with a known amplitude
            alone = None if moves else beside.submit(still._explained, part, errors, least)
            logs = np.array([one._explained(part, errors, least) for one in multiples])
        at_rest = alone.result() if alone else -math.inf
        if max(at_rest, logs.max()) == -math.inf:
            return math.nan, 0.0, 0.0
        is_whole = len(recording.times) == len(part.times)
        own = self._physical(found if is_whole else self._in_sequence(part, errors), part)
        odds = np.array([_odds(log, own) for log in logs]) / len(_MULTIPLES)
        if self.phase is not None and at_rest > -math.inf:  # it does not tell whether it moves
            free = replace(self, phase=None)
            own = free._physical(free._in_sequence(part, errors), part)
        best = multiples[int(np.argmax(odds))].frequency / math.tau
        return best, float(odds.sum()), _odds(at_rest, own)

    def _explained(self, recording: Recording, errors: Array | None, least: float) -> float:
        """The evidence of this model's flights, -inf where that of their chain is below least."""
        times = recording.times
        if self._chain(times, self._starts(times), least).evidence > least:
            with contextlib.suppress(FailedError):
                return self._physical(self._in_sequence(recording, errors), recording)
        return -math.inf

    def _physical(self, found: _Sequence, recording: Recording) -> float:
        """The evidence of flights above the platform with a restitution from 0 to 1."""
        restitutions = found.draws.parameters[:, RESTITUTION]
        part = part_possible(found.profiles, found.draws)
        part *= float(np.mean((restitutions >= 0.0) & (restitutions <= 1.0)))
        evidence = self._evidence(found, recording)
        return evidence + math.log(part) if part > 0.0 and evidence == evidence else -math.inf

    def _profiles(self, name: str, data: Data, *starts: Array) -> Profiles:
        """The likeliest fit from first values, and from these."""
        model = Model(self.free, self.gravity, self.scatter, self.phase)
        tried = []
        for start in [*self._starts(data.times, data.kinds != VOID), *starts]:
            with contextlib.suppress(np.linalg.LinAlgError):  # its end tells nothing
                tried.append(Profiles(data, model, start))
        profiles = min(tried, key=lambda one: one.cost(one.best), default=None)
        if profiles is None or not profiles.cost(profiles.best) < math.inf:
            raise FailedError(f"{name}: no model fits; is the frequency right? was it in contact?")
        return profiles

    def _data(self, recording: Recording, errors: Array | None, chain: Chain) -> Data:
        count, least = len(recording.times), recording.resolution
        if errors is None:
            errors = np.full(count, self.time_error or NOMINAL)
        if self.time_error > 0.0:
            errors = np.maximum(errors, least)
        nominal = float(np.median(errors))
        hits, first = recording.times[chain.kept], recording.times[0]
        released = np.full(int(self.fall_time > 0.0), first - self.fall_time)
        times = np.concatenate([hits, released, chain.missed])
        sizes = np.concatenate([
            errors[chain.kept], np.full(len(released), errors[0]),
            np.full(len(chain.missed), _VOID * nominal),
        ])  # fmt: skip
        order = np.argsort(times)
        missed = order >= len(hits) + len(released)
        contacts = np.searchsorted(times[order], hits[chain.contacts])
        return Data(times[order], sizes[order], missed, self.time_error > 0.0, least / nominal,
                    self.fall_time > 0.0, tuple(int(place) for place in contacts))  # fmt: skip

    def _starts(
        self, times: Array, told: NDArray[np.bool_] | None = None, most: int = _USUAL
    ) -> list[Array]:
        if self.frequency == 0.0:
            flights = np.diff(times)
            start = np.zeros(PARAMETERS)
            start[RESTITUTION] = float(np.median(flights[1:] / flights[:-1]))
            return [start]
        step = 1.0 / (times[-1] - times[0])
        width = math.ceil(2.0 * self.frequency_error / step)
        if width > _MOST_FREQUENCIES:
            allowed = f"up to {0.5 * step * _MOST_FREQUENCIES / math.tau:.3g} Hz for times so long"
            given = self.frequency_error / math.tau
            raise InputError("frequency_error", given, allowed, "Give a part of the recording.")
        tried = self.frequency + step * np.arange(-width, width + 1)
        phase = self.phase and self.phase[0]
        found: list[Array] = []
        for w in tried:
            found += first_values(times, float(w), self.gravity, phase, most, told)
        for p in found:
            p[AMPLITUDE] = self.amplitude or p[AMPLITUDE]
        return found

    def _told(self, found: _Sequence) -> tuple[dict[str, Interval], float]:
        """Parameters, and the part of the draws that is possible: one thread makes the draws."""
        draws = found.many_draws
        return self._parameters(found.profiles, draws), part_possible(found.profiles, draws)

    def _intervals(self, profiles: Profiles) -> dict[str, Interval]:
        """The restitution, and the platform's motion."""
        phase = float(profiles.estimate[PHASE])
        ranges = {RESTITUTION: (0.0, 1.0), AMPLITUDE: (0.0, math.inf), FREQUENCY: (0.0, math.inf),
                  PHASE: (phase - math.pi, phase + math.pi)}  # fmt: skip
        told = profiles.intervals({index: ranges[index] for index in self.free})
        fitted = dict(zip(self.free, told, strict=True))
        found = {"restitution": fitted[RESTITUTION]}
        if self.frequency > 0.0:
            found |= self._platform(fitted, float(profiles.estimate[FREQUENCY]))
        return found

    def _parameters(self, profiles: Profiles, draws: Draws) -> dict[str, Interval]:
        found = self._intervals(profiles)
        if self.frequency == 0.0:
            found |= rest_parameters(draws, self.gravity, self.height, profiles.data.is_released)
        if not profiles.data.is_absolute:
            nominal = float(np.median(profiles.data.errors[~profiles.data.missed]))
            found["time_error"] = interval_of(nominal * draws.scale)
        if self.scatter is None:
            found["scatter"] = interval_of(draws.scatter)
        return found

    def _platform(self, fitted: dict[int, Interval], frequency: float) -> dict[str, Interval]:
        """Forcing, amplitude, phase, frequency: of a platform with A > 0."""
        found = {}
        if AMPLITUDE in fitted:
            a = fitted[AMPLITUDE]
            part = frequency**2 / (math.pi * self.gravity)
            found["axial_forcing"] = Interval(part * a.value, part * a.low, part * a.high)
            found["axial_amplitude"] = a
        found["forcing_phase"] = turned(fitted[PHASE])
        if FREQUENCY in fitted:
            w = fitted[FREQUENCY]
            found["frequency"] = Interval(*(x / math.tau for x in (w.value, w.low, w.high)))
        return found


class _Tried:
    """Chains that are fitted with the scatter of one fit: the likeliest, and the others."""

    def __init__(
        self, known: _Known, recording: Recording, errors: Array | None, found: _Sequence
    ) -> None:
        self._known, self._recording, self._errors, self._found = known, recording, errors, found
        self._model = replace(found.profiles.model, scatter=found.profiles.best.rho)
        self.chain, self.suspected = found.chain, list[Change]()
        self._evidence, self._others = -math.inf, list[Chain]()
        self.add(found.chain)
        self._first = self._evidence

    def add(
        self, chain: Chain, start: Array | None = None, is_near: bool = False,
        least: float = -math.inf,
    ) -> bool:  # fmt: skip
        """Fit one more chain; return whether to try its change again after other changes.

        `start`: parameters from which its fit begins. `is_near`: its true times are near the true
        times of the first fit. `least`: evidence that it must exceed to become the likeliest chain.
        """
        profiles = self._found.profiles
        data = self._known._data(self._recording, self._errors, chain)
        near = profiles.true_times(data.times) if is_near else None
        start = profiles.estimate if start is None else start
        try:
            own = Profiles(data, self._model, start, near)
        except np.linalg.LinAlgError:
            return False
        evidence = self._known._evidence(_Sequence(chain, own), self._recording)
        self._others.append(replace(chain, parameters=own.estimate, evidence=evidence))
        if evidence > max(self._evidence, least):
            self.chain, self._evidence, self.suspected = chain, evidence, chain.suspected(own)
            self._chosen = self._others[-1]
        return evidence > self._evidence - _EXCLUDED

    def evidence_without(self, hit: int) -> float:
        """The evidence of the likeliest chain that begins after this hit."""
        later = [one.evidence for one in self._others if one.kept[0] > hit]
        return float(np.nanmax([-math.inf, *later]))

    def likeliest(self) -> _Sequence:
        """The fit of the likeliest chain."""
        found, gain = self._found, self._evidence - self._first
        if not gain < math.inf:
            return found
        others = [replace(one, evidence=one.evidence - gain) for one in found.others]
        others += [replace(one, evidence=one.evidence - self._evidence)
                   for one in self._others if one is not self._chosen]  # fmt: skip
        likely = tuple(one for one in others if one.evidence > math.log(REFUTED))
        if self.chain is not found.chain:
            known, errors = self._known, self._errors
            data = known._data(self._recording, errors, self.chain)
            fit = known._profiles(self._recording.name, data, self._chosen.parameters)
            found = _Sequence(self.chain, fit)
        return replace(found, others=likely)


def _odds(evidence: float, other: float) -> float:
    """Of a model for another one."""
    return math.exp(min(evidence - other, _SURE)) if evidence > -math.inf else 0.0


def _check(name: str, restitution: Interval, better: str) -> None:
    """FailedError where no restitution from 0 to 1 explains the times; `better`: what does."""
    for beyond, why in (
        (restitution.low >= 1.0, "above 1: does the platform vibrate? then give its frequency"),
        (restitution.high <= 0.0, "below 0: are frequency and phase reference right?"),
    ):
        if beyond:
            text = f"{why.partition(':')[0]}: {better}" if better else why
            raise FailedError(f"{name}: no model fits, the restitution would be {text}")


def _check_scatter(
    name: str, profiles: Profiles, parameters: dict[str, Interval], better: str
) -> None:
    """FailedError where the scatter is larger than that of any restitutions from 0 to 1.

    With the mean ε their variance is at most ε(1 - ε) (Bhatia and Davis, "A better bound on the
    variance", 2000).
    """
    if "scatter" not in parameters:
        return
    least, found = parameters["scatter"].low, profiles.interval(RESTITUTION, -math.inf, math.inf)
    nearest = min(max(0.5, found.low), found.high)
    if least**2 > max(nearest * (1.0 - nearest), 0.0):
        why = "two drops, or other sounds, in one file? does the platform vibrate?"
        if FREQUENCY in profiles.model.free or profiles.estimate[FREQUENCY] > 0.0:
            why = better or "are frequency and phase reference right?"
        text = f"{name}: no model fits: restitutions from 0 to 1 cannot scatter by {least:.2g}"
        raise FailedError(f"{text}; {why}")


def _is_outside(values: Array, intervals: Mapping[str, Interval]) -> bool:
    """Whether one of a model's parameters is not in its interval."""
    for name, index in (("restitution", RESTITUTION), ("axial_amplitude", AMPLITUDE)):
        if name in intervals and not intervals[name].low <= values[index] <= intervals[name].high:
            return True
    if "forcing_phase" not in intervals:
        return False
    low, high = intervals["forcing_phase"].low, intervals["forcing_phase"].high
    return float(values[PHASE] - low) % math.tau > high - low


def _untold(parameters: dict[str, Interval]) -> tuple[str, ...]:
    """The parameters whose interval leaves them as open as they were without data.

    That is an end of the range in the interval, or more than half of a bounded range. Such data do
    not even tell in which half it is, one bit: a settled orbit of period 2 can bound ε by where it
    exists at all, 0.02 to 0.94.
    """
    ranges = {
        "restitution": (0.0, 1.0, 0.5),
        "axial_forcing": (0.0, math.inf, math.inf),
        "forcing_phase": (-math.inf, math.inf, math.pi),
    }
    found = []
    for name, (low, high, width) in ranges.items():
        if name in parameters:
            one = parameters[name]
            if one.low <= low or one.high >= high or one.high - one.low > width:
                found.append(name)
    return tuple(found)


def flights_of(th: Array, p: Array, g: float) -> tuple[Array, Array]:
    """Flights (N - 1, 3): take-off and landing velocity, height; and (N - 2, 2) inner impacts.

    The impacts' columns: velocity relative to the platform before and after.
    """
    angle = p[FREQUENCY] * th + p[PHASE]
    s, d = p[AMPLITUDE] * np.sin(angle), p[AMPLITUDE] * p[FREQUENCY] * np.cos(angle)
    duration = np.diff(th)
    up = np.diff(s) / duration + 0.5 * g * duration
    down = up - g * duration
    height = np.where(up > 0.0, up**2 / (2.0 * g), 0.0)
    flights = np.column_stack([up, down, height])
    return flights, np.column_stack([down[:-1] - d[1:-1], up[1:] - d[1:-1]])
