"""Laws of the restitution on a platform at rest, fitted to the same impacts and compared by AICc.

AICc: Hurvich and Tsai, "Regression and time series model selection in small samples" (1989). All
laws have the same errors of times and the same scatter, so the densities of times are compared.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from bouncing_disk_ros.measured.kernels.rest_laws import DRAG, RESTITUTION, SLOPE
from bouncing_disk_ros.measured.profiles import Array, Interval, Profiles


@dataclass(frozen=True)
class Law:
    """A law of the restitution.

    `parameters`: restitution (the constant, or at speed 0) and slope, s/m, or drag, 1/m, and
    terminal_speed, m/s. `criterion`: AICc, inf with too few impacts for it. `cost`: minus twice the
    logarithm of the likelihood.
    """

    name: str
    text: str
    parameters: dict[str, Interval]
    criterion: float
    cost: float

    def evidence(self, other: Law) -> str:
        """By how much the criterion of another law is larger, in words."""
        if self.criterion == math.inf:
            return "the interval of its parameter is without 0"
        return f"AICc lower by {other.criterion - self.criterion:.3g}"

    def curve(self, fastest: float, gravity: float) -> tuple[Array, Array]:
        """Impact speeds up to the fastest, and restitutions as they seem without drag."""
        eps = self.parameters["restitution"].value
        takeoff = np.linspace(1e-3, 1.0, 200) * fastest
        if "drag" not in self.parameters:
            slope = self.parameters["slope"].value if "slope" in self.parameters else 0.0
            return takeoff, eps - slope * takeoff
        terminal = self.parameters["terminal_speed"].value
        if not terminal < math.inf:
            return takeoff, np.full(len(takeoff), eps)

        def flight(u: Array) -> Array:
            return np.asarray(terminal / gravity * (np.arctan(u / terminal)
                                                    + np.arcsinh(u / terminal)))  # fmt: skip

        before = flight(takeoff)
        after = flight(eps * takeoff / np.sqrt(1.0 + (takeoff / terminal) ** 2))
        return 0.5 * gravity * before, after / before


def laws_of(constant: Profiles) -> tuple[Law, ...]:
    """The constant restitution as it was fitted, one that falls with the speed, and drag."""
    found = [_law("constant", "a constant restitution", constant, ())]
    others = [("slope", "a restitution that depends on the speed", constant, (SLOPE,)),
              ("drag", "a constant restitution with drag", constant, (DRAG,))]  # fmt: skip

    def told(one: tuple[str, str, Profiles, tuple[int, ...]]) -> Law | None:
        try:
            return _law(*one)
        except np.linalg.LinAlgError:  # these data tell nothing of it
            return None

    if constant.data.count > 2:
        with ThreadPoolExecutor() as pool:  # the kernels let go of the GIL
            found += filter(None, pool.map(told, others))
    return tuple(found)


def other_law(laws: Sequence[Law]) -> Law | None:
    """The law that these data tell in place of the constant one; None: they do not refute that.

    The interval of its own parameter is without 0, and its AICc is lower, where there is one.
    """
    told = [law for law in laws[1:] if _is_without_0(law) and
            (law.criterion < laws[0].criterion or law.criterion == math.inf)]  # fmt: skip
    return min(told, key=lambda law: (law.criterion, law.cost), default=None)


def _is_without_0(law: Law) -> bool:
    own = law.parameters["slope" if "slope" in law.parameters else "drag"]
    return own.low > 0.0 or own.high < 0.0


def _law(name: str, text: str, constant: Profiles, own: tuple[int, ...]) -> Law:
    profiles = constant
    if own:
        model = replace(constant.model, free=(RESTITUTION, *own))
        profiles = Profiles(constant.data, model, constant.estimate)
        if profiles.is_singular:
            raise np.linalg.LinAlgError(f"law {name}: a singular matrix")
    ranges = {RESTITUTION: (0.0, math.inf), **dict.fromkeys(own, (-math.inf, math.inf))}
    eps, *others = profiles.intervals(ranges)
    parameters = {"restitution": eps}
    if SLOPE in own:
        parameters["slope"] = others[0]
    if DRAG in own:
        drag = Interval(*(max(x, 0.0) for x in (others[0].value, others[0].low, others[0].high)))
        speeds = [math.sqrt(profiles.model.gravity / x) if x > 0.0 else math.inf
                  for x in (drag.value, drag.high, drag.low)]  # fmt: skip
        parameters |= {"drag": drag, "terminal_speed": Interval(*speeds)}
    cost = min(profiles.cost(node) for node in profiles.nodes)
    return Law(name, text, parameters, _criterion(profiles, cost), cost)


def _criterion(profiles: Profiles, cost: float) -> float:
    """AICc with the scale of errors and the scatter among the parameters, if they are fitted."""
    data, model = profiles.data, profiles.model
    count = len(model.free) + (not data.is_absolute) + (model.scatter is None)
    if data.count - count - 1 <= 0:
        return math.inf
    return cost + 2.0 * count * data.count / (data.count - count - 1)
