"""A slip in closed form, for lanes: its steepest points, its falling pieces, and where it ends.

With x = ωt, speeds over ω and γ = μ a_e/a_g², a slip of sign σ obeys

    σ w_T = K − γ(g/ω²) x − γA cos x − σ Φ cos(x + θ),

so that its drive is one sinusoid, R sin(x + δ) − fall, fall = γg/ω². Counted from a steepest point
c, where sin(x + δ) = −1,

    σ w_T = F − fall y − R sin y,    y = x − c,    F = K − fall c,

which is Kepler's equation. It falls over |y| < half, half = arccos(−fall/R), or π where R ≤ fall
and it falls always, and by `depth` = fall half + √(R² − fall²) from c to the end of that piece. So
a piece has a zero, and just one, if the slip is above zero where the piece begins and not above it
where the piece ends: the sign there decides, and no zero can be stepped over.
"""

from __future__ import annotations

import math

from bouncing_disk_ros.core import roots
from bouncing_disk_ros.maps.lanes.lane_table import lane

inverse_series = lane(roots.inverse_series)

_TAN_8 = math.sqrt(2.0) - 1.0  # tan(π/8)
# (arctan t − t)/t³ as a polynomial in t² through Chebyshev's points of [0, tan²(π/8)]: with it
# arctan t has a relative error below 5e-18 there
_A3, _A5, _A7, _A9 = (
    -0.3333333333333333,
    0.1999999999999552,
    -0.14285714284666542,
    0.11111111015256361,
)
_A11, _A13, _A15, _A17 = (
    -0.09090904578123903,
    0.07692183190826087,
    -0.06664511447381948,
    0.0585814891280221,
)
_A19, _A21, _A23 = -0.0508544973794026, 0.03923165829558719, -0.01917688711906226

_SHORT = 5e-4  # a step so much shorter than what bends the slip is exact to rounding


@lane
def lane_angle(y: float, x: float) -> float:
    """arctan(y/x) in the quadrant of (x, y), within 4e-16; 0 for (0, 0)."""
    across, along = abs(y), abs(x)
    steep = across > along
    low, high = (along, across) if steep else (across, along)
    turned = low > _TAN_8 * high  # by π/4
    t = (low - high if turned else low) / max(low + high if turned else high, 1e-300)
    z = t * t
    p = _A15 + z * (_A17 + z * (_A19 + z * (_A21 + z * _A23)))
    p = _A3 + z * (_A5 + z * (_A7 + z * (_A9 + z * (_A11 + z * (_A13 + z * p)))))
    angle = t + t * z * p
    angle = 0.25 * math.pi + angle if turned else angle
    angle = 0.5 * math.pi - angle if steep else angle
    angle = math.pi - angle if x < 0.0 else angle
    return -angle if y < 0.0 else angle


@lane
def first_guess(above: float, half: float, depth: float) -> float:
    """About where fall y + R sin y = above ≥ 0, by a parabola with its top at (half, depth)."""
    return half - half * math.sqrt(max(1.0 - above / depth, 0.0))


@lane
def bent_step(
    above: float, fall: float, span: float, y: float, sine: float, cosine: float
) -> float:
    """A step to the zero of above − fall y − R sin y; s, c are sin y, cos y.

    By the parabola, which has its zero near a fold too, then by what the parabola leaves out.
    """
    h, h1 = above - fall * y - span * sine, -fall - span * cosine
    h2, h3 = span * sine, span * cosine
    q = math.sqrt(max(h1 * h1 - 2.0 * h * h2, 0.0))
    d = 2.0 * h / max(q - h1, 1e-300)
    slope = h1 + d * (h2 + d * (0.5 * h3 - d * h2 * (1.0 / 6.0)))
    left = d * d * d * (h3 * (1.0 / 6.0) - d * h2 * (1.0 / 24.0))
    return d - left / min(slope, 0.5 * h1)


@lane
def last_step(
    above: float, fall: float, span: float, y: float, sine: float, cosine: float
) -> tuple[float, bool]:
    """A step by the series of the inverse function, and whether it ends at the zero to rounding."""
    h, h1 = above - fall * y - span * sine, -fall - span * cosine
    h2, h3 = span * sine, span * cosine
    d = inverse_series((h, h1, h2, h3, -h2), 1.0 / h1)
    curvature = fall + span
    return d, curvature * abs(d) < _SHORT * min(-h1, curvature)


@lane
def turned_by(sine: float, cosine: float, d: float) -> tuple[float, float]:
    """Sine and cosine an angle |d| < 5e-4 on, to rounding."""
    dd = d * d
    sd = d - d * dd * (1.0 / 6.0 - dd * (1.0 / 120.0))
    cd = dd * (0.5 - dd * (1.0 / 24.0))
    return sine + (cosine * sd - sine * cd), cosine - (sine * sd + cosine * cd)
