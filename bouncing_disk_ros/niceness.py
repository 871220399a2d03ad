"""How threads give way to a simulator beside them: niceness, and the switch interval of Python."""

from __future__ import annotations

import os
import sys

NICENESS = 10
"""Of threads that compute: with another program at work, 1 kHz ticks in the same process were late
by 2.6 ms at p99 so, and by 3.9 ms without."""
SWITCH_SECONDS = 2e-4
"""So long a thread that runs Python's own code may keep the interpreter's lock from another one.

Python's default is 5 ms: so late was a tick where a study beside it opened its result."""


def give_way() -> None:
    """Let the calling thread come after others, so that a simulator beside it keeps its ticks."""
    if sys.platform == "linux":  # elsewhere it would be the whole process
        os.nice(NICENESS)


def hand_on_the_lock() -> None:
    """Let the threads of this process hand on the interpreter's lock within SWITCH_SECONDS."""
    if sys.getswitchinterval() > SWITCH_SECONDS:
        sys.setswitchinterval(SWITCH_SECONDS)
