"""Estimates with intervals from impact times: profiles of the likelihood, averaged over scatter.

For a given ratio ρ = σ_ε/c the scale c is profiled analytically. Then a parameter has the
confidence distribution T_(n-p)(± √((n-p)(exp(D/n) - 1))), with D the fall of 2 log L along its
profile: the threshold n ln(1 + t²/(n-p)). Few impacts do not tell ρ. Its best value is 0 too often,
and the intervals there are too short. So the distributions of all ρ are averaged with their
restricted likelihood and with weights. Three quarters are scatter alone, ρ = ∞. One quarter is
uniform in arctan(ρ/s), where s is the spread of restitution that errors of times make. Where errors
are given, the weights are uniform in log(1 + ρ/s). With scatter that can be seen the intervals
cover 95 %, with less they are longer. An interval also holds what the profile over ρ and all else
holds. In the estimate each ρ counts by its precision too. That makes the expected squared error
least, in units of the variance that the errors and scatter of each ρ leave.

Steady flights hardly tell ε: along a ridge of parameters the likelihood is flat but for the best
oscillation in the noise, whose gain grows with the number of frequencies that are tried (Davies,
"Hypothesis testing when a nuisance parameter is present only under the alternative", 1987). No
quantile of t or χ² holds there. So an interval also holds what the likelihood holds that is
integrated along the ridge, uniformly in ε. The top moves along the ridge with ρ. So the interval
also holds what each ρ holds that the data do not refute (Berger and Boos, "P values maximized over
a confidence set for the nuisance parameter", 1994). Where the likelihood has one top there is no
such ridge.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.distributions import normal, normal_quantile, t_probability
from bouncing_disk_ros.measured.kernels.likelihood import (
    excess_slopes,
    fit_times,
    median_eigenvalue,
)
from bouncing_disk_ros.measured.kernels.rest_laws import (
    AMPLITUDE,
    DRAG,
    FREQUENCY,
    PARAMETERS,
    PHASE,
    RELEASED,
    RESTITUTION,
    SLOPE,
    USUAL,
    VOID,
)

Array = NDArray[np.float64]

LEVEL = 0.95
"""Probability that an interval holds the true value."""
_LARGEST_RATIO = 1e5
"""Of the scatter to the spread that errors of times make."""
_ANY = 1e100
"""A ratio with which the measured times are as good as any."""
_NODES, _LEAST_NODES, _ZOOMS, _DROP = 25, 7, 8, 9.0
_ALONE = 3.0
"""Weight of scatter alone, in those of all other ratios together.

