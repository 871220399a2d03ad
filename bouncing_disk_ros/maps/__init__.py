"""The next-collision map, its lanes, attractors, continuation and boundaries; single tosses."""
