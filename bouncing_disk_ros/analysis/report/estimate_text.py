"""Estimates and transients in words."""

from __future__ import annotations

import math

from bouncing_disk_ros.analysis.recorded.estimate import Estimate
from bouncing_disk_ros.analysis.recorded.transient import Transient, TransientKind

FEWEST = 3
"""A straight line through fewer points gives no rate."""
Pairs = list[tuple[str, str]]


def estimate_text(estimate: Estimate, of: str, unit: str = "") -> str:
    """A value with its interval, or why there is none."""
    value, low, high, count, note = estimate
    if math.isnan(value):
        bound = ""
        if low > 0.0 and math.isinf(high):
            bound = f"; at least {low:.4g}{unit}"
        return (note or "not identifiable") + bound
    half = max(high - value, value - low)
    narrow = half < 1e-6 * abs(value)
    interval = f"± {half:.1g}" if narrow else f"[{low:.5g}, {high:.5g}]"
    return f"{value:.6g}{unit} {interval} ({count} {of}{'; ' + note if note else ''})"


def transient_text(transient: Transient) -> str:
    """A transient in one line."""
    note = f" ({transient.note})" if transient.note else ""
    path = f"from {transient.initial:.5g} to {transient.final:.5g} rad/s"
    match transient.kind:
        case TransientKind.EXPONENTIAL:
            constant = estimate_text(transient.time_constant, "points", " s")
            return f"exponential {path}, time constant T {constant}{note}"
        case TransientKind.LINEAR if transient.finished and transient.rate.impacts < FEWEST:
            return f"{path} within {transient.rate.impacts + 1} impacts{note}"
        case TransientKind.LINEAR:
            rate = estimate_text(transient.rate, "points", " rad/s²")
            ends = "" if math.isnan(transient.end) else f", locked at {transient.end:.4g} s"
            path = path if ends else f"from {transient.initial:.5g} rad/s"
            return f"linear {path}, rate {rate}{ends}{note}"
        case TransientKind.NONE:
            return f"none: {transient.final:.5g} rad/s throughout{note}"
    return f"unresolved{note}"
