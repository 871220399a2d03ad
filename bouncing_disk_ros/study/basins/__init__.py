"""The study basins."""
