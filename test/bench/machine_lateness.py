"""How late the machine itself is: a bare loop that sleeps to instants a fixed period apart.

    python machine_lateness.py RATE SECONDS

Prints p50, p99 and max of its lateness in ms: what no node in Python can undercut just then.
"""

from __future__ import annotations

import sys
import time


def lateness(rate: float, seconds: float) -> list[float]:
    """Lateness of each tick in ms, sorted; the ticks that a late one missed are left out."""
    period = 1.0 / rate
    begin = due = time.monotonic()
    late = []
    while due < begin + seconds:
        due += period
        time.sleep(max(0.0, due - time.monotonic()))
        late.append(time.monotonic() - due)
        due += period * (late[-1] // period)
    return sorted(1e3 * value for value in late)


if __name__ == "__main__":
    found = lateness(float(sys.argv[1]), float(sys.argv[2]))
    print(found[len(found) // 2], found[int(0.99 * len(found))], found[-1])
