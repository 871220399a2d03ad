"""The platform's motion from a state on, steady or in a cross-fade."""

from __future__ import annotations

from bouncing_disk_ros.proof.ball_platform import Platform
from bouncing_disk_ros.proof.exact_records import MotionRecord, State
from bouncing_disk_ros.proof.fading_platform import FadingPlatform
from bouncing_disk_ros.proof.steady_platform import SteadyPlatform


def platform_of(motion: MotionRecord, state: State) -> Platform:
    """The motion in force from a state on."""
    return FadingPlatform(motion, state) if motion.fading else SteadyPlatform(motion, state)
