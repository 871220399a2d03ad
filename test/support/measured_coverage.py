"""How often intervals of measured impacts hold the truth: cells of many simulated experiments."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros import InputError, fit_impacts
from bouncing_disk_ros.measured.kernels.likelihood import whitened_residuals
from bouncing_disk_ros.measured.profiles import Data, Model, Profiles
from bouncing_disk_ros.measured.result import ImpactFit
from bouncing_disk_ros.measured.starts import first_values
from support.measured_impacts import GRAVITY, at_rest, vibrating

OMEGA = math.tau * 20.0
SEED, SEED_ODD, SEED_MISSED = 20095, 8101, 20097
_TAIL = 0.025
_ODD, _APART = 0.05, 5.0
"""Parts of impacts that are missed, and of false ones; errors by which these are off true ones."""
_MOST_BEFORE = 0.1
"""Of a false first hit, s."""


@dataclass(frozen=True)
class Cell:
    """Experiments of one kind: impacts, error of times (s), scatter, and whether that is fitted.

    `forcing`: Γ at 20 Hz, 0: at rest; `skip`: impacts before the first one that is measured.
    """

    count: int
    error: float
    scatter: float
    is_fitted: bool
    restitution: float = 0.75
    forcing: float = 0.0
    skip: int = 0

    def __str__(self) -> str:
        platform = f"Γ = {self.forcing}" if self.forcing else "at rest"
        return (
            f"{platform}, ε = {self.restitution}, {self.count} impacts, {1e6 * self.error:g} µs, "
            f"scatter {100.0 * self.scatter:g} % {'fitted' if self.is_fitted else 'given'}"
        )

    @property
    def free(self) -> tuple[int, ...]:
        return (0, 1, 2) if self.forcing else (0,)


REST = [
    Cell(count, error, scatter, is_fitted, restitution)
    for count, restitution in ((6, 0.75), (12, 0.75), (40, 0.95))
    for error in (1e-5, 1e-4, 1e-3)
    for scatter, is_fitted in ((0.0, False), (0.003, True), (0.0, True))
]
VIBRATING = [
    Cell(count, error, scatter, scatter > 0.0, restitution, forcing, skip)
    for forcing, restitution, count, skip in ((0.45, 0.5, 12, 0), (0.55, 0.5, 118, 30),
                                              (0.8, 0.7, 118, 30))
    for error in (1e-5, 1e-4)
    for scatter in (0.0, 0.003)
]  # fmt: skip

ODD_HITS = [cell for cell in VIBRATING if not cell.scatter]
"""Cells of experiments with missed and false impacts."""


@dataclass(frozen=True)
class Found:
    """Of one experiment: confidence at the true parameters, and errors of the restitution.

    `away`: estimate minus truth; `deviation`: as the fit says; `bound`: of Cramér and Rao.
    """

    confidence: tuple[float, ...]
    away: float
    deviation: float
    bound: float


@dataclass(frozen=True)
class Summary:
    """Of all experiments of a cell.

    `held`: how often each parameter's interval holds the truth; `bias`: in lengths of the interval;
    `variance`: in bounds of Cramér and Rao.
    """

    count: int
    held: tuple[float, ...]
    bias: float
    variance: float


def experiments(cell: Cell, count: int) -> Iterator[Found]:
    """So many experiments of a cell, always the same ones."""
    rng, true = np.random.default_rng(SEED), np.zeros(6)
    true[0] = cell.restitution
    if not cell.forcing:
        for _ in range(count):
            exact = at_rest(rng, cell.count, 0.0, cell.scatter, cell.restitution)
            yield _experiment(cell, exact, exact + _noise(rng, cell), true)
        return
    true[1], true[3] = cell.forcing * math.pi * GRAVITY / OMEGA**2, OMEGA
    made = 0
    while made < count:
        runs, phases = vibrating(
            rng, 256, cell.count, cell.forcing, cell.restitution, cell.scatter, cell.skip
        )
        for exact, phase in zip(runs[: count - made], phases, strict=False):
            true[2] = phase
            made += 1
            yield _experiment(cell, exact, exact + _noise(rng, cell), true)


def odd_hits(cell: Cell, place: int) -> tuple[NDArray[np.float64], float]:
    """Hits of an experiment with missed and false impacts on a vibrating platform, and φ.

    Misses are independent, false hits a Poisson process.
    """
    rng = np.random.default_rng([SEED_ODD, ODD_HITS.index(cell), place])
    runs, phases = np.empty(0), np.empty(0)
    while not len(runs):
        runs, phases = vibrating(
            rng, 2, cell.count, cell.forcing, cell.restitution, cell.scatter, cell.skip
        )
    exact = runs[0]
    seen = exact + _noise(rng, cell)
    hits = [float(t) for t in seen[rng.random(cell.count) >= _ODD]]
    others, count = [*exact], len(hits) + rng.poisson(_ODD * cell.count)
    while len(hits) < count:
        at = rng.uniform(seen[0], seen[-1])
        if np.abs(np.array(others) - at).min() >= _APART * cell.error:
            hits.append(at)
            others.append(at)
    return np.sort(hits), float(phases[0])


def held_with_odd_hits(cell: Cell, place: int) -> tuple[bool, ...] | None:
    """Whether intervals hold ε, A and φ of such an experiment; None: the data do not tell them."""
    hits, phase = odd_hits(cell, place)
    fit = fit_impacts(hits, frequency=20.0, scatter=0.0)
    if fit.untold:
        return None
    found = [fit[name] for name in ("restitution", "axial_amplitude", "forcing_phase")]
    phase += math.tau * round((found[2].value - phase) / math.tau)
    true = (cell.restitution, cell.forcing * math.pi * GRAVITY / OMEGA**2, phase)
    return tuple(one.low < x < one.high for one, x in zip(found, true, strict=True))


def missed_impacts(
    cell: Cell, place: int, missed: Sequence[int]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Hits of an experiment on a vibrating platform in which these impacts are missed.

    Also the true times of the missed impacts.
    """
    parts = (int(100.0 * cell.forcing), cell.count, int(1e6 * cell.error), place)
    rng, runs = np.random.default_rng([SEED_MISSED, *parts]), np.empty(0)
    while not len(runs):
        runs, _ = vibrating(
            rng, 2, cell.count, cell.forcing, cell.restitution, cell.scatter, cell.skip
        )
    seen = runs[0] + _noise(rng, cell)
    return np.delete(seen, missed), runs[0][list(missed)]


