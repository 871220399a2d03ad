"""A plot of your own from the dataset of a study: how long each start takes to settle.

    python examples/own_plot.py [SIZE]      (default: 80 pixels along each side)

The window is a part of the plane of starts; the store in output/own_plot.zarr keeps what is done,
so that a run that was interrupted goes on there, and a second one only draws. Writes own_plot.svg.
"""

import sys

if "--help" in sys.argv:  # before the imports, which take seconds
    print(__doc__)
    sys.exit()

import matplotlib.pyplot as plt

from bouncing_disk_ros import basins


def main(size: int = 80) -> None:
    """Compute a window of basins, draw the settling times of the starts that end in period 1."""
    result = basins(
        "output/own_plot.zarr",
        axial_forcing=0.45,
        width=size,
        height=size,
        phase_begin=0.2,
        phase_end=1.6,
        velocity_begin=-2.5,
        velocity_end=-0.5,
    )
    names = list(result["attractor_name"].values)
    in_period_one = result["label"] == names.index("period-1")
    periods = result["impacts"].where(in_period_one)  # one impact in each period of the platform
    print(f"{float(in_period_one.mean()):.1%} of the window, {float(periods.median()):.0f} impacts")

    figure, axes = plt.subplots(layout="constrained")
    periods.plot.pcolormesh(ax=axes, cmap="viridis", cbar_kwargs={"label": "impacts until settled"})
    axes.set(title="Starts that end in the period-1 orbit at Γ = 0.45")
    figure.savefig("own_plot.svg")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
