"""Whether the residuals are those of the model: their probability if it is true.

Whitened residuals are independent normal numbers there, less what the free parameters take. So
draws of such numbers have the distribution of each statistic (the parametric bootstrap of the
linearised model): von Neumann's ratio of neighbours in time, in speed and in phase ("Distribution
of the ratio of the mean square successive difference to the variance", 1941), the largest one, and
where errors are given the sum of squares. The least probability of these is compared with that of
the draws.

Chance: hits that follow no law have chains of flights too, if enough of them are left out. So the
chain is compared with hits each of whose intervals has a density of one over itself.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.measured.kernels.chains import ODD
from bouncing_disk_ros.measured.kernels.likelihood import whitened_residuals
from bouncing_disk_ros.measured.kernels.rest_laws import FREQUENCY, PHASE, VOID
from bouncing_disk_ros.measured.profiles import Array, Node, Profiles

SEED = 20091
FEWEST = 3
"""Residuals that can be like their neighbours, or not."""
_DRAWS, _NUMBERS = 2000, 2_000_000
"""Most of draws, and of numbers in all of them."""


def probability_of(profiles: Profiles, speeds: Array) -> float:
    """Of residuals as odd as these; nan with fewer than three, or where they are rounding.

    speeds (N - 2): of inner impacts. Rounding: no more than the half digit of each of N times that
    are added up, as in a simulation. Such residuals are not independent.
    """
    white, taken = _whitened(profiles, profiles.best)
    data, p = profiles.data, profiles.best.p
    told = (data.kinds != VOID) & ~data.missed[2:]  # a missed impact takes its own residual
    told &= np.isfinite(speeds) & np.isfinite(white)
    count = int(told.sum())
    if count < FEWEST or count <= len(taken):
        return math.nan
    size = float(np.sqrt(np.mean(white[told] ** 2)) * np.median(data.errors[~data.missed]))
    if size < 0.5 * len(data.times) * np.spacing(np.abs(data.times).max()):
        return math.nan
    angle = np.mod(p[FREQUENCY] * profiles.best.times[1:-1] + p[PHASE], math.tau)
    orders: list[NDArray[np.int64]] = [np.arange(count), np.argsort(speeds[told])]
    if p[FREQUENCY] > 0.0:
        orders.append(np.argsort(angle[told]))
    draws = min(_DRAWS, _NUMBERS // count)
    left = np.random.default_rng(SEED).standard_normal((draws, count))
    own, sizes, _ = np.linalg.svd(taken[:, told].T, full_matrices=False)
    own = own[:, sizes > 1e-9 * sizes.max(initial=0.0)]
    left -= (left @ own) @ own.T
    columns = np.column_stack([white[told], left.T])
    odd = _statistics(columns, orders, profiles.data.is_absolute)
    smaller = [np.searchsorted(np.sort(column), column) for column in odd.T]
    least = 1.0 - np.max(smaller, axis=0) / len(odd)
    return float(np.mean(least <= least[0]))


def evidence_of(profiles: Profiles, odd: int) -> float:
    """Logarithm of how much likelier flights of a chain are than hits of no law; nan: not told.

    `odd`: hits that are left out, missed impacts, contacts and gaps. Each costs as a false hit does
    in the search for the chain. There a gap costs three of them. With half or twice of either cost
    at most one of 30 recordings had another chain; of four with two gaps three hits apart, two had.
    A contact or a gap also leaves out the equations at its two ends.
    The likelihood is integrated over the parameters as by Schwarz ("Estimating the dimension of a
    model", 1978): each costs half of the logarithm of the number of equations. A missed second
    impact of a part is one more parameter, whose density is one over the interval of the flights
    around it. With a scatter of 0, where log_det is 0, it costs 7 less: the logarithm of its error
    over the error of a hit. Without that, fewer such chains are found. If hits of no law are the
    truth, the ratio of both likelihoods exceeds x with a probability of 1/x at most (Markov's
    inequality). That is for one chain. The likeliest of all exceeds x more often: on a vibrating
    platform, where many chains are possible, in a third of lists of twelve hits it exceeds a
    hundred.
    """
    node, data, model = profiles.best, profiles.data, profiles.model
    if profiles.degrees < 1 and not data.is_absolute:
        return math.nan
    scale = profiles.scale(node)
    is_measured = (data.kinds != VOID) & ~data.missed[2:]
    measured = np.maximum.accumulate(np.where(data.missed, -np.inf, data.times))
    intervals = data.times[2:] - measured[1:-1]
    spreads = math.sqrt(math.tau) * scale * data.errors
    evidence = -0.5 * (node.squares / scale**2 + node.log_det)
    evidence += float(np.sum(np.log(intervals[is_measured] / spreads[2:][is_measured])))
    for first in (0, *(place + 1 for place in data.contacts)):
        later = is_measured[first:]
        if data.missed[first + 1 : first + 2].any() and later.any():
            evidence += math.log(spreads[first + 1] / intervals[first:][later][0])
    if model.phase is not None:
        evidence += math.log(math.sqrt(math.tau) / scale)
    count = len(model.free) + (not data.is_absolute) + (model.scatter is None)
    return evidence - 0.5 * count * math.log(max(profiles.count, 1)) - ODD * odd


def _statistics(columns: Array, orders: list[NDArray[np.int64]], is_absolute: bool) -> Array:
    """(M, statistics) of residuals (n, M): the larger, the odder."""
    squares = np.sum(columns**2, axis=0)
    found = [np.abs(np.sum(np.diff(columns[order], axis=0) ** 2, axis=0) / squares - 2.0)
             for order in orders]  # fmt: skip
    found.append(np.max(columns**2, axis=0) / squares)
    if is_absolute:
        found.append(squares)
    return np.column_stack(found)


def _whitened(profiles: Profiles, node: Node) -> tuple[Array, Array]:
    """Residuals (n) and their derivatives (free, n)."""
    data, free = profiles.data, np.array(profiles.model.free, np.int64)
    n = len(data.times) - 2
    white, taken = np.full(n, np.nan), np.zeros((len(free), n))
    if not whitened_residuals(
        data.times, data.errors, node.p, free, data.kinds, profiles.model.gravity, node.rho,
        node.times, white, taken,
    ):  # fmt: skip
        white[:] = np.nan
    return white, taken