def false_first_hit(cell: Cell, place: int) -> NDArray[np.float64]:
    """Hits of the same experiments with a false one up to 0.1 s before them."""
    hits, _ = missed_impacts(cell, place, ())
    before = np.random.default_rng([SEED_MISSED, place]).uniform(0.0, _MOST_BEFORE)
    return np.concatenate([[hits[0] - before], hits])


def is_wrong(fit: ImpactFit, restitution: float) -> bool:
    """Whether there is a preset whose interval is wrong by more than five of its half widths."""
    one = fit["restitution"]
    away = abs(restitution - 0.5 * (one.low + one.high))
    try:
        return bool(fit.preset) and away > 6.0 * 0.5 * (one.high - one.low)
    except InputError:
        return False


def summary(found: list[Found]) -> Summary:
    confidence = np.array([one.confidence for one in found])
    held = np.mean((confidence > _TAIL) & (confidence < 1.0 - _TAIL), axis=0)
    away = np.array([one.away for one in found])
    lengths = 2.0 * 1.96 * np.array([one.deviation for one in found])
    ratios = away / np.array([one.bound for one in found])
    return Summary(
        len(found), tuple(float(x) for x in held), float(away.mean() / lengths.mean()),
        float(np.mean(ratios**2)),
    )  # fmt: skip


def _noise(rng: np.random.Generator, cell: Cell) -> NDArray[np.float64]:
    return cell.error * rng.standard_normal(cell.count)


def _experiment(
    cell: Cell, exact: NDArray[np.float64], seen: NDArray[np.float64], true: NDArray[np.float64]
) -> Found:
    n, free = cell.count, cell.free
    data = Data(seen, np.full(n, 1e-6), np.zeros(n, bool), False, 1e-6)
    model = Model(free, GRAVITY, None if cell.is_fitted else cell.scatter / cell.error * 1e-6)
    if cell.forcing:
        tried = [Profiles(data, model, start) for start in first_values(seen, OMEGA, GRAVITY)]
        profiles = min(tried, key=lambda one: one.cost(one.best))
    else:
        flights = np.diff(seen)
        start = np.zeros(6)
        start[0] = float(np.median(flights[1:] / flights[:-1]))
        profiles = Profiles(data, model, start)
    at = true.copy()
    at[2] += math.tau * round((profiles.estimate[2] - at[2]) / math.tau)
    confidence = tuple(float(profiles.confidence(i)(at[i])) for i in free)
    away = float(profiles.estimate[0]) - cell.restitution
    return Found(confidence, away, profiles.deviation(0), _bound(cell, data, exact, true))


def _bound(cell: Cell, data: Data, exact: NDArray[np.float64], true: NDArray[np.float64]) -> float:
    """Least standard deviation of an estimate of ε, with errors and scatter known."""
    n, free = cell.count - 2, np.array(cell.free, np.int64)
    white, by = np.empty(n), np.empty((len(free), n))
    errors, rho = np.full(cell.count, cell.error), cell.scatter
    whitened_residuals(exact, errors, true, free, data.kinds, GRAVITY, rho, exact.copy(), white, by)
    return math.sqrt(float(np.linalg.inv(by @ by.T)[0, 0]))
