"""The next event of a disk in flight: an impact, or a complete chatter."""

from __future__ import annotations

import math

from numba import types

from bouncing_disk_ros.core.arithmetic import kernel, part
from bouncing_disk_ros.core.contact import load_returns, stopped
from bouncing_disk_ros.core.flight import search_impact
from bouncing_disk_ros.core.impact_law import BOUNCES, STILL, braked_chatter, chatter_verdict
from bouncing_disk_ros.core.layout import (
    CHATTER_ENDS,
    DISK,
    IMPACT,
    LONGEST,
    MOTION,
    NOTHING,
    PAST_BOUNDARY,
    STATE,
    STILLED,
    NextEvent,
)
from bouncing_disk_ros.core.platform import Jet, Record, axial_jet


@kernel
def _chatter(
    state: Record, motion: Record, disk: Record, s: Jet, since: float, horizon: float
) -> NextEvent:
    """Complete chattering in closed form, where that is exact and friction's part decided."""
    u = state.u
    sine, cosine = state.sine, state.cosine
    if disk.brake > 0.0:
        end, t, sign = braked_chatter(motion, disk, since, sine, cosine, s, u, state.omega)
    else:
        end, t, sign = chatter_verdict(
            motion, disk, disk.lag, since, sine, cosine, s, u, state.omega
        )
    if end == STILL:
        return NextEvent(CHATTER_ENDS, 0.0, STILLED, 0)
    if end == BOUNCES or t + PAST_BOUNDARY > horizon:
        return NextEvent(NOTHING, 0.0, 0.0, 0)
    return NextEvent(CHATTER_ENDS, t, sign, 0)


@part(STATE.dtype, MOTION.dtype, DISK.dtype, types.float64, types.float64)
def after_flight(
    state: Record, motion: Record, disk: Record, since: float, horizon: float
) -> NextEvent:
    """Next event of a disk in flight, up to `horizon` s ahead."""
    start, steps = 0.0, 0
    sine, cosine = state.sine, state.cosine
    jet = axial_jet(motion, sine, cosine, since)
    if state.gap == 0.0:
        if state.u == 0.0:  # launched: no root before the platform can come back (rule 2)
            returns = load_returns(motion, disk, since, state.tau, horizon)
            if returns.zero == math.inf:
                return stopped(returns.reached, horizon, returns.steps)
            start, steps = returns.zero, returns.steps
        elif state.u > 0.0:
            chatter = _chatter(state, motion, disk, jet, since, horizon)
            if chatter.kind != NOTHING:
                return chatter
    within = min(horizon, start + LONGEST)
    d, w, more = search_impact(
        motion, since, sine, cosine, jet, disk.g, state.gap, state.u, start, within
    )
    if w > 0.0:
        return stopped(d, horizon, steps + more)
    if d > within or d == math.inf:
        return stopped(within, horizon, steps + more)
    return NextEvent(IMPACT, d, w, steps + more)
