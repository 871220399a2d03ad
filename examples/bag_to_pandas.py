"""The impacts of a recorded run as a pandas frame.

    python examples/bag_to_pandas.py [BAG]      (default: a bag that make_bag.py writes)

Two lines do it; pandas comes with xarray, which this package needs.
"""

import sys

if "--help" in sys.argv:  # before the imports, which take seconds
    print(__doc__)
    sys.exit()

import pandas as pd

from bouncing_disk_ros import read_run
from make_bag import given_or_made


def main(folder: str) -> None:
    """Make the frame, and use it: the last impacts, the impulse in each second."""
    run = read_run(folder)
    impacts = pd.DataFrame(run.rows).set_index("index")

    print(impacts[["time", "forcing_phase", "axial_impact_velocity", "angular_velocity"]].tail())
    each_second = impacts.groupby(impacts["time"].astype(int))["axial_impulse"]
    print(each_second.agg(["count", "sum"]).rename(columns={"sum": "N·s"}).T)


if __name__ == "__main__":
    with given_or_made() as folder:
        main(folder)
