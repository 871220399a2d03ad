"""The next-collision map, its lanes, attractors, bifurcations and boundaries; single tosses."""