Six impacts at rest with 10 µs and 0.3 % scatter: 93.2 % of 235 experiments, and with 1 as well.
"""
_FAILED = 1e299
_ROUNDING = 1e-13
"""Of an information, in parts of its largest eigenvalue."""
_RIDGE_STEPS, _NEAR_STEPS, _LOST = 64, 17, 40.0
"""Points along a ridge, those near its top, and the fall of 2 log L where it ends: a part 1e-9."""
_REFUTED = normal_quantile(0.5 + 0.5 * LEVEL) ** 2
"""Of twice the log of a likelihood ratio: χ² of one degree."""
_LEAST_PART = 1e-12
"""Of a distribution: beyond it no quantile is finite."""
_FAR = 1e3
"""How many times its value a parameter is looked for."""


@dataclass(frozen=True)
class Data:
    """Times of impacts with their errors.

    `times`: s, increasing; a missed impact stands at its supposed time, with an error that makes it
    worth nothing. `errors`: standard deviations, s, or parts of them where `is_absolute` is false.
    `missed`: which times were not measured. `floor`: least scale of errors that are not absolute.
    `is_released`: the first time is that of a release at rest. `contacts`: indices of times after
    which the disk does not fly to the next one.
    """

    times: Array
    errors: Array
    missed: NDArray[np.bool_]
    is_absolute: bool
    floor: float
    is_released: bool = False
    contacts: tuple[int, ...] = ()

    @cached_property
    def kinds(self) -> NDArray[np.int64]:
        """Kinds of the equations: a contact leaves nothing of those at its two ends."""
        found = np.full(len(self.times) - 2, USUAL)
        found[: int(self.is_released)] = RELEASED
        for place in self.contacts:
            found[max(place - 1, 0) : place + 1] = VOID
        return found

    @property
    def count(self) -> int:
        """Equations that tell something."""
        return int(np.sum(self.kinds != VOID)) - int(self.missed.sum())


@dataclass(frozen=True)
class Model:
    """What is known and what is fitted: `free` are indices of RESTITUTION, AMPLITUDE ...

    `scatter`: standard deviation of the restitution, None: fitted. `gravity`: m/s². `phase`: φ of a
    reference with its standard deviation, rad; None: there is none.
    """

    free: tuple[int, ...]
    gravity: float
    scatter: float | None
    phase: tuple[float, float] | None = None


@dataclass
class Node:
    """The fit for one ratio ρ: parameters, true times, sum of squares, and -2 log of the rest.

    `slopes` (n, 3): of the equations by the times; `factor` (n, 3): Cholesky factor of S.
    `weight`: share among the ratios; `log`: of the restricted likelihood of the ratio.
    """

    rho: float
    p: Array
    times: Array
    squares: float
    log_det: float
    information: Array
    slopes: Array
    factor: Array
    weight: float = 1.0
    log: float = 0.0


@dataclass(frozen=True)
class Interval:
    """A value with the ends of its interval; not told where these are the ends of its range."""

    value: float
    low: float
    high: float


def interval_text(found: Interval, unit: str = "") -> str:
    """A value with its interval; digits as far as the interval tells them."""
    width = found.high - found.low
    decimals = 6 if not 0.0 < width < math.inf else max(0, 2 - math.floor(math.log10(width)))
    values = (found.value, found.low, found.high)
    if decimals <= 6:
        texts = [f"{x:.{decimals}f}" for x in values]
    elif width > 0.01 * abs(found.value):
        texts = [f"{x:.3e}" for x in values]
    else:
        digits = 1 + math.floor(math.log10(abs(found.value))) + decimals
        texts = [f"{x:#.{digits}g}" for x in values]
    return f"{texts[0]} ({texts[1]} to {texts[2]}) {unit}".rstrip()


def _crossing(
    confidence: Callable[[float], float], wanted: float, low: float, high: float, width: float
) -> float:
    """Where a distribution is `wanted`, between two places, to `width`.

    By secants of its normal quantiles, which are nearly on a line; an end that stays has its
    distance halved (the Illinois method). `scalar_search.root_between` would also close the
    bracket, at more places: each place costs a fit for every ratio.
    """

    def away(x: float) -> float:
        part = min(max(confidence(x), _LEAST_PART), 1.0 - _LEAST_PART)
        return normal_quantile(part) - normal_quantile(wanted)

    a, b, fa, fb = low, high, away(low), away(high)
    while abs(b - a) > width and fb != 0.0:
        x = b - fb * (b - a) / (fb - fa)
        fx = away(x)
        if fx * fb < 0.0:
            a, fa = b, fb
        else:
            fa *= 0.5
        is_near = abs(x - b) < 0.5 * width
        b, fb = x, fx
        if is_near:
            break
    return b


class Profiles:
    """Fits of one model to data at all ratios ρ that matter, and profiles through them."""

    def __init__(self, data: Data, model: Model, start: Array, times: Array | None = None) -> None:
        """`times`: near the true ones; the search for a given scatter begins there."""
        self.data, self.model = data, model
        self.count = data.count + (model.phase is not None)
        self.beyond = self.count - len(model.free)
        """Equations beyond the parameters."""
        self.degrees = (self.count if data.is_absolute else data.count) - len(model.free)
        """Equations that tell errors which are not given; a reference has an error of its own."""
        self._weights: dict[float, float] = {}
        self._distributions: dict[int, Callable[[float], float]] = {}
        self.nodes = self._nodes(start, times)

    # --- one fit ---------------------------------------------------------------------------------
    def fit(self, rho: float, start: Array, times: Array, free: Sequence[int]) -> Node:
        """The likeliest values at one ratio; `squares` is above 1e299 where there are none."""
        node = self._reached(rho, start, times, free)
        if rho > 0.0 and set(free) - {RESTITUTION} and node.squares < _FAILED:
            found = self._least_squares(rho, self._shifted(node, list(free)), node.times, ())
            if self.cost(found) < self.cost(node):
                return replace(found, information=node.information)
        return node

    def _reached(self, rho: float, start: Array, times: Array, free: Sequence[int]) -> Node:
        """The least squares; where the search ends before, the best times with its parameters."""
        node = self._least_squares(rho, start, times, free)
        if node.squares >= _FAILED and len(free):
            found = self._least_squares(rho, node.p, node.times, ())
            return replace(found, information=node.information)
        return node

    def _known(self, rho: float, start: Array, times: Array) -> Array:
        """The phase of a reference, with its weight: c, if it is not given, from a fit without."""
        known = np.zeros((2, len(start)))
        if self.model.phase is not None:
            phase, error = self.model.phase
            if rho not in self._weights:
                scale = 1.0
                if not self.data.is_absolute:
                    found = self._search(rho, start, times, self.model.free, known)
                    if found.squares >= _FAILED:  # nothing tells the parameters
                        found = self._search(rho, found.p, found.times, (), known)
                    scale = self.scale(found) if found.squares < _FAILED else 1.0
                self._weights[rho] = (scale / error) ** 2
            known[:, PHASE] = phase, self._weights[rho]
        return known

    def _least_squares(self, rho: float, start: Array, times: Array, free: Sequence[int]) -> Node:
        return self._search(rho, start, times, free, self._known(rho, start, times))

    def _search(
        self, rho: float, start: Array, times: Array, free: Sequence[int], known: Array
    ) -> Node:
        p, th, size, n = start.copy(), times.copy(), len(free), len(times) - 2
        h, b, low = np.zeros((size, size)), np.zeros((n, 3)), np.zeros((n, 3))
        squares, excess = fit_times(
            self.data.times, self.data.errors, p, np.array(free, np.int64), known,
            self.data.kinds, self.model.gravity, rho, th, h, b, low,
        )  # fmt: skip
        if p[AMPLITUDE] < 0.0 and {AMPLITUDE, PHASE} <= set(free) and known[1, PHASE] == 0.0:
            place = list(free).index(AMPLITUDE)  # the same motion with A > 0
            p[AMPLITUDE], p[PHASE] = -p[AMPLITUDE], p[PHASE] + math.pi
            h[place], h[:, place] = -h[place], -h[:, place]
        if self.model.scatter == 0.0:  # exact orbits: nothing is integrated
            excess = 0.0
        if known[1, PHASE] > 0.0:  # the variance of a reference, in units of c²
            excess -= math.log(known[1, PHASE])
        return Node(rho, p, th, squares, excess, h, b, low)

    def _shifted(self, node: Node, free: list[int]) -> Array:
        """Parameters where the log of the determinants counts beside the squares."""
        p, slopes, span = node.p.copy(), np.zeros(len(node.p)), np.ptp(self.data.times)
        rest = self._ranges(node, (SLOPE, DRAG))
        steps = 1e-5 * np.array([1.0, max(abs(p[AMPLITUDE]), 1e-12), 1.0, 1.0 / span, *rest])
        excess_slopes(
            self.data.errors, p, np.array(free, np.int64), self.data.kinds, node.times,
            self.model.gravity, node.rho, steps, slopes,
        )  # fmt: skip
        p[free] -= 0.5 * self.covariance(node, free) @ slopes[free]
        return p

    def true_times(self, times: Array) -> Array:
        """True times in the likeliest fit; a time that the fit does not have stays as it is."""
        place = np.minimum(np.searchsorted(self.data.times, times), len(self.data.times) - 1)
        return np.where(self.data.times[place] == times, self.best.times[place], times)

    def cost(self, node: Node) -> float:
        """-2 log of the likelihood, the scale profiled where it is not known."""
        if node.squares >= _FAILED:
            return math.inf
        if self.data.is_absolute:
            return node.squares + node.log_det
        return self.count * math.log(self._squares(node)) + node.log_det

    def _squares(self, node: Node) -> float:
        """Sum of squares, at least that of the smallest scale."""
        return max(node.squares, self.count * self.data.floor**2, 1e-300)

    def scale(self, node: Node) -> float:
        """c: of the errors, 1 where they are absolute."""
        if self.data.is_absolute:
            return 1.0
        return math.sqrt(self._squares(node) / max(self.beyond, 1))

    def covariance(self, node: Node, free: Sequence[int] | None = None) -> Array:
        """Of the free parameters; directions that are not told are bounded by their range."""
        ranges = self._ranges(node, self.model.free if free is None else free)
        sizes, axes = self._directions(node, ranges)
        axes *= ranges[:, None]
        return np.asarray(axes / (1.0 + sizes / self.scale(node) ** 2) @ axes.T)

    @property
    def is_singular(self) -> bool:
        """Whether the data do not tell some direction of the free parameters."""
        sizes, _ = self._directions(self.best, self._ranges(self.best, self.model.free))
        return bool((sizes == 0.0).any())

    @staticmethod
    def _directions(node: Node, ranges: Array) -> tuple[Array, Array]:
        """Eigenvalues of the information in units of the ranges, 0 below rounding, and axes."""
        sizes, axes = np.linalg.eigh(node.information * np.outer(ranges, ranges))
        return np.where(sizes < _ROUNDING * sizes.max(initial=0.0), 0.0, sizes), axes

    def _ranges(self, node: Node, free: Sequence[int]) -> Array:
        speed = self._speed
        all_ranges = (1.0, 10.0 * abs(node.p[AMPLITUDE]) + 1e-9, math.pi, node.p[FREQUENCY],
                      1.0 / speed, self.model.gravity / speed**2)  # fmt: skip
        return np.array([all_ranges[i] for i in free])

    @cached_property
    def _speed(self) -> float:
        """Of a typical impact, m/s."""
        return 0.5 * self.model.gravity * float(np.median(np.diff(self.data.times)))

    # --- ratios ----------------------------------------------------------------------------------
    def _nodes(self, start: Array, times: Array | None) -> list[Node]:
        free = self.model.free
        if self.model.scatter is not None and times is not None:
            return [self.fit(self.model.scatter, start, times, free)]
        spread = self._spread(start)
        if self.model.scatter is not None:
            return [self._approached(self.model.scatter, spread, start, free)]
        count, state, times = _NODES, start, self.data.times
        low, high = 0.0, self._highest(spread, start)
        last = high
        for _ in range(_ZOOMS):
            places = np.linspace(high, low, count)
            nodes = []
            for x in places:
                nodes.append(self.fit(spread * self._ratio(x), state, times, free))
                if nodes[-1].squares < _FAILED:
                    state, times = nodes[-1].p, nodes[-1].times
            logs = np.array([self._log_weight(node) for node in nodes])
            best = int(np.argmax(logs))
            if not math.isfinite(logs[best]):
                return nodes[:1]
            held = np.flatnonzero(logs > logs[best] - _DROP)
            state, times = nodes[best].p, nodes[best].times
            if len(held) >= _LEAST_NODES or high - low < 1e-3:
                break
            low, high = places[min(held[-1] + 1, count - 1)], places[max(held[0] - 1, 0)]
            count = 2 * _LEAST_NODES
        alone = _ALONE * last if high == last and not self.data.is_absolute else 0.0
        return self._weighed(nodes, logs, held, (high - low) / (count - 1), alone)

    @staticmethod
    def _weighed(
        nodes: list[Node], logs: Array, held: NDArray[np.int64], step: float, alone: float
    ) -> list[Node]:
        """Nodes in equal steps of their place, with shares; `alone`: weight of the first beside."""
        weights = np.full(len(nodes), step)
        weights[[0, -1]] *= 0.5
        weights[0] += alone
        weights *= np.exp(logs - logs.max())
        weights /= weights[held].sum()
        return [replace(nodes[i], weight=float(weights[i]), log=float(logs[i])) for i in held]

    def _ratio(self, place: float) -> float:
        """ρ/s at a place where the weights are uniform."""
        return math.expm1(place) if self.data.is_absolute else math.tan(place)

    def _highest(self, spread: float, start: Array) -> float:
        """The last place: scatter of 1, or errors of times that are the least ones."""
        if self.data.is_absolute:
            return math.log1p(1.0 / spread)
        node = self.fit(_LARGEST_RATIO * spread, start, self.data.times, self.model.free)
        most = _LARGEST_RATIO
        if node.squares < _FAILED and self.data.floor > 0.0:
            scatter = node.rho * math.sqrt(node.squares / max(self.beyond, 1))
            most = min(most, max(scatter / (self.data.floor * spread), 1.0))
        return math.atan(most)

    def _approached(self, rho: float, spread: float, start: Array, free: Sequence[int]) -> Node:
        """The fit at one ratio, by way of larger ones: with them the likelihood has fewer tops.

        Where the last one has no mode of the true times that can be found, the one before stands.
        """
        state, times = start, self.data.times
        ratios = [larger * spread for larger in (1e3, 1e2, 1e1, 1.0, 0.1, 0.01)]
        last = self._reached(ratios[0], state, times, free)
        for ratio in [*(one for one in ratios[1:] if one > rho), rho]:
            node = self._reached(ratio, state, times, free)
            if node.squares < _FAILED:
                last, state, times = node, node.p, node.times
        return last if last.rho == 0.0 else self.fit(last.rho, state, times, free)

    def _approached_fall(self, node: Node, start: Array, free: Sequence[int]) -> float:
        """The fall of 2 log L from a node to a start, at the ratio nearest to it that has a mode.

        With errors of 0.1 ms, searches along exact orbits of chaos often end between tops of the
        likelihood. One hundredth of the spread is enough to join these.
        """
        found = self._approached(node.rho, self._spread(start), start, free)
        top = node
        if found.rho != node.rho:
            top = self.fit(found.rho, node.p, node.times, self.model.free)
        return self.cost(found) - self.cost(top) if top.squares < _FAILED else math.inf

    def _spread(self, start: Array) -> float:
        """Spread of restitution that errors of times make: root of S's median eigenvalue."""
        slopes = self.fit(_ANY, start, self.data.times, ()).slopes
        void = int(np.sum(self.data.kinds == VOID))
        return math.sqrt(max(median_eigenvalue(slopes, self.data.errors, void), 1e-300))

    def _log_weight(self, node: Node) -> float:
        """Log of the restricted likelihood."""
        if node.squares >= _FAILED or not np.isfinite(node.information).all():
            return -math.inf
        h = node.information + np.diag(
            (self.scale(node) / self._ranges(node, self.model.free)) ** 2
        )
        size = float(np.linalg.slogdet(h)[1]) if len(h) else 0.0
        if self.data.is_absolute:
            return -0.5 * (node.squares + node.log_det + size)
        return -0.5 * (self.beyond * math.log(self._squares(node)) + node.log_det + size)

    @cached_property
    def ridges(self) -> list[tuple[Array, Array]]:
        """Parameters (M, 6) along the ridge over ε from 0 to 1, and the share of each.

        First averaged over the ratios, then at each ratio that the data do not refute. Empty where
        the likelihood has one top or tops that no ridge joins, and on a platform at rest, which has
        no steady flights.
        """
        if PHASE not in self.model.free:
            return []
        top, width = float(self.estimate[RESTITUTION]), self.deviation(RESTITUTION)
        step, best = 1.0 / _RIDGE_STEPS, self.best
        if all(
            self.cost(self._followed(best, top + way, self._slopes(best, 0)))
            > self.cost(best) + _LOST
            for way in (-step, step)
        ):
            return []
        near = top + width * np.linspace(-4.0, 4.0, _NEAR_STEPS)
        grid = np.concatenate([step * (np.arange(_RIDGE_STEPS) + 0.5), near])
        grid = np.unique(grid[(grid > 0.0) & (grid < 1.0)])
        points = np.zeros((len(self.nodes), len(grid), PARAMETERS))
        shares = np.zeros((len(self.nodes), len(grid)))
        for own, share, node in zip(points, shares, self.nodes, strict=True):
            slopes, part = self._slopes(node, 0), node.weight / self._width(node, 0)
            for side in (np.flatnonzero(grid >= top), np.flatnonzero(grid < top)[::-1]):
                last = node
                for i in side:
                    last = self._followed(last, grid[i], slopes)
                    fall = self.cost(last) - self.cost(node)
                    if not fall < _LOST:
                        break
                    # far below the node, which is then no top, the density would overflow
                    own[i], share[i] = last.p, part * self._density(max(fall, -_LOST))
        shares *= np.gradient(grid)
        total = shares.sum(axis=0)
        if not total.any():
            return []
        mean = np.einsum("km,kmi->mi", shares, points) / np.where(total > 0.0, total, 1.0)[:, None]
        found = [(mean, total)]
        for own, share, node in zip(points, shares, self.nodes, strict=True):
            if 2.0 * (best.log - node.log) < _REFUTED and share.any():
                found.append((own, share))
        return [(own[share > 0.0], share[share > 0.0] / share.sum()) for own, share in found]

    def _width(self, node: Node, place: int) -> float:
        return math.sqrt(float(self.covariance(node)[place, place]))

    def _followed(self, near: Node, restitution: float, slopes: Array) -> Node:
        """The fit at another ε, from one nearby; `slopes`: of the other parameters."""
        others = list(self.model.free[1:])
        start = near.p.copy()
        start[others] += slopes * (restitution - start[RESTITUTION])
        start[RESTITUTION] = restitution
        found = self.fit(near.rho, start, near.times, others)
        if found.squares >= _FAILED:
            start[others] = near.p[others]
            found = self.fit(near.rho, start, near.times, others)
        return found

    def _density(self, fall: float) -> float:
        """Of the confidence distribution, relative to its top."""
        if self.data.is_absolute:
            return math.exp(-0.5 * fall)
        return math.exp(-0.5 * fall * (self.beyond + 1) / self.count)

    # --- estimates -------------------------------------------------------------------------------
    @property
    def best(self) -> Node:
        """The node of the likeliest ratio."""
        return max(self.nodes, key=lambda node: node.log)

    @cached_property
    def estimate(self) -> Array:
        """Parameters, averaged over the ratios: each counts by its weight and its precision."""
        free, found = list(self.model.free), self.best.p.copy()
        ranges = self._ranges(self.best, free)
        total, pull = np.zeros((len(free), len(free))), np.zeros(len(free))
        for node in self.nodes:
            precision = node.information / self.scale(node) ** 2
            precision += np.diag(1.0 / self._ranges(node, free) ** 2)
            precision *= node.weight * np.outer(ranges, ranges)
            total += precision
            pull += precision @ ((node.p - found)[free] / ranges)
        found[free] += ranges * (np.linalg.pinv(total, _ROUNDING, hermitian=True) @ pull)
        return found

    def deviation(self, index: int) -> float:
        """Standard deviation of a free parameter, by the curvature at the top."""
        place = self.model.free.index(index)
        total = sum(n.weight * float(self.covariance(n)[place, place]) for n in self.nodes)
        return math.sqrt(total)

    def interval(self, index: int, low: float, high: float) -> Interval:
        """The interval of a free parameter; an end beyond low or high is that bound."""
        value = float(self.estimate[index])
        if self.degrees < 1 and not self.data.is_absolute:
            return Interval(value, low, high)
        width, tail = self.deviation(index), 0.5 * (1.0 - LEVEL)
        return Interval(
            value,
            self._end(index, value, -width, low, tail),
            self._end(index, value, width, high, 1.0 - tail),
        )

    def intervals(self, ranges: Mapping[int, tuple[float, float]]) -> list[Interval]:
        """Those of free parameters within ranges, side by side: the kernels let go of the GIL."""
        _ = self.ridges  # which all of them need
        with ThreadPoolExecutor() as pool:
            return list(pool.map(lambda index: self.interval(index, *ranges[index]), ranges))

    def _end(self, index: int, value: float, step: float, bound: float, wanted: float) -> float:
        """Where the confidence distribution is `wanted`; the bound if it is not up to there."""
        below, confidence = wanted < 0.5, self.confidence(index)
        sign = -1.0 if below else 1.0
        last = bound if math.isfinite(bound) else value + sign * _FAR * max(abs(value), abs(step))
        inner, outer = value, value + 2.0 * step
        while True:
            outer = max(outer, last) if below else min(outer, last)
            if (confidence(outer) > wanted) != below:
                break
            if outer == last:
                return bound
            inner, outer = outer, outer + 2.0 * (outer - inner)
        if (confidence(inner) > wanted) != below:
            return inner
        return _crossing(confidence, wanted, inner, outer, 1e-2 * abs(step))

    def confidence(self, index: int) -> Callable[[float], float]:
        """The confidence distribution of a free parameter: a function from 0 to 1."""
        if index not in self._distributions:
            self._distributions[index] = self._distribution(index)
        return self._distributions[index]

    def _distribution(self, index: int) -> Callable[[float], float]:
        place = self.model.free.index(index)
        others = [i for i in self.model.free if i != index]
        slopes = [self._slopes(node, place) for node in self.nodes]
        known = [[node] for node in self.nodes]
        lowest = min(self.cost(node) for node in self.nodes)
        ridges = []
        for points, parts in self.ridges:
            order = np.argsort(points[:, index])
            sums = np.cumsum(parts[order]) - 0.5 * parts[order]
            ridges.append((points[order, index], sums))

        @cache
        def distribution(x: float) -> float:
            total, least, side = 0.0, math.inf, 1.0 if x > self.estimate[index] else -1.0
            for i, node in enumerate(self.nodes):
                near = min(known[i], key=lambda one: abs(one.p[index] - x))
                start = near.p.copy()
                start[others] += slopes[i] * (x - start[index])
                start[index] = x
                found = self.fit(node.rho, start, near.times, others)
                if found.squares >= _FAILED:
                    start[others] = near.p[others]
                    found = self.fit(node.rho, start, near.times, others)
                if found.squares < _FAILED:
                    known[i].append(found)
                    fall = self.cost(found) - self.cost(node)
                else:
                    fall = self._approached_fall(node, start, others)
                least = min(least, self.cost(node) + fall)
                own = 1.0 if x > node.p[index] else -1.0
                total += node.weight * self._share(own, fall)
            held = [total, self._share(side, least - lowest)]
            held += [float(np.interp(x, along, sums, 0.0, 1.0)) for along, sums in ridges]
            return max(held) if side < 0.0 else min(held)

        return distribution

    def refuted(self, freed: Profiles, chance: float) -> bool:
        """Whether these data refute this model, if `freed` has one parameter more, at this level.

        That is also one without the phase of a reference, which is a datum here.
        """
        if freed.degrees < 1 and not self.data.is_absolute:
            return False
        costs = []
        for one in (self, freed):  # a reference adds the logarithm of its variance
            logs = [node.log_det + math.log(one._weights.get(node.rho, 1.0)) for node in one.nodes]
            costs.append(min(freed.cost(replace(node, log_det=log))
                             for node, log in zip(one.nodes, logs, strict=True)))  # fmt: skip
        return 1.0 - freed._share(1.0, costs[0] - costs[1]) < 0.5 * chance

    def _slopes(self, node: Node, place: int) -> Array:
        """How the other free parameters follow one along its profile."""
        covariance = self.covariance(node)
        return np.asarray(np.delete(covariance[place], place) / covariance[place, place])

    def _share(self, side: float, fall: float) -> float:
        """The confidence distribution where 2 log L is lower by `fall` than at its top."""
        fall = max(fall, 0.0)
        if self.data.is_absolute:
            return normal(side * math.sqrt(fall))
        if fall > 600.0 * self.count:
            return 1.0 if side > 0.0 else 0.0
        root = math.sqrt(self.degrees * math.expm1(fall / self.count))
        return t_probability(self.degrees, side * root)
