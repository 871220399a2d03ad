"""Fig. 3 and Fig. 4 of the paper at another restitution.

    python examples/figures_3_and_4.py [RESTITUTION [SIZE]]      (default: 0.3, 60)

SIZE is the number of values along Γ and the pixels along each side of the map of basins; the
paper's figures have 1261 and 1000. Writes figures_3_and_4_bifurcation.pdf and _basins.pdf.
"""

import sys

if "--help" in sys.argv:  # before the imports, which take seconds
    print(__doc__)
    sys.exit()

from bouncing_disk_ros import basins, bifurcation, figures, fixed_point, period_doublings


def main(restitution: float = 0.3, size: int = 60) -> None:
    """Compute both, print what they hold, draw them."""
    if not 0.0 < restitution < 1.0:
        sys.exit(f"RESTITUTION: got {restitution:g}, allowed: between 0 and 1")
    # begin=0.0: the period-1 orbit is followed from where it begins at this restitution
    begin = 1.005 * (1.0 - restitution) / (1.0 + restitution)
    first = period_doublings(fixed_point(begin, restitution), "axial_forcing", limit=2.0, count=1)
    end = 1.11 * first[0].value  # beyond the first doubling
    diagram = bifurcation(restitution=restitution, begin=0.0, end=end, count=size, settling=200)
    for value, impacts in zip(diagram["doubling"], diagram["doubling_impacts"], strict=True):
        print(f"period {int(impacts)} → {2 * int(impacts)} at Γ = {float(value):.8f}")

    forcing = float(diagram["doubling"][0]) - 0.02  # a little below the first doubling
    starts = basins(axial_forcing=forcing, restitution=restitution, width=size, height=size)
    for name, share in zip(starts["attractor_name"], starts["fraction"], strict=True):
        print(f"Γ = {forcing:.4f}: {100 * float(share):6.2f} % of the starts go to {name.item()}")

    for result in (diagram, starts):
        for name, figure in figures(result).items():
            figure.savefig(f"figures_3_and_4_{name}.pdf")


if __name__ == "__main__":
    main(*(kind(word) for kind, word in zip((float, int), sys.argv[1:], strict=False)))
