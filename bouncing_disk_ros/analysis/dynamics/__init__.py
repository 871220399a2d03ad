"""The next-collision map as a dynamical system: orbits, attractors, basins, bifurcations."""
