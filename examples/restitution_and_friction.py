"""Restitution ε and friction μ from the impacts of a recorded run, with 95 % intervals.

    python examples/restitution_and_friction.py [BAG]      (default: a bag that make_bag.py writes)

ε comes from impulses and velocities, μ from the impacts that slip. The true values are those of
the disk that was simulated; of a real machine they are what is looked for.
"""

import sys

if "--help" in sys.argv:  # before the imports, which take seconds
    print(__doc__)
    sys.exit()

from bouncing_disk_ros import friction_of, read_run, restitution_of
from make_bag import given_or_made


def main(folder: str) -> None:
    """Estimate both; print them beside what the simulator had."""
    run = read_run(folder)
    for name, found, true in (
        ("restitution", restitution_of(run.rows, mass=run.disk.mass), run.disk.restitution),
        ("friction", friction_of(run.rows, run.disk), run.disk.friction),
    ):
        print(f"{name} {found.value:.6f}, from {found.low:.6f} to {found.high:.6f}, "
              f"by {found.impacts} impacts; true {true}")  # fmt: skip
        if found.note:
            print(f"    {found.note}")


if __name__ == "__main__":
    with given_or_made() as folder:
        main(folder)
